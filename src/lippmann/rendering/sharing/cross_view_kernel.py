"""Light of one surface point, averaged over the views of a quilt that see it: the compiled part."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import uncounted

#: The squared difference of normals from which on they are those of different surfaces: an angle of 25 degrees.
_OTHER_NORMAL = 0.19
#: Heights count as alike within so many pixels and this share of them.
_PIXELS, _OF_HEIGHT = 2.0, 0.01


@uncounted
def share_view_rows(
    first: int,
    last: int,
    light: NDArray[np.float32],
    normal: NDArray[np.float32],
    height: NDArray[np.float32],
    slopes: NDArray[np.float32],
    columns: int,
    convergence: float,
    pixels_per_mm: float,
    reach: int,
    shared: NDArray[np.float32],
) -> None:
    """Rows ``[first, last)`` of ``shared``: the weighted mean of ``light`` over the views up to ``reach`` to the side.

    ``light``, ``normal`` and ``shared`` are ``(H, W, 3)``, ``height`` ``(H, W)`` z in millimetres, of a quilt of
    ``columns`` views in a row; ``slopes`` (N) says for every view, the leftmost camera's first, how far aside its
    camera stands over how far away. What view k sees at height z at some place, view j sees
    ``(s_k - s_j) z / (1 - z / D)`` millimetres to the right of it in its picture.
    """
    views = slopes.shape[0]
    width = light.shape[1] // columns
    view_height = light.shape[0] // (views // columns)
    for row in range(first, last):
        above, line = row // view_height, row % view_height
        below = views // columns - 1 - above
        for column in range(columns * width):
            k = below * columns + column // width
            place = column % width
            z = float(height[row, column])
            per_slope = z / (1.0 - z * convergence) * pixels_per_mm
            nearest = _PIXELS / pixels_per_mm + _OF_HEIGHT * abs(z)
            total = 1.0
            for c in range(3):
                shared[row, column, c] = light[row, column, c]
            for j in range(max(0, k - reach), min(views, k + reach + 1)):
                at = place + math.floor((slopes[k] - slopes[j]) * per_slope + 0.5)
                if j == k or at < 0 or at >= width:
                    continue
                other_row = (views // columns - 1 - j // columns) * view_height + line
                other = j % columns * width + int(at)
                if abs(height[other_row, other] - z) > nearest:
                    continue
                apart = 0.0
                for c in range(3):
                    difference = normal[other_row, other, c] - normal[row, column, c]
                    apart += difference * difference
                if apart > _OTHER_NORMAL:
                    continue
                weight = 1.0 - abs(j - k) / (reach + 1.0)
                total += weight
                for c in range(3):
                    shared[row, column, c] += weight * light[other_row, other, c]
            for c in range(3):
                shared[row, column, c] /= total
