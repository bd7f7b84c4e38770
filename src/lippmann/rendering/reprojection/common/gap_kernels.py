"""What no point has reached: which of those pixels are traced, and how the gaps between them are bridged. Compiled.

A lens shows only a small piece of a surface near to the lens plane, and shows it magnified: there no other lens helps,
but a few pixels tell all. So a run of missed pixels is traced at some places first; where two neighbours among these
see one surface in one colour, what lies between them is a piece of it, drawn as pieces are from lens to lens. Else the
gap is traced as well: all of it, or where edges may be off by a pixel, its middle alone.

A *run* is a row of one micro-image: pixels of a row that have one lens. Run k of a row covers the columns from
``first[row, k]`` to ``first[row, k + 1]``, whatever the layout of the lenses. All kernels visit only those runs that
``unsettled (H, runs)`` names.
"""

from __future__ import annotations

import numpy as np

from lippmann.rendering.reprojection.common.array_types import BoolArray, IntArray
from lippmann.rendering.reprojection.common.point_image import INTERPOLATED, MISSED, REPROJECTED, WANTED, PointImage
from lippmann.rendering.reprojection.common.thresholds import Rules, alike, color_difference
from lippmann.rendering.reprojection.common.tuning import TUNING
from lippmann.runtime.numba_jit import inlined, uncounted

#: What :func:`bridge` does with gaps between different surfaces or colours: want all of their pixels, want the middle
#: one, or give every pixel the colour of the nearest one that is known.
TRACE_ALL, TRACE_MIDDLE, TAKE_NEAREST = range(3)


@uncounted
def scatter_samples(
    first_row: int,
    last_row: int,
    points: PointImage,
    first: IntArray,
    unsettled: BoolArray,
    rules: Rules,
) -> None:
    """Want some of the missed pixels, ``longest_gap`` apart at most.

    From row to row the places shift, so that upright lines do not slip through.
    """
    gap = rules.longest_gap
    beyond = gap - 1 - rules.overhang
    for row in range(first_row, last_row):
        for k in range(unsettled.shape[1]):
            if not unsettled[row, k]:
                continue
            begin, end = first[row, k], first[row, k + 1]
            start = begin
            while start < end:
                if points.status[row, start] != MISSED:
                    start += 1
                    continue
                stop = start
                while stop < end and points.status[row, stop] == MISSED:
                    stop += 1
                # Next known pixels; beyond the end of the micro-image they are imagined.
                a = start - 1 if start > begin else start - 1 - beyond
                b = stop if stop < end else stop + beyond
                steps = -(-(b - a) // gap)
                if start == begin and stop == end:
                    steps = max(steps, 3)
                rounding = steps // 2 if row & 1 else (steps - 1) // 2
                none = True
                for i in range(1, steps):
                    column = a + ((b - a) * i + rounding) // steps
                    if start <= column < stop:
                        points.status[row, column] = WANTED
                        none = False
                if none and start == begin and stop == end:
                    # The stub of a micro-image that the panel cuts off: something must be known of every run.
                    points.status[row, start] = WANTED
                start = stop


@uncounted
def bridge(
    first_row: int,
    last_row: int,
    points: PointImage,
    first: IntArray,
    unsettled: BoolArray,
    rules: Rules,
    otherwise: int,
) -> None:
    """Fill the gaps between known pixels that belong together, and decide on the others.

    ``otherwise`` is :data:`TRACE_ALL`, :data:`TRACE_MIDDLE` or :data:`TAKE_NEAREST`.
    """
    for row in range(first_row, last_row):
        for k in range(unsettled.shape[1]):
            if not unsettled[row, k]:
                continue
            begin, end = first[row, k], first[row, k + 1]
            settled = True
            start = begin
            while start < end:
                if points.status[row, start] >= 0:
                    start += 1
                    continue
                stop = start
                while stop < end and points.status[row, stop] < 0:
                    stop += 1
                if not _fill(points, row, begin, end, start, stop, rules):
                    if otherwise == TRACE_ALL:
                        for column in range(start, stop):
                            points.status[row, column] = WANTED
                        settled = False
                    elif otherwise == TRACE_MIDDLE:
                        _want_middle(points, row, begin, end, start, stop)
                        settled = False
                    else:
                        _take_nearest(points, row, begin, end, start, stop)
                start = stop
            unsettled[row, k] = not settled


@uncounted
def _fill(points: PointImage, row: int, begin: int, end: int, start: int, stop: int, rules: Rules) -> bool:
    """Bridge the gap ``[start, stop)`` if both its ends see one surface in one colour, or extrapolate a short one."""
    a, b = start - 1, stop
    if start == begin:
        a, b = stop, stop + 1
    elif stop == end:
        a, b = start - 2, start - 1
    if a < begin or b >= end or points.status[row, a] < 0 or points.status[row, b] < 0:
        return False
    if b - a > rules.longest_gap or ((start == begin or stop == end) and stop - start > rules.overhang):
        return False
    s, t = np.float64(points.disparity[row, a]), np.float64(points.disparity[row, b])
    flat = abs(s - t) <= TUNING.height_per_pixel * (b - a) * abs(s * t)
    if not (flat or alike(s, t, TUNING.one_surface_per_pixel * (b - a))):
        return False
    if rules.careful and (points.fragile[row, a] != points.fragile[row, b]):
        return False
    if color_difference(points.color, row, a, row, b, rules.coded) > rules.tolerance:
        return False
    for column in range(start, stop):
        along = (column - a) / (b - a)
        for channel in range(3):
            value = (1.0 - along) * points.color[row, a, channel] + along * points.color[row, b, channel]
            points.color[row, column, channel] = max(0.0, value)
        between = (1.0 - along) * s + along * t
        # Through the lens plane disparity goes by way of infinity: keep to the nearer end there.
        straight = between * s > 0.0 and between * t > 0.0
        points.disparity[row, column] = between if straight else (s if along < 0.5 else t)
        points.fragile[row, column] = points.fragile[row, a] or points.fragile[row, b]
        points.status[row, column] = REPROJECTED
    return True


@inlined
def _want_middle(points: PointImage, row: int, begin: int, end: int, start: int, stop: int) -> None:
    if start == begin and stop == end:
        points.status[row, start] = WANTED
        points.status[row, stop - 1] = WANTED
    elif stop - start > 1:
        column = start if start == begin else (stop - 1 if stop == end else (start + stop) // 2)
        points.status[row, column] = WANTED


@inlined
def _take_nearest(points: PointImage, row: int, begin: int, end: int, start: int, stop: int) -> None:
    for column in range(start, stop):
        source = stop
        if stop == end or (start > begin and column - start + 1 <= stop - column):
            source = start - 1
        for channel in range(3):
            points.color[row, column, channel] = points.color[row, source, channel]
        points.disparity[row, column] = points.disparity[row, source]
        points.fragile[row, column] = points.fragile[row, source]
        points.status[row, column] = REPROJECTED


@uncounted
def average(
    first: int, last: int, points: PointImage, numbers: IntArray, left: IntArray, right: IntArray, rules: Rules
) -> None:
    """Give each pixel of the list ``numbers`` the mean colour of its corresponding pixels under the neighbouring
    lenses, ``left`` and ``right`` (linear numbers, -1 for none), or of the one that there is.

    Where ``careful``, pixels on which the neighbours disagree stay missed; without any neighbour they always do.
    """
    width = points.status.shape[1]
    for i in range(first, last):
        one, other = left[i], right[i]
        if one < 0 and other < 0:
            continue
        if one < 0 or other < 0:
            one = other = max(one, other)
        row, column = divmod(int(numbers[i]), width)
        one_row, one_column = divmod(one, width)
        other_row, other_column = divmod(other, width)
        if rules.careful and (
            one == other
            or points.fragile[one_row, one_column]
            or points.fragile[other_row, other_column]
            or color_difference(points.color, one_row, one_column, other_row, other_column, rules.coded)
            > TUNING.averaged_tolerance * rules.tolerance
        ):
            continue
        for channel in range(3):
            total = points.color[one_row, one_column, channel] + points.color[other_row, other_column, channel]
            points.color[row, column, channel] = np.float32(0.5) * total
        points.disparity[row, column] = points.disparity[one_row, one_column]
        points.status[row, column] = INTERPOLATED
