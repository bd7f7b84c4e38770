"""The lock of the rendering engine: one thread of a process uses the engine at a time, and no forked child does.

Mitsuba keeps its variant, and Dr.Jit its thread count, its registry of plugins and the kernel that is being recorded,
for the whole process: two threads that render at the same time end the process. The threads of Dr.Jit and of Open Image
Denoise do not survive ``os.fork``, and locks that they held are never released in the child.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

from lippmann.errors import EngineError

#: Libraries that start threads of their own.
_THREADED = ("drjit", "pyoidn")

_lock = threading.RLock()
_lost = False  # whether this process was forked from one that had loaded such a library


@contextmanager
def exclusive() -> Iterator[None]:
    """Keep the engine to the calling thread; a context manager, and as ``@exclusive()`` a decorator.

    A thread waits until no other thread uses the engine, and Ctrl-C ends the wait. A thread that has the engine may
    enter again.

    Raises
    ------
    EngineError
        The process was forked from one that had loaded the engine.
    """
    if _lost:
        raise EngineError(
            "this process was forked from one that had loaded the rendering engine",
            rule="the engine's threads do not survive a fork",
            fix="start workers by the spawn method: multiprocessing.get_context('spawn')",
        )
    with _lock:
        yield


def _after_fork() -> None:
    """Set up the child: without a lock that a thread of the parent held, and without the engine."""
    global _lock, _lost
    in_use = not _lock.acquire(blocking=False)
    _lock = threading.RLock()
    if not _lost and any(name in sys.modules for name in _THREADED):
        _lost = True
        if in_use:
            _leave_exit_functions_out()
        else:
            _leave_destructors_out()


def _leave_exit_functions_out() -> None:
    """End the process, when its time has come, without functions that were registered before with :mod:`atexit`.

    The one of Dr.Jit waits for the kernel that ran during the fork, and without it the interpreter's own clean-up
    crashes. Python does not tell exit functions the exit code: it is noted where it arises, in ``sys.exit`` and where
    uncaught errors are shown.
    """
    code: object = None
    leave, show = sys.exit, sys.excepthook

    def noted_exit(status: Any = None, /) -> NoReturn:
        nonlocal code
        code = status
        leave(status)

    def noted_error(*error: Any) -> None:
        nonlocal code
        code = 1
        show(*error)

    def end() -> None:
        for stream in (sys.stdout, sys.stderr):
            with suppress(AttributeError, OSError, ValueError):  # there is none, or it is closed
                stream.flush()
        if code is None:
            os._exit(0)
        os._exit(code & 0xFF if isinstance(code, int) else 1)  # Python shows anything else as a message

    sys.exit, sys.excepthook = noted_exit, noted_error
    atexit.register(end)


def _leave_destructors_out() -> None:
    """End the process, when its time has come, without the destructors of C++ libraries.

    Dr.Jit's wait for threads that the child does not have. Python has finished its own clean-up by then.
    """
    if _ON_EXIT is not None:
        atexit.register(_LIBC.fflush, None)
        _ON_EXIT(_LIBC._exit, None)


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    # Found before any fork: the loader's own lock may be held during one.
    _LIBC: Any = ctypes.CDLL(None)
    #: Of the GNU C library alone: runs a function with the exit code, before all destructors that came earlier.
    _ON_EXIT: Any = getattr(_LIBC, "on_exit", None)
    os.register_at_fork(after_in_child=_after_fork)
