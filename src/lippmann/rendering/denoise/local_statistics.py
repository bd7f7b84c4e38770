"""What is measured of the halves of a picture, pixel by pixel, and its means over the pixels around each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope
from lippmann.rendering.denoise.local_statistics_kernels import (
    column_mean_rows,
    known_rows,
    row_mean_rows,
)
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]
Halves = tuple[Floats, Floats]


def measured(rows: Callable[..., None], *pictures: Halves, transfer: Transfer, bands: Bands) -> tuple[Floats, Floats]:
    """The two measures, ``(H, W)`` each, that compiled ``rows`` take of pictures, between codes.

    Each picture is two halves, ``(H, W, 3)`` linear; the slope of the code is that of the last one's mean. Beyond white
    the codes are cut off, but what is wrong there is wrong around, too.
    """
    first, second = pictures[-1]
    slope = np.empty_like(first)

    def slope_rows(start: int, end: int) -> None:
        band = slice(start, end)
        slope[band] = coding_slope(np.clip(np.float32(0.5) * (first[band] + second[band]), 0, 1), transfer)

    bands.lines(slope_rows, len(slope))
    found = np.empty(slope.shape[:2], dtype=np.float32), np.empty(slope.shape[:2], dtype=np.float32)
    bands.lines(rows, len(slope), *(half for halves in pictures for half in halves), slope, *found)
    return found


def mean_around(values: Floats, reach: int, bands: Bands) -> Floats:
    """Means of ``(H, W)`` over the square of pixels up to ``reach`` away, cut at the edges."""
    along, mean = np.empty_like(values), np.empty_like(values)
    bands.lines(row_mean_rows, len(values), values, reach, along)
    bands.lines(column_mean_rows, len(values), along, reach, mean)
    return mean


def leave_one_out_mean(values: Floats, reach: int, errors: float, bands: Bands) -> Floats:
    """Leave-one-out local mean, soft-thresholded at ``errors`` of its own standard errors (>= 0), ``(H, W)``.

    The mean of a pixel is that of the others up to ``reach`` pixels away, cut at the edges. Its standard error
    is the sample standard deviation of those n values over the root of n, as of values that know nothing of each
    other. Where fewer than two others are left, nothing is known: 0.
    """
    mean, squared = (mean_around(part, reach, bands) for part in (values, np.square(values)))
    known = np.empty_like(values)
    bands.lines(known_rows, len(values), values, mean, squared, reach, errors, known)
    return known
