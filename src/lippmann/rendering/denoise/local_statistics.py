"""What is measured of the halves of a picture, pixel by pixel, and its means over the pixels around each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]
Halves = tuple[Floats, Floats]

#: Two measures of rows of halves and of the slope of their code.
Measure = Callable[..., tuple[NDArray[Any], NDArray[Any]]]


def measured(measure: Measure, *pictures: Halves, transfer: Transfer, bands: Bands) -> tuple[Floats, Floats]:
    """The two measures, ``(H, W)`` each, that ``measure`` takes of pictures, between codes.

    Each picture is two halves, ``(H, W, 3)`` linear; the slope of the code is that of the last one's mean. Beyond white
    the codes are cut off, but what is wrong there is wrong around, too.
    """
    first, second = pictures[-1]
    found = np.empty(first.shape[:2], dtype=np.float32), np.empty(first.shape[:2], dtype=np.float32)

    def measure_rows(start: int, end: int) -> None:
        band = slice(start, end)
        slope = coding_slope(np.clip(np.float32(0.5) * (first[band] + second[band]), 0, 1), transfer)
        halves = (half[band] for picture in pictures for half in picture)
        found[0][band], found[1][band] = measure(*halves, slope)

    bands.lines(measure_rows, len(first))
    return found


def mean_around(values: Floats, reach: int, bands: Bands) -> Floats:
    """Means of ``(H, W)`` over the square of pixels up to ``reach`` away, cut at the edges."""
    padded = np.pad(values, reach)
    count = _pixels_around(values.shape, reach)
    mean = np.empty_like(values)

    def mean_rows(start: int, end: int) -> None:
        columns = _window_sums(padded[start : end + 2 * reach], 2 * reach + 1)
        mean[start:end] = _window_sums(columns.T, 2 * reach + 1).T / count[start:end]

    bands.lines(mean_rows, len(values))
    return mean


def _window_sums(values: Floats, size: int) -> Floats:
    """Sums down each column over all windows of ``size`` rows.

    Windows are put together from such of 1, 2, 4, ... rows: nothing is taken away again, so that a strong value leaves
    nothing behind.
    """
    length = len(values) - size + 1
    total = np.zeros_like(values[:length])
    block, rows, done = values, 1, 0
    while True:
        if size & rows:
            total += block[done : done + length]
            done += rows
        if done == size:
            return total
        block = block[:-rows] + block[rows:]
        rows *= 2


def _pixels_around(shape: tuple[int, ...], reach: int) -> Floats:
    """``(H, W)``: of how many pixels the mean around each is, itself included."""
    rows, columns = (
        np.minimum(place + reach, len(place) - 1) - np.maximum(place - reach, 0) + 1 for place in map(np.arange, shape)
    )
    return np.outer(rows, columns).astype(np.float32)


def leave_one_out_mean(values: Floats, reach: int, errors: float, bands: Bands) -> Floats:
    """Leave-one-out local mean, soft-thresholded at ``errors`` of its own standard errors (>= 0), ``(H, W)``.

    The mean of a pixel is that of the others up to ``reach`` pixels away, cut at the edges. Its standard error
    is the sample standard deviation of those n values over the root of n, as of values that know nothing of each
    other. Where fewer than two others are left, nothing is known: 0.
    """
    mean = _mean_of_others(values, reach, bands)
    squares = _mean_of_others(np.square(values), reach, bands)
    others = _pixels_around(values.shape, reach) - 1
    # Of n values: the mean square about the mean, over n - 1.
    variance = np.maximum(squares - np.square(mean), 0) / np.maximum(others - 1, 1)
    known: NDArray[Any] = np.maximum(mean - np.float32(errors) * np.sqrt(variance), 0)
    return np.where(others > 1, known, np.float32(0))


def _mean_of_others(values: Floats, reach: int, bands: Bands) -> Floats:
    """Means of ``(H, W)`` over the other pixels up to ``reach`` away, cut at the edges; 0 where there is none."""
    count = _pixels_around(values.shape, reach)
    mean: NDArray[Any] = (mean_around(values, reach, bands) * count - values) / np.maximum(count - 1, 1)
    return mean
