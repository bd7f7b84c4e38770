"""Filling what no point has reached, for all lens layouts: trace some, bridge what lies between, trace the rest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lippmann.rendering.reprojection.common import gap_kernels
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.common.point_image import MISSED, WANTED, PointImage
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.runtime.row_threads import Bands

#: Called with the number of pixels that have just been traced.
Settled = Callable[[int], None]


class Gaps:
    """The missed pixels of a picture.

    Attributes
    ----------
    unsettled:
        ``(H, runs)`` bool: runs that are being made and have pixels without a colour, see
        :mod:`lippmann.rendering.reprojection.common.gap_kernels`.
    """

    def __init__(
        self,
        points: PointImage,
        field: LensField,
        tracer: PixelTracer,
        bands: Bands,
        rules: Rules,
        settled: Settled,
    ) -> None:
        height, edges = field.first.shape
        self.unsettled = np.zeros((height, edges - 1), dtype=np.bool_)
        self._points = points
        self._field = field
        self._tracer = tracer
        self._bands = bands
        self._rules = rules
        self._settled = settled
        self._runs = points, field.first, self.unsettled, rules

    def trace_samples(self) -> None:
        """Trace some pixels of each gap in the unsettled runs, and all that are :data:`WANTED`."""
        self._bands.lines(gap_kernels.scatter_samples, len(self.unsettled), *self._runs)
        self._trace_wanted()

    def fill(self) -> None:
        """Leave no gap in the unsettled runs: bridge what sees one surface, and trace in the others.

        Where reuse is careful all of their pixels are traced, else one in the middle.
        """
        otherwise = gap_kernels.TRACE_ALL if self._rules.careful else gap_kernels.TRACE_MIDDLE
        self._bands.lines(gap_kernels.bridge, len(self.unsettled), *self._runs, otherwise)
        self._trace_wanted()
        self._bands.lines(gap_kernels.bridge, len(self.unsettled), *self._runs, gap_kernels.TAKE_NEAREST)

    def average(self) -> None:
        """Give all missed pixels the mean colour of the corresponding ones under the lenses to either side."""
        numbers = self._pixels(MISSED)
        sides = self._field.corresponding_beside(numbers)
        self._bands.pixels(gap_kernels.average, len(numbers), self._points, numbers, *sides, self._rules)

    def _trace_wanted(self) -> None:
        numbers = self._pixels(WANTED)
        self._tracer.trace(numbers, self._points)
        self._settled(len(numbers))

    def _pixels(self, status: int) -> Pixels:
        return np.flatnonzero(self._points.status == status).astype(np.uint32)
