"""Points of finished micro-images drawn into others, row by row under straight cylindrical lenses, compiled.

Two neighbouring pixels of one micro-image that see one smooth surface are the ends of a piece of it. The piece is
drawn into the other micro-image with its colour and disparity in between: no holes open up, and no colour is taken from
half a pixel away. Where pieces overlap, the nearest wins. What the sources to the left and to the right show alike is
blended by their distance.

A point can be reprojected only to where nothing nearer hides it, and nearer things that no source has seen are not
known. Therefore every micro-image has a few *probes*, pixels traced beforehand; a point that lies farther away than
what the probes around it have met is not taken.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.reprojection.common.array_types import BoolArray, IntArray, RealArray
from lippmann.rendering.reprojection.common.epipolar_rows import Rows
from lippmann.rendering.reprojection.common.point_image import BACKGROUND, REPROJECTED, TRACED, PointImage
from lippmann.rendering.reprojection.common.thresholds import (
    ON_CENTER,
    ONE_POINT,
    ONE_PROBED_SURFACE,
    ONE_SURFACE,
    Rules,
    alike,
    coded_value,
    color_difference,
    nearer,
)
from lippmann.rendering.reprojection.lenticular.linear_rows import Lines, draw_plain, prepare
from lippmann.runtime.numba_jit import compiled, inlined, uncounted

#: A piece stretched to more pixels than this is seen too obliquely by its source.
LONGEST_PIECE = 3.0
#: Column of a row's first probe in eighths of a micro-image; the second lies half a micro-image on. Four rows of probes
#: visit all eight places, so that no upright line escapes them.
PROBE_PLACES = (0, 2, 1, 3)


class Scratch(NamedTuple):
    """What was drawn into one row of a micro-image, ``(2 sides, pixels)`` each.

    Attributes
    ----------
    disparity:
        Of the point at the pixel's centre.
    piece, part:
        Column of the right end of the piece that covers it (-1: none), and how far along the piece it lies, 0 to 1.
    hidden:
        Disparity of the nearest outline that might reach the pixel.
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
    lines: Lines,
    unsettled: BoolArray,
) -> None:
    """Give the micro-images ``targets (n,)`` the points of ``sources (n, 2)``, to the left and right (-1: none).

    Pixels that get a point become :data:`REPROJECTED`; traced ones stay as they are. ``unsettled (H, lenses)`` says
    which rows of micro-images have missed pixels left.
    """
    widest = 1
    for t in range(len(targets)):
        widest = max(widest, rows.first[targets[t] + 1] - rows.first[targets[t]])
    where, shifts = prepare(rows, targets, sources)
    limits = np.empty((len(targets), 4))
    scratch = Scratch(
        np.empty((2, widest)), np.empty((2, widest), np.int64), np.empty((2, widest)), np.empty((2, widest))
    )
    _receive(first_row, last_row, points, rows, targets, rules, lines, unsettled, where, shifts, limits, scratch)


@uncounted
def _receive(
    first_row: int,
    last_row: int,
    points: PointImage,
    rows: Rows,
    targets: IntArray,
    rules: Rules,
    lines: Lines,
    unsettled: BoolArray,
    where: IntArray,
    shifts: RealArray,
    limits: RealArray,
    scratch: Scratch,
) -> None:
    for row in range(first_row, last_row):
        has_probes = row % rules.probe_rows == 0
        for t in range(len(targets)):
            lens, left, right = targets[t], where[t, 0], where[t, 1]
            if has_probes or row == first_row:
                probed_limits(points, rows, row, lens, rules.probe_rows, limits, t)
            if left >= 0 and right >= 0:
                missed = draw_plain(points, row, has_probes, where, shifts, t, rules, lines, limits[t, 3])
                if missed >= 0:
                    unsettled[row, lens] = missed > 0
                    continue
            for side in range(2):
                source = left if side == 0 else right
                if source >= 0:
                    draw(points, rows, row, source, lens, side, scratch)
                else:
                    for place in range(where[t, 3]):
                        scratch.piece[side, place] = -1
                        scratch.hidden[side, place] = BACKGROUND
            settle(points, rows, row, lens, scratch, shifts[t, 4], limits, t, rules, unsettled)


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
    """Draw one row of the micro-image ``source`` into that of ``target``: fills row ``side`` of ``scratch``."""
    disparity, piece, part, hidden = scratch.disparity, scratch.piece, scratch.part, scratch.hidden
    count = rows.first[target + 1] - rows.first[target]
    for place in range(count):
        piece[side, place] = -1
        hidden[side, place] = BACKGROUND
    begin = rows.first[source]
    shift = rows.center[target] - rows.center[source]
    base = rows.offset[source] - rows.offset[target]
    last = float(count - 1)
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
            if alike(s, s_before, ONE_SURFACE):
                length = here - before
                if 0.0 < length <= LONGEST_PIECE and here >= -ON_CENTER and before <= last + ON_CENTER:
                    low = max(0.0, np.ceil(before - ON_CENTER))
                    high = min(last, np.floor(here + ON_CENTER))
                    for place in range(int(low), int(high) + 1):
                        along = (place - before) / length
                        between = s_before + along * (s - s_before)
                        if piece[side, place] < 0 or nearer(between, disparity[side, place]):
                            disparity[side, place], part[side, place] = between, along
                            piece[side, place] = column
            else:
                # The nearer of the two surfaces may reach up to one pixel further than its last point.
                start, edge = (before, s_before) if nearer(s_before, s) else (here - 1.0, s)
                if start > -1.0 and start <= last:
                    for place in range(max(0, int(np.ceil(start))), int(min(last, np.floor(start + 1.0))) + 1):
                        if nearer(edge, hidden[side, place]):
                            hidden[side, place] = edge
        known = True


@inlined
def probe_column(rows: Rows, row: int, lens: int, number: int, probe_rows: int) -> int:
    """Column of probe ``number`` (0, 1) of a lens in ``row``, one of the rows that have probes."""
    begin = rows.first[lens]
    count = rows.first[lens + 1] - begin
    return int(begin + (count * (PROBE_PLACES[(row // probe_rows) % 4] + 4 * number)) // 8)


@inlined
def probed_limits(
    points: PointImage, rows: Rows, row: int, lens: int, probe_rows: int, limits: RealArray, entry: int
) -> None:
    """What the probes above and below ``row`` say of the stretches of a micro-image before, between and after them.

    ``limits[entry, :3]``: nothing farther than this disparity is to be expected there; 0 where nothing is known.
    ``limits[entry, 3]`` holds for the whole width.
    """
    height = points.status.shape[0]
    above = (row // probe_rows) * probe_rows
    below = min(above + probe_rows, (height - 1) // probe_rows * probe_rows)
    limits[entry, 3] = 0.0
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
                if nearest == 0.0:
                    nearest, farthest = s, s
                elif nearer(s, nearest):
                    nearest = s
                elif nearer(farthest, s):
                    farthest = s
        # Probes that see one surface vouch for all of it; between different ones only the nearer is sure.
        limit = farthest if alike(nearest, farthest, ONE_PROBED_SURFACE) else nearest
        limits[entry, stretch] = limit
        if limits[entry, 3] == 0.0 or (limit != 0.0 and nearer(limit, limits[entry, 3])):
            limits[entry, 3] = limit


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
    unsettled: BoolArray,
) -> None:
    """Decide what the pixels of one row of a micro-image take of the points drawn from its left and right source."""
    s, piece, part, hidden = scratch.disparity, scratch.piece, scratch.part, scratch.hidden
    begin = rows.first[lens]
    count = rows.first[lens + 1] - begin
    first_probe = (count * PROBE_PLACES[(row // rules.probe_rows) % 4]) // 8
    second_probe = first_probe + count // 2
    missed = 0
    for place in range(count):
        column = begin + place
        if points.status[row, column] == TRACED:
            continue
        missed += 1
        from_left, from_right = piece[0, place] >= 0, piece[1, place] >= 0
        if not (from_left or from_right):
            continue
        if from_left and from_right and not alike(s[0, place], s[1, place], ONE_POINT):
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
        if limit != 0.0 and nearer(limit, depth) and not alike(limit, depth, ONE_PROBED_SURFACE):
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
        missed -= 1
    unsettled[row, lens] = missed > 0
