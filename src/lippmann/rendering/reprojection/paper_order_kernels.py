"""Points of one micro-image carried into the next, each to the nearest pixel, as the paper does. Compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.reprojection.common.array_types import IntArray
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.point_image import BACKGROUND, MISSED, REPROJECTED, PointImage
from lippmann.rendering.reprojection.common.thresholds import nearer
from lippmann.runtime.numba_jit import uncounted

#: Where a point lies beside the centre of its pixel, ``(H, W, 2)`` in pixels (x, y). A point that has been carried lies
#: where it always lay: were it moved to the pixel's centre, points would drift from lens to lens.
Beside = NDArray[np.float32]


@uncounted
def carry(points: PointImage, beside: Beside, field: LensField, numbers: IntArray, step: int) -> None:
    """Carry the points of the pixels ``numbers`` (linear, all settled) to the lenses ``step`` further on in the row.

    Each goes to the pixel nearest to its projection, if that has no traced colour. Where several meet, the nearest to
    the viewer wins; of two at the same distance the first. What receives a point becomes :data:`REPROJECTED`. A pixel
    that shows the background has hit nothing, and has no point to give.
    """
    height, width = points.status.shape
    lenses = len(field.center)
    for k in range(len(numbers)):
        row, column = divmod(int(numbers[k]), width)
        source = field.lens[row, column]
        target = source + step
        if target < 0 or target >= lenses or points.status[row, column] < 0:
            continue
        if points.disparity[row, column] == np.float32(BACKGROUND):
            continue
        s = np.float64(points.disparity[row, column])
        x = column + beside[row, column, 0] + (field.center[target, 0] - field.center[source, 0]) * (1.0 + s)
        y = row + beside[row, column, 1] + (field.center[target, 1] - field.center[source, 1]) * (1.0 + s)
        # Points near to the lens plane are seen by no other lens; whole numbers do not reach as far as their places.
        if not (x > -1.0 and x < width and y > -1.0 and y < height):
            continue
        # What lies on the border of two pixels belongs to the pixel after it: rounding must not decide.
        c, r = int(np.floor(x + (0.5 + 1e-5))), int(np.floor(y + (0.5 + 1e-5)))
        if c < 0 or c >= width or r < 0 or r >= height or field.lens[r, c] != target:
            continue
        taken = points.status[r, c] == REPROJECTED and not nearer(s, np.float64(points.disparity[r, c]))
        if taken or not (points.status[r, c] == MISSED or points.status[r, c] == REPROJECTED):
            continue
        for channel in range(3):
            points.color[r, c, channel] = points.color[row, column, channel]
        points.disparity[r, c] = points.disparity[row, column]
        points.fragile[r, c] = points.fragile[row, column]
        points.status[r, c] = REPROJECTED
        beside[r, c, 0], beside[r, c, 1] = x - c, y - r
