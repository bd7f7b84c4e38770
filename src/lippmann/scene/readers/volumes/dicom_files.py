"""Where DICOM files lie: told by their first bytes, since their names tell nothing."""

from __future__ import annotations

import os
from pathlib import Path

#: What stands after the first 128 bytes of a file.
DICOM = b"DICM"

#: Files and levels of folders that are looked at.
MOST_FILES, MOST_LEVELS = 20_000, 4
#: Files that are looked at to find out whether a folder holds any.
_A_FEW = 64


def holds_dicom(folder: Path) -> bool:
    """Whether one of the first files of a folder is a DICOM file."""
    return any(is_dicom(path) for path in files_in(folder, _A_FEW))


def is_dicom(path: str) -> bool:
    """Whether a file says that it is a DICOM file."""
    try:
        with open(path, "rb") as file:
            return file.read(132)[128:] == DICOM
    except OSError:
        return False


def files_in(folder: Path, most: int = MOST_FILES) -> list[str]:
    """Paths of plain files in a folder and those below it, in order; links are left alone."""
    found: list[str] = []
    root = len(folder.parts)
    for parent, folders, names in os.walk(folder):
        folders[:] = sorted(folders) if len(Path(parent).parts) - root < MOST_LEVELS else []
        for name in sorted(names):
            path = os.path.join(parent, name)
            if os.path.isfile(path) and not os.path.islink(path):
                found.append(path)
                if len(found) >= most:
                    return found
    return found
