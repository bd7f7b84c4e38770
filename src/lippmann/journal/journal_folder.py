"""Files in a journal's folder: telling the journal's own from others, and removing only the former."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from lippmann.runtime.atomic_write import NUMBER

JOB, LOCK = "job.json", "lock"
#: Ending of a tile's file.
TILE = ".tile"

_TILE_NAME = re.compile(r"r\d{4,}_c\d{4,}\.tile")
#: Names that :func:`lippmann.runtime.atomic_write.replacing` gives to files on their way to a tile's or the job's
#: place, and those of empty files by which a file system is tried.
_HALF_FILE = re.compile(rf"\.(r\d{{4,}}_c\d{{4,}}-{NUMBER}\.part\.tile|job-{NUMBER}\.part\.json|[0-9a-f]{{16}}\.part)")

#: Whether a name is that of a tile.
IsTile = Callable[[str], bool]


def is_tile(name: str) -> bool:
    """Whether ``name`` is that of a tile of any grid."""
    return _TILE_NAME.fullmatch(name) is not None


def no_tile(name: str) -> bool:
    """False: a folder without a job has no tiles."""
    return False


def holds_tiles(folder: Path) -> bool:
    """Whether the folder holds a file with a tile's name; an :class:`OSError` if it cannot be listed."""
    return any(is_tile(name) for name in os.listdir(folder))


def foreign_names(folder: Path, tiles: IsTile) -> list[str]:
    """Sorted names in the folder that are no part of the journal; an :class:`OSError` if it cannot be listed.

    ``tiles`` tells the names of the journal's tiles.
    """
    return sorted(name for name in os.listdir(folder) if not _is_part(folder / name, tiles))


def sweep(folder: Path) -> None:
    """Remove half-written files; to be called by the owner of the lock only."""
    for name in os.listdir(folder):
        if _HALF_FILE.fullmatch(name):
            with suppress(OSError):
                (folder / name).unlink()


def clear(folder: Path, tiles: IsTile, unlock: Callable[[], None] | None = None) -> list[str]:
    """Remove the journal's own files, and the folder if it is empty then.

    Parameters
    ----------
    folder:
        The journal's folder.
    tiles:
        Tells the names of the journal's tiles.
    unlock:
        Closes the lock's file, which Windows and network drives cannot remove before.

    Returns
    -------
    Sorted names of the files that stay.
    """
    # The job is removed after the tiles, so that a folder half removed is still recognized as a journal.
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
    """Whether a file is the journal's own: a plain file of such a name. A lock is empty."""
    if path.name not in (JOB, LOCK) and not tiles(path.name) and not _HALF_FILE.fullmatch(path.name):
        return False
    is_plain = path.is_file() and not path.is_symlink()
    return is_plain and not (path.name == LOCK and path.stat().st_size > 0)
