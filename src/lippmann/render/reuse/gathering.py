"""Points of finished micro-images gathered by others, pixel by pixel, for lenses of any layout. Compiled.

A pixel of the target sees along its light line; under another lens that line appears as a straight line of pixels, its
points in order of their height. The pixel walks along it, from the nearest point to the farthest, until the line enters
a surface that the other lens sees: there it has found its own point. Colour and disparity are taken between the four
pixels around that place, if these see one surface: no holes open up, and no colour is taken from half a pixel away.

Where the line passes an outline at its very depth, the nearer surface may reach further than its last pixel. And nearer
things that no source has seen are not known: therefore some pixels, the *probes*, are traced beforehand, on a wide grid
over the whole picture that comes to every row and column; a point farther away than what the probes around it have met
is not taken.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.render.reuse.compiled import compiled, inlined, uncounted
from lippmann.render.reuse.lens_field import LensField
from lippmann.render.reuse.points import BACKGROUND, REPROJECTED, TRACED, PointImage
from lippmann.render.reuse.rules import (
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

#: A root is found when the surface lies this near to the line, in pixels; farther away than the second it is none.
CLOSE, TOO_FAR = 0.02, 0.2
#: Pixels that stand for missing ones must have this share of a place together ...
SMALLEST_SHARE = 0.25
#: ... and be alike in colour to this part of the tolerance.
RIM_TOLERANCE = 0.4
#: Halvings of a step at most.
MOST_HALVINGS = 8


class Gathering(NamedTuple):
    """Who gathers from whom.

    Attributes
    ----------
    target:
        ``(lenses,)`` bool: lenses that gather.
    source:
        ``(lenses, n)`` lenses that they gather from, -1: none.
    probe_stride, probe_shift:
        Columns from one probe to the next in a row, and how far they move from row to row.
    probe_reach:
        Rows and columns from a pixel over which probes are asked.
    """

    target: NDArray[np.bool_]
    source: NDArray[np.int64]
    probe_stride: int
    probe_shift: int
    probe_reach: int


class Place(NamedTuple):
    """A place between four pixels under one lens.

    Attributes
    ----------
    found:
        Whether enough of the four belong to the lens, are known and see one surface.
    whole:
        Whether none is missing.
    row, column:
        Of the upper left one.
    a, b, c, d:
        Weights of upper left, upper right, lower left and lower right; 0 for those that have no say.
    disparity:
        Of the surface there.
    """

    found: bool
    whole: bool
    row: int
    column: int
    a: float
    b: float
    c: float
    d: float
    disparity: float


@uncounted
def mark_nearest(
    first_row: int, last_row: int, points: PointImage, field: LensField, target: Any, nearest: Any
) -> None:
    """Enter into ``nearest (H, W)`` the disparity of the nearest point in the 3x3 pixels around each pixel.

    Of those under the same lens, one of ``target (lenses,)``.
    """
    height, width = points.status.shape
    for row in range(first_row, last_row):
        for column in range(width):
            lens = field.lens[row, column]
            if not target[lens]:
                continue
            best = points.disparity[row, column]
            for r in range(max(0, row - 1), min(height, row + 2)):
                for c in range(max(0, column - 1), min(width, column + 2)):
                    if field.lens[r, c] == lens and nearer(points.disparity[r, c], best):
                        best = points.disparity[r, c]
            nearest[row, column] = best


@uncounted
def place_at(points: PointImage, field: LensField, lens: int, x: float, y: float) -> Place:
    """The place (x, y) under ``lens``. At the rim of a micro-image those pixels that there are stand for the others."""
    height, width = points.status.shape
    column, row = int(np.floor(x + ON_CENTER)), int(np.floor(y + ON_CENTER))
    u, v = x - column, y - row
    u = 0.0 if u < ON_CENTER else u
    v = 0.0 if v < ON_CENTER else v
    a, b, c, d = (1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v
    total, s, low, high = 0.0, 0.0, 0.0, 0.0
    count = 0
    for k in range(4):
        weight = a if k == 0 else (b if k == 1 else (c if k == 2 else d))
        if weight == 0.0:
            continue
        r, q = row + (k >> 1), column + (k & 1)
        inside = r >= 0 and r < height and q >= 0 and q < width
        if inside and field.lens[r, q] == lens and points.status[r, q] >= 0:
            t = np.float64(points.disparity[r, q])
            low, high = (min(low, t), max(high, t)) if count else (t, t)
            total += weight
            s += weight * t
            count += 1
        elif k == 0:
            a = 0.0
        elif k == 1:
            b = 0.0
        elif k == 2:
            c = 0.0
        else:
            d = 0.0
    whole = total > 1.0 - ON_CENTER
    found = (whole or (count > 1 and total >= SMALLEST_SHARE)) and alike(low, high, ONE_SURFACE)
    share = 1.0 / total if total > 0.0 else 0.0
    # Rounding must not put what is infinitely far away any farther or nearer.
    disparity = s * share if low < high else low
    return Place(found, whole, row, column, a * share, b * share, c * share, d * share, disparity)


@uncounted
def look_along(
    points: PointImage,
    field: LensField,
    nearest: Any,
    source: int,
    x: float,
    y: float,
    shift_x: float,
    shift_y: float,
) -> tuple[Place, float, float]:
    """Where the line of pixels ``(x, y) + s (shift_x, shift_y)`` under ``source`` enters a surface of disparity s.

    Returns
    -------
    place, disparity:
        The first such place, if it is ``found``.
    beside:
        Disparity of the nearest outline that the line has passed by at its depth; :data:`BACKGROUND` for none.
    """
    height, width = points.status.shape
    step = 1.0 / max(abs(shift_x), abs(shift_y))
    beside = BACKGROUND
    nothing = Place(False, False, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for behind in range(2):
        # Before the lens plane the line leads away from the place of infinite distance, behind it back to there.
        k, last = 0, 1 << 30
        if behind:
            while True:
                c = int(np.floor(x + (k - 1) * step * shift_x + 0.5))
                r = int(np.floor(y + (k - 1) * step * shift_y + 0.5))
                inside = c >= 0 and c < width and r >= 0 and r < height
                if k < -1 and not (inside and field.lens[r, c] == source):
                    break
                k -= 1
            last = 0
        in_front = not behind
        before, before_shown = 0.0, 0.0
        fresh = True
        while k <= last:
            s = k * step if k != 0 else (BACKGROUND if behind else -BACKGROUND)
            here_x, here_y = x + s * shift_x, y + s * shift_y
            c, r = int(np.floor(here_x + 0.5)), int(np.floor(here_y + 0.5))
            inside = c >= 0 and c < width and r >= 0 and r < height
            if not (inside and field.lens[r, c] == source):
                if not behind and k > 0:
                    break
                k += 1
                continue
            near = np.float64(nearest[r, c])
            if nearer(s, near):
                in_front = True
            else:
                passes = fresh or nearer(before, near)
                place = place_at(points, field, source, here_x, here_y)
                if place.found and nearer(s, place.disparity):
                    # A smooth surface is near, or a nearer one ends here.
                    if passes and not alike(near, place.disparity, ONE_SURFACE) and nearer(near, beside):
                        beside = near
                    in_front = True
                else:
                    # It comes out from behind another surface and enters this one within a step, or it was before it.
                    comes_out = not fresh and not alike(before_shown, place.disparity, ONE_SURFACE)
                    if place.found and (in_front or comes_out):
                        found, t = _enter(points, field, source, x, y, shift_x, shift_y, before, s)
                        if found.found:
                            return found, t, beside
                    if passes and not fresh and nearer(near, beside):
                        beside = near
                    in_front = False
            before, before_shown = s, np.float64(points.disparity[r, c])
            fresh = False
            k += 1
    return nothing, 0.0, beside


@uncounted
def _enter(
    points: PointImage,
    field: LensField,
    source: int,
    x: float,
    y: float,
    shift_x: float,
    shift_y: float,
    front: float,
    back: float,
) -> tuple[Place, float]:
    """Where between the disparities ``front`` (before the surface) and ``back`` (not before it) the line enters it."""
    pixels = max(abs(shift_x), abs(shift_y))
    place = place_at(points, field, source, x + back * shift_x, y + back * shift_y)
    s = back
    excess = s - place.disparity
    low, high = front, back
    low_excess, high_excess = np.nan, excess
    for _ in range(MOST_HALVINGS):
        if abs(excess) * pixels <= CLOSE:
            break
        s = 0.5 * (low + high)
        if not np.isnan(low_excess):
            s = low + (high - low) * low_excess / (low_excess - high_excess)
        elif abs(place.disparity - high) < abs(high - low):
            # At equal height the line enters where the surface is.
            s = place.disparity
        here = place_at(points, field, source, x + s * shift_x, y + s * shift_y)
        if not here.found:
            if place.found and abs(excess) * pixels <= TOO_FAR:
                break
            return here, s
        place = here
        excess = s - place.disparity
        if nearer(s, place.disparity):
            low, low_excess = s, excess
        else:
            high, high_excess = s, excess
    if abs(excess) * pixels > TOO_FAR:
        return Place(False, False, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0), s
    return place, place.disparity


@uncounted
def probed_limit(points: PointImage, field: LensField, row: int, column: int, gathering: Gathering) -> float:
    """Nothing farther than this disparity is to be expected at a pixel, say the probes around it; 0: no one knows."""
    height, width = points.status.shape
    stride, reach = gathering.probe_stride, gathering.probe_reach
    nearest, farthest = 0.0, 0.0
    for r in range(max(0, row - reach), min(height, row + reach + 1)):
        left = max(0, column - reach)
        c = left + (r * gathering.probe_shift - left) % stride
        while c <= column + reach and c < width:
            if field.lens[r, c] == field.lens[row, column] and points.status[r, c] == TRACED:
                s = np.float64(points.disparity[r, c])
                if nearest == 0.0:
                    nearest, farthest = s, s
                elif nearer(s, nearest):
                    nearest = s
                elif nearer(farthest, s):
                    farthest = s
            c += stride
    # Probes that see one surface vouch for all of it; between different ones only the nearer is sure.
    return farthest if alike(nearest, farthest, ONE_PROBED_SURFACE) else nearest


@inlined
def is_trusted(points: PointImage, place: Place, rules: Rules) -> bool:
    """Whether the colour at a place may be seen from elsewhere: no pixel of it is fragile, no edge runs through it."""
    first_row, first_column = -1, -1
    trusted = True
    tolerance = rules.tolerance if place.whole else RIM_TOLERANCE * rules.tolerance
    for k in range(4):
        weight = place.a if k == 0 else (place.b if k == 1 else (place.c if k == 2 else place.d))
        if weight == 0.0:
            continue
        r, c = place.row + (k >> 1), place.column + (k & 1)
        if points.fragile[r, c]:
            trusted = False
        if first_row < 0:
            first_row, first_column = r, c
        elif color_difference(points.color, r, c, first_row, first_column, rules.coded) > tolerance:
            trusted = False
    return trusted


@inlined
def color_at(points: PointImage, place: Place, channel: int) -> float:
    """A channel of the colour at a place."""
    value = 0.0
    for k in range(4):
        weight = place.a if k == 0 else (place.b if k == 1 else (place.c if k == 2 else place.d))
        if weight != 0.0:
            value += weight * points.color[place.row + (k >> 1), place.column + (k & 1), channel]
    return value


@compiled
def gather(
    first_row: int,
    last_row: int,
    points: PointImage,
    field: LensField,
    gathering: Gathering,
    rules: Rules,
    nearest: Any,
    unsettled: Any,
) -> None:
    """Give the pixels of the targets the points of their sources.

    Pixels that get a point become :data:`REPROJECTED`; traced ones stay as they are. ``nearest (H, W)`` as of
    :func:`mark_nearest`; ``unsettled (H, runs)`` says which stretches of the targets have missed pixels left.
    """
    sources = gathering.source.shape[1]
    depth = np.empty(sources)
    share = np.empty(sources)
    color = np.empty((sources, 3))
    for row in range(first_row, last_row):
        for run in range(unsettled.shape[1]):
            begin, end = field.first[row, run], field.first[row, run + 1]
            if begin == end or not gathering.target[field.lens[row, begin]]:
                continue
            missed = 0
            for column in range(begin, end):
                if points.status[row, column] != TRACED:
                    got = _gather_pixel(points, field, gathering, rules, nearest, row, column, depth, share, color)
                    missed += not got
            unsettled[row, run] = missed > 0


@uncounted
def _gather_pixel(
    points: PointImage,
    field: LensField,
    gathering: Gathering,
    rules: Rules,
    nearest: Any,
    row: int,
    column: int,
    depth: Any,
    share: Any,
    color: Any,
) -> bool:
    lens = field.lens[row, column]
    front = 0.0
    outlines, seen, asked = 0, 0, 0
    beside_nearest = BACKGROUND
    doubted = 0
    for k in range(len(depth)):
        share[k] = 0.0
        source = gathering.source[lens, k]
        if source < 0:
            continue
        shift_x = field.center[source, 0] - field.center[lens, 0]
        shift_y = field.center[source, 1] - field.center[lens, 1]
        place, s, beside = look_along(points, field, nearest, source, column + shift_x, row + shift_y, shift_x, shift_y)
        asked += 1
        if beside != BACKGROUND:
            outlines += 1
            if nearer(beside, beside_nearest):
                beside_nearest = beside
        if not place.found:
            continue
        seen += 1
        depth[k] = s
        share[k] = 1.0 / np.sqrt(shift_x * shift_x + shift_y * shift_y)
        if front == 0.0 or nearer(s, front):
            front = s
        if rules.careful and not is_trusted(points, place, rules):
            # Only what is taken in the end must be trusted.
            doubted |= 1 << k
        for channel in range(3):
            color[k, channel] = color_at(points, place, channel)
    if seen == 0:
        return False
    total, mean = 0.0, 0.0
    for k in range(len(depth)):
        if share[k] > 0.0 and not alike(depth[k], front, ONE_POINT):
            share[k] = 0.0
        if share[k] > 0.0 and doubted >> k & 1:
            return False
        total += share[k]
        mean += share[k] * depth[k]
    mean /= total
    limit = probed_limit(points, field, row, column, gathering)
    if limit != 0.0 and nearer(limit, mean) and not alike(limit, mean, ONE_PROBED_SURFACE):
        return False
    if nearer(beside_nearest, mean) and (rules.careful or outlines == asked):
        return False
    for channel in range(3):
        value, low, high = 0.0, np.inf, -np.inf
        for k in range(len(depth)):
            if share[k] > 0.0:
                value += share[k] * color[k, channel]
                low, high = min(low, color[k, channel]), max(high, color[k, channel])
        if rules.careful and coded_value(high, rules.coded) - coded_value(low, rules.coded) > rules.tolerance:
            return False
        points.color[row, column, channel] = value / total
    points.disparity[row, column] = mean
    points.status[row, column] = REPROJECTED
    return True
