"""A Python process that answers requests: native code that damaged data brings down ends that process, not this one.

The process is started for the first request, ends when nothing is asked of it for a while, and is then started anew.
Requests and answers are bytes, each after its length.
"""

from __future__ import annotations

import atexit
import os
import select
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from lippmann.runtime.child_python import python_command
from lippmann.runtime.machine import check_input

_LENGTH = struct.Struct("<Q")
#: Seconds without a request after which the process ends, and its memory is free.
_IDLE_SECONDS = 10.0
#: Bytes that are read at a time.
_PART = 1 << 20
#: Bytes that libraries set aside for their threads.
_THREADS = 256 << 20

#: Bytes of data that this process had before its first request.
_libraries: int | None = None


class HelperEndedError(Exception):
    """The process ended over a request; ``str()`` of it says how."""


class HelperProcess:
    """A child process that runs ``code``, which calls :func:`serve`.

    Parameters
    ----------
    most_seconds:
        Time that a request may take.
    """

    def __init__(self, code: str, most_seconds: float) -> None:
        self._code = code
        self._most_seconds = most_seconds
        self._process: subprocess.Popen[bytes] | None = None
        self._parent = 0
        self._lock = threading.Lock()
        atexit.register(self._end)

    def ask(self, request: bytes, *, where: str) -> bytes:
        """The answer to a request; ``where`` is the file that it is about.

        Raises
        ------
        HelperEndedError
            The process ended, or the request took longer than it may.
        MemoryLimitError
            The answer is larger than the memory that is left.
        """
        with self._lock:
            try:
                while True:
                    process, is_new = self._running()
                    answer = self._answer(process, request, where)
                    if answer is not None:
                        return answer
                    status = process.wait()
                    self._end()
                    if status or is_new:  # else it had nothing to do for a while, and ended just now
                        raise HelperEndedError(f"signal {-status}" if status < 0 else f"exit status {status}")
            except BaseException:  # an answer that is half read would be taken for the next one
                self._end()
                raise

    def _answer(self, process: subprocess.Popen[bytes], request: bytes, where: str) -> bytes | None:
        """The answer; None from a process that ended."""
        assert process.stdin is not None
        deadline = time.monotonic() + self._most_seconds
        with suppress(BrokenPipeError):
            process.stdin.write(_LENGTH.pack(len(request)) + request)
            process.stdin.flush()
        head = self._read(process, _LENGTH.size, deadline)
        if head is None:
            return None
        (size,) = _LENGTH.unpack(head)
        check_input(size, "what it holds", where=where)
        return self._read(process, size, deadline)

    def _read(self, process: subprocess.Popen[bytes], size: int, deadline: float) -> bytes | None:
        assert process.stdout is not None
        parts, left = [], size
        while left:
            if os.name != "nt":  # which waits for sockets alone
                seconds = max(0.0, deadline - time.monotonic())
                if not select.select([process.stdout], [], [], seconds)[0]:
                    raise HelperEndedError(f"it takes more than {self._most_seconds:g} s")
            part = os.read(process.stdout.fileno(), min(left, _PART))
            if not part:
                return None
            parts.append(part)
            left -= len(part)
        return b"".join(parts)

    def _running(self) -> tuple[subprocess.Popen[bytes], bool]:
        """The process, and whether it was started for this."""
        if self._process is not None and self._parent == os.getpid():  # a fork does not share it
            if self._process.poll() is None:
                return self._process, False
            self._end()
        command, environment = python_command(self._code)
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
        )
        self._parent = os.getpid()
        return self._process, True

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is None or self._parent != os.getpid():
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):  # what was asked last did not reach it
                pipe.close()


def serve(answer: Callable[[bytes], bytes]) -> None:
    """Answer the requests of the process that started this one, until it ends or asks nothing for a while."""
    answers = os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)  # what libraries print is no answer
    os.dup2(silence, 2)
    requests = sys.stdin.buffer
    while _is_asked():
        head = requests.read(_LENGTH.size)
        if len(head) < _LENGTH.size:
            return
        data = answer(requests.read(*_LENGTH.unpack(head)))
        answers.write(_LENGTH.pack(len(data)))
        answers.write(data)
        answers.flush()


def limit_memory(most: int) -> None:
    """Let this process take ``most`` bytes of memory besides its libraries; who asks for more gets a MemoryError.

    What the process had when this was first called belongs to its libraries, as do the stacks and pools of their
    threads, which are set aside in whole and hardly used.
    """
    global _libraries
    try:
        import resource
    except ImportError:  # there is none on Windows
        return
    if _libraries is None:
        import psutil

        _libraries = int(getattr(psutil.Process().memory_info(), "data", 0))
    most += _libraries + _THREADS
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (most if hard < 0 else min(most, hard), hard))


def _is_asked() -> bool:
    if os.name == "nt":
        return True
    return bool(select.select([0], [], [], _IDLE_SECONDS)[0])
