"""Memory that the process has freed, given back to the system."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable


def return_freed_memory() -> None:
    """Give freed memory back to the system, where the C library keeps it (glibc); elsewhere nothing is done.

    glibc keeps a heap for each of several threads. Large blocks that many threads allocate and free, as those of Open
    Image Denoise do, leave holes in all of them, and a process that goes on for hours grows. It takes milliseconds.
    """
    trim = _trim()
    if trim is not None:
        trim(0)


@functools.cache
def _trim() -> Callable[[int], int] | None:
    try:
        function = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):  # another C library, or Windows, which has no library of that name
        return None
    function.argtypes, function.restype = [ctypes.c_size_t], ctypes.c_int
    return function
