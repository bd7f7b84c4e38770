"""The lock of the rendering engine: one thread of a process uses the engine at a time, and no forked child does.

The variant of Mitsuba and the thread count, plugin registry and recorded kernel of Dr.Jit belong to the whole process:
two threads that render at the same time crash it, and so does one that frees a scene while another renders. The
threads of Dr.Jit and of Open Image Denoise do not survive ``os.fork``, and locks that they held are never released in
the child.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import os
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from typing import TYPE_CHECKING, Any, NoReturn

from lippmann.errors import EngineError
from lippmann.runtime import open_image_denoise

_lock = threading.RLock()
_next = threading.Lock()  # held by the one thread that waits for its turn
_depth = threading.local()  # ``of_thread``: how often this thread holds the lock
_dropped: deque[object] = deque()  # objects to free once no thread uses the engine
_lost = False  # whether this process was forked from one that had loaded such a library


@contextmanager
def exclusive() -> Iterator[None]:
    """Exclusive use of the engine by the calling thread; a context manager, and as ``@exclusive()`` a decorator.

    The call waits until no other thread uses the engine; Ctrl-C ends the wait. The lock is reentrant, and fair: a
    thread that takes it again and again, as live rendering does, lets one that waits go first. Python's cyclic
    collector waits for its end.

    Raises
    ------
    EngineError
        If the process was forked from one that had loaded the engine.
    """
    if _lost:
        raise EngineError(
            "this process was forked from one that had loaded the rendering engine",
            rule="the engine's threads do not survive a fork",
            fix="start workers by the spawn method: multiprocessing.get_context('spawn')",
        )
    lock = _lock  # a fork within the block replaces it, and this one is released all the same
    depth = getattr(_depth, "of_thread", 0)
    with nullcontext() if depth else _next:
        lock.acquire()
    _depth.of_thread = depth + 1
    try:
        with no_collection():
            yield
    finally:
        if not depth:
            _dropped.clear()
        _depth.of_thread = depth
        lock.release()


class EngineOwner:
    """Base of what holds scenes of the engine: a thread that drops it frees them only if no other uses the engine.

    An emitter or a surface that another thread frees while a kernel is recorded aborts the process, for the reason
    that :func:`no_collection` gives. So the thread that uses the engine frees them at its end.
    """

    def __del__(self) -> None:
        _dropped.append([*vars(self).values()])
        if _lock.acquire(blocking=False):
            try:
                _dropped.clear()
            finally:
                _lock.release()


def _after_fork() -> None:
    """Set up the child: without a lock that a thread of the parent held, and without the engine."""
    global _lock, _next, _lost
    in_use = not _lock.acquire(blocking=False)
    _lock, _next = threading.RLock(), threading.Lock()
    if not _lost and ("drjit" in sys.modules or open_image_denoise.is_loaded()):
        _lost = True
        if in_use:
            _leave_exit_functions_out()
        else:
            _leave_destructors_out()


def _leave_exit_functions_out() -> None:
    """Make the process exit without the functions that were registered before with :mod:`atexit`.

    That of Dr.Jit waits for the kernel that ran during the fork, and without it the interpreter's own clean-up crashes.
    Exit functions do not receive the exit code, so ``sys.exit`` and the hook of uncaught errors store it.
    """
    code: object = None
    leave, show = sys.exit, sys.excepthook

    def exit_and_store(status: Any = None, /) -> NoReturn:
        nonlocal code
        code = status
        leave(status)

    def show_and_store(*error: Any) -> None:
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

    sys.exit, sys.excepthook = exit_and_store, show_and_store
    atexit.register(end)


def _leave_destructors_out() -> None:
    """Make the process exit without the destructors of C++ libraries, after Python's own clean-up.

    Those of Dr.Jit wait for threads that the child does not have.
    """
    if _ON_EXIT is not None:
        atexit.register(_LIBC.fflush, None)
        _ON_EXIT(_LIBC._exit, None)


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    # Loaded before any fork: the loader's own lock may be held during one.
    _LIBC: Any = ctypes.CDLL(None)
    #: GNU C library only: registers a function that receives the exit code and runs before earlier destructors.
    _ON_EXIT: Any = getattr(_LIBC, "on_exit", None)
    os.register_at_fork(after_in_child=_after_fork)


@contextmanager
def no_collection() -> Iterator[None]:
    """Free nothing that only the cyclic collector finds, such as an earlier scene, within the block.

    The collector runs at any moment. Where it frees an emitter or a surface between two calls that one kernel makes to
    all of them, Dr.Jit 1.5 writes the code of those that are left down twice (its key of a function tells single ones
    from one of many) and aborts the process; a frozen kernel cannot record that either.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


if TYPE_CHECKING or sys.version_info >= (3, 12):
    from functools import cached_property as cached_property
else:

    class cached_property:  # noqa: N801 - stands in for that of functools
        """``functools.cached_property`` without the lock that it has before Python 3.12.

        All objects share that lock: a thread that holds it while it waits for another lock, or a fork while a thread
        holds it, deadlocks every access. Here two threads may both compute the value; both get the one stored first.
        """

        def __init__(self, compute):
            self.compute = compute
            self.__doc__ = compute.__doc__

        def __set_name__(self, owner, name):
            self.name = name

        def __get__(self, instance, owner=None):
            # For an object this is called only until the value is in its dictionary.
            return self if instance is None else vars(instance).setdefault(self.name, self.compute(instance))
