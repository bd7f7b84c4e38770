"""One process at a time: an open file that says that somebody is at work."""

from __future__ import annotations

from pathlib import Path
from typing import IO

from lippmann.errors import OutputError
from lippmann.runtime.private_files import open_to_append


def locked(path: Path, where: Path) -> IO[bytes]:
    """The file ``path``, made if it is not there, open for reading and adding, and locked until it is closed.

    The system lets go of it when the process ends, however it does.

    Raises
    ------
    OutputError
        If another process has it; about ``where``.
    ForeignFileError
        If it is a link or another user's, see :func:`lippmann.runtime.private_files.open_to_append`.
    OSError
        If it cannot be written.
    """
    file = open_to_append(path)
    try:
        import fcntl
    except ImportError:  # no such locks on this system: two processes would do the same work twice, to the same end
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
