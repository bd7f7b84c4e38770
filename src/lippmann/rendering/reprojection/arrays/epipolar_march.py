"""Along a line of sight as another lens sees it, to the first surface there. Compiled."""

from __future__ import annotations

import numpy as np

from lippmann.rendering.reprojection.arrays.bilinear import Place, place_at
from lippmann.rendering.reprojection.common.array_types import IntArray, RealArray
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.point_image import BACKGROUND, PointImage
from lippmann.rendering.reprojection.common.thresholds import alike, nearer
from lippmann.rendering.reprojection.common.tuning import TUNING
from lippmann.runtime.numba_jit import uncounted


@uncounted
def mark_nearest(
    first_row: int, last_row: int, points: PointImage, field: LensField, target: IntArray, nearest: RealArray
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
def look_along(
    points: PointImage,
    field: LensField,
    nearest: RealArray,
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
                    if passes and not alike(near, place.disparity, TUNING.one_surface) and nearer(near, beside):
                        beside = near
                    in_front = True
                else:
                    # It comes out from behind another surface and enters this one within a step, or it was before it.
                    comes_out = not fresh and not alike(before_shown, place.disparity, TUNING.one_surface)
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
    for _ in range(8):
        if abs(excess) * pixels <= TUNING.close:
            break
        s = 0.5 * (low + high)
        if not np.isnan(low_excess):
            s = low + (high - low) * low_excess / (low_excess - high_excess)
        elif abs(place.disparity - high) < abs(high - low):
            # At equal height the line enters where the surface is.
            s = place.disparity
        here = place_at(points, field, source, x + s * shift_x, y + s * shift_y)
        if not here.found:
            if place.found and abs(excess) * pixels <= TUNING.too_far:
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
