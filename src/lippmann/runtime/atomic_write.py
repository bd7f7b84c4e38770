"""Atomic writes: files and folders appear whole or not at all.

A file or folder is written under a temporary name beside its path, flushed to disk, and renamed. A failure (full disk,
error in the writer, Ctrl-C) leaves the path as it was.

Who makes something temporary says beforehand how to undo it (:func:`undone`). It is undone where its block ends,
whatever ends it. An interrupt may strike in that very end; therefore the command line, before it leaves the process
after Ctrl-C, undoes what is left once more (:func:`undo_all`).

What a killed writer left under such a name is removed by the next one (:func:`sweep`).
``tempfile`` names them no better: its files are their owner's alone, and here they get the permissions of an output.
"""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from lippmann.errors import OutputError
from lippmann.printable import one_line
from lippmann.runtime.folder_list import CONTENTS_FILE, read_list, write_list

#: Bytes of a name that are kept.
_KEPT = 64

#: Characters that names of files cannot hold.
_NOT_ON_DISK = dict.fromkeys(map(ord, '/\\:*?"<>|' if os.name == "nt" else "/"), "_")

#: The number, for patterns: machine, process, random digits.
NUMBER = "[0-9a-f]{20}"


#: Work that is begun and not finished, and how to undo it.
_undos: dict[object, Callable[[], None]] = {}
_remark = ""


class Unfinished:
    """Something that is undone by :func:`undo_all` unless it was settled before."""

    def __init__(self, undo: Callable[[], None]) -> None:
        self.undo = undo
        _undos[self] = undo

    def settle(self) -> None:
        """Nothing is left to undo."""
        _undos.pop(self, None)


@contextmanager
def undone(undo: Callable[[], None]) -> Iterator[None]:
    """Call ``undo`` at the end of the block. It may be called twice, and has nothing to do after a success.

    After an error it stays known to :func:`undo_all`: processes that were killed may have gone on for a moment.
    """
    begun = Unfinished(undo)
    try:
        yield
    finally:
        undo()
    begun.settle()


def undo_all() -> None:
    """Undo what is not finished, the last first."""
    while _undos:
        _, undo = _undos.popitem()
        with suppress(Exception):  # the others come all the same
            undo()


def remark(text: str) -> None:
    """Note what lies on disk on purpose if this process ends early, such as finished tiles; empty as work begins."""
    global _remark
    _remark = text


def last_remark() -> str:
    """The last remark; empty if there was none."""
    return _remark


def temporary_file(place: Path) -> Path:
    """The temporary name of a file."""
    return place.with_name(f".{_cut(place.stem)}-{_number()}.part{place.suffix}")


def temporary_folder(place: Path) -> Path:
    """The temporary name of a folder."""
    return place.with_name(f".{_cut(place.name)}-{_number()}.part")


def pattern_of(place: Path) -> re.Pattern[str]:
    """Matches all temporary names of an output, with the number as the group ``number`` of files or ``other``."""
    file, folder = (re.escape(_cut(text)) for text in (place.stem, place.name))
    suffix = re.escape(place.suffix)
    return re.compile(rf"\.(?:{file}-(?P<number>{NUMBER})\.part{suffix}|{folder}-(?P<other>{NUMBER})\.(?:part|old))")


def sweep(place: Path) -> None:
    """Remove what writers of ``place`` left that ran on this machine and are no more."""
    pattern = pattern_of(place)
    with suppress(OSError):  # a folder that cannot be listed keeps them
        for name in os.listdir(place.parent):
            match = pattern.fullmatch(name)
            if match and _is_dead(match["number"] or match["other"]):
                remove(place.with_name(name))


@contextmanager
def scratch_folder(prefix: str, above: str | None = None) -> Iterator[str]:
    """A new folder of this account alone, removed at the end; those that killed processes left there go before.

    Parameters
    ----------
    prefix:
        Beginning of its name, such as ``lippmann-dask-``.
    above:
        Where it lies; None for the system's temporary folder.

    Raises
    ------
    OSError
        If it cannot be created.
    """
    above = above or tempfile.gettempdir()
    with suppress(OSError):
        for name in os.listdir(above):
            if name.startswith(prefix) and _is_dead(name.removeprefix(prefix)[:20]):
                remove(Path(above, name))
    folder = Path(above, f"{prefix}{_number()}")
    with undone(lambda: remove(folder)):
        folder.mkdir(mode=0o700)
        yield str(folder)


def remove(path: Path) -> None:
    """Remove a file, a link or a folder; errors are ignored, links are not followed."""
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()


def _is_dead(number: str) -> bool:
    if not re.fullmatch(NUMBER, number) or not number.startswith(_machine()):
        return False
    import psutil

    return not psutil.pid_exists(int(number[4:12], 16))


def _number() -> str:
    return f"{_machine()}{os.getpid():08x}{secrets.token_hex(4)}"


@cache
def _machine() -> str:
    """Four digits of the machine: processes of others cannot be asked whether they run."""
    return hashlib.sha256(platform.node().encode()).hexdigest()[:4]


def disk_name(name: str, most: int) -> str:
    """A name of any origin as that of a file: whole if it can be, else without what file systems or terminals do not
    take, and of at most so many bytes."""
    return _cut(one_line(name.translate(_NOT_ON_DISK)), most)


def _cut(text: str, most: int = _KEPT) -> str:
    """The beginning of a name, of at most so many bytes."""
    while len(os.fsencode(text)) > most:
        text = text[:-1]
    return text


_REASONS = {
    errno.ENOSPC: ("no space is left on the disk", "free some space or choose another place"),
    errno.EDQUOT: ("the disk quota is used up", "free some space or choose another place"),
    errno.EFBIG: ("the file would be larger than the system allows here", "choose another place"),
    errno.EACCES: ("permission to write is denied", "choose a place that you may write to"),
    errno.EPERM: ("permission to write is denied", "choose a place that you may write to"),
    errno.EROFS: ("the file system is read-only", "choose another place"),
    errno.EISDIR: ("a folder of this name is in the way", "choose another name"),
    errno.ENOENT: ("its folder was removed or renamed", "create it again, or choose another place"),
    errno.ENAMETOOLONG: ("the name is too long", "choose a shorter name"),
}


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Write a file atomically: yield a temporary path, which is renamed to ``path`` when the block succeeds.

    The temporary file has the same suffix and exists already, empty, with the permissions of the file that it replaces,
    else the default ones.

    Parameters
    ----------
    path:
        The file. A symbolic link is followed: its target is replaced.

    Raises
    ------
    OutputError
        If ``path`` cannot be written, or the block raises an :class:`OSError` about the temporary file. Other
        exceptions pass through.
    """
    place = _place(path)
    temporary = temporary_file(place)
    with _report_errors(path, temporary):
        sweep(place)
        with undone(lambda: remove(temporary)):
            _create(temporary, like=place)
            yield temporary
            _flush(temporary)
            os.replace(temporary, place)
            _flush_folder(place.parent)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Write a folder atomically: yield a temporary folder, which is renamed to ``path`` when the block succeeds.

    An existing folder is replaced if it is empty, or if this function wrote it and it holds no other files, as
    :mod:`~lippmann.runtime.folder_list` says. No stale file of an earlier write remains, and no file of the user is
    lost.

    Raises
    ------
    OutputError
        If ``path`` cannot be written or holds other files, or the block raises an :class:`OSError` about the temporary
        folder. Other exceptions pass through.
    """
    place = _place(path, folder=True)
    temporary = temporary_folder(place)
    with _report_errors(path, temporary):
        sweep(place)
        with undone(lambda: remove(temporary)):
            temporary.mkdir()
            yield temporary
            names = sorted(_files(temporary))
            write_list(temporary, names)
            for name in (*names, CONTENTS_FILE):
                _flush(temporary / name)
            _refuse_foreign_files(place, path)  # again: the block may have taken hours
            _exchange(temporary, place)
            _flush_folder(place.parent)


def check_writable(path: Path) -> None:
    """Raise :class:`OutputError` if :func:`replacing` cannot write ``path``, for a check before a long render."""
    place = _place(path)
    temporary = place.with_name(f".{secrets.token_hex(8)}.part")
    with _report_errors(path, temporary), undone(lambda: remove(temporary)):
        _create(temporary, like=place)


def check_folder_writable(path: Path) -> None:
    """Raise :class:`OutputError` if :func:`replacing_folder` cannot write ``path``, for a check before a long
    render."""
    place = _place(path, folder=True)
    temporary = place.with_name(f".{secrets.token_hex(8)}.part")
    with _report_errors(path, temporary), undone(lambda: remove(temporary)):
        temporary.mkdir()


def _place(path: Path, *, folder: bool = False) -> Path:
    """The resolved ``path``, once it is known that a file or folder can be written there."""
    try:
        mode = _mode(path)
        place = path.resolve()
        parent = _mode(place.parent)
    except OSError as error:
        raise output_error(path, error) from None
    if parent is None:
        raise OutputError(
            f"there is no folder '{path.parent}'", where=str(path), fix=f"create it: mkdir -p '{path.parent}'"
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
    """``st_mode`` of ``path``, links followed; None if it does not exist."""
    try:
        return path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


def _create(temporary: Path, *, like: Path) -> None:
    """Create an empty file with the permissions of ``like``, else the default ones."""
    replaces = like.exists()
    mode = 0o600 if replaces else 0o666  # less the user's umask
    descriptor = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode)
    try:
        if replaces:
            if not os.access(like, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            os.chmod(descriptor if os.chmod in os.supports_fd else temporary, stat.S_IMODE(like.stat().st_mode))
    except BaseException:
        temporary.unlink()
        raise
    finally:
        os.close(descriptor)


def _flush(path: Path) -> None:
    """Flush ``path`` to disk, so that a crash after the rename cannot leave an empty file."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems cannot flush
            raise
    finally:
        os.close(descriptor)


def _flush_folder(folder: Path) -> None:
    """Flush the entries of a folder to disk, if the system can."""
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
    foreign = sorted(set(_files(place)) - {CONTENTS_FILE} - read_list(place))
    if foreign:
        raise OutputError(
            f"the folder holds {foreign[0]!r}, which Lippmann did not write, or which was changed since",
            where=str(path),
            rule="a folder is replaced as a whole",
            fix="choose a new folder, or move your files out of this one",
        )


def _exchange(temporary: Path, place: Path) -> None:
    """Rename the folder ``temporary`` to ``place``, and remove the folder that was there."""
    if not place.exists():
        os.rename(temporary, place)
        return
    # A folder cannot be renamed onto one that is not empty: for an instant the old one has another name.
    old = temporary.with_suffix(".old")

    def put_in_order() -> None:
        if old.exists() and not place.exists():
            os.rename(old, place)
        shutil.rmtree(old, ignore_errors=True)

    with undone(put_in_order):
        os.rename(place, old)
        os.rename(temporary, place)


@contextmanager
def _report_errors(path: Path, temporary: Path) -> Iterator[None]:
    """Turn an :class:`OSError` about ``path`` or ``temporary`` into an :class:`OutputError`."""
    try:
        yield
    except OSError as error:
        name = os.fspath(error.filename) if isinstance(error.filename, (str, os.PathLike)) else ""
        ours = not name or name == str(path) or str(name).startswith(str(temporary))
        if not ours:
            raise  # the block failed to read something else
        raise output_error(path, error) from error


def reason_and_fix(error: OSError) -> tuple[str, str]:
    """Meaning of a system's error in words, and its remedy; empty if none is known."""
    said = str(error).lower()  # libraries quote the system in errors without a number
    number = error.errno or next((each for each in _REASONS if os.strerror(each).lower() in said), 0)
    return _REASONS.get(number, (error.strerror or str(error), ""))


def output_error(path: Path, error: OSError) -> OutputError:
    """The error that ``path`` cannot be written."""
    reason, fix = reason_and_fix(error)
    if error.errno == errno.ENOENT and path.parent.is_dir():  # as in /proc
        reason, fix = "its folder takes no files", "choose another place"
    return OutputError(f"cannot be written: {reason}", where=str(path), fix=fix)
