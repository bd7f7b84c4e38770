"""The default order: key micro-images first, the others from the finished ones on either side of them."""

from __future__ import annotations

import numpy as np

from lippmann.display import Display
from lippmann.rendering.reprojection.arrays.backward_warp import BackwardWarp
from lippmann.rendering.reprojection.common.gap_filling import Gaps, Settled
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.pixel_tracer import PixelTracer
from lippmann.rendering.reprojection.common.point_image import WANTED, PointImage
from lippmann.rendering.reprojection.common.schedule import Lenses, Step, odd_and_even, refine
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.rendering.reprojection.lenticular.forward_warp import ForwardWarp
from lippmann.rendering.reprojection.retrace.adaptive_retrace import choose_neighborhoods, search
from lippmann.runtime.row_threads import Bands


class DefaultOrder:
    """Makes the micro-images of a display.

    Under straight cylindrical lenses every row of pixels is a world of its own: a forward warp of spans takes a seventh
    of the time of the backward warp, which slanted sheets, square and hexagonal arrays need.

    Parameters
    ----------
    points:
        Where the picture comes to be; nothing is known of it yet.
    settled:
        Called with the number of pixels that have just been traced.
    """

    def __init__(
        self,
        display: Display,
        points: PointImage,
        tracer: PixelTracer,
        bands: Bands,
        rules: Rules,
        settled: Settled,
    ) -> None:
        self._points = points
        self._field = LensField.of(display)
        warp = ForwardWarp if display.lattice.rows_are_alike else BackwardWarp
        self._warp: ForwardWarp | BackwardWarp = warp(points, self._field, bands, rules)
        self._gaps = Gaps(points, self._field, tracer, bands, rules, settled)
        self._search = (choose_neighborhoods(display, self._field.reach), tracer, bands, rules, settled)

    def lens_view(self) -> None:
        """Every micro-image from its neighbours, near or far; what no point reached is traced."""
        self._make(np.arange(self._field.columns))

    def interpolated(self) -> None:
        """The odd micro-images of each row of lenses (counted from 1) as in :meth:`lens_view`; what no point reached of
        the even ones becomes the mean of the corresponding pixels of their odd neighbours on both sides.

        Corresponding pixels are those whose light lines are nearest to parallel. The last micro-image of an even number
        has one neighbour, whose colours it takes where reuse need not be careful. Pixels for which neither neighbour
        has a corresponding one are treated as the missed ones of :meth:`lens_view`, and with them, where reuse is
        careful, those that have one neighbour only or two that disagree.
        """
        odd, even = odd_and_even(self._field.columns, self._field.rows)
        self._make(odd)
        if len(even.targets):
            self._receive(even)
            self._gaps.average()
            if isinstance(self._warp, BackwardWarp):
                # Without them arrays lose 3 dB where reuse is careful; straight sheets are better by 1 dB without.
                self._gaps.trace_samples()
            self._gaps.fill()

    def correct(self) -> None:
        """Trace what reprojection has falsified, as far as it can be found."""
        search(self._points, self._field, *self._search)

    def _make(self, columns: Lenses) -> None:
        field, status = self._field, self._points.status
        keys, steps = refine(columns, field.rows, field.columns)
        for row in range(len(status)):
            # All probes are traced now, whether or not their micro-images are made.
            status[row, self._warp.probes(row)] = WANTED
        is_key = np.isin(np.arange(len(field.center)), keys)
        begins, ends = field.first[:, :-1], field.first[:, 1:]
        rows = np.arange(len(status))[:, None]
        lens_of_run = field.lens[rows, np.minimum(begins, status.shape[1] - 1)]
        self._gaps.unsettled[...] = is_key[lens_of_run] & (ends > begins)
        self._gaps.trace_samples()
        self._gaps.fill()
        self._warp.finish(keys)
        for step in steps:
            self._receive(step)
            self._gaps.trace_samples()
            self._gaps.fill()
            self._warp.finish(step.targets)

    def _receive(self, step: Step) -> None:
        self._gaps.unsettled[...] = False
        self._warp.receive(step, self._gaps.unsettled)
