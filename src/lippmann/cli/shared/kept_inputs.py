"""No command writes over a file that it reads: one check for all of them, before any work."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from lippmann.errors import OutputError

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
