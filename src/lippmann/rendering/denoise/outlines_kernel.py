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
    height, width, channels = share.shape
    color = np.zeros((2, 3))
    for row in range(first, last):
        for column in range(width):
            changes = False
            for channel in range(channels):
                changes = changes or lacking[row, column, channel] != 0
            for c in range(3):
                result[row, column, c] = pixels[row, column, c]
            if not changes:
                continue
            is_known = True
            for side in range(2):
                # What is seen of the colours, the colours, and their squares; a deviation is the root of little.
                total, seen_r, seen_g, seen_b = 0.0, 0.0, 0.0, 0.0
                mean_r, mean_g, mean_b, square_r, square_g, square_b = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
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
                        r, g, b = float(pixels[y, x, 0]), float(pixels[y, x, 1]), float(pixels[y, x, 2])
                        seen_r += weight * min(r, 1.0)
                        seen_g += weight * min(g, 1.0)
                        seen_b += weight * min(b, 1.0)
                        mean_r += weight * r
                        mean_g += weight * g
                        mean_b += weight * b
                        square_r += weight * r * r
                        square_g += weight * g * g
                        square_b += weight * b * b
                if total < _LEAST_WEIGHT:
                    is_known = False
                    break
                # What is beyond white is not seen, and a highlight is no colour of a whole side; but half of what is
                # five times white in all pixels around is white still.
                color[side, 0] = max(seen_r / total, _least_sure(mean_r / total, square_r / total))
                color[side, 1] = max(seen_g / total, _least_sure(mean_g / total, square_g / total))
                color[side, 2] = max(seen_b / total, _least_sure(mean_b / total, square_b / total))
            if not is_known:
                continue
            for c in range(3):
                part = lacking[row, column, c if channels == 3 else 0]
                result[row, column, c] = max(0.0, pixels[row, column, c] + part * (color[0, c] - color[1, c]))


@compiled
def _least_sure(mean: float, square: float) -> float:
    return mean - math.sqrt(max(square - mean * mean, 0.0))
