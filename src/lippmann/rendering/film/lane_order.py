"""The order in which the pixels of a picture are traced: column by column in strips of four rows.

The processor follows the rays of 16 lanes at once, until the last of them has ended. Four rows of a column look the
same way through lenses above each other, or through neighbouring points of one lens, and meet much the same; four
pixels of a row are as many views. Samples know their pixel, so that no order changes the picture.

What is left below the last whole strip lies in rows. Lanes are *places* in this order; pictures are in rows.
"""

from __future__ import annotations

from typing import TypeVar

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.types import UInt32

T = TypeVar("T", bound=np.generic)

#: Rows of a strip: with one sample a pixel, 16 lanes are a square.
STRIP_ROWS = 4


def in_strips(pixels: int, width: int) -> int:
    """How many of the first ``pixels`` of a picture of ``width`` lie in whole strips."""
    strip = STRIP_ROWS * width
    return pixels // strip * strip


def pixel_at(place: UInt32, width: UInt32 | int, strips: UInt32) -> tuple[UInt32, UInt32]:
    """Row and column of a place.

    Parameters
    ----------
    place:
        0 to the number of pixels - 1.
    width:
        Columns of the picture.
    strips:
        Pixels in whole strips, :func:`in_strips`; 0 for a picture all in rows.
    """
    strip, inside = divide(place, width * STRIP_ROWS)
    strip_column, strip_row = divide(inside, STRIP_ROWS)
    row, column = divide(place, width)
    stands = place < strips
    return dr.select(stands, strip * STRIP_ROWS + strip_row, row), dr.select(stands, strip_column, column)


def to_rows(values: NDArray[T], width: int) -> NDArray[T]:
    """``values (pixels, ...)`` in rows, of values in the order of places that begin with a strip."""
    whole = in_strips(len(values), width)
    inner = values.shape[1:]
    ordered = np.empty_like(values)
    np.swapaxes(ordered[:whole].reshape(-1, STRIP_ROWS, width, *inner), 1, 2)[:] = values[:whole].reshape(
        -1, width, STRIP_ROWS, *inner
    )
    ordered[whole:] = values[whole:]
    return ordered
