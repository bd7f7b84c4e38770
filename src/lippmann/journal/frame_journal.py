"""Which frames of a sequence are finished: a file of lines beside them, safe from whatever ends the process.

``frames.journal`` begins with the fingerprint of the sequence; each finished frame adds a line with the check sum of
its file, once that lies in its place. A line that was cut short ends the journal: what it would have said is rendered
again. The journal is written in place: it has to be a file of the user's own (:mod:`lippmann.runtime.private_files`),
and one that begins otherwise is never changed.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from lippmann.errors import OutputError, PictureError
from lippmann.journal.file_lock import locked
from lippmann.journal.fingerprint import differences
from lippmann.runtime.private_files import ForeignFileError

#: Added to the sequence's name.
ENDING = ".journal"

_KEY, _VERSION = "lippmann-frames", 1
#: How every journal begins, and the most bytes of its first line, some kilobytes of text.
_BEGINNING = b'{"fingerprint": {'
_MOST_HEAD = 1 << 24
_BLOCK = 1 << 20


class FrameJournal:
    """The finished frames of one sequence. Make one with :meth:`open`; it is a context manager.

    Attributes
    ----------
    path:
        Its file.
    chosen:
        What was chosen for all frames when the first was rendered, by name.
    """

    def __init__(self, path: Path, file: IO[bytes], sums: dict[int, str], chosen: dict[str, str]) -> None:
        self.path = path
        self.chosen = chosen
        self._file = file
        self._sums = sums

    @classmethod
    def open(cls, path: Path, fingerprint: Mapping[str, str], *, resume: bool) -> FrameJournal:
        """Begin a journal, or with ``resume`` go on with the one that is there, if there is one.

        Raises
        ------
        OutputError
            If another process works on the sequence, or the journal cannot be written.
        PictureError
            If the journal is of another sequence, and says what differs; or what lies there is none of the user's.
        """
        try:
            file = locked(path, path)
        except ForeignFileError as error:
            raise _no_journal(path, f"it {error}", error.fix) from error
        except OSError as error:
            raise OutputError(f"cannot be written: {error.strerror or error}", where=str(path)) from error
        try:
            file.seek(0)
            line = file.readline(_MOST_HEAD)
            head = _head_of(line, path)
            sums: dict[int, str] = {}
            chosen: dict[str, str] = {}
            length = 0
            if resume and head:
                _check_same(head, fingerprint, path)
                sums, chosen, length = _frames_of(file.read())
                length += len(line)
            file.truncate(length)
            journal = cls(path, file, sums, chosen)
            if not length:
                journal._add({_KEY: _VERSION, "fingerprint": dict(fingerprint)})
        except BaseException:
            file.close()
            raise
        return journal

    def holds(self, frame: int, file: Path) -> bool:
        """Whether a frame is finished, and its file (or folder) as it was then."""
        try:
            return frame in self._sums and _sum_of(file) == self._sums[frame]
        except OSError:
            return False

    def add(self, frame: int, file: Path, chosen: Mapping[str, str]) -> None:
        """A frame lies in its file.

        Raises
        ------
        OutputError
            If that cannot be written down, or the file not be read.
        """
        try:
            found = _sum_of(file)
        except OSError as error:
            raise OutputError(f"cannot be read again: {error.strerror or error}", where=str(file)) from error
        self._add({"frame": frame, "sum": found, "chosen": dict(chosen)})
        self._sums[frame] = found
        self.chosen = self.chosen or dict(chosen)

    def finish(self) -> None:
        """Remove the journal: all is in its place."""
        with suppress(OSError):  # some systems keep what is open
            self.path.unlink()
        self._file.close()
        with suppress(OSError):
            self.path.unlink(missing_ok=True)

    def __contains__(self, frame: int) -> bool:
        return frame in self._sums

    def __enter__(self) -> FrameJournal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None and not self._sums:
            self.finish()  # what failed before its first frame leaves nothing behind
        self._file.close()

    def _add(self, values: Mapping[str, Any]) -> None:
        try:
            self._file.write(json.dumps(values, sort_keys=True).encode() + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise OutputError(f"cannot be written: {error.strerror or error}", where=str(self.path)) from error


def _head_of(line: bytes, path: Path) -> dict[str, Any]:
    """What the journal's first line says; nothing if it was cut short before its end.

    Raises
    ------
    PictureError
        If this is no journal's.
    """
    is_whole = line.endswith(b"\n")
    if not is_whole and line[: len(_BEGINNING)] == _BEGINNING[: len(line)]:
        return {}
    head = _values(line) if is_whole else None
    if head is None or _KEY not in head:
        raise _no_journal(path, "it holds something else")
    return head


def _no_journal(path: Path, why: str, fix: str = "") -> PictureError:
    return PictureError(
        f"this is no journal of an unfinished sequence: {why}",
        where=str(path),
        rule="finished frames are listed under this name",
        fix=fix or "choose another name for the frames, or move what lies there",
    )


def _check_same(begun: Mapping[str, Any], fingerprint: Mapping[str, str], path: Path) -> None:
    """Refuse the journal of another sequence, and say what differs."""
    if begun[_KEY] != _VERSION:
        raise _no_journal(path, f"its version is {begun[_KEY]!r}, this program writes {_VERSION}")
    if not _are_texts(begun.get("fingerprint")):
        raise _no_journal(path, "its first line is damaged")
    if found := differences(begun["fingerprint"], fingerprint):
        raise PictureError(
            f"the unfinished sequence is another one: {', '.join(found)}",
            where=str(path),
            rule="what was begun is finished as it was begun",
            fix=f"put that back as it was, or delete {path.name} and begin anew",
        )


def _frames_of(data: bytes) -> tuple[dict[int, str], dict[str, str], int]:
    """Sums by frame, what was chosen, and up to which byte the lines are sound."""
    sums: dict[int, str] = {}
    chosen: dict[str, str] = {}
    length = 0
    for line in data.split(b"\n")[:-1]:
        values = _values(line)
        if values is None or not _is_frame(values):
            break
        sums[values["frame"]] = values["sum"]
        chosen = chosen or values["chosen"]
        length += len(line) + 1
    return sums, chosen, length


def _values(line: bytes) -> dict[str, Any] | None:
    try:
        values = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return values if isinstance(values, dict) else None


def _is_frame(values: Mapping[str, Any]) -> bool:
    return type(values.get("frame")) is int and isinstance(values.get("sum"), str) and _are_texts(values.get("chosen"))


def _are_texts(values: object) -> bool:
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
