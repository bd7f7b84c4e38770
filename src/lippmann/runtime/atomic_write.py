"""Files and folders that appear whole or not at all.

What is written goes to a temporary name beside its place and is renamed into it once it is complete and on the disk.
Whatever fails on the way (a full disk, an error in the writer, Ctrl-C) leaves the place as it was.

Temporary names hold random digits and are made, never opened, so that no link can be planted in their places. In a
folder in which other users may rename any file, one without a sticky bit, they may exchange them later, and the output
too.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lippmann.errors import OutputError
from lippmann.runtime.private_files import FILE_MODE, ForeignFileError, open_to_read, without_following

#: Lists the files of a folder written by :func:`replacing_folder`, so that a later run may replace them and no others.
CONTENTS_FILE = ".lippmann-files"

_REASONS = {
    errno.ENOSPC: ("no space is left on the disk", "free some space or choose another place"),
    errno.EDQUOT: ("the disk quota is used up", "free some space or choose another place"),
    errno.EFBIG: ("the file would be larger than the system allows here", "choose another place"),
    errno.EACCES: ("permission to write is denied", "choose a place that you may write to"),
    errno.EPERM: ("permission to write is denied", "choose a place that you may write to"),
    errno.EROFS: ("the file system is read-only", "choose another place"),
    errno.EISDIR: ("a folder of this name is in the way", "choose another name"),
    errno.ENAMETOOLONG: ("the name is too long", "choose a shorter name"),
}


@contextmanager
def replacing(path: Path, *, private: bool = False) -> Iterator[Path]:
    """Yield a temporary path beside ``path``, with the same suffix; rename it to ``path`` when the block succeeds.

    The temporary file exists already, empty, with the permissions that ``path`` will have: those of the file it
    replaces, else the usual ones. A symbolic link is followed: its target is replaced.

    Parameters
    ----------
    private:
        For names that the program makes up in a folder of its own: only the user may read the file, and a symbolic link
        is itself replaced.

    Raises
    ------
    OutputError
        If ``path`` cannot be written, or the block fails with an :class:`OSError` about writing. Other exceptions
        pass through.
    """
    place = path.absolute() if private else _place(path)
    temporary = place.with_name(f".{place.stem[:64]}-{secrets.token_hex(4)}.part{place.suffix}")
    with _reported(path, temporary):
        try:
            _create(temporary, like=None if private else place)
            yield temporary
            _flush(temporary)
            os.replace(temporary, place)
            _flush_folder(place.parent)
        except BaseException:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield a temporary folder beside ``path``; rename it to ``path`` when the block succeeds.

    A folder already at ``path`` is replaced if it is empty or was written by this function and holds nothing else
    since; the file :data:`CONTENTS_FILE` inside tells. So no stale file of an earlier run survives, and no file of the
    user's is lost.

    Raises
    ------
    OutputError
        If ``path`` cannot be written, holds files of another origin, or the block fails with an :class:`OSError` about
        writing. Other exceptions pass through.
    """
    place = _place(path, folder=True)
    temporary = place.with_name(f".{place.name[:64]}-{secrets.token_hex(4)}.part")
    with _reported(path, temporary):
        try:
            mode = _make_folder(temporary)
            yield temporary
            names = sorted(_files(temporary))
            (temporary / CONTENTS_FILE).write_text("".join(f"{name}\n" for name in names), encoding="utf-8")
            for name in (*names, CONTENTS_FILE):
                _flush(temporary / name)
            _set_mode(temporary, mode)
            _refuse_foreign_files(place, path)  # again: the block may have taken hours
            _exchange(temporary, place)
            _flush_folder(place.parent)
        except BaseException:
            shutil.rmtree(temporary, ignore_errors=True)
            raise


def check_writable(path: Path) -> None:
    """Raise :class:`OutputError` now if :func:`replacing` could not write ``path`` later: before hours of work."""
    place = _place(path)
    temporary = place.with_name(f".{secrets.token_hex(8)}.part")
    with _reported(path, temporary):
        _create(temporary, like=place)
        temporary.unlink()


def check_folder_writable(path: Path) -> None:
    """Raise :class:`OutputError` now if :func:`replacing_folder` could not write ``path`` later."""
    place = _place(path, folder=True)
    temporary = place.with_name(f".{secrets.token_hex(8)}.part")
    with _reported(path, temporary):
        temporary.mkdir()
        temporary.rmdir()


def _place(path: Path, *, folder: bool = False) -> Path:
    """Where ``path`` really lies, once it is known that something can be put there."""
    try:
        mode = _mode(path)
        place = path.resolve()
        parent = _mode(place.parent)
    except OSError as error:
        raise _output_error(path, error) from None
    if parent is None:
        raise OutputError(
            f"the folder '{path.parent}' is not there", where=str(path), fix=f"create it: mkdir -p '{path.parent}'"
        )
    if not stat.S_ISDIR(parent):
        raise OutputError(f"'{path.parent}' is not a folder", where=str(path), fix="choose another place")
    if folder:
        if mode is not None and not stat.S_ISDIR(mode):
            raise OutputError("this is a file, not a folder", where=str(path), fix="choose another name")
        _refuse_foreign_files(place, path)
    elif mode is not None and stat.S_ISDIR(mode):
        raise OutputError("this is a folder", where=str(path), rule="a file is written here", fix="add a file name")
    elif mode is not None and not stat.S_ISREG(mode):
        # Renaming onto a device or a pipe would replace it for everyone.
        raise OutputError("this is not a regular file", where=str(path), fix="choose another name")
    return place


def _mode(path: Path) -> int | None:
    """Kind and permissions of what lies at ``path``, links followed; ``None`` if nothing does."""
    try:
        return path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


def _create(temporary: Path, *, like: Path | None) -> None:
    """Make an empty file with the permissions of ``like``, or the usual ones; for the user alone if that is None."""
    replaces = like is not None and like.exists()
    mode = FILE_MODE if like is None or replaces else 0o666  # less the user's umask
    descriptor = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY | without_following(), mode)
    try:
        if like is not None and replaces:
            if not os.access(like, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            os.chmod(descriptor if os.chmod in os.supports_fd else temporary, stat.S_IMODE(like.stat().st_mode))
    except BaseException:
        temporary.unlink()
        raise
    finally:
        os.close(descriptor)


def _make_folder(temporary: Path) -> int:
    """Make a folder for the user alone, for as long as it is written; the permissions that it is to have then."""
    temporary.mkdir()
    mode = stat.S_IMODE(temporary.stat().st_mode)
    _set_mode(temporary, mode & ~0o077)
    if os.listdir(temporary):  # of a user of the same group, who was quicker than the line before
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(temporary))
    return mode


def _set_mode(folder: Path, mode: int) -> None:
    with suppress(OSError):  # some file systems keep no permissions
        folder.chmod(mode)


def _flush(path: Path) -> None:
    """Wait until ``path`` is on the disk, so that a crash after the rename cannot leave an empty file."""
    descriptor = os.open(path, os.O_RDONLY | without_following())
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems cannot; that is no failure
            raise
    finally:
        os.close(descriptor)


def _flush_folder(folder: Path) -> None:
    """Make a rename last; where a folder cannot be flushed, the system does it in its own time."""
    with suppress(OSError):
        _flush(folder)


def _files(folder: Path) -> Iterator[str]:
    """Paths of all files, and of links to folders, below ``folder``."""
    for parent, folders, names in os.walk(folder):
        for name in (*names, *(name for name in folders if (Path(parent) / name).is_symlink())):
            yield (Path(parent) / name).relative_to(folder).as_posix()


def _refuse_foreign_files(place: Path, path: Path) -> None:
    if not place.exists():
        return
    foreign = sorted(set(_files(place)) - {CONTENTS_FILE, *_listed(place)})
    if foreign:
        raise OutputError(
            f"the folder holds {foreign[0]!r}, which Lippmann did not write there",
            where=str(path),
            rule="a folder is replaced as a whole",
            fix="choose a new folder, or move what is yours out of this one",
        )


def _listed(folder: Path) -> list[str]:
    """What Lippmann wrote into ``folder``; nothing if somebody else than its owner says so, or a link does."""
    try:
        with open_to_read(folder / CONTENTS_FILE, owner=folder.stat().st_uid) as file:
            return file.read().decode().split("\n")
    except (OSError, UnicodeDecodeError, ForeignFileError):
        return []


def _exchange(temporary: Path, place: Path) -> None:
    """Put the folder ``temporary`` in the place of the folder ``place``, which may be missing."""
    if not place.exists():
        os.rename(temporary, place)
        return
    # Folders cannot be renamed onto filled ones: for an instant the old one lies beside its place.
    old = temporary.with_suffix(".old")
    os.rename(place, old)
    try:
        os.rename(temporary, place)
    except BaseException:
        os.rename(old, place)
        raise
    shutil.rmtree(old, ignore_errors=True)


@contextmanager
def _reported(path: Path, temporary: Path) -> Iterator[None]:
    """Turn an :class:`OSError` about ``path`` or ``temporary`` into an :class:`OutputError`."""
    try:
        yield
    except OSError as error:
        name = os.fspath(error.filename) if isinstance(error.filename, (str, os.PathLike)) else ""
        ours = not name or name == str(path) or str(name).startswith(str(temporary))
        if not ours:
            raise  # the block failed to read something else
        raise _output_error(path, error) from error


def _output_error(path: Path, error: OSError) -> OutputError:
    reason, fix = _REASONS.get(error.errno or 0, (error.strerror or str(error), ""))
    return OutputError(f"cannot be written: {reason}", where=str(path), fix=fix)
