"""Suppression of standard error, on which some libraries print errors that they also raise."""

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
#: Number of threads inside the context; copy of the descriptor; and Python's stream, which is another one in notebooks.
_users = 0
_descriptor: int | None = None
_stream: TextIO | None = None


@contextlib.contextmanager
def silence_libraries() -> Iterator[None]:
    """Context in which nothing appears on standard error.

    Standard error belongs to the whole process: the first thread that enters redirects it, and the last that leaves
    restores it.
    """
    _begin()
    try:
        yield
    finally:
        _end()


def _begin() -> None:
    global _users, _descriptor, _stream
    with _lock:
        _users += 1
        if _users > 1:
            return
        _stream, sys.stderr = sys.stderr, io.StringIO()
        try:
            _descriptor = os.dup(_STANDARD_ERROR)
        except OSError:  # there is none
            return
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), _STANDARD_ERROR)


def _end() -> None:
    global _users
    with _lock:
        if _users == 0:  # in a child forked meanwhile, which has restored it
            return
        _users -= 1
        if _users == 0:
            _restore()


def _restore() -> None:
    global _descriptor, _stream
    sys.stderr, _stream = _stream, None
    if _descriptor is not None:
        os.dup2(_descriptor, _STANDARD_ERROR)
        os.close(_descriptor)
        _descriptor = None


def _after_fork() -> None:
    """Restore standard error in the child: the threads inside the context are the parent's."""
    global _lock, _users
    _lock = threading.Lock()
    if _users:
        _users = 0
        _restore()


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    os.register_at_fork(after_in_child=_after_fork)
