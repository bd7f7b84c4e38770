"""A Python process that answers requests: native code that damaged data brings down ends that process, not this one.

The process is started for the first request, ends when nothing is asked of it for a while, and is then started anew.
Requests and answers are bytes, each after its length.
"""

from __future__ import annotations

import atexit
import io
import json
import os
import select
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lippmann.errors import LippmannError
from lippmann.runtime.child_python import python_command
from lippmann.runtime.machine import check_input, input_memory_left

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

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
                    process, is_new = self._start_process()
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

    def ask_arrays(self, path: Path, **request: object) -> dict[str, NDArray[np.generic]]:
        """Arrays that a process of :func:`serve_arrays` reads from a file, by name; errors as of :meth:`ask`."""
        import numpy as np

        message = {"path": str(path.resolve()), "memory": input_memory_left(), **request}
        answer = self.ask(json.dumps(message).encode(), where=path.name)
        with np.load(io.BytesIO(answer), allow_pickle=False) as arrays:
            return dict(arrays)

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

    def _start_process(self) -> tuple[subprocess.Popen[bytes], bool]:
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


class RefusedFileError(Exception):
    """A file that a reader of :func:`serve_arrays` does not take: the name of the text that it answers with, and it."""


def serve_arrays(read: Callable[[dict[str, Any]], Mapping[str, NDArray[np.generic]]]) -> None:
    """Answer requests of :meth:`HelperProcess.ask_arrays` by the arrays that ``read`` makes of them.

    What it raises becomes a text, ``error``; but of a :class:`RefusedFileError` that of its name.
    """
    import numpy as np

    def answer(data: bytes) -> bytes:
        request = json.loads(data)
        limit_memory(request["memory"])
        try:
            arrays = dict(read(request))
        except RefusedFileError as error:
            name, text = error.args
            arrays = {name: np.array(text)}
        except Exception as error:  # noqa: BLE001  # libraries raise errors of many kinds
            arrays = {"error": np.array(_words(error, request["path"]))}
        written = io.BytesIO()
        np.savez(written, **arrays)  # type: ignore[arg-type]  # names are free
        return written.getvalue()

    serve(answer)


def _words(error: Exception, path: str) -> str:
    """An error's text in one line, without the folder of the file."""
    if isinstance(error, MemoryError):
        return "it takes more memory than is left"
    try:
        said = " ".join((error.what if isinstance(error, LippmannError) else str(error)).split())
    except UnicodeDecodeError:  # it quotes the file
        return "it holds text that is not UTF-8"
    return said.replace(os.path.join(os.path.dirname(path), ""), "")[:300] or type(error).__name__


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
