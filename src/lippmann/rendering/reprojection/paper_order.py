"""The paper's own order: lens by lens, colours as they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.rendering.reprojection.common import gap_kernels
from lippmann.rendering.reprojection.common.gap_filling import Settled
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.common.point_image import MISSED, PointImage
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.rendering.reprojection.paper_order_kernels import carry
from lippmann.runtime.row_threads import Bands

#: The mean of two colours is taken whatever they are.
_ANY_COLOR = Rules(careful=False, tolerance=1.0, coded=False, probe_rows=1, probe_stride=1, longest_gap=1, overhang=0)


class PaperOrder:
    """Makes the micro-images of a display of any layout lens by lens, as the paper does.

    The first micro-image is traced. Each next one receives the points of the one before: 3D points, projected through
    its lens to the nearest pixel with their colours as they are; where several meet, the nearest to the viewer wins.
    Its missed pixels (status -1) are traced (status 0). A ray that hits nothing has no point, so that the background is
    not carried: it is traced everywhere, and things that come into sight before it are found. Mirrors, highlights and
    outlines get no care, as they get none there, nor do things hidden from all lenses before.

    Under square and hexagonal lenses every row of lenses is such a display of its own, its first micro-image traced.
    The rows go side by side, a column of lenses at a time, so that a picture takes as many calls as a row has lenses.

    Parameters
    ----------
    points:
        Where the picture comes to be; nothing is known of it yet.
    settled:
        Called with the number of pixels that have just been traced.
    """

    def __init__(
        self, display: Display, points: PointImage, tracer: PixelTracer, bands: Bands, settled: Settled
    ) -> None:
        self._points = points
        self._tracer = tracer
        self._bands = bands
        self._settled = settled
        self._field = LensField.of(display)
        self._beside = np.zeros((*points.status.shape, 2), dtype=np.float32)
        columns = self._field.columns
        # Sixteen bits are sorted in one sweep, and no display has as many lenses in a row.
        column = (self._field.lens % columns).astype(np.uint16).ravel()
        self._numbers = np.argsort(column, kind="stable").astype(np.uint32)
        self._starts = np.searchsorted(column[self._numbers], np.arange(columns + 1))

    def lens_view(self) -> None:
        """Every micro-image from the one before; what no point reached is traced."""
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
            carry(self._points, self._beside, self._field, self._of_column(column - 1), 1)
            if column + 1 < columns:
                carry(self._points, self._beside, self._field, self._of_column(column + 1), -1)
        self._average(self._missed(even))
        self._trace(self._missed(even))

    def _pass_on(self, columns: range, step: int) -> None:
        for column in columns:
            if column >= step:
                carry(self._points, self._beside, self._field, self._of_column(column - step), step)
            self._trace(self._missed(range(column, column + 1)))

    def _average(self, numbers: Pixels) -> None:
        if not len(numbers):
            return
        sides = self._field.corresponding_beside(numbers)
        self._bands.pixels(gap_kernels.average, len(numbers), self._points, numbers, *sides, _ANY_COLOR)

    def _missed(self, columns: range) -> Pixels:
        status = self._points.status.ravel()
        parts = [numbers[status[numbers] == MISSED] for numbers in map(self._of_column, columns)]
        return np.concatenate(parts) if parts else np.empty(0, dtype=np.uint32)

    def _of_column(self, column: int) -> Pixels:
        """The pixels of one column of lenses."""
        numbers: NDArray[np.uint32] = self._numbers[self._starts[column] : self._starts[column + 1]]
        return numbers

    def _trace(self, numbers: Pixels) -> None:
        if len(numbers):
            self._tracer.trace(numbers, self._points)
            self._settled(len(numbers))
