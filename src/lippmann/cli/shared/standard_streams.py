"""The process of a command: standard streams that are closed, full or read by nobody any more, and when it began.

Limits of time count from the beginning of the command, not from when all is loaded.
"""

from __future__ import annotations

import errno
import io
import os
import sys
import time
from contextlib import suppress
from typing import TextIO, cast

from lippmann.errors import OutputError
from lippmann.runtime.atomic_write import reason_and_fix


class _Stream(io.RawIOBase):
    """A standard stream whose first failure is told, if at all, and which takes everything from then on."""

    def __init__(self, raw: io.RawIOBase, *, reports_failure: bool) -> None:
        super().__init__()
        self._raw = raw
        self._reports_failure = reports_failure
        self._failed = False

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._raw.fileno()

    def isatty(self) -> bool:
        return self._raw.isatty()

    def write(self, data: object, /) -> int | None:
        size = memoryview(data).nbytes  # type: ignore[arg-type]
        if self._failed:
            return size
        try:
            return self._raw.write(data)  # type: ignore[arg-type]
        except OSError as error:
            self._failed = True
            if not self._reports_failure:
                return size
            if error.errno == errno.EPIPE:  # its reader has read enough
                raise
            reason, fix = reason_and_fix(error)
            if error.errno == errno.EBADF:
                reason, fix = "it is closed", "send it to a file, or to /dev/null"
            raise OutputError(f"cannot be written: {reason}", where="standard output", fix=fix) from None


def complete() -> None:
    """Let no file that is opened later become a standard stream, where what is printed would land in it.

    A standard output that is closed or full is an :class:`OutputError`; what standard error cannot take is lost.
    """
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:  # the lowest that is free is taken: this one
            os.open(os.devnull, os.O_WRONLY if descriptor == 2 else os.O_RDONLY)
    if sys.stdin is None:
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115  # for the whole process
    sys.stdout = _standing(sys.stdout, 1, reports_failure=True)
    sys.stderr = _standing(sys.stderr, 2, reports_failure=False)


def _standing(stream: TextIO | None, descriptor: int, *, reports_failure: bool) -> TextIO:
    if stream is None:
        raw: io.RawIOBase = io.FileIO(descriptor, "w", closefd=False)
        encoding, errors, is_terminal = "utf-8", "backslashreplace", False
    else:
        with suppress(OSError):
            stream.flush()
        raw = cast("io.RawIOBase", getattr(stream.buffer, "raw", stream.buffer))
        encoding, errors, is_terminal = stream.encoding, stream.errors or "strict", stream.isatty()
    buffer = io.BufferedWriter(_Stream(raw, reports_failure=reports_failure))
    return io.TextIOWrapper(buffer, encoding, errors, line_buffering=is_terminal or not reports_failure)


_began: list[float] = []


def begin_command() -> None:
    """Say that a command begins now."""
    _began[:] = [time.perf_counter()]


def command_began() -> float | None:
    """Seconds of :func:`time.perf_counter` at which the command began; None outside of one."""
    return _began[0] if _began else None
