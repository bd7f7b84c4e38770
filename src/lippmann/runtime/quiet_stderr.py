"""Libraries that print what is wrong with a file on standard error, beside saying it where they were called."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import threading
from collections.abc import Iterator
from typing import TextIO

_STANDARD_ERROR = 2

_lock = threading.Lock()
#: How many threads want silence, and what they took away: a copy of the descriptor, and Python's stream, which leads
#: elsewhere in notebooks.
_users = 0
_kept: int | None = None
_stream: TextIO | None = None


@contextlib.contextmanager
def libraries_silenced() -> Iterator[None]:
    """Nothing that is printed on standard error inside the ``with`` is seen.

    Standard error belongs to the whole process: it is turned away by the first thread that comes and given back by the
    last that goes.
    """
    _begin()
    try:
        yield
    finally:
        _end()


def _begin() -> None:
    global _users, _kept, _stream
    with _lock:
        _users += 1
        if _users > 1:
            return
        _stream, sys.stderr = sys.stderr, io.StringIO()
        try:
            _kept = os.dup(_STANDARD_ERROR)
        except OSError:  # there is none
            return
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), _STANDARD_ERROR)


def _end() -> None:
    global _users
    with _lock:
        if _users == 0:  # in a child forked meanwhile, which has it back
            return
        _users -= 1
        if _users == 0:
            _give_back()


def _give_back() -> None:
    global _kept, _stream
    sys.stderr, _stream = _stream, None
    if _kept is not None:
        os.dup2(_kept, _STANDARD_ERROR)
        os.close(_kept)
        _kept = None


def _after_fork() -> None:
    """Give standard error back in the child: the threads that want silence are the parent's."""
    global _lock, _users
    _lock = threading.Lock()
    if _users:
        _users = 0
        _give_back()


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    os.register_at_fork(after_in_child=_after_fork)
