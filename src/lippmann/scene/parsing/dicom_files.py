"""Search for DICOM files, by their first bytes, since their names tell nothing."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

#: The mark after the first 128 bytes of a file.
DICOM = b"DICM"

#: Bytes at the beginning of a file that tell whether it is one.
HEAD_LENGTH = 132
#: The first element of a data set that stands without the mark, of group 2 or 8: its length, or its kind in letters.
_BARE = re.compile(rb"[\x02\x08]\0.\0(?:[A-Z]{2}[\0-\x7f]\0|[\0-\x7f]\0\0\0)", re.DOTALL)

#: Files and levels of folders that are looked at.
MOST_FILES, MOST_LEVELS = 20_000, 4
#: Files that are looked at to find out whether a folder holds any.
_A_FEW = 64


def holds_dicom(folder: Path) -> bool:
    """Whether one of the first files of a folder is a DICOM file."""
    return any(fault_of(path) is None for path in islice(files_in(folder), _A_FEW))


def begins_dicom(head: bytes) -> bool:
    """Whether a file begins as DICOM files do, those of before 2000 too, whose data set stands without the mark."""
    return head[128:HEAD_LENGTH] == DICOM or _BARE.match(head) is not None


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
            return None if begins_dicom(file.read(HEAD_LENGTH)) else "no DICOM"
    except OSError:
        return "no DICOM"


def files_in(folder: Path) -> Iterator[str]:
    """Paths of all that is no folder in a folder and those below it, in order."""
    root = len(folder.parts)
    for parent, folders, names in os.walk(folder):
        folders[:] = sorted(folders) if len(Path(parent).parts) - root < MOST_LEVELS else []
        yield from (os.path.join(parent, name) for name in sorted(names))
