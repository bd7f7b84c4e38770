"""Filling what no point has reached, for all lens layouts: trace some, bridge what lies between, trace the rest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.reprojection.common import gap_kernels
from lippmann.rendering.reprojection.common.array_types import BoolArray, IntArray
from lippmann.rendering.reprojection.common.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.common.point_image import MISSED, WANTED, PointImage
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.runtime.row_threads import Bands

#: Told how many pixels have just been traced.
Settled = Callable[[int], None]
#: Linear numbers of the corresponding pixels to the left and right (-1: none) of a list of pixels.
Corresponding = Callable[[Pixels], tuple[NDArray[np.int64], NDArray[np.int64]]]


class Gaps:
    """The missed pixels of a picture.

    Attributes
    ----------
    first:
        ``(H, runs + 1)`` columns at which the runs begin and end, see
        :mod:`lippmann.rendering.reprojection.common.gap_kernels`.
    unsettled:
        ``(H, runs)`` bool: runs that are being made and have pixels without a colour.
    """

    def __init__(
        self,
        points: PointImage,
        first: NDArray[np.int64],
        tracer: PixelTracer,
        bands: Bands,
        rules: Rules,
        settled: Settled,
    ) -> None:
        height, edges = first.shape
        self.first = first
        self.unsettled = np.zeros((height, edges - 1), dtype=np.bool_)
        self._points = points
        self._tracer = tracer
        self._bands = bands
        self._rules = rules
        self._settled = settled
        self._counts = np.zeros(height, dtype=np.int64)

    def trace_samples(self, also: BoolArray | tuple[slice, IntArray] | None = None) -> None:
        """Trace some pixels of each missed stretch in the unsettled runs, and all that are wanted already.

        ``also`` is an index of ``unsettled``: more runs with wanted pixels, which are not being made yet.
        """
        self._bands.lines(
            gap_kernels.scatter_samples,
            len(self._points.status),
            self._points,
            self.first,
            self.unsettled,
            self._counts,
            self._rules,
        )
        if also is not None:
            self.unsettled[also] = True
        self._trace_wanted()
        if also is not None:
            self.unsettled[also] = False

    def complete(self) -> None:
        """Leave no gap in the unsettled runs."""
        if self._rules.careful or self._rules.middles:
            self._bridge(gap_kernels.TRACE_ALL if self._rules.careful else gap_kernels.TRACE_MIDDLE)
            self._trace_wanted()
        self._bridge(gap_kernels.TAKE_NEAREST)

    def average(self, corresponding: Corresponding) -> None:
        """Give missed pixels of the unsettled runs the mean colour of the corresponding ones under other lenses."""
        counts = np.zeros_like(self._counts)
        self._bands.lines(
            gap_kernels.count_pixels, len(self._points.status), self._points, self.first, self.unsettled, MISSED, counts
        )
        numbers = self._listed(MISSED, counts)
        left, right = corresponding(numbers)
        self._bands.pixels(gap_kernels.average, len(numbers), self._points, numbers, left, right, self._rules)

    def want(self, row: int, columns: NDArray[np.int64]) -> None:
        """Have pixels of a row traced with the next samples; their runs must be unsettled by then."""
        status = self._points.status
        self._counts[row] += len(columns)
        status[row, columns] = WANTED

    def _bridge(self, otherwise: int) -> None:
        self._bands.lines(
            gap_kernels.bridge,
            len(self._points.status),
            self._points,
            self.first,
            self.unsettled,
            self._counts,
            self._rules,
            otherwise,
        )

    def _trace_wanted(self) -> None:
        numbers = self._listed(WANTED, self._counts)
        self._counts[:] = 0
        self._tracer.trace(numbers, self._points)
        self._settled(len(numbers))

    def _listed(self, status: int, counts: NDArray[np.int64]) -> Pixels:
        ends = np.cumsum(counts)
        numbers = np.empty(int(ends[-1]), dtype=np.uint32)
        self._bands.lines(
            gap_kernels.list_pixels,
            len(self._points.status),
            self._points,
            self.first,
            self.unsettled,
            status,
            ends - counts,
            numbers,
        )
        return numbers
