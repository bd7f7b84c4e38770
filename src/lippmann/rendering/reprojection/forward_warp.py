"""Forward warp of finished micro-images into others, row by row under straight cylindrical lenses. Compiled.

Two neighbouring pixels of one micro-image that see one smooth surface are the ends of a piece of it. The piece is
splatted into the other micro-image with interpolated colour and disparity, so there are no holes and no offsets of half
a pixel. Where pieces overlap, the nearest wins (z-buffer). Points on which the left and the right source agree are
blended by the distance of the lenses.

Occluders that no source has seen are unknown. So every micro-image has a few *probes*, pixels traced beforehand. Points
farther away than the probes around them are rejected.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.point_image import (
    BACKGROUND,
    QUEUED,
    REPROJECTED,
    TRACED,
    IntArray,
    PointImage,
    RealArray,
)
from lippmann.rendering.reprojection.rules import (
    Rules,
    alike,
    coded_value,
    color_difference,
    is_behind,
    limit_of_probes,
    nearer,
    widen,
)
from lippmann.rendering.reprojection.schedule import Lenses, Step
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.runtime.numba_jit import compiled, inlined, uncounted
from lippmann.runtime.row_threads import Bands


class Rows(NamedTuple):
    """The columns of the micro-images in every row, lens by lens from the left.

    Each row of pixels is an epipolar plane: a point of disparity s that lens c shows at panel position ``c + o``
    appears under lens c' at ``c' + o + (c' - c) s``.

    Attributes
    ----------
    first:
        ``(lenses + 1,)`` first column of each micro-image; its last one ends where the next begins.
    center:
        ``(lenses,)`` the lens's centre, in pixels from the centre of column 0.
    """

    first: NDArray[np.int64]
    center: NDArray[np.float64]


class ForwardWarp:
    """Makes micro-images of straight cylindrical lenses from others."""

    def __init__(self, points: PointImage, field: LensField, bands: Bands, rules: Rules) -> None:
        self._points = points
        self._bands = bands
        self._rules = rules
        self._rows = Rows(np.searchsorted(field.lens[0], np.arange(field.columns + 1)), field.center[:, 0].copy())

    def probes(self, row: int) -> NDArray[np.int64]:
        """Columns of the probes in a row: two in each micro-image of some rows."""
        if row % self._rules.probe_rows:
            return np.empty(0, np.int64)
        first, count = self._rows.first[:-1], np.diff(self._rows.first)
        place = count * (first_place(row // self._rules.probe_rows) + np.array([[0], [4]])) // 8
        return np.unique((first + place)[place < count])

    def receive(self, step: Step) -> None:
        """Give the targets of a step the points of their sources."""
        height = len(self._points.status)
        self._bands.lines(receive, height, self._points, self._rows, step.targets, step.sources, self._rules)

    def finish(self, lenses: Lenses) -> None:
        """Prepare the micro-images of ``lenses`` as sources: nothing to do here."""


class Scratch(NamedTuple):
    """Z-buffer of one row of a micro-image, ``(2 sides, pixels)`` each.

    Attributes
    ----------
    disparity:
        Disparity of the point at the pixel's centre.
    piece, part:
        Column of the right end of the piece that covers it (-1: none), and how far along the piece it lies, 0 to 1.
    hidden:
        Disparity of the nearest outline that may extend over the pixel.
    """

    disparity: NDArray[np.float64]
    piece: NDArray[np.int64]
    part: NDArray[np.float64]
    hidden: NDArray[np.float64]


@compiled
def receive(
    first_row: int,
    last_row: int,
    points: PointImage,
    rows: Rows,
    targets: IntArray,
    sources: IntArray,
    rules: Rules,
) -> None:
    """Give the micro-images ``targets (n,)`` the points of ``sources (n, 2)``, to the left and right (-1: none).

    Pixels that get a point become :data:`REPROJECTED`, missed ones :data:`QUEUED`; traced ones stay as they are.
    """
    widest = 1
    for t in range(len(targets)):
        widest = max(widest, rows.first[targets[t] + 1] - rows.first[targets[t]])
    limits = np.empty((len(targets), 3))
    scratch = Scratch(
        np.empty((2, widest)), np.empty((2, widest), np.int64), np.empty((2, widest)), np.empty((2, widest))
    )
    _receive(first_row, last_row, points, rows, targets, sources, rules, limits, scratch)


@uncounted
def _receive(
    first_row: int,
    last_row: int,
    points: PointImage,
    rows: Rows,
    targets: IntArray,
    sources: IntArray,
    rules: Rules,
    limits: RealArray,
    scratch: Scratch,
) -> None:
    for row in range(first_row, last_row):
        has_probes = row % rules.probe_rows == 0
        for t in range(len(targets)):
            lens, left, right = targets[t], sources[t, 0], sources[t, 1]
            if has_probes or row == first_row:
                probed_limits(points, rows, row, lens, rules.probe_rows, limits, t)
            weight = 0.5
            if left >= 0 and right >= 0:
                weight = (rows.center[right] - rows.center[lens]) / (rows.center[right] - rows.center[left])
            for side in range(2):
                source = left if side == 0 else right
                for place in range(rows.first[lens + 1] - rows.first[lens]):
                    scratch.piece[side, place] = -1
                    scratch.hidden[side, place] = BACKGROUND
                if source >= 0:
                    draw(points, rows, row, source, lens, side, scratch)
            settle(points, rows, row, lens, scratch, weight, limits, t, rules)


@inlined
def draw(
    points: PointImage,
    rows: Rows,
    row: int,
    source: int,
    target: int,
    side: int,
    scratch: Scratch,
) -> None:
    """Splat one row of the micro-image ``source`` into that of ``target``: fills row ``side`` of ``scratch``."""
    disparity, piece, part, hidden = scratch.disparity, scratch.piece, scratch.part, scratch.hidden
    begin = rows.first[source]
    shift = rows.center[target] - rows.center[source]
    base = begin - rows.first[target] + shift
    last = float(rows.first[target + 1] - rows.first[target] - 1)
    known = False
    here, s = 0.0, 0.0
    for column in range(begin, rows.first[source + 1]):
        if points.status[row, column] < 0:
            known = False
            continue
        before, s_before = here, s
        s = np.float64(points.disparity[row, column])
        here = base + (column - begin) + shift * s
        if known:
            if alike(s, s_before, TUNING.one_surface):
                length = here - before
                if (
                    0.0 < length <= TUNING.longest_piece
                    and here >= -TUNING.on_center
                    and before <= last + TUNING.on_center
                ):
                    low = max(0.0, np.ceil(before - TUNING.on_center))
                    high = min(last, np.floor(here + TUNING.on_center))
                    for place in range(int(low), int(high) + 1):
                        along = (place - before) / length
                        between = s_before + along * (s - s_before)
                        if piece[side, place] < 0 or nearer(between, disparity[side, place]):
                            disparity[side, place], part[side, place] = between, along
                            piece[side, place] = column
            else:
                # The nearer surface may extend up to one pixel beyond its last point.
                start, edge = (before, s_before) if nearer(s_before, s) else (here - 1.0, s)
                if start > -1.0 and start <= last:
                    for place in range(max(0, int(np.ceil(start))), int(min(last, np.floor(start + 1.0))) + 1):
                        if nearer(edge, hidden[side, place]):
                            hidden[side, place] = edge
        known = True


@inlined
def first_place(number: int) -> int:
    """Column of the first of two probes in the ``number``-th row that has probes: 0 to 3 eighths of a micro-image.

    The second probe lies half a micro-image to its right. Four rows of probes visit all eighths: no line escapes.
    """
    return 2 * (number & 1) + (number >> 1 & 1)


@inlined
def probe_column(rows: Rows, row: int, lens: int, number: int, probe_rows: int) -> int:
    """Column of probe ``number`` (0, 1) of a lens in ``row``, one of the rows that have probes."""
    begin = rows.first[lens]
    count = rows.first[lens + 1] - begin
    return int(begin + (count * (first_place(row // probe_rows) + 4 * number)) // 8)


@inlined
def probed_limits(
    points: PointImage, rows: Rows, row: int, lens: int, probe_rows: int, limits: RealArray, entry: int
) -> None:
    """Set ``limits[entry]`` from the probes above and below ``row``, for the stretches before, between and after them.

    Each is the disparity of the farthest point to expect there; 0 where it is unknown.
    """
    height = points.status.shape[0]
    above = (row // probe_rows) * probe_rows
    below = min(above + probe_rows, (height - 1) // probe_rows * probe_rows)
    for stretch in range(3):
        nearest, farthest = 0.0, 0.0
        for number in range(2):
            if (stretch == 0 and number == 1) or (stretch == 2 and number == 0):
                continue
            for probed in (above, below):
                column = probe_column(rows, probed, lens, number, probe_rows)
                if column >= rows.first[lens + 1] or points.status[probed, column] != TRACED:
                    continue
                s = np.float64(points.disparity[probed, column])
                nearest, farthest = widen(nearest, farthest, s)
        limits[entry, stretch] = limit_of_probes(nearest, farthest)


@inlined
def settle(
    points: PointImage,
    rows: Rows,
    row: int,
    lens: int,
    scratch: Scratch,
    weight: float,
    limits: RealArray,
    entry: int,
    rules: Rules,
) -> None:
    """Resolve the splats from the left and right source for one row of a micro-image: blend, take one, or reject."""
    s, piece, part, hidden = scratch.disparity, scratch.piece, scratch.part, scratch.hidden
    begin = rows.first[lens]
    count = rows.first[lens + 1] - begin
    first_probe = (count * first_place(row // rules.probe_rows)) // 8
    second_probe = first_probe + count // 2
    for place in range(count):
        column = begin + place
        if points.status[row, column] == TRACED:
            continue
        points.status[row, column] = QUEUED
        from_left, from_right = piece[0, place] >= 0, piece[1, place] >= 0
        if not (from_left or from_right):
            continue
        if from_left and from_right and not alike(s[0, place], s[1, place], TUNING.one_surface):
            from_left = nearer(s[0, place], s[1, place])
            from_right = not from_left
        share = 1.0 if not from_right else (0.0 if not from_left else weight)
        depth = 0.0
        if from_left:
            depth += share * s[0, place]
        if from_right:
            depth += (1.0 - share) * s[1, place]

        stretch = 0 if place < first_probe else (1 if place < second_probe else 2)
        limit = limits[entry, stretch]
        if is_behind(depth, limit):
            continue
        beside_left, beside_right = nearer(hidden[0, place], depth), nearer(hidden[1, place], depth)
        if (beside_left and beside_right) or (rules.careful and (beside_left or beside_right)):
            continue

        left, right = piece[0, place], piece[1, place]
        if rules.careful:
            if from_left and (
                points.fragile[row, left]
                or points.fragile[row, left - 1]
                or color_difference(points.color, row, left, row, left - 1, rules.coded) > rules.tolerance
            ):
                continue
            if from_right and (
                points.fragile[row, right]
                or points.fragile[row, right - 1]
                or color_difference(points.color, row, right, row, right - 1, rules.coded) > rules.tolerance
            ):
                continue
        apart = 0.0
        for channel in range(3):
            one, other = 0.0, 0.0
            if from_left:
                a, b = points.color[row, left - 1, channel], points.color[row, left, channel]
                one = a + part[0, place] * (b - a)
            if from_right:
                a, b = points.color[row, right - 1, channel], points.color[row, right, channel]
                other = a + part[1, place] * (b - a)
            if rules.careful and from_left and from_right:
                apart = max(apart, abs(coded_value(one, rules.coded) - coded_value(other, rules.coded)))
            points.color[row, column, channel] = share * one + (1.0 - share) * other
        if apart > rules.tolerance:
            continue
        points.disparity[row, column] = depth
        points.status[row, column] = REPROJECTED
