"""Exclusive lock of a journal: one process at a time."""

from __future__ import annotations

from pathlib import Path
from typing import IO

from lippmann.errors import OutputError
from lippmann.runtime.private_files import open_to_append


def locked(path: Path, where: Path) -> IO[bytes]:
    """Open a file for reading and appending, and lock it until it is closed.

    The system releases the lock when the process ends. File systems without locks give an unlocked file.

    Parameters
    ----------
    path:
        The file; created if it is missing.
    where:
        Name of the picture or journal, for errors.

    Raises
    ------
    OutputError
        If another process holds the lock.
    ForeignFileError
        If the file is a link or another user's.
    OSError
        If the file cannot be written.
    """
    file = open_to_append(path)
    try:
        import fcntl
    except ImportError:  # a system without such locks: two processes would do the same work twice, with the same result
        return file
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise OutputError(
            "another process is rendering this picture", where=str(where), fix="wait for it, or end it"
        ) from None
    except OSError:  # a file system without locks
        return file
    return file
