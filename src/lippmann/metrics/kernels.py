"""The compiled parts of a comparison. The modules that use them import them late: loading Numba takes half a second."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.image.stored_values import Indices, Values
from lippmann.runtime.numba_jit import uncounted

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


@uncounted
def look_up(codes: Values, levels: NDArray[np.generic], values: NDArray[np.generic]) -> None:
    """``values = levels[codes]``, all of one dimension, a few times quicker than NumPy."""
    for k in range(len(codes)):
        values[k] = levels[codes[k]]


@uncounted
def gather(pixels: Values, row: Indices, column: Indices, present: Flags, gathered: Values) -> None:
    """``gathered (H, W, 3) = pixels[row, column]`` where ``present``, else 0; the other three are ``(H, W)``."""
    for y in range(gathered.shape[0]):
        for x in range(gathered.shape[1]):
            if present[y, x]:
                for c in range(3):
                    gathered[y, x, c] = pixels[row[y, x], column[y, x], c]
            else:
                for c in range(3):
                    gathered[y, x, c] = 0


@uncounted
def add_changes(before: Real, present_before: Flags, after: Real, present_after: Flags, sums: Real) -> int:
    """Change of the errors ``(H, W, 3)`` from one view to another, over the pixels that both have (``(H, W)`` masks).

    Adds the squared differences and half the squares of both to ``sums``; returns the number of values.
    """
    squared, own, count = 0.0, 0.0, 0
    for row in range(before.shape[0]):
        for column in range(before.shape[1]):
            if not (present_before[row, column] and present_after[row, column]):
                continue
            for c in range(3):
                one, other = before[row, column, c], after[row, column, c]
                squared += (other - one) * (other - one)
                own += one * one + other * other
            count += 3
    sums[0] += squared
    sums[1] += 0.5 * own
    return count


@uncounted
def mark_jumps(values: Real, at: NDArray[np.int32], limit: float, marks: Flags) -> None:
    """Mark pixels that differ from a neighbour, along all four axes of the micro-images.

    Parameters
    ----------
    values:
        ``(pixels, channels)``; NaN where nothing is seen. Two differ if a channel does by more than ``limit``, or is
        NaN in one of them.
    at:
        ``(lens_rows, lens_cols, ny, nx)``: one more than the number of the pixel at each place, 0 where there is none.
    marks:
        ``(pixels,)`` bool; both of a pair that differs become True.
    """
    rows, columns, ny, nx = at.shape
    channels = values.shape[1]
    for j in range(rows):
        for i in range(columns):
            for y in range(ny):
                for x in range(nx):
                    pixel = at[j, i, y, x] - 1
                    if pixel < 0:
                        continue
                    for axis in range(4):
                        other = -1
                        if axis == 0 and x + 1 < nx:
                            other = at[j, i, y, x + 1] - 1
                        elif axis == 1 and y + 1 < ny:
                            other = at[j, i, y + 1, x] - 1
                        elif axis == 2 and i + 1 < columns:
                            other = at[j, i + 1, y, x] - 1
                        elif axis == 3 and j + 1 < rows:
                            other = at[j + 1, i, y, x] - 1
                        if other < 0:
                            continue
                        for c in range(channels):
                            a, b = values[pixel, c], values[other, c]
                            if abs(a - b) > limit or math.isnan(a) != math.isnan(b):
                                marks[pixel] = True
                                marks[other] = True
                                break
