"""The rule that every reader keeps, whatever it is given: a result or a LippmannError, soon and in little memory."""

from __future__ import annotations

import os
import re
import resource
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.errors import LippmannError
from lippmann.runtime.machine import limit_inputs

#: CPU seconds and bytes of memory that one input may take. Seconds of the clock would measure the machine's load.
#: Readers are granted a quarter of the bytes for what files hold, and have to ask first.
SECONDS = 2.0
MEMORY = 1 << 30

_PACKAGE = f"{os.sep}lippmann{os.sep}"

Read = Callable[[bytes, Path], object]


class TooSlow(BaseException):  # no Exception: a reader that catches those must not swallow it
    """An input that takes longer than :data:`SECONDS`."""


@dataclass(frozen=True)
class Outcome:
    """How an input ended.

    Attributes
    ----------
    broken:
        How the rule was broken; empty if it was kept.
    site:
        Where it ended: the places of the last lines in Lippmann that an error came through. Inputs that end where none
        did before are worth changing further.
    """

    broken: str
    site: tuple[str, ...]


def judge(read: Read, data: bytes, folder: Path, seconds: float | None = None) -> Outcome:
    """Give an input to a reader, which may write into ``folder`` and take so many CPU seconds (:data:`SECONDS`)."""
    seconds = SECONDS if seconds is None else seconds
    _forget_peak()
    peak = _peak()
    site: tuple[str, ...] = ("result",)
    faults: list[str] = []
    with warnings.catch_warnings(record=True) as warned, _limit(seconds), limit_inputs(MEMORY // 4):
        warnings.simplefilter("always")
        try:
            result = read(data, folder)
            if isinstance(result, bytes):
                site = ("result", repr(result[:32]), repr(result[-48:]))
        except LippmannError as error:
            site = _site(error)
            faults += _faults_of(error)
        except TooSlow as error:
            site = _site(error)
            faults.append(f"takes more than {seconds:g} s of CPU time at {site[-1] if site else '?'}")
        except Exception as error:  # noqa: BLE001  # which is what is looked for
            site = _site(error)
            faults.append(f"{type(error).__name__}: {str(error)[:200]} at {site[-1] if site else '?'}")
    faults += [f"warning: {entry.category.__name__}: {str(entry.message)[:200]}" for entry in warned]
    if _peak() - peak > MEMORY:
        faults.append(f"takes {(_peak() - peak) >> 20} MiB")
    return Outcome("; ".join(faults), site)


def _faults_of(error: LippmannError) -> list[str]:
    """What is wrong with an error that is of the right kind."""
    faults = []
    line = str(error)
    if not line or len(line.splitlines()) != 1:
        faults.append(f"{type(error).__name__} is not one line: {line[:200]!r}")
    if re.search("bad_alloc|std::|MemoryError|length_error", line):
        faults.append(f"tells of memory as a library does: {line[:200]}")
    cause: BaseException | None = error
    for _ in range(20):
        if isinstance(cause, MemoryError):
            faults.append(f"asks for too much memory at {_site(cause)[-1:]}")
        cause = None if cause is None else cause.__cause__ or cause.__context__
    return faults


def _site(error: BaseException) -> tuple[str, ...]:
    while isinstance(error.__context__, LippmannError):  # the first of those that were told further
        error = error.__context__
    places = []
    for frame, line in traceback.walk_tb(error.__traceback__):
        name = frame.f_code.co_filename
        if _PACKAGE in name:
            places.append(f"{name.rpartition(_PACKAGE)[2]}:{line}")
    return tuple(places[-3:])


def _peak() -> int:
    """Bytes of memory that this process took at most since :func:`_forget_peak`, or, where that is not kept, ever."""
    # Linux counts what the parent took among a child's ru_maxrss.
    with suppress(OSError), open("/proc/self/status", encoding="utf-8", errors="replace") as status:
        for line in status:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) << 10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def _forget_peak() -> None:
    """Whatever came before would hide what an input takes."""
    with suppress(OSError), open("/proc/self/clear_refs", "w", encoding="ascii") as control:
        control.write("5")


@contextmanager
def _limit(seconds: float) -> Iterator[None]:
    def stop(*_: Any) -> None:
        raise TooSlow

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


@contextmanager
def quiet() -> Iterator[Callable[[], str]]:
    """What is printed meanwhile, by libraries too; the function gives what was since its last call."""
    with tempfile.TemporaryFile() as sink, open(sink.fileno(), "w", encoding="utf-8", closefd=False) as text:
        read = 0

        def said() -> str:
            nonlocal read
            text.flush()
            size = os.fstat(sink.fileno()).st_size
            if size == read:
                return ""
            part = os.pread(sink.fileno(), size - read, read).decode("utf-8", "replace")
            read = size
            return part

        sys.stdout.flush()
        sys.stderr.flush()
        kept = [os.dup(1), os.dup(2)]
        try:
            for descriptor in (1, 2):
                os.dup2(sink.fileno(), descriptor)
            # Both ways of printing: by the descriptors, and by Python's streams, which may lead elsewhere.
            with redirect_stdout(text), redirect_stderr(text):
                yield said
        finally:
            for descriptor, copy in zip((1, 2), kept, strict=True):
                os.dup2(copy, descriptor)
                os.close(copy)
