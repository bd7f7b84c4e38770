"""The files in a journal's folder: which are the journal's own, and how they are removed without any other."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from lippmann.runtime import private_files

JOB, LOCK = "job.json", "lock"
#: The ending of a tile's file.
TILE = ".tile"

_TILE_NAME = re.compile(r"r\d{4,}_c\d{4,}\.tile")
#: Names that :func:`lippmann.runtime.atomic_write.replacing` gives to files on their way to a tile's or the job's
#: place, and those of empty files by which a file system is tried.
_HALF_FILE = re.compile(r"\.(r\d{4,}_c\d{4,}-[0-9a-f]{8}\.part\.tile|job-[0-9a-f]{8}\.part\.json|[0-9a-f]{16}\.part)")

#: Whether a name is that of a tile.
IsTile = Callable[[str], bool]


def is_tile(name: str) -> bool:
    """Whether ``name`` is that of a tile of any grid."""
    return _TILE_NAME.fullmatch(name) is not None


def no_tile(name: str) -> bool:
    """Of a folder that has no job: nothing is a tile."""
    return False


def holds_tiles(folder: Path) -> bool:
    """Whether there is anything in the folder to lose; raises :class:`OSError`."""
    return any(is_tile(name) for name in os.listdir(folder))


def foreign_names(folder: Path, tiles: IsTile) -> list[str]:
    """Names in the folder that are no part of the journal, sorted; raises :class:`OSError`."""
    return sorted(name for name in os.listdir(folder) if not _is_part(folder / name, tiles))


def sweep(folder: Path) -> None:
    """Remove half-written files; only the owner of the lock may."""
    for name in os.listdir(folder):
        if _HALF_FILE.fullmatch(name):
            with suppress(OSError):
                (folder / name).unlink()


def clear(folder: Path, tiles: IsTile, unlock: Callable[[], None] | None = None) -> list[str]:
    """Remove the journal's own files, and the folder if nothing else is in it.

    Parameters
    ----------
    tiles:
        Tells the names of its tiles.
    unlock:
        Closes the lock's file. Windows and network drives can remove it only then.

    Returns
    -------
    What stays: names, sorted.
    """
    # The job goes after the tiles: what is left when the process ends in between can still be told to be a journal.
    for name in sorted(os.listdir(folder), key=lambda name: name == JOB):
        if name != LOCK and _is_part(folder / name, tiles):
            with suppress(OSError):
                (folder / name).unlink()
    if unlock is not None:
        unlock()
    if _is_part(folder / LOCK, tiles):
        with suppress(OSError):
            (folder / LOCK).unlink()
    try:
        folder.rmdir()
    except OSError:
        return sorted(os.listdir(folder))
    return []


def _is_part(path: Path, tiles: IsTile) -> bool:
    """Whether a file is the journal's own: by its name, and as a regular file of the user's. A lock is empty."""
    if path.name not in (JOB, LOCK) and not tiles(path.name) and not _HALF_FILE.fullmatch(path.name):
        return False
    try:
        status = os.lstat(path)
    except OSError:
        return False
    is_lock_of_another = path.name == LOCK and status.st_size > 0
    return stat.S_ISREG(status.st_mode) and not is_lock_of_another and private_files.is_own(path)
