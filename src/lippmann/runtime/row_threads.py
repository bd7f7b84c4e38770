"""Compiled kernels over rows or pixels on several threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from types import TracebackType

#: Bands per thread: bands of equal length do not take equal time.
_BANDS_PER_THREAD = 4
#: Smallest band in rows and in pixels: a call costs some ten microseconds.
SMALLEST_BAND_OF_ROWS, SMALLEST_BAND_OF_PIXELS = 16, 4096


class Bands:
    """Runs kernels ``kernel(first, last, *arguments)`` over a range, such as the rows of a picture, in bands.

    Kernels release the interpreter's lock and never write where another band reads, so that the result does not depend
    on the number of threads.

    Parameters
    ----------
    threads:
        Number of threads, at least 1.
    """

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    def lines(self, kernel: Callable[..., None], count: int, *arguments: object) -> None:
        """Call ``kernel(first_row, last_row, *arguments)`` for all of ``count`` rows, and wait."""
        self._run(kernel, count, SMALLEST_BAND_OF_ROWS, arguments)

    def pixels(self, kernel: Callable[..., None], count: int, *arguments: object) -> None:
        """Call ``kernel(first, last, *arguments)`` for all of ``count`` pixels, and wait."""
        self._run(kernel, count, SMALLEST_BAND_OF_PIXELS, arguments)

    def _run(self, kernel: Callable[..., None], length: int, smallest: int, arguments: tuple[object, ...]) -> None:
        count = max(1, min(self._threads * _BANDS_PER_THREAD, length // smallest))
        if self._pool is None or count == 1:
            kernel(0, length, *arguments)
            return
        edges = [length * i // count for i in range(count + 1)]
        waiting = [self._pool.submit(kernel, a, b, *arguments) for a, b in pairwise(edges)]
        for future in waiting:
            future.result()

    def __enter__(self) -> Bands:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
