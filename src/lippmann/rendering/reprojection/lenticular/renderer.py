"""Reuse under straight cylindrical lenses: the micro-images in order, a row at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.rendering.reprojection.common.epipolar_rows import Rows
from lippmann.rendering.reprojection.common.gap_filling import Gaps, Settled
from lippmann.rendering.reprojection.common.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.common.point_image import PointImage
from lippmann.rendering.reprojection.common.schedule import Lenses, Step, key_stride, odd_and_even, refine
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.rendering.reprojection.lenticular.forward_warp import PROBE_PLACES, receive
from lippmann.rendering.reprojection.lenticular.linear_rows import Lines, find_plain
from lippmann.rendering.reprojection.retrace import region_growing
from lippmann.runtime.row_threads import Bands


class StraightRenderer:
    """Makes the micro-images of a straight lenticular display, in the default order.

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
        self._bands = bands
        self._rules = rules
        self._rows = Rows.of(display)
        height = len(points.status)
        first = np.broadcast_to(self._rows.first, (height, len(self._rows.first)))
        self._gaps = Gaps(points, first, tracer, bands, rules, settled)
        self._lines = Lines.empty(height, self._rows.lenses)
        self._fresh: Lenses = np.zeros(0, dtype=np.int64)  # made since plain rows were last looked for

    def lens_view(self) -> None:
        """Every micro-image from its neighbours, near or far; what no point reached is traced."""
        lenses = np.arange(self._rows.lenses)
        self._make(lenses, key_stride(len(lenses), self._rules.careful))

    def interpolated(self) -> None:
        """The odd micro-images as in :meth:`lens_view`; what no point reached of the even ones becomes the mean of the
        corresponding pixels of their odd neighbours."""
        odd, even = odd_and_even(self._rows.lenses)
        self._make(odd, max(1, key_stride(self._rows.lenses, self._rules.careful) // 2))
        if len(even.targets):
            self._receive(even)
            self._gaps.average(self._corresponding)
            self._gaps.complete()

    def _make(self, lenses: Lenses, stride: int) -> None:
        keys, steps = refine(lenses, stride)
        unsettled = self._gaps.unsettled
        self._want_probes()
        # All rows of probes are traced now, whether or not their micro-images are made.
        others = np.setdiff1d(np.arange(self._rows.lenses), keys)
        unsettled[:, keys] = True
        self._gaps.trace_samples(also=(slice(None, None, self._rules.probe_rows), others))
        self._gaps.complete()
        self._fresh = keys
        for step in steps:
            self._receive(step)
            self._gaps.trace_samples()
            self._gaps.complete()
            self._fresh = step.targets

    def _receive(self, step: Step) -> None:
        self._bands.lines(
            find_plain, len(self._points.status), self._points, self._rows, self._fresh, self._rules, self._lines
        )
        self._bands.lines(
            receive,
            len(self._points.status),
            self._points,
            self._rows,
            step.targets,
            step.sources,
            self._rules,
            self._lines,
            self._gaps.unsettled,
        )

    def _want_probes(self) -> None:
        first, count = self._rows.first[:-1], np.diff(self._rows.first)
        for number, row in enumerate(range(0, len(self._points.status), self._rules.probe_rows)):
            place = count * (PROBE_PLACES[number % 4] + np.array([[0], [4]])) // 8
            self._gaps.want(row, np.unique((first + place)[place < count]))

    def _corresponding(self, numbers: Pixels) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The pixels at the same place under the neighbouring lenses; micro-images may be cut off at the edges."""
        rows = self._rows
        row, column = np.divmod(numbers.astype(np.int64), self._points.status.shape[1])
        lens = self._lens_of_column[column]
        found = []
        for side in (-1, 1):
            other = np.clip(lens + side, 0, rows.lenses - 1)
            shift = np.floor(rows.offset[lens] - rows.offset[other] + 0.5).astype(np.int64)
            place = rows.first[other] + column - rows.first[lens] + shift
            exists = (other != lens) & (place >= rows.first[other]) & (place < rows.first[other + 1])
            found.append(np.where(exists, row * self._points.status.shape[1] + place, -1))
        return found[0], found[1]

    @property
    def _lens_of_column(self) -> NDArray[np.int32]:
        return np.repeat(np.arange(self._rows.lenses, dtype=np.int32), np.diff(self._rows.first))

    # ---- The search for what was falsified ---------------------------------------------------------------------------

    def lens_numbers(self) -> NDArray[np.int32]:
        """The lens of every pixel, ``(H, W)``."""
        return np.broadcast_to(self._lens_of_column, self._points.status.shape)

    @property
    def reach(self) -> int:
        """Columns of a micro-image, about."""
        return int(np.diff(self._rows.first).max())

    def follow(self, surprised: Pixels, lens: NDArray[np.int32], wanted: NDArray[np.bool_]) -> None:
        """Want the pixels of neighbouring lenses that should see the points of surprising ones."""
        region_growing.follow_across(self._points, self._rows, surprised, lens, wanted)
