"""March along an epipolar line to the first surface, with bilinear interpolation between pixels. Compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.point_image import BACKGROUND, IntArray, PointImage, RealArray
from lippmann.rendering.reprojection.rules import Rules, alike, color_difference, nearer
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.runtime.numba_jit import inlined, uncounted


class Place(NamedTuple):
    """A place between four pixels under one lens, for bilinear interpolation.

    Attributes
    ----------
    is_known:
        Whether enough of the four pixels belong to the lens, are known and see one surface.
    whole:
        Whether all four do.
    row, column:
        Of the upper left one.
    a, b, c, d:
        Weights of upper left, upper right, lower left and lower right; 0 for pixels that do not count.
    disparity:
        Of the surface there.
    """

    is_known: bool
    whole: bool
    row: int
    column: int
    a: float
    b: float
    c: float
    d: float
    disparity: float


@uncounted
def place_at(points: PointImage, field: LensField, lens: int, x: float, y: float) -> Place:
    """Bilinear weights and disparity at (x, y) under ``lens``; at its border from the pixels inside alone."""
    height, width = points.status.shape
    column, row = int(np.floor(x + TUNING.on_center)), int(np.floor(y + TUNING.on_center))
    u, v = x - column, y - row
    u = 0.0 if u < TUNING.on_center else u
    v = 0.0 if v < TUNING.on_center else v
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
    whole = total > 1.0 - TUNING.on_center
    is_known = (whole or (count > 1 and total >= TUNING.smallest_share)) and alike(low, high, TUNING.one_surface)
    share = 1.0 / total if total > 0.0 else 0.0
    # Equal disparities must not be rounded: background is recognised by its exact value.
    disparity = s * share if low < high else low
    return Place(is_known, whole, row, column, a * share, b * share, c * share, d * share, disparity)


@inlined
def is_trusted(points: PointImage, place: Place, rules: Rules) -> bool:
    """Whether the colour at a place may be reprojected: no pixel is fragile, no edge runs through it."""
    first_row, first_column = -1, -1
    trusted = True
    tolerance = rules.tolerance if place.whole else TUNING.part_tolerance * rules.tolerance
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


@uncounted
def mark_nearest(
    first_row: int, last_row: int, points: PointImage, field: LensField, target: IntArray, nearest: RealArray
) -> None:
    """Set ``nearest (H, W)`` to the disparity of the nearest point in the 3x3 pixels around each pixel of its lens.

    For pixels of the lenses in the mask ``target (lenses,)``.
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
def march(
    points: PointImage,
    field: LensField,
    nearest: RealArray,
    source: int,
    x: float,
    y: float,
    shift_x: float,
    shift_y: float,
) -> tuple[Place, float, float]:
    """First place at which the epipolar line ``(x, y) + s (shift_x, shift_y)`` under ``source`` enters a surface.

    Returns
    -------
    place, disparity:
        The place, and s there; ``is_known`` is False if there is none.
    beside:
        Disparity of the nearest outline that the line passes at its depth; :data:`BACKGROUND` for none.
    """
    height, width = points.status.shape
    step = 1.0 / max(abs(shift_x), abs(shift_y))
    beside = BACKGROUND
    nothing = Place(False, False, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for behind in range(2):
        # In front of the lens plane s runs from 0 (infinity) upwards, behind it from the far end back to 0.
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
        before, previous_disparity = 0.0, 0.0
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
                if place.is_known and nearer(s, place.disparity):
                    # The place lies in front of a smooth surface, or beside the outline of a nearer one.
                    if passes and not alike(near, place.disparity, TUNING.one_surface) and nearer(near, beside):
                        beside = near
                    in_front = True
                else:
                    # The line enters the surface from in front, or from behind another one within this step.
                    comes_out = not fresh and not alike(previous_disparity, place.disparity, TUNING.one_surface)
                    if place.is_known and (in_front or comes_out):
                        entry, t = _enter(points, field, source, x, y, shift_x, shift_y, before, s)
                        if entry.is_known:
                            return entry, t, beside
                    if passes and not fresh and nearer(near, beside):
                        beside = near
                    in_front = False
            before, previous_disparity = s, np.float64(points.disparity[r, c])
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
    """Intersection of the line with a surface, by regula falsi between the disparities ``front`` and ``back`` (behind
    it).

    Returns the place and its disparity.
    """
    pixels = max(abs(shift_x), abs(shift_y))
    place = place_at(points, field, source, x + back * shift_x, y + back * shift_y)
    s = back
    excess = s - place.disparity
    low, high = front, back
    low_excess, high_excess = np.nan, excess
    for _ in range(8):
        if abs(excess) * pixels <= TUNING.close:
            break
        s = 0.5 * (low + high)
        if not np.isnan(low_excess):
            s = low + (high - low) * low_excess / (low_excess - high_excess)
        elif abs(place.disparity - high) < abs(high - low):
            # The first step jumps to the surface's own height.
            s = place.disparity
        here = place_at(points, field, source, x + s * shift_x, y + s * shift_y)
        if not here.is_known:
            if place.is_known and abs(excess) * pixels <= TUNING.too_far:
                break
            return here, s
        place = here
        excess = s - place.disparity
        if nearer(s, place.disparity):
            low, low_excess = s, excess
        else:
            high, high_excess = s, excess
    if abs(excess) * pixels > TUNING.too_far:
        return Place(False, False, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0), s
    return place, place.disparity
