"""What paths lack of a surface or of what is behind it, by the colours around: the compiled part."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import uncounted

#: Pixels that show more of one side tell more of its colour, by this power of the share.
_POWER = 4
#: Less weight of the pixels around than this, of 8, tells no colour: a pixel counts that is half of one side.
_LEAST_WEIGHT = 0.05


@uncounted
def exchange_rows(
    first: int,
    last: int,
    pixels: NDArray[np.float32],
    share: NDArray[np.float32],
    lacking: NDArray[np.float32],
    result: NDArray[np.float32],
) -> None:
    """Rows ``[first, last)`` of ``result``: ``pixels``, both ``(H, W, 3)``, and what they are ``lacking`` of a surface
    in place of what is behind it.

    ``share`` of each pixel that its paths have seen covered, and ``lacking``, are ``(H, W, C)``: with three channels
    each sub-pixel has rays of its own. The colour of a side is the mean of what is seen of it in the eight pixels
    around, or, where these agree that it is beyond white, their mean less one standard deviation.
    """
    width, channels = share.shape[1], share.shape[2]
    for row in range(first, last):
        for column in range(width):
            changes = False
            for channel in range(channels):
                changes = changes or lacking[row, column, channel] != 0
            for c in range(3):
                result[row, column, c] = pixels[row, column, c]
            if not changes:
                continue
            for c in range(3):
                of_surface, front = _color_around(pixels, share, row, column, c, True)
                behind, back = _color_around(pixels, share, row, column, c, False)
                if min(of_surface, behind) < _LEAST_WEIGHT:
                    continue
                part = lacking[row, column, c if channels == 3 else 0]
                result[row, column, c] = max(0.0, pixels[row, column, c] + part * (front - back))


@uncounted
def _color_around(
    pixels: NDArray[np.float32], share: NDArray[np.float32], row: int, column: int, c: int, is_surface: bool
) -> tuple[float, float]:
    """How much is seen of the surface, or of what is behind it, around a pixel, and one channel of its colour."""
    height, width, channels = share.shape
    total, within, color, square = 0.0, 0.0, 0.0, 0.0
    for y in range(max(0, row - 1), min(height, row + 2)):
        for x in range(max(0, column - 1), min(width, column + 2)):
            if y == row and x == column:
                continue
            # The side is told by all colours together, where sub-pixels have rays of their own, too.
            covered = 0.0
            for channel in range(channels):
                covered += share[y, x, channel] / channels
            weight = (covered if is_surface else 1.0 - covered) ** _POWER
            value = float(pixels[y, x, c])
            total += weight
            within += weight * min(value, 1.0)
            color += weight * value
            square += weight * value * value
    if total < _LEAST_WEIGHT:
        return total, 0.0
    # What is beyond white is not seen, and a highlight is no colour of a whole side; but half of what is five times
    # white in all pixels around is white still. A deviation is the root of little.
    mean = color / total
    return total, max(within / total, mean - math.sqrt(max(square / total - mean * mean, 0.0)))
