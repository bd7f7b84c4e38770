"""Files that commands write: none is one that the command reads, and what nobody named is named after its source."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from lippmann.errors import LippmannError, OutputError

#: Options that name what is written.
_WRITTEN = frozenset({"--output", "--csv", "--map", "--maps", "--export", "--video"})


def check_outputs(values: Iterable[tuple[Iterable[str], object]]) -> None:
    """Refuse a command whose output is one of its inputs, under whatever name: links and hard links count.

    Parameters
    ----------
    values:
        The names of each parameter of the command, and its value; text that names no file is none.

    Raises
    ------
    OutputError
        An output is a file that another parameter names.
    """
    read: list[Path] = []
    written_to: list[Path] = []
    for names, value in values:
        (read if _WRITTEN.isdisjoint(names) else written_to).extend(_files(value))
    for written in written_to:
        for path in read:
            if os.path.samefile(written, path):
                raise OutputError(f"is '{path}', which is read", where=str(written), fix="choose another name")


def _files(value: object) -> Iterator[Path]:
    """The files and folders that there are of those that a value may name."""
    for each in value if isinstance(value, list | tuple) else (value,):
        if isinstance(each, str | Path):
            try:
                if os.path.exists(each):
                    yield Path(each)
            except (OSError, ValueError):  # no file can have such a name
                continue


def output_of(given: Path | None, source: str | Path, ending: str) -> Path:
    """The file to write: ``given``, or in the working folder the source's name with ``ending``, such as ``-seen.png``.

    The picture of a photograph ``photo.png`` in this folder is ``photo-native.png``.

    Raises
    ------
    OutputError
        There is such a file already, and it is no picture of this program's.
    """
    if given is not None:
        return given
    path = Path(f"{Path(source).stem or 'picture'}{ending}")
    # With a word in its name the file is this program's; a model's plain name may be that of its texture.
    if ending.startswith(".") and path.exists() and not _is_ours(path):
        if os.path.exists(source) and path.samefile(source):
            return path.with_stem(f"{path.stem}-native")
        raise OutputError("is there, and no picture of Lippmann's", where=str(path), fix="say -o FILE")
    return path


def _is_ours(path: Path) -> bool:
    from lippmann.image import open_file

    try:
        return open_file(path).metadata is not None
    except LippmannError:
        return False
