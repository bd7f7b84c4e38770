"""Search for DICOM files, by their first bytes, since their names tell nothing."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

#: The mark after the first 128 bytes of a file.
DICOM = b"DICM"

#: Files and levels of folders that are looked at.
MOST_FILES, MOST_LEVELS = 20_000, 4
#: Files that are looked at to find out whether a folder holds any.
_A_FEW = 64


def holds_dicom(folder: Path) -> bool:
    """Whether one of the first files of a folder is a DICOM file."""
    return any(fault_of(path) is None for path in islice(files_in(folder), _A_FEW))


def fault_of(path: str) -> str | None:
    """Why a file is no DICOM file: ``link``, ``empty`` or ``no DICOM``; None if it says that it is one."""
    try:
        status = os.lstat(path)
        if stat.S_ISLNK(status.st_mode):
            return "link"
        if not stat.S_ISREG(status.st_mode):
            return "no DICOM"
        if not status.st_size:
            return "empty"
        with open(path, "rb") as file:
            return None if file.read(132)[128:] == DICOM else "no DICOM"
    except OSError:
        return "no DICOM"


def files_in(folder: Path) -> Iterator[str]:
    """Paths of all that is no folder in a folder and those below it, in order."""
    root = len(folder.parts)
    for parent, folders, names in os.walk(folder):
        folders[:] = sorted(folders) if len(Path(parent).parts) - root < MOST_LEVELS else []
        yield from (os.path.join(parent, name) for name in sorted(names))
