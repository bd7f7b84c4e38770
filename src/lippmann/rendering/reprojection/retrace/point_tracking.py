"""Points of traced pixels looked for under the lenses beside, for lenses of any layout. Compiled."""

from __future__ import annotations

import numpy as np

from lippmann.rendering.reprojection.common.array_types import BoolArray, IntArray
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.point_image import BACKGROUND, TRACED, PointImage
from lippmann.rendering.reprojection.common.thresholds import ONE_POINT, Rules, alike, color_difference, nearer
from lippmann.runtime.numba_jit import uncounted


@uncounted
def follow_points(
    points: PointImage, field: LensField, neighbors: IntArray, numbers: IntArray, rules: Rules, wanted: BoolArray
) -> None:
    """Set ``wanted (H, W)`` for untraced pixels under the ``neighbors (lenses, n)`` that should show the points of the
    pixels ``numbers``, and do not.

    A point lies between four pixels of another lens. It is missing there if none of them shows that surface in that
    colour, and none anything nearer, which may hide it.
    """
    height, width = points.status.shape
    for i in range(len(numbers)):
        row, column = divmod(int(numbers[i]), width)
        s = np.float64(points.disparity[row, column])
        if s == np.float32(BACKGROUND):
            continue
        lens = field.lens[row, column]
        for k in range(neighbors.shape[1]):
            target = neighbors[lens, k]
            if target < 0:
                continue
            x = column + (field.center[target, 0] - field.center[lens, 0]) * (1.0 + s)
            y = row + (field.center[target, 1] - field.center[lens, 1]) * (1.0 + s)
            if not (x > -1.0 and x < width and y > -1.0 and y < height):
                continue
            left, top = int(np.floor(x)), int(np.floor(y))
            missing = True
            for r in range(max(0, top), min(height, top + 2)):
                for c in range(max(0, left), min(width, left + 2)):
                    if field.lens[r, c] != target:
                        continue
                    shown = np.float64(points.disparity[r, c])
                    if alike(s, shown, ONE_POINT):
                        # What looks different from every side is not the same anywhere.
                        if (
                            points.fragile[row, column]
                            or points.fragile[r, c]
                            or color_difference(points.color, row, column, r, c, rules.coded) <= rules.tolerance
                        ):
                            missing = False
                    elif nearer(shown, s):
                        missing = False
            if not missing:
                continue
            for r in range(max(0, top), min(height, top + 2)):
                for c in range(max(0, left), min(width, left + 2)):
                    if field.lens[r, c] == target and points.status[r, c] != TRACED:
                        wanted[r, c] = True
