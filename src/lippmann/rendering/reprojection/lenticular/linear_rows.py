"""Plain rows of micro-images, and the short way to reproject them. Compiled.

Most rows of a micro-image see one flat piece of one surface, or nothing but the background: disparity runs along a
straight line. Between two such rows there is nothing to sort: each pixel of the target asks either source for the place
where it shows the same point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.reprojection.common.array_types import IntArray, RealArray
from lippmann.rendering.reprojection.common.epipolar_rows import Rows
from lippmann.rendering.reprojection.common.point_image import REPROJECTED, TRACED, PointImage
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
from lippmann.runtime.numba_jit import compiled, inlined, uncounted

#: A row is plain if no disparity leaves the line by more than this: a tenth of a pixel, half a hundred pixels away.
STRAIGHT = 0.002

#: Pixels by which a row may be stretched at its ends and still count as merely shifted.
EVEN = 0.1


class Lines(NamedTuple):
    """Disparity ``start + slope * place`` of the rows of micro-images, each ``(H, lenses)`` float32.

    ``start`` is not a number where a row is not plain.
    """

    start: NDArray[np.float32]
    slope: NDArray[np.float32]

    @classmethod
    def empty(cls, height: int, lenses: int) -> Lines:
        """No row is plain."""
        return cls(np.full((height, lenses), np.nan, np.float32), np.zeros((height, lenses), np.float32))


@uncounted
def find_plain(
    first_row: int, last_row: int, points: PointImage, rows: Rows, lenses: IntArray, rules: Rules, lines: Lines
) -> None:
    """Enter the plain rows of the micro-images ``lenses`` into ``lines``."""
    for row in range(first_row, last_row):
        for i in range(len(lenses)):
            lens = lenses[i]
            begin, end = rows.first[lens], rows.first[lens + 1]
            if end - begin < 2 or points.status[row, begin] < 0 or points.status[row, end - 1] < 0:
                continue
            start = np.float64(points.disparity[row, begin])
            stop = np.float64(points.disparity[row, end - 1])
            slope = (stop - start) / (end - 1 - begin)
            if abs(slope) > ONE_SURFACE * min(abs(start), abs(stop)):
                continue
            plain = True
            for column in range(begin, end):
                leaves = abs(points.disparity[row, column] - (start + slope * (column - begin))) > STRAIGHT
                if leaves or points.status[row, column] < 0:
                    plain = False
                    break
            if plain and rules.careful:
                plain = not points.fragile[row, begin]
                for column in range(begin + 1, end):
                    edge = color_difference(points.color, row, column - 1, row, column, rules.coded) > rules.tolerance
                    if edge or points.fragile[row, column]:
                        plain = False
                        break
            if plain:
                lines.start[row, lens] = start
                lines.slope[row, lens] = slope


@inlined
def draw_plain(
    points: PointImage,
    row: int,
    has_probes: bool,
    where: IntArray,
    shifts: RealArray,
    t: int,
    rules: Rules,
    lines: Lines,
    limit: float,
) -> int:
    """Reproject one row of a micro-image from plain rows of its sources.

    Parameters
    ----------
    where, shifts:
        Rows ``t`` of what :func:`prepare` gives.
    limit:
        Nothing farther than this disparity is to be expected (0: nothing is known).

    Returns
    -------
    1 if pixels are still missed, 0 if not, -1 if it is not as simple as that and nothing has been done.
    """
    left, right = where[t, 0], where[t, 1]
    a, b = np.float64(lines.start[row, left]), np.float64(lines.start[row, right])
    if not (a == a and b == b):
        return -1
    a_slope, b_slope = np.float64(lines.slope[row, left]), np.float64(lines.slope[row, right])
    # Where the first pixel of a source is seen, and how far apart its pixels are there.
    a_first, a_step = shifts[t, 0] + shifts[t, 1] * a, 1.0 + shifts[t, 1] * a_slope
    b_first, b_step = shifts[t, 2] + shifts[t, 3] * b, 1.0 + shifts[t, 3] * b_slope
    if not (0.25 < a_step < 4.0 and 0.25 < b_step < 4.0):
        return -1
    a_per, b_per = 1.0 / a_step, 1.0 / b_step
    begin, count = where[t, 2], where[t, 3]
    s, t_first = a - a_slope * a_first * a_per, b - b_slope * b_first * b_per
    s_last, t_last = s + a_slope * (count - 1) * a_per, t_first + b_slope * (count - 1) * b_per
    if not (alike(s, t_first, ONE_POINT) and alike(s_last, t_last, ONE_POINT)):
        return -1
    behind = limit != 0.0 and (nearer(limit, s) or nearer(limit, s_last))
    if behind and not (alike(limit, s, ONE_PROBED_SURFACE) and alike(limit, s_last, ONE_PROBED_SURFACE)):
        return -1

    weight = np.float32(shifts[t, 4])
    a_begin, a_last, b_begin, b_last = where[t, 4], where[t, 5], where[t, 6], where[t, 7]
    color = points.color
    missed = 0
    low, high = count, count - 1
    if not (rules.careful or has_probes):
        low, high = _copy_shifted(
            points, row, begin, count, a_begin, a_last, a_first, a_step, b_begin, b_last, b_first, b_step, weight
        )
        for place in range(low, high + 1):
            points.disparity[row, begin + place] = s + place * (a_slope * a_per)
            points.status[row, begin + place] = REPROJECTED
    for place in range(count):
        if low <= place <= high:
            continue
        p, q = (place - a_first) * a_per, (place - b_first) * b_per
        column = begin + place
        if has_probes and points.status[row, column] == TRACED:
            continue
        from_left = -ON_CENTER <= p <= a_last + ON_CENTER
        from_right = -ON_CENTER <= q <= b_last + ON_CENTER
        if not (from_left or from_right):
            missed = 1
            continue
        # Where a source does not reach, its share is nothing and its end stands for it.
        i, j = int(min(max(p, 0.0), a_last - 1.0)), int(min(max(q, 0.0), b_last - 1.0))
        u, v = np.float32(p - i), np.float32(q - j)
        i += a_begin
        j += b_begin
        share = weight if from_left and from_right else (np.float32(1.0) if from_left else np.float32(0.0))
        apart = 0.0
        for channel in range(3):
            one, other = color[row, i, channel], color[row, j, channel]
            one += u * (color[row, i + 1, channel] - one)
            other += v * (color[row, j + 1, channel] - other)
            if rules.careful and from_left and from_right:
                apart = max(apart, abs(coded_value(one, rules.coded) - coded_value(other, rules.coded)))
            color[row, column, channel] = share * one + (np.float32(1.0) - share) * other
        if apart > rules.tolerance:
            missed = 1
            continue
        points.disparity[row, column] = a + a_slope * p if from_left else b + b_slope * q
        points.status[row, column] = REPROJECTED
    return missed


@inlined
def _copy_shifted(
    points: PointImage,
    row: int,
    begin: int,
    count: int,
    a_begin: int,
    a_last: int,
    a_first: float,
    a_step: float,
    b_begin: int,
    b_last: int,
    b_first: float,
    b_step: float,
    weight: np.float32,
) -> tuple[int, int]:
    """Blend colours of two sources whose pixels lie as far apart in the target as in themselves, to a tenth of one.

    That is the same shift for all, and numbers in a row for the processor. Returns the first and last place that both
    sources reach; nothing is done, and the last comes before the first, where there is none or the shift is not even.
    """
    middle = 0.5 * (count - 1)
    if abs(a_step - 1.0) * middle > EVEN or abs(b_step - 1.0) * middle > EVEN:
        return count, count - 1
    a_shift, b_shift = (middle - a_first) / a_step - middle, (middle - b_first) / b_step - middle
    if abs(a_shift - np.rint(a_shift)) < 2.0 * ON_CENTER:
        a_shift = np.rint(a_shift)
    if abs(b_shift - np.rint(b_shift)) < 2.0 * ON_CENTER:
        b_shift = np.rint(b_shift)
    low = max(0, int(np.ceil(-a_shift)), int(np.ceil(-b_shift)))
    high = min(count - 1, int(np.floor(a_last - a_shift)), int(np.floor(b_last - b_shift)))
    if low > high:
        return count, count - 1
    i, j = np.floor(a_shift), np.floor(b_shift)
    u, v = np.float32(a_shift - i), np.float32(b_shift - j)
    one = np.float32(1.0)
    a_weight, b_weight = weight * (one - u), (one - weight) * (one - v)
    a_next, b_next = weight * u, (one - weight) * v
    color = points.color.reshape(-1)
    start = row * points.color.shape[1]
    # Unsigned numbers are not checked for being counted from the end.
    out = np.uintp(3 * (start + begin + low))
    a = np.uintp(3 * (start + a_begin + low + int(i)))
    b = np.uintp(3 * (start + b_begin + low + int(j)))
    # A shift by whole pixels must not look beyond the last one.
    a_step_on, b_step_on = np.uintp(3 if u > 0 else 0), np.uintp(3 if v > 0 else 0)
    for k in range(np.uintp(3 * (high - low + 1))):
        color[out + k] = (
            a_weight * color[a + k]
            + a_next * color[a + a_step_on + k]
            + b_weight * color[b + k]
            + b_next * color[b + b_step_on + k]
        )
    return low, high


@compiled
def prepare(rows: Rows, targets: IntArray, sources: IntArray) -> tuple[IntArray, RealArray]:
    """What :func:`draw_plain` needs of each target with sources on both sides, said once for all rows.

    Returns
    -------
    ``(n, 8)`` whole numbers: left and right source, the target's first column and width, then for either source its
    first column and the place of its last. ``(n, 5)``: for either source the place of its first pixel without
    parallax, and the places that disparity 1 moves it by; the left source's share.
    """
    where = np.zeros((len(targets), 8), np.int64)
    shifts = np.zeros((len(targets), 5))
    for t in range(len(targets)):
        lens = targets[t]
        where[t, 2], where[t, 3] = rows.first[lens], rows.first[lens + 1] - rows.first[lens]
        for side in range(2):
            source = sources[t, side]
            where[t, side] = source
            if source >= 0:
                where[t, 4 + 2 * side] = rows.first[source]
                where[t, 5 + 2 * side] = rows.first[source + 1] - rows.first[source] - 1
                shifts[t, 2 * side] = rows.offset[source] - rows.offset[lens]
                shifts[t, 2 * side + 1] = rows.center[lens] - rows.center[source]
        shifts[t, 4] = shifts[t, 3] / (shifts[t, 3] - shifts[t, 1]) if shifts[t, 3] != shifts[t, 1] else 0.5
    return where, shifts
