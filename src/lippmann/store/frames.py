"""Which frames of a sequence are finished: a file of lines beside them, safe from whatever ends the process.

``frames.journal`` begins with the fingerprint of the sequence; each finished frame adds a line with the check sum of
its file, once that lies in its place. A line that was cut short ends the journal: what it would have said is rendered
again.
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
from lippmann.store.fingerprint import differences
from lippmann.store.lock import locked

#: Added to the sequence's name.
ENDING = ".journal"

_KEY, _VERSION = "lippmann-frames", 1
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
            If the journal is of another sequence, and says what differs, or is none of ours.
        """
        try:
            file = locked(path, path)
        except OSError as error:
            raise OutputError(f"cannot be written: {error.strerror or error}", where=str(path)) from error
        try:
            file.seek(0)
            data = file.read() if resume else b""
            sums, chosen, length = _read(data, fingerprint, path)
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


def _read(data: bytes, fingerprint: Mapping[str, str], path: Path) -> tuple[dict[int, str], dict[str, str], int]:
    """Sums by frame, what was chosen, and up to which byte the journal is sound; all empty where there is none."""
    head, mark, _ = data.partition(b"\n")
    if not mark:
        return {}, {}, 0  # nothing, or cut short before its first frame
    begun = _values(head)
    if begun is None or begun.get(_KEY) != _VERSION or not _are_texts(begun.get("fingerprint")):
        raise PictureError("this is no journal of an unfinished sequence", where=str(path), fix="delete it")
    if found := differences(begun["fingerprint"], fingerprint):
        raise PictureError(
            f"the unfinished sequence is another one: {', '.join(found)}",
            where=str(path),
            rule="what was begun is finished as it was begun",
            fix=f"put that back as it was, or delete {path.name} and begin anew",
        )
    sums: dict[int, str] = {}
    chosen: dict[str, str] = {}
    length = len(head) + 1
    for line in data[length:].split(b"\n")[:-1]:
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
