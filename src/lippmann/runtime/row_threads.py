"""Compiled kernels over rows or pixels on several threads."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

#: Bands per thread: bands of equal length do not take equal time.
_BANDS_PER_THREAD = 4
#: Smallest band in rows and in pixels: a call costs some ten microseconds.
SMALLEST_BAND_OF_ROWS, SMALLEST_BAND_OF_PIXELS = 16, 4096

#: Helpers by their number, kept: starting threads takes as long as a kernel over a small picture.
_helpers: dict[int, ThreadPoolExecutor] = {}

if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    # Threads do not survive one.
    os.register_at_fork(after_in_child=_helpers.clear)


class Bands:
    """Runs kernels ``kernel(first, last, *arguments)`` over a range, such as the rows of a picture, in bands.

    Kernels release the interpreter's lock and never write where another band reads, so that the result does not depend
    on the number of threads.

    Parameters
    ----------
    threads:
        Number of threads, at least 1: the one that calls is among them.
    """

    def __init__(self, threads: int) -> None:
        self._threads = threads

    def lines(self, kernel: Callable[..., None], count: int, *arguments: object) -> None:
        """Call ``kernel(first_row, last_row, *arguments)`` for all of ``count`` rows, and wait."""
        self._run(kernel, count, SMALLEST_BAND_OF_ROWS, arguments)

    def pixels(self, kernel: Callable[..., None], count: int, *arguments: object) -> None:
        """Call ``kernel(first, last, *arguments)`` for all of ``count`` pixels, and wait."""
        self._run(kernel, count, SMALLEST_BAND_OF_PIXELS, arguments)

    def _run(self, kernel: Callable[..., None], length: int, smallest: int, arguments: tuple[object, ...]) -> None:
        count = max(1, min(self._threads * _BANDS_PER_THREAD, length // smallest))
        if self._threads == 1 or count == 1:
            kernel(0, length, *arguments)
            return
        waiting = deque(pairwise([length * i // count for i in range(count + 1)]))

        def take_bands() -> None:
            while True:
                try:
                    first, last = waiting.popleft()
                except IndexError:
                    return
                kernel(first, last, *arguments)

        pool = _pool(self._threads - 1)
        helping = [pool.submit(take_bands) for _ in range(min(self._threads, count) - 1)]
        try:
            take_bands()
        finally:
            waiting.clear()
            # Helpers that are busy elsewhere, with whoever waits for this one perhaps, are not waited for.
            for helper in helping:
                if not helper.cancel():
                    helper.result()


def _pool(threads: int) -> ThreadPoolExecutor:
    if threads not in _helpers:
        _helpers[threads] = ThreadPoolExecutor(threads)
    return _helpers[threads]
