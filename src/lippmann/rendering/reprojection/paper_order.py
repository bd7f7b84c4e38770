"""The paper's own order: lens by lens, each point to the nearest pixel, colours as they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.missed_pixels import average_neighbors
from lippmann.rendering.reprojection.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.point_image import BACKGROUND, MISSED, REPROJECTED, IntArray, PointImage
from lippmann.rendering.reprojection.rules import Rules, nearer
from lippmann.runtime.numba_jit import uncounted
from lippmann.runtime.row_threads import Bands

#: Two corresponding pixels are averaged however much their colours differ.
_ANY_COLOR = Rules(careful=False, tolerance=1.0, coded=False, probe_rows=1, probe_stride=1, run_step=1)


class PaperOrder:
    """Makes the micro-images of a display of any layout lens by lens, as the paper does.

    The first micro-image is traced. Each next one receives the points of the one before: 3D points, projected through
    its lens to the nearest pixel, with unchanged colours. Where several meet, the nearest to the viewer wins. Missed
    pixels (status -1) are traced (status 0). A ray without a hit has no point. So background is traced everywhere,
    which finds objects that appear in front of it. As in the paper, mirrors, highlights, outlines and disocclusions
    behind other points are not treated.

    Each row of square or hexagonal lenses is processed like such a display of its own. All rows advance together, one
    column of lenses at a time, so a picture takes as many calls as a row has lenses.

    ``points`` receives the picture, and is empty at first.
    """

    def __init__(self, display: Display, points: PointImage, tracer: PixelTracer, bands: Bands) -> None:
        self._points, self._tracer, self._bands = points, tracer, bands
        self._field = LensField.of(display)
        self._beside = np.zeros((*points.status.shape, 2), dtype=np.float32)
        columns = self._field.columns
        # Sixteen bits are sorted in one sweep, and no display has as many lenses in a row.
        column = (self._field.lens % columns).astype(np.uint16).ravel()
        self._numbers = np.argsort(column, kind="stable").astype(np.uint32)
        self._starts = np.searchsorted(column[self._numbers], np.arange(columns + 1))

    def lens_view(self) -> None:
        """Reproject every micro-image from the one before, and trace its missed pixels."""
        self._pass_on(range(self._field.columns), 1)

    def interpolated(self) -> None:
        """The odd micro-images of each row (counted from 1) as in :meth:`lens_view`, each from the odd one before.

        The even ones receive the points of their odd neighbours on both sides, and what no point reached of them
        becomes the mean red, green and blue of the corresponding pixels of those neighbours: the pixels whose light
        lines are nearest to parallel. The last micro-image of an even number has one neighbour, and takes its pixels as
        they are. So does any pixel for which one neighbour only has a corresponding pixel; where neither has, it is
        traced. Odd micro-images are complete by then, so that no neighbour can have missed a pixel itself.
        """
        columns = self._field.columns
        self._pass_on(range(0, columns, 2), 2)
        even = range(1, columns, 2)
        for column in even:
            _carry(self._points, self._beside, self._field, self._of_column(column - 1), 1)
            if column + 1 < columns:
                _carry(self._points, self._beside, self._field, self._of_column(column + 1), -1)
        average_neighbors(self._points, self._field, self._find_missed(even), _ANY_COLOR, self._bands)
        self._tracer.trace(self._find_missed(even), self._points)

    def _pass_on(self, columns: range, step: int) -> None:
        for column in columns:
            if column >= step:
                _carry(self._points, self._beside, self._field, self._of_column(column - step), step)
            self._tracer.trace(self._find_missed(range(column, column + 1)), self._points)

    def _find_missed(self, columns: range) -> Pixels:
        status = self._points.status.ravel()
        parts = [numbers[status[numbers] == MISSED] for numbers in map(self._of_column, columns)]
        return np.concatenate(parts) if parts else np.empty(0, dtype=np.uint32)

    def _of_column(self, column: int) -> Pixels:
        """The pixels of one column of lenses."""
        numbers: NDArray[np.uint32] = self._numbers[self._starts[column] : self._starts[column + 1]]
        return numbers


#: Offset of each point from the centre of its pixel, ``(H, W, 2)`` in pixels (x, y). Reprojected points keep it:
#: snapped to pixel centres, points would drift from lens to lens.
Beside = NDArray[np.float32]


@uncounted
def _carry(points: PointImage, beside: Beside, field: LensField, numbers: IntArray, step: int) -> None:
    """Reproject the points of the pixels ``numbers`` (linear, none missed) to the lenses ``step`` further in the row.

    Each goes to the pixel nearest to its projection, unless that one is traced. Where several meet, the nearest to the
    viewer wins; of two at the same distance the first. Pixels that receive a point become :data:`REPROJECTED`.
    Background has no points.
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
        # Points near to the lens plane project far outside, beyond the range of integers.
        if not (x > -1.0 and x < width and y > -1.0 and y < height):
            continue
        # A point on the border of two pixels belongs to the second, independently of rounding.
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
