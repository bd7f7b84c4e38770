"""The default order: key micro-images first, the others from the finished ones on either side of them."""

from __future__ import annotations

import numpy as np

from lippmann.display import Display
from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.backward_warp import BackwardWarp
from lippmann.rendering.reprojection.forward_warp import ForwardWarp
from lippmann.rendering.reprojection.missed_pixels import average_neighbors, bridge, thin_out
from lippmann.rendering.reprojection.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.point_image import MISSED, QUEUED, PointImage
from lippmann.rendering.reprojection.rules import Rules
from lippmann.rendering.reprojection.schedule import Lenses, odd_and_even, refine
from lippmann.rendering.reprojection.search import choose_neighborhoods, search
from lippmann.runtime.row_threads import Bands


class DefaultOrder:
    """Micro-images of a display, reprojected from coarse to fine, with their missed pixels traced.

    Under straight cylindrical lenses each row of pixels is independent of the others (an epipolar plane), and a forward
    warp of spans takes a seventh of the time of the backward warp that all other layouts need.

    ``points`` is the picture that is filled; it must be empty at first.
    """

    def __init__(self, display: Display, points: PointImage, tracer: PixelTracer, bands: Bands, rules: Rules) -> None:
        self._points, self._tracer, self._bands, self._rules = points, tracer, bands, rules
        self._display = display
        self._field = LensField.of(display)
        warp = ForwardWarp if display.lattice.rows_are_alike else BackwardWarp
        self._warp: ForwardWarp | BackwardWarp = warp(points, self._field, bands, rules)

    def lens_view(self) -> None:
        """Reproject every micro-image from nearer and farther neighbours, and trace its missed pixels."""
        self._make(np.arange(self._field.columns))

    def interpolated(self) -> None:
        """Odd micro-images of each row of lenses (counted from 1) as in :meth:`lens_view`. Missed pixels of the even
        ones are the mean of the corresponding pixels of their two odd neighbours.

        Corresponding pixels are those whose light lines are nearest to parallel. The last micro-image of an even number
        has one neighbour and takes its colours. Pixels without a corresponding one are traced. With careful rules, so
        are those with a single one, or with two that disagree.
        """
        odd, even = odd_and_even(self._field.columns, self._field.rows)
        self._make(odd)
        if len(even.targets):
            self._warp.receive(even)
            average_neighbors(self._points, self._field, self._find_queued(), self._rules, self._bands)
            self._trace_queued()

    def correct(self) -> None:
        """Search for falsified pixels and trace them."""
        neighborhoods = choose_neighborhoods(self._display, self._field.reach)
        search(self._points, self._field, neighborhoods, self._tracer, self._bands, self._rules)

    def _make(self, columns: Lenses) -> None:
        field, status = self._field, self._points.status
        keys, steps = refine(columns, field.rows, field.columns)
        for row in range(len(status)):
            # Probes of all micro-images, also of those in other columns, which are interpolated later.
            status[row, self._warp.probes(row)] = QUEUED
        self._tracer.trace(self._find_queued(), self._points)
        is_key = np.isin(np.arange(len(field.center)), keys)
        status[is_key[field.lens] & (status == MISSED)] = QUEUED
        self._trace_queued()
        self._warp.finish(keys)
        for step in steps:
            self._warp.receive(step)
            self._trace_queued()
            self._warp.finish(step.targets)

    def _find_queued(self) -> Pixels:
        return np.flatnonzero(self._points.status == QUEUED).astype(np.uint32)

    def _trace_queued(self) -> None:
        """Trace some of the queued pixels, bridge the others, and trace those that careful rules do not bridge."""
        arguments = self._points, self._field.lens, self._rules
        self._bands.lines(thin_out, len(self._points.status), *arguments)
        self._tracer.trace(self._find_queued(), self._points)
        self._bands.lines(bridge, len(self._points.status), *arguments)
        self._tracer.trace(self._find_queued(), self._points)
