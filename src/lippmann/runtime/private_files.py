"""Files that are opened with care: inputs must be plain files, private ones the program's own.

Private files are files and folders that the program names itself, opened without following links and only if own.

The user names an output, so that a link there is followed. The program chooses the names of journals and temporary
files. In a folder that others may write to, such as ``/tmp``, another user may have created a link or a file under such
a name.

A private folder is checked by its owner and permissions. Its files are then opened by path, which is safe, since nobody
else can rename files in a folder of the user that nobody else may write to. Parent folders are not checked: whoever can
rename files there can replace the output as well.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import stat
from contextlib import suppress
from pathlib import Path
from typing import IO

from lippmann.errors import LippmannError

#: Permissions of private folders and files.
FOLDER_MODE, FILE_MODE = 0o700, 0o600

_OTHERS_FIX = "choose another name, or another folder"

#: Results of :func:`_status_of_new_file` by folder.
_probes: dict[Path, os.stat_result] = {}


class ForeignFileError(Exception):
    """A file or folder that must not be used.

    Parameters
    ----------
    predicate:
        The reason as a predicate, such as ``is a symbolic link``.
    fix:
        What the user can do; empty if the caller knows better.
    """

    def __init__(self, predicate: str, fix: str = "") -> None:
        super().__init__(predicate)
        self.fix = fix


def make_folder(path: Path) -> None:
    """Create the private folder ``path``, or check an existing one.

    Raises
    ------
    ForeignFileError
        If ``path`` is no folder, the folder is another user's, or other users may write to it.
    OSError
        If it cannot be created.
    """
    with suppress(FileExistsError):
        os.mkdir(path, FOLDER_MODE)
    if not check_folder(path):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))  # removed again by another process


def check_folder(path: Path) -> bool:
    """Whether the private folder ``path`` exists.

    Raises
    ------
    ForeignFileError
        If ``path`` is no folder, the folder is another user's, or other users may write to it.
    OSError
        If its status cannot be read.
    """
    try:
        status = os.lstat(path)
    except FileNotFoundError:
        return False
    if _is_link(status):
        raise ForeignFileError("is a symbolic link")
    if not stat.S_ISDIR(status.st_mode):
        raise ForeignFileError("is no folder")
    if not _is_own(status, path.parent):
        raise ForeignFileError("belongs to another user", _OTHERS_FIX)
    if hasattr(os, "geteuid") and status.st_mode & 0o022:
        probe = _status_of_new_file(path.parent)
        # File systems without permissions, such as FAT, show all files as open to everyone.
        if probe is None or not probe.st_mode & 0o077:
            raise ForeignFileError(
                "can be written to by other users", f"take that permission away: chmod go-w '{path}'"
            )
    return True


def open_to_read(path: Path, owner: int | None = None) -> IO[bytes]:
    """Open a private file for reading.

    Parameters
    ----------
    path:
        The file.
    owner:
        User ID of the required owner; None for this user.

    Raises
    ------
    ForeignFileError
        If it is a link, no regular file, or the file of another user.
    OSError
        If it cannot be opened.
    """
    return os.fdopen(_open(path, os.O_RDONLY, owner=owner), "rb")


def open_to_append(path: Path) -> IO[bytes]:
    """Open a private file for reading and appending; it is created if it does not exist.

    Raises
    ------
    ForeignFileError
        If it is a link, no regular file, the file of another user, or has a hard link.
    OSError
        If it cannot be opened.
    """
    return os.fdopen(_open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, is_changed=True), "a+b")


def is_own(path: Path) -> bool:
    """Whether ``path``, which may itself be a link, belongs to the user."""
    try:
        return _is_own(os.lstat(path), path.parent)
    except OSError:
        return False


def remove(path: Path) -> None:
    """Remove a file, link or folder if it belongs to the user; errors are ignored, links are not followed."""
    if not is_own(path):
        return
    with suppress(OSError):
        if stat.S_ISDIR(os.lstat(path).st_mode):
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()


def without_following() -> int:
    """Flags for :func:`os.open` that refuse links and do not wait for pipes, as far as the system has them."""
    names = ("O_NOFOLLOW", "O_CLOEXEC", "O_NONBLOCK", "O_BINARY")
    flags = 0
    for name in names:
        flags |= getattr(os, name, 0)
    return flags


def _open(path: Path, flags: int, *, owner: int | None = None, is_changed: bool = False) -> int:
    if not hasattr(os, "O_NOFOLLOW") and os.path.islink(path):
        raise ForeignFileError("is a symbolic link")
    try:
        descriptor = os.open(path, flags | without_following(), FILE_MODE)
    except OSError as error:
        if os.path.islink(path):
            raise ForeignFileError("is a symbolic link") from error
        raise
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise ForeignFileError("is no regular file")
        if not (_is_own(status, path.parent) if owner is None else status.st_uid == owner):
            raise ForeignFileError("belongs to another user", _OTHERS_FIX)
        if is_changed and status.st_nlink > 1:
            raise ForeignFileError("has another name, too (a hard link)")
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _is_link(status: os.stat_result) -> bool:
    """Whether the status is that of a symbolic link or, on Windows, a junction."""
    junction = getattr(stat, "IO_REPARSE_TAG_MOUNT_POINT", None)
    return stat.S_ISLNK(status.st_mode) or getattr(status, "st_reparse_tag", 0) == junction


def _is_own(status: os.stat_result, folder: Path) -> bool:
    """Whether a file in ``folder`` with this status belongs to the user."""
    if not hasattr(os, "geteuid") or status.st_uid == os.geteuid():
        return True
    # Network drives and containers may show another owner for all files of a user.
    probe = _status_of_new_file(folder)
    return probe is not None and probe.st_uid == status.st_uid


def _status_of_new_file(folder: Path) -> os.stat_result | None:
    """Status that the file system shows for a new private file in ``folder``; None if none can be created."""
    if folder not in _probes:
        path = folder / f".{secrets.token_hex(8)}.part"
        try:
            descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | without_following(), FILE_MODE)
        except OSError:
            return None
        try:
            _probes[folder] = os.fstat(descriptor)
        finally:
            os.close(descriptor)
            with suppress(OSError):
                path.unlink()
    return _probes[folder]


_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def other_kind(path: str | os.PathLike[str]) -> str | None:
    """What ``path`` is, wherever links lead, in place of a plain file; None for such a file, or for nothing at all.

    It is not opened: that alone would wait for whoever writes into a pipe.
    """
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):  # whoever opens it tells why
        return None
    return next((name for is_kind, name in _KINDS if is_kind(mode)), None)


def check_kind(path: Path, error: type[LippmannError]) -> None:
    """Raise ``error`` if ``path`` is a pipe, a device or a socket; of folders and missing files others tell."""
    kind = other_kind(path)
    if kind is not None and kind != "a folder":
        raise error(f"is {kind}, no file", where=str(path), fix="save it as a file first")
