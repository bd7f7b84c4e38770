"""Compiled gathering of the light that an eye sees. It is imported late: loading Numba takes half a second."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import inlined, uncounted

Real = NDArray[np.float64]
FloatArray = NDArray[np.float32]


@inlined
def weight_at(weights: Real, down: float, right: float) -> float:
    """Bilinear interpolation of ``weights`` ``(rows, columns)``; 0 outside. One row holds for all distances along."""
    rows, columns = weights.shape
    x = right + 0.5 * (columns - 1)
    column = math.floor(x)
    if column < -1 or column >= columns:
        return 0.0
    y = down + 0.5 * (rows - 1) if rows > 1 else 0.0
    row = math.floor(y)
    if row < -1 or row >= rows:
        return 0.0
    part_x, part_y, total = x - column, y - row, 0.0
    for j in range(2):
        for i in range(2):
            if 0 <= row + j < rows and 0 <= column + i < columns:
                share_y = part_y if j else 1.0 - part_y
                share_x = part_x if i else 1.0 - part_x
                total += share_y * share_x * weights[row + j, column + i]
    return total


@inlined
def columns_about(panel: Real, row: int, across: float, reach: float) -> tuple[float, int, int]:
    """Of a row of pixels: its middle in mm along, and the first column and the one past the last about a place."""
    width, height, pixel, sine, cosine = panel[0], panel[1], panel[2], panel[3], panel[4]
    y = (0.5 * height - row - 0.5) * pixel
    middle = (across + y * sine) / cosine / pixel + 0.5 * width - 0.5
    return y, max(0, math.floor(middle - reach)), min(int(width), math.ceil(middle + reach) + 1)


@uncounted
def gather_light(
    first: int,
    last: int,
    values: FloatArray,
    top: int,
    panel: Real,
    cells: Real,
    weights: Real,
    step: float,
    numbers: NDArray[np.int32],
    places: Real,
    lines: Real,
    out: FloatArray,
) -> None:
    """Add the light of the panel's sub-pixels to rows ``first`` to ``last`` of ``out`` ``(rows, columns, 3, n)``.

    Parameters
    ----------
    values:
        ``(rows, width, 3, n)`` linear RGB of the panel's rows from row ``top`` on, of n pictures.
    panel:
        Width and height in pixels, pixel pitch in mm, sine and cosine of the slant.
    cells:
        ``(rows, columns, 3, 2)`` places of the sub-pixels in pixels of each kind: right and down.
    weights, step:
        As of :class:`lippmann.optics.eye_light.EyeLight`, one table for each of the ``numbers``.
    numbers:
        ``(rows, columns)`` tables of the points.
    places:
        ``(rows, columns, 2)`` middle of the light of each point in mm, across and along the lenses.
    lines:
        ``(rows, columns, 2)`` rows of the panel that a point of a cylinder covers, first and last; empty of arrays.
    """
    width, height, pixel, sine, cosine = panel[0], panel[1], panel[2], panel[3], panel[4]
    is_line = lines.shape[0] > 0
    reach_x = (0.5 * weights.shape[2] * step) / (pixel * cosine) + 1.0
    reach_y = 0.5 * weights.shape[1] * step / pixel + 1.0
    for n in range(first, last):
        for m in range(out.shape[1]):
            table = weights[numbers[n, m]]
            across, along = places[n, m, 0], places[n, m, 1]
            if is_line:
                begin, end = lines[n, m, 0], lines[n, m, 1]
            else:
                middle = 0.5 * height - along / pixel - 0.5
                begin, end = middle - reach_y, middle + reach_y
            for row in range(max(0, math.floor(begin)), min(int(height), math.ceil(end))):
                share = 1.0
                if is_line:
                    share = (min(end, row + 1.0) - max(begin, float(row))) / (end - begin)
                y, left, right_end = columns_about(panel, row, across, reach_x)
                for column in range(left, right_end):
                    cell = cells[row % cells.shape[0], column % cells.shape[1]]
                    x = (column + 0.5 - 0.5 * width) * pixel
                    for channel in range(3):
                        place_x, place_y = x + cell[channel, 0] * pixel, y - cell[channel, 1] * pixel
                        right = (place_x * cosine - place_y * sine - across) / step
                        weight = share * weight_at(table, (place_y - along) / step, right)
                        if weight != 0.0:
                            for picture in range(values.shape[3]):
                                out[n, m, channel, picture] += weight * values[row - top, column, channel, picture]
