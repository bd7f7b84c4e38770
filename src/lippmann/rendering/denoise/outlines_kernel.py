"""What paths lack of a surface or of what is behind it, by the colours around: the compiled part."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import compiled

#: Pixels that show more of one side tell more of its colour, by this power of the share.
_POWER = 4
#: Less weight of the pixels around than this, of 8, tells no colour: a pixel counts that is half of one side.
_LEAST_WEIGHT = 0.05


@compiled
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
    width, channels = share.shape[1:]
    color, sums = np.zeros((2, 3)), np.zeros((3, 3))
    for row in range(first, last):
        for column in range(width):
            changes = False
            for channel in range(channels):
                changes = changes or lacking[row, column, channel] != 0
            for c in range(3):
                result[row, column, c] = pixels[row, column, c]
            if not changes or not _colors_around(pixels, share, row, column, sums, color):
                continue
            for c in range(3):
                part = lacking[row, column, c if channels == 3 else 0]
                result[row, column, c] = max(0.0, pixels[row, column, c] + part * (color[0, c] - color[1, c]))


@compiled
def _colors_around(
    pixels: NDArray[np.float32],
    share: NDArray[np.float32],
    row: int,
    column: int,
    sums: NDArray[np.float64],
    color: NDArray[np.float64],
) -> bool:
    """Find the ``color`` of either side, ``(2, 3)``, around a pixel; whether both are known.

    ``sums``, ``(3, 3)``, is overwritten.
    """
    height, width, channels = share.shape
    for side in range(2):
        # What is seen of the colours, the colours, and their squares; a deviation is the root of little.
        total = 0.0
        sums[:] = 0.0
        for y in range(max(0, row - 1), min(height, row + 2)):
            for x in range(max(0, column - 1), min(width, column + 2)):
                if y == row and x == column:
                    continue
                # The side is told by all colours together, where sub-pixels have rays of their own, too.
                covered = 0.0
                for channel in range(channels):
                    covered += share[y, x, channel] / channels
                weight = (covered if side == 0 else 1.0 - covered) ** _POWER
                total += weight
                for c in range(3):
                    value = float(pixels[y, x, c])
                    sums[0, c] += weight * min(value, 1.0)
                    sums[1, c] += weight * value
                    sums[2, c] += weight * value * value
        if total < _LEAST_WEIGHT:
            return False
        for c in range(3):
            # What is beyond white is not seen, and a highlight is no colour of a whole side; but half of what is five
            # times white in all pixels around is white still.
            seen, mean, square = sums[0, c] / total, sums[1, c] / total, sums[2, c] / total
            color[side, c] = max(seen, mean - math.sqrt(max(square - mean * mean, 0.0)))
    return True
