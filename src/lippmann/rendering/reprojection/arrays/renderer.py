"""Reuse under lenses of any layout: slanted sheets, square and hexagonal arrays, lenses not of whole pixels."""

from __future__ import annotations

from math import gcd, sqrt

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.rendering.reprojection.arrays.backward_warp import Gathering, gather
from lippmann.rendering.reprojection.arrays.epipolar_march import mark_nearest
from lippmann.rendering.reprojection.common.array_schedule import ArrayStep, array_key_stride, refine_grid
from lippmann.rendering.reprojection.common.gap_filling import Gaps, Settled
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.common.point_image import TRACED, PointImage
from lippmann.rendering.reprojection.common.schedule import Lenses, Step, odd_and_even
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.rendering.reprojection.retrace.point_tracking import follow_points
from lippmann.runtime.row_threads import Bands

#: One pixel in so many would be a probe, if all probes lay in the rows that the rules give them.
_PROBE_COLUMNS = 4
#: From one probe to the next in a row, and from there to the one below: the golden section scatters them evenly.
_GOLDEN = (sqrt(5) - 1) / 2


class ArrayRenderer:
    """Makes the micro-images of a display of any layout, in the default order.

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
        # One more round of tracing costs little beside gathering.
        rules = rules._replace(middles=True)
        self._points = points
        self._tracer = tracer
        self._settled = settled
        self._bands = bands
        self._rules = rules
        self._field = LensField.of(display)
        self._gaps = Gaps(points, self._field.first, tracer, bands, rules, settled)
        self._probe_stride = _PROBE_COLUMNS * rules.probe_rows
        self._probe_shift = _scattering(self._probe_stride)
        self._nearest = np.zeros(points.status.shape, dtype=np.float32)
        self._lens_of_run = self._field.lens[
            np.arange(len(points.status))[:, None], np.minimum(self._field.first[:, :-1], points.status.shape[1] - 1)
        ]

    def lens_view(self) -> None:
        """Every micro-image from its neighbours, near or far; what no point reached is traced."""
        self._make(np.arange(self._field.columns), self._stride)
        self._look_beside()

    def interpolated(self) -> None:
        """The odd micro-images of each row of lenses (counted from 1) as in :meth:`lens_view`; what no point reached of
        the even ones becomes the mean of the corresponding pixels of their odd neighbours on both sides.

        Corresponding pixels are those whose light lines are nearest to parallel. The last micro-image of an even number
        has one neighbour, whose colours it takes where reuse need not be careful. Pixels for which neither neighbour
        has a corresponding one are treated as the missed ones of :meth:`lens_view`, and with them, where reuse is
        careful, those that have one neighbour only or two that disagree.
        """
        odd, even = odd_and_even(self._field.columns)
        self._make(odd, max(1, self._stride // 2))
        if len(even.targets):
            self._average(even)
        self._look_beside()

    def _average(self, even: Step) -> None:
        first = np.arange(self._field.rows)[:, None, None] * self._field.columns
        sources = np.where(even.sources >= 0, first + even.sources, -1).reshape(-1, 2)
        self._receive(ArrayStep((first[:, 0] + even.targets).ravel(), sources))
        self._gaps.average(self._corresponding)
        self._gaps.trace_samples()
        self._gaps.complete()

    @property
    def _stride(self) -> int:
        return array_key_stride(max(self._field.columns, self._field.rows))

    def _make(self, columns: Lenses, stride: int) -> None:
        field, unsettled = self._field, self._gaps.unsettled
        keys, steps = refine_grid(columns, field.rows, stride, field.columns)
        self._want_probes()
        # All probes are traced now, whether or not their micro-images are made.
        is_key = self._of_lenses(keys)
        exists = field.first[:, 1:] > field.first[:, :-1]
        unsettled[...] = is_key & exists
        self._gaps.trace_samples(also=~is_key & exists)
        self._gaps.complete()
        self._finish(keys)
        for step in steps:
            self._receive(step)
            self._gaps.trace_samples()
            self._gaps.complete()
            self._finish(step.targets)

    def _receive(self, step: ArrayStep) -> None:
        lenses = len(self._field.center)
        target = np.zeros(lenses, dtype=np.bool_)
        target[step.targets] = True
        source = np.full((lenses, step.sources.shape[1]), -1, dtype=np.int64)
        source[step.targets] = step.sources
        self._gaps.unsettled[...] = False
        self._bands.lines(
            gather,
            len(self._points.status),
            self._points,
            self._field,
            Gathering(target, source, self._probe_stride, self._probe_shift, round(sqrt(self._probe_stride))),
            self._rules,
            self._nearest,
            self._gaps.unsettled,
        )

    def _finish(self, lenses: Lenses) -> None:
        """Others may gather from these now."""
        done = np.zeros(len(self._field.center), dtype=np.bool_)
        done[lenses] = True
        self._bands.lines(mark_nearest, len(self._points.status), self._points, self._field, done, self._nearest)

    def _look_beside(self) -> None:
        """Where care is taken, trace what traced pixels show and the lenses beside theirs do not."""
        if not self._rules.careful:
            return
        status = self._points.status
        wanted = np.zeros(status.shape, dtype=np.bool_)
        numbers = np.flatnonzero(status == TRACED).astype(np.uint32)
        while len(numbers):
            wanted[:] = False
            follow_points(self._points, self._field, self._neighbors, numbers, self._rules, wanted)
            numbers = np.flatnonzero(wanted).astype(np.uint32)
            self._tracer.trace(numbers, self._points)
            self._settled(len(numbers))

    def _of_lenses(self, lenses: Lenses) -> NDArray[np.bool_]:
        """The stretches that belong to some lenses, ``(H, runs)``."""
        chosen = np.zeros(len(self._field.center), dtype=np.bool_)
        chosen[lenses] = True
        of_runs: NDArray[np.bool_] = chosen[self._lens_of_run]
        return of_runs

    def _want_probes(self) -> None:
        height, width = self._points.status.shape
        for row in range(height):
            self._gaps.want(row, np.arange(row * self._probe_shift % self._probe_stride, width, self._probe_stride))

    def _corresponding(self, numbers: Pixels) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        field = self._field
        lens = field.lens.ravel()[numbers].astype(np.int64)
        column = lens % field.columns
        left = np.where(column > 0, lens - 1, -1)
        right = np.where(column + 1 < field.columns, lens + 1, -1)
        places = numbers.astype(np.int64)
        return field.corresponding(places, left), field.corresponding(places, right)

    # ---- The search for what was falsified ---------------------------------------------------------------------------

    def lens_numbers(self) -> NDArray[np.int32]:
        """The lens of every pixel, ``(H, W)``."""
        return self._field.lens

    @property
    def reach(self) -> int:
        """Columns of a micro-image, about."""
        return self._field.reach

    def follow(self, surprised: Pixels, lens: NDArray[np.int32], wanted: NDArray[np.bool_]) -> None:
        """Want the pixels of neighbouring lenses that should show the points of surprising ones, and do not."""
        follow_points(self._points, self._field, self._neighbors, surprised, self._rules, wanted)

    @property
    def _neighbors(self) -> NDArray[np.int64]:
        """The lenses to the left and right, above and below, ``(lenses, 4)``; -1 for none."""
        rows, columns = self._field.rows, self._field.columns
        j, i = (a.ravel() for a in np.indices((rows, columns)))
        found = []
        for down, right in ((0, -1), (0, 1), (-1, 0), (1, 0)):
            exists = (i + right >= 0) & (i + right < columns) & (j + down >= 0) & (j + down < rows)
            found.append(np.where(exists, (j + down) * columns + i + right, -1))
        return np.stack(found, axis=1)


def _scattering(stride: int) -> int:
    """How far probes move from row to row, so that they come to every column and leave no large holes."""
    shift = round(_GOLDEN * stride)
    while gcd(shift, stride) > 1:
        shift -= 1
    return shift
