"""Places between the pixels of a micro-image: which surface is there, and in which colour. Compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.point_image import PointImage
from lippmann.rendering.reprojection.common.thresholds import Rules, alike, color_difference
from lippmann.rendering.reprojection.common.tuning import TUNING
from lippmann.runtime.numba_jit import inlined, uncounted


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
def place_at(points: PointImage, field: LensField, lens: int, x: float, y: float) -> Place:
    """The place (x, y) under ``lens``. At the rim of a micro-image those pixels that there are stand for the others."""
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
    found = (whole or (count > 1 and total >= TUNING.smallest_share)) and alike(low, high, TUNING.one_surface)
    share = 1.0 / total if total > 0.0 else 0.0
    # Rounding must not put what is infinitely far away any farther or nearer.
    disparity = s * share if low < high else low
    return Place(found, whole, row, column, a * share, b * share, c * share, d * share, disparity)


@inlined
def is_trusted(points: PointImage, place: Place, rules: Rules) -> bool:
    """Whether the colour at a place may be seen from elsewhere: no pixel of it is fragile, no edge runs through it."""
    first_row, first_column = -1, -1
    trusted = True
    tolerance = rules.tolerance if place.whole else TUNING.rim_tolerance * rules.tolerance
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
