"""The loop over the pixels of an eye's picture, compiled by Numba."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import compiled

#: Tolerance in pixels for points on a boundary between pixels: that of :mod:`lippmann.viewing.replay`.
_ON_BOUNDARY = 1e-6
#: Beyond this many pixels the exact place does not matter.
_FAR = 1e9


@compiled
def number_pixels(
    center_x: NDArray[np.float64],
    center_y: NDArray[np.float64],
    eye: tuple[float, float, float],
    panel: tuple[int, int, float],
    cells: NDArray[np.float64],
    last: NDArray[np.int32],
    keys: NDArray[np.int64],
    number: NDArray[np.int32],
) -> int:
    """Number the (sub-)pixels that an eye sees in the order in which they are first seen.

    Parameters
    ----------
    center_x, center_y:
        ``(height, width)``: where the eye's line crosses the lens plane, mm.
    eye:
        Its x and y in mm, and the gap over its z.
    panel:
        Width and height in pixels, and the pixel pitch in mm.
    cells:
        ``(rows, columns, channels, 2)``: offsets right and down of the sub-pixels of each kind of pixel.
    last:
        ``(pixels * channels,)``: any numbers from earlier calls; kept here between them.
    keys:
        Receives ``(row * width + column) * channels + channel`` of each pixel found, and two pixels where there are
        fewer.
    number:
        ``(height, width, channels)``, receives the number of the pixel seen; -1 past the panel.

    Returns
    -------
    How many were found.
    """
    eye_x, eye_y, scale = eye
    width, height, pitch = panel
    channels = number.shape[2]
    several = cells.shape[0] * cells.shape[1] > 1
    found = 0
    keys[0] = 0
    keys[1] = 0
    for line in range(number.shape[0]):
        for place in range(number.shape[1]):
            x, y = center_x[line, place], center_y[line, place]
            u = (x + (x - eye_x) * scale) / pitch + 0.5 * width
            v = 0.5 * height - (y + (y - eye_y) * scale) / pitch
            u = min(max(u, -_FAR), _FAR)
            v = min(max(v, -_FAR), _FAR)
            for channel in range(channels):
                if several:
                    column, row = _nearest(u, v, channel, width, height, cells)
                else:
                    column = math.floor(u - cells[0, 0, channel, 0] + _ON_BOUNDARY)
                    row = math.floor(v - cells[0, 0, channel, 1] + _ON_BOUNDARY)
                if column < 0 or column >= width or row < 0 or row >= height:
                    number[line, place, channel] = -1
                    continue
                key = (row * width + column) * channels + channel
                known = last[key]
                if not (known < found and keys[known] == key):
                    known = found
                    keys[found] = key
                    last[key] = found
                    found += 1
                number[line, place, channel] = known
    return found


@compiled
def _nearest(u: float, v: float, channel: int, width: int, height: int, cells: NDArray[np.float64]) -> tuple[int, int]:
    """Column and row of the pixel whose sub-pixel ``channel`` has the nearest centre; -1 where none is on the panel."""
    best, best_column, best_row = 1e30, -1, -1
    middle_column, middle_row = math.floor(u + _ON_BOUNDARY), math.floor(v + _ON_BOUNDARY)
    for row in range(middle_row - 2, middle_row + 3):
        for column in range(middle_column - 2, middle_column + 3):
            if column < 0 or column >= width or row < 0 or row >= height:
                continue
            right, down = cells[row % cells.shape[0], column % cells.shape[1], channel]
            distance = (column + 0.5 + right - u) ** 2 + (row + 0.5 + down - v) ** 2
            if distance < best:
                best, best_column, best_row = distance, column, row
    return best_column, best_row
