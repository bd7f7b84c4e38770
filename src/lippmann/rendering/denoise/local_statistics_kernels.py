"""Means over the pixels around each: the compiled part."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import inlined, uncounted

#: Pictures and their rows.
RealArray: TypeAlias = NDArray[np.floating]

#: Sums that run down a picture begin anew after so many rows, wherever bands begin: all round alike.
_BLOCK = 64


@uncounted
def row_mean_rows(first: int, last: int, values: RealArray, radius: int, mean: RealArray) -> None:
    """Rows ``[first, last)`` of ``mean``: that of the ``radius`` pixels to either side in ``values``, both ``(H, W)``.

    Cut at the edges.
    """
    width = values.shape[1]
    for row in range(first, last):
        total = 0.0
        for column in range(min(radius, width)):
            total += values[row, column]
        for column in range(width):
            if column + radius < width:
                total += values[row, column + radius]
            if column > radius:
                total -= values[row, column - radius - 1]
            mean[row, column] = total / (min(column + radius, width - 1) - max(column - radius, 0) + 1)


@uncounted
def column_mean_rows(first: int, last: int, values: RealArray, radius: int, mean: RealArray) -> None:
    """Rows ``[first, last)`` of ``mean``: that of the ``radius`` pixels above and below in ``values``, cut likewise."""
    height, width = values.shape
    for start in range(first // _BLOCK * _BLOCK, last, _BLOCK):
        for column in range(width):
            total = 0.0
            for other in range(max(0, start - radius), min(start + radius + 1, height)):
                total += values[other, column]
            for row in range(start, min(start + _BLOCK, last)):
                if row > start:
                    if row + radius < height:
                        total += values[row + radius, column]
                    if row > radius:
                        total -= values[row - radius - 1, column]
                if row >= first:
                    count = min(row + radius, height - 1) - max(row - radius, 0) + 1
                    mean[row, column] = total / count


@inlined
def _pixels_around(row: int, column: int, height: int, width: int, radius: int) -> int:
    """How many pixels the mean around a pixel is of, the pixel itself included."""
    rows = min(row + radius, height - 1) - max(row - radius, 0) + 1
    return rows * (min(column + radius, width - 1) - max(column - radius, 0) + 1)


@uncounted
def known_rows(
    first: int,
    last: int,
    values: RealArray,
    mean: RealArray,
    squared: RealArray,
    radius: int,
    errors: float,
    known: RealArray,
) -> None:
    """Rows ``[first, last)`` of ``known``: the mean of the other pixels around, less ``errors`` of its standard errors.

    ``mean`` and ``squared``, ``(H, W)``, are those of ``values`` and of their squares around each pixel. Not below 0; 0
    where there are fewer than two other pixels.
    """
    height, width = values.shape
    for row in range(first, last):
        for column in range(width):
            count = _pixels_around(row, column, height, width, radius)
            if count <= 2:
                known[row, column] = 0.0
                continue
            value = float(values[row, column])
            of_others = (mean[row, column] * count - value) / (count - 1)
            square = (squared[row, column] * count - value * value) / (count - 1)
            # Of n values, n = count - 1: the mean square about the mean, over n - 1.
            variance = max(square - of_others * of_others, 0.0) / (count - 2)
            known[row, column] = max(of_others - errors * math.sqrt(variance), 0.0)


@uncounted
def judged_rows(
    first: int,
    last: int,
    noisy: RealArray,
    other: RealArray,
    clean: RealArray,
    other_clean: RealArray,
    slope: RealArray,
    noise: RealArray,
    error: RealArray,
) -> None:
    """Rows ``[first, last)`` of what is measured of a picture's halves, ``(H, W)``, between codes.

    ``noisy``, ``other`` and their denoised ``clean``, ``other_clean`` are ``(H, W, 3)``, ``slope`` is the code's.
    ``noise`` is the squared error of a noisy half, ``error`` that of a clean one; both are right on the average.
    """
    for row in range(first, last):
        for column in range(noisy.shape[1]):
            of_noise, of_error = 0.0, 0.0
            for c in range(3):
                weight = slope[row, column, c] * slope[row, column, c] / 6.0
                a, b = noisy[row, column, c], other[row, column, c]
                apart = (a - b) * (a - b)
                to_other, to_own = clean[row, column, c] - b, other_clean[row, column, c] - a
                of_noise += weight * apart
                of_error += weight * (to_other * to_other + to_own * to_own - apart)
            noise[row, column] = of_noise
            error[row, column] = of_error


@uncounted
def compared_rows(
    first: int,
    last: int,
    noisy: RealArray,
    other: RealArray,
    clean: RealArray,
    other_clean: RealArray,
    shared: RealArray,
    other_shared: RealArray,
    slope: RealArray,
    gain: RealArray,
    apart: RealArray,
) -> None:
    """Rows ``[first, last)`` of how a picture's ``clean`` halves compare with its ``shared`` ones, ``(H, W)``.

    Pictures are as for :func:`judged_rows`. ``gain`` is, right on the average, the product of what a shared half is
    wrong by and of its difference to the clean one; ``apart`` is the square of that.
    """
    for row in range(first, last):
        for column in range(noisy.shape[1]):
            of_gain, of_apart = 0.0, 0.0
            for c in range(3):
                weight = slope[row, column, c] * slope[row, column, c]
                mine, theirs = shared[row, column, c], other_shared[row, column, c]
                my_step, their_step = mine - clean[row, column, c], theirs - other_clean[row, column, c]
                of_gain += weight * (
                    (mine - other[row, column, c]) * my_step + (theirs - noisy[row, column, c]) * their_step
                )
                of_apart += weight * (my_step * my_step + their_step * their_step)
            gain[row, column] = of_gain
            apart[row, column] = of_apart
