"""The compiled kernels of :mod:`lippmann.studio_app.real_lens`, imported late."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.image.stored_values import FloatArray
from lippmann.optics.eye_light_kernel import columns_about, weight_at
from lippmann.runtime.numba_jit import inlined, uncounted

Real = NDArray[np.float64]


@inlined
def _interpolate(tables: Real, at: Real, down: float, right: float) -> float:
    """The weight of a distance, interpolated between the tables of the four directions around ``at``."""
    row = min(max(int(at[0]), 0), tables.shape[0] - 2)
    column = min(max(int(at[1]), 0), tables.shape[1] - 2)
    part_y, part_x, total = at[0] - row, at[1] - column, 0.0
    for j in range(2):
        for i in range(2):
            share = (part_y if j else 1.0 - part_y) * (part_x if i else 1.0 - part_x)
            if share > 0.0:
                total += share * weight_at(tables[row + j, column + i], down, right)
    return total


@uncounted
def weigh(
    first: int,
    last: int,
    at: Real,
    places: Real,
    tables: Real,
    step: float,
    panel: Real,
    cells: Real,
    is_line: bool,
    is_even: bool,
    least: float,
    starts: NDArray[np.int64],
    pixels: NDArray[np.int64],
    weights: FloatArray,
) -> None:
    """Write the pixels of lenses ``first`` to ``last`` from their ``starts`` on; without room, count them there.

    Parameters
    ----------
    at, places:
        ``(n, 2)`` rows and columns among the tables, and middle of the light in mm across and along the lenses;
        along a cylinder in rows of pixels.
    tables, step:
        Weights as of :class:`lippmann.optics.eye_light.EyeLight`.
    panel:
        Width and height in pixels, pixel pitch in mm, sine and cosine of the slant.
    cells:
        ``(rows, columns, 3, 2)`` places of the sub-pixels in pixels of each kind: right and down.
    is_line:
        Whether the lenses are cylinders.
    is_even:
        Whether all sub-pixels lie in the middle of their pixels.
    least:
        Weight below which a pixel is left out.
    starts, pixels, weights:
        What is written. Counts of lens n stand at n + 1.
    """
    width, height, pixel, sine, cosine = panel[0], panel[1], panel[2], panel[3], panel[4]
    reach_x = 0.5 * tables.shape[3] * step / (pixel * cosine) + 1.0
    reach_y = 0.5 if is_line else 0.5 * tables.shape[2] * step / pixel + 1.0
    counts = len(pixels) == 0
    for n in range(first, last):
        across, along = places[n, 0], places[n, 1]
        middle_row = along if is_line else 0.5 * height - along / pixel - 0.5
        begin, end = middle_row - reach_y, middle_row + reach_y
        entry = 0 if counts else starts[n]
        for row in range(max(0, math.floor(begin)), min(int(height), math.ceil(end))):
            share = min(end, row + 1.0) - max(begin, float(row)) if is_line else 1.0
            y, left, right_end = columns_about(panel, row, across, reach_x)
            for column in range(left, right_end):
                cell = cells[row % cells.shape[0], column % cells.shape[1]]
                x = (column + 0.5 - 0.5 * width) * pixel
                red, green, blue = 0.0, 0.0, 0.0
                for channel in range(1 if is_even else 3):
                    place_x, place_y = x + cell[channel, 0] * pixel, y - cell[channel, 1] * pixel
                    right = (place_x * cosine - place_y * sine - across) / step
                    weight = share * _interpolate(tables, at[n], (place_y - along) / step, right)
                    if channel == 0:
                        red = weight
                    elif channel == 1:
                        green = weight
                    else:
                        blue = weight
                if is_even:
                    green = blue = red
                if max(red, green, blue) < least:
                    continue
                if not counts:
                    pixels[entry] = row * int(width) + column
                    weights[entry, 0], weights[entry, 1], weights[entry, 2] = red, green, blue
                entry += 1
        if counts:
            starts[n + 1] = entry


@uncounted
def mix(
    first: int,
    last: int,
    starts: NDArray[np.int64],
    members: NDArray[np.int32],
    weights: FloatArray,
    values: FloatArray,
    out: FloatArray,
) -> None:
    """Fill lenses ``first`` to ``last`` of ``out`` ``(n, 3)`` with the weighted sums of their members' values."""
    is_split = members.shape[1] == 3
    for n in range(first, last):
        for channel in range(3):
            total = 0.0
            for entry in range(starts[n], starts[n + 1]):
                number = members[entry, channel if is_split else 0]
                total += weights[entry, channel] * values[number, channel]
            out[n, channel] = total
