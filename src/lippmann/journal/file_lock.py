"""Exclusive lock of a journal: one process at a time.

The system's lock is that of the journal itself, and the system releases it when a process is killed. The library
``filelock`` locks a file of its own, which would lie beside each journal; and on file systems without locks it falls
back to a file that a killed process leaves behind, so that its picture could not be resumed.
"""

from __future__ import annotations

from pathlib import Path
from typing import IO

from lippmann.errors import OutputError


def take_lock(path: Path, where: Path) -> IO[bytes]:
    """Open a file for reading and appending, and lock it until it is closed.

    File systems without locks give an unlocked file.

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
    OSError
        If the file cannot be written.
    """
    file = path.open("a+b")
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
