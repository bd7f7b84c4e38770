"""Journal of a sequence: the finished frames, in a text file beside them.

``frames.journal`` begins with the fingerprint of the sequence. Each finished frame adds a line with the check sum of
its file, after that file is in its place. A line that was cut short ends the journal; its frame is rendered again. The
journal is written in place; a file with another beginning is never changed.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any, TypeGuard

from lippmann.errors import LippmannError, OutputError, PictureError
from lippmann.journal.file_lock import take_lock
from lippmann.journal.fingerprint import differences
from lippmann.runtime.atomic_write import Unfinished, output_error, remark

#: Added to the sequence's name.
ENDING = ".journal"

_KEY, _VERSION = "lippmann-frames", 1
#: How every journal begins, and the most bytes of its first line, some kilobytes of text.
_BEGINNING = b'{"fingerprint": {'
_MOST_HEAD = 1 << 24
_BLOCK = 1 << 20


class FrameJournal:
    """Finished frames of one sequence; made by :meth:`open`, and a context manager.

    Attributes
    ----------
    path:
        The journal's file.
    """

    def __init__(self, path: Path, file: IO[bytes], sums: dict[int, str], begun: Unfinished) -> None:
        self.path = path
        self._file = file
        self._sums = sums
        self._begun = begun

    @classmethod
    def open(cls, path: Path, fingerprint: Mapping[str, str], *, resume: bool) -> FrameJournal:
        """Open and lock a journal.

        Parameters
        ----------
        path:
            The journal's file.
        fingerprint:
            Settings of the sequence by name, see :mod:`lippmann.journal.fingerprint`.
        resume:
            Whether to keep the finished frames of an existing journal; otherwise a new one is begun.

        Raises
        ------
        OutputError
            If another process works on the sequence, or the journal cannot be written.
        PictureError
            If the journal is of another sequence (names the differences), or the file is no journal.
        """
        if path.is_symlink():
            raise _no_journal(path, "it is a symbolic link")
        begun = Unfinished(lambda: _remove_without_frames(path))
        with ExitStack() as stack:
            stack.callback(begun.undo)
            try:
                file = stack.enter_context(take_lock(path, path))
            except OSError as error:
                raise output_error(path, error) from error
            file.seek(0)
            line = file.readline(_MOST_HEAD)
            head = _head_of(line, path)
            sums: dict[int, str] = {}
            length = 0
            if resume and head:
                _check_same(head, fingerprint, path)
                sums, length = _frames_of(file.read())
                length += len(line)
            file.truncate(length)
            journal = cls(path, file, sums, begun)
            if not length:
                journal._add({_KEY: _VERSION, "fingerprint": dict(fingerprint)})
            stack.pop_all()
            return journal

    def holds(self, frame: int, file: Path) -> bool:
        """Whether a frame is finished and its file (or folder) has not changed since."""
        try:
            return frame in self._sums and _sum_of(file) == self._sums[frame]
        except OSError:
            return False

    def add(self, frame: int, file: Path) -> None:
        """Record a finished frame.

        Parameters
        ----------
        frame:
            Its number.
        file:
            Its file or folder, complete.

        Raises
        ------
        OutputError
            If the file cannot be read, or the journal cannot be written.
        """
        try:
            check_sum = _sum_of(file)
        except OSError as error:
            raise OutputError(f"cannot be read again: {error.strerror or error}", where=str(file)) from error
        self._add({"frame": frame, "sum": check_sum})
        self._sums[frame] = check_sum

    def finish(self) -> None:
        """Remove the journal, after the last frame."""
        _remove(self.path, self._file)

    def __contains__(self, frame: int) -> bool:
        return frame in self._sums

    def __enter__(self) -> FrameJournal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
        if kind is not None:
            self._begun.undo()
            if self._sums:
                remark(f"finished frames are listed in {self.path.name}: with resume=True the command goes on")
        self._begun.settle()

    def _add(self, values: Mapping[str, object]) -> None:
        try:
            self._file.write(json.dumps(values, sort_keys=True).encode() + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise output_error(self.path, error) from error


def _remove(path: Path, file: IO[bytes]) -> None:
    with suppress(OSError):  # some systems keep what is open
        path.unlink()
    file.close()
    with suppress(OSError):
        path.unlink(missing_ok=True)


def _remove_without_frames(path: Path) -> None:
    """Remove a journal to which no frame came, unless another process works on it."""
    with suppress(OSError, LippmannError):
        if path.exists():
            with take_lock(path, path) as file:
                file.seek(0)
                _head_of(file.readline(_MOST_HEAD), path)
                if not _frames_of(file.read())[0]:
                    _remove(path, file)


def _head_of(line: bytes, path: Path) -> dict[str, object]:
    """Values of a journal's first line; empty if the line was cut short.

    Raises
    ------
    PictureError
        If the line is no journal's.
    """
    is_whole = line.endswith(b"\n")
    if not is_whole and line[: len(_BEGINNING)] == _BEGINNING[: len(line)]:
        return {}
    head = _values(line) if is_whole else None
    if head is None or _KEY not in head:
        raise _no_journal(path, "it holds something else")
    return head


def _no_journal(path: Path, why: str) -> PictureError:
    return PictureError(
        f"this is no journal of an unfinished sequence: {why}",
        where=str(path),
        rule="finished frames are listed under this name",
        fix="choose another name for the frames, or move what lies there",
    )


def _check_same(begun: Mapping[str, object], fingerprint: Mapping[str, str], path: Path) -> None:
    """Refuse the journal of another sequence, naming the differences."""
    if begun[_KEY] != _VERSION:
        raise _no_journal(path, f"its version is {begun[_KEY]!r}, this program writes {_VERSION}")
    before = begun.get("fingerprint")
    if not _are_texts(before):
        raise _no_journal(path, "its first line is damaged")
    if phrases := differences(before, fingerprint):
        raise PictureError(
            f"the unfinished sequence is another one: {', '.join(phrases)}",
            where=str(path),
            rule="what was begun is finished as it was begun",
            fix=f"put that back as it was, or delete {path.name} and begin anew",
        )


def _frames_of(data: bytes) -> tuple[dict[int, str], int]:
    """Check sums by frame, and the length in bytes of the undamaged lines."""
    sums: dict[int, str] = {}
    length = 0
    for line in data.split(b"\n")[:-1]:
        values = _values(line)
        if values is None or not _is_frame(values):
            break
        sums[values["frame"]] = values["sum"]
        length += len(line) + 1
    return sums, length


def _values(line: bytes) -> dict[str, Any] | None:
    try:
        values = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return values if isinstance(values, dict) else None


def _is_frame(values: Mapping[str, Any]) -> bool:
    return type(values.get("frame")) is int and isinstance(values.get("sum"), str)


def _are_texts(values: object) -> TypeGuard[dict[str, str]]:
    return isinstance(values, dict) and all(isinstance(value, str) for value in values.values())


def _sum_of(path: Path) -> str:
    """SHA-256 of a file, or of a folder's files with their names."""
    digest = hashlib.sha256()
    files = sorted(part for part in path.rglob("*") if part.is_file()) if path.is_dir() else [path]
    for part in files:
        digest.update(f"{part.relative_to(path).as_posix()}:{part.stat().st_size}\n".encode())
        with part.open("rb") as file:
            while block := file.read(_BLOCK):
                digest.update(block)
    return digest.hexdigest()
