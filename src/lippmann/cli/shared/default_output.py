"""Names of files that nobody named: beside what they are made of, by what they show."""

from __future__ import annotations

from pathlib import Path

from lippmann.errors import LippmannError, OutputError


def output_of(given: Path | None, source: str | Path, ending: str) -> Path:
    """The file to write: ``given``, or in the working folder the source's name with ``ending``, such as ``-seen.png``.

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
        raise OutputError("is there, and no picture of Lippmann's", where=str(path), fix="say -o FILE")
    return path


def _is_ours(path: Path) -> bool:
    from lippmann.image import open_file

    try:
        return open_file(path).metadata is not None
    except LippmannError:
        return False
