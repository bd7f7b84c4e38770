"""Reprojection under straight cylindrical lenses, row by row, compiled.

There a row of pixels is a world of its own (an epipolar plane): a point at height z that lens c shows at panel position
u = c + o appears under lens c' at ``c' + o + (c' - c) g / z``. Two neighbouring pixels of one micro-image that see one
smooth surface are the ends of a piece of it, and the piece is drawn into the other micro-image with its colour and
depth in between: no holes open up, and no colour is taken from half a pixel away.

Where ``careful``, what reprojection would falsify is left to be traced: pieces whose ends differ in colour by more than
a tolerance (the edge of a texture, of a shadow, of a highlight), points marked fragile, and the last pixel before an
outline, into which the nearer surface may still reach.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display
from lippmann.render.reuse.points import MISSED, REPROJECTED, PointImage

#: Internal: a point reached the pixel, but its colour must not be used.
_FALSIFIED = -2
#: A piece stretched to more than this many pixels is no surface but the gap between two.
_LONGEST_PIECE = 1.75


@dataclass(frozen=True)
class Rows:
    """Where the columns of a straight lenticular display lie, in mm: pixel centres, lens centres, and the first column
    of each micro-image (one more than there are lenses)."""

    x: NDArray[np.float64]
    centers: NDArray[np.float64]
    first: NDArray[np.int64]
    gap: float
    pitch: float

    @staticmethod
    def of(display: Display) -> Rows:
        """The columns of ``display``, which must be lenticular without slant."""
        columns = np.arange(display.panel.width)
        x, y = display.panel_point(columns + 0.5, np.full(columns.shape, 0.5), NUMPY)
        i, j = display.lens_of(x, y, NUMPY)
        lenses = np.arange(display.lens_grid.columns + 1)
        first = np.searchsorted(i, lenses)
        # Pixel offsets are taken on the panel: the lens's own point there is where the line from the viewer's point
        # through its centre arrives.
        middle = np.zeros(len(lenses) - 1)
        centers, _ = display.lens_center(lenses[:-1].astype(float), middle, middle, middle, NUMPY)
        return Rows(x, np.asarray(centers), first.astype(np.int64), display.gap, display.panel.pixel_pitch)


def warp(
    points: PointImage,
    rows: Rows,
    targets: NDArray[np.int64],
    sources: NDArray[np.int64],
    *,
    careful: bool,
    tolerance: float,
    coded: bool,
    key_rows: int,
) -> NDArray[np.uint32]:
    """Draw the points of the source lenses into the target lenses.

    Parameters
    ----------
    targets, sources:
        ``(n,)`` lens indices, and ``(n, 2)`` those that each receives from (-1: none).
    careful, tolerance, coded:
        Whether to leave what would be falsified; the colour difference that counts as such; whether colours are
        compared on a scale like the eye's (square root) or as they are.

    Returns
    -------
    Linear numbers of the target lenses' pixels that are still missed, row by row.
    """
    counts = np.zeros(points.z.shape[0], dtype=np.int64)
    _warp(
        points.color,
        points.z,
        points.fragile,
        points.status,
        rows.x,
        rows.centers,
        rows.first,
        rows.gap,
        rows.pitch,
        targets,
        sources,
        careful,
        tolerance,
        coded,
        key_rows,
        counts,
    )
    return list_missed(points, rows, targets, counts)


def list_missed(
    points: PointImage, rows: Rows, targets: NDArray[np.int64], counts: NDArray[np.int64]
) -> NDArray[np.uint32]:
    """Linear numbers of the missed pixels of ``targets``; ``counts`` says how many each row has."""
    ends = np.cumsum(counts)
    missed = np.empty(int(ends[-1]), dtype=np.uint32)
    _list_missed(points.status, rows.first, targets, ends - counts, missed)
    return missed


def all_pixels(points: PointImage, rows: Rows, targets: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Linear numbers of all pixels of ``targets``, which nothing has reached yet."""
    per_row = int((rows.first[targets + 1] - rows.first[targets]).sum())
    return list_missed(points, rows, targets, np.full(points.z.shape[0], per_row, dtype=np.int64))


@njit(cache=True, inline="always")
def _apart(color: Any, row: int, a: int, b: int, tolerance: float, coded: bool) -> bool:
    for channel in range(3):
        one, other = min(max(color[row, a, channel], 0.0), 1.0), min(max(color[row, b, channel], 0.0), 1.0)
        if coded:
            one, other = np.sqrt(one), np.sqrt(other)
        if abs(one - other) > tolerance:
            return True
    return False


@njit(cache=True, inline="always")
def _certain(z_above: float, z_below: float, slope: float, depth: float, gap: float, width: int) -> bool:
    """Whether nothing nearer than a point is to be expected at its pixel, by what the key rows show there.

    Rows between two key rows that see one surface see that surface; between two that see different ones, an outline
    passes, and only the nearer of them is taken without tracing. Depths are compared by their disparity, in pixels
    from lens to lens.
    """
    slope_above = 0.0 if z_above == -np.inf else gap / z_above
    slope_below = 0.0 if z_below == -np.inf else gap / z_below
    apart = abs(slope_above - slope_below) * width
    one_surface = apart <= 0.75 and (z_above == -np.inf) == (z_below == -np.inf)
    bound = min(z_above, z_below) if one_surface else max(z_above, z_below)
    if bound == -np.inf or depth >= bound:
        return True
    if depth == -np.inf:
        return False
    return abs(slope - gap / bound) * width <= 0.35


@njit(cache=True, parallel=True)
def _warp(
    color: Any,
    z: Any,
    fragile: Any,
    status: Any,
    x: Any,
    centers: Any,
    first: Any,
    gap: float,
    pitch: float,
    targets: Any,
    sources: Any,
    careful: bool,
    tolerance: float,
    coded: bool,
    key_rows: int,
    counts: Any,
) -> None:
    height = z.shape[0]
    for row in prange(height):
        counts[row] = 0
        if key_rows > 0 and (row % key_rows == 0 or row == height - 1):
            continue
        missed = 0
        above = (row // key_rows) * key_rows if key_rows > 0 else 0
        below = min(above + key_rows, height - 1) if key_rows > 0 else 0
        for t in range(len(targets)):
            lens = targets[t]
            begin, end = first[lens], first[lens + 1]
            far = end - begin
            for s in range(sources.shape[1]):
                source = sources[t, s]
                if source < 0:
                    continue
                shift = centers[lens] - centers[source]
                known = False
                before, slope_before = 0.0, 0.0
                for k in range(first[source], first[source + 1]):
                    if status[row, k] < 0:
                        known = False
                        continue
                    slope = 0.0 if z[row, k] == -np.inf else gap / z[row, k]
                    # Panel position under the target lens, in pixels from its first pixel centre.
                    here = (x[k] + shift + shift * slope - x[begin]) / pitch
                    if known:
                        length = here - before
                        both_far = slope == 0.0 and slope_before == 0.0
                        joined = 0.0 < length <= _LONGEST_PIECE and (both_far or slope * slope_before != 0.0)
                        if joined:
                            low = max(0, int(np.ceil(before)))
                            high = min(end - begin - 1, int(np.floor(here)))
                            if low <= high:
                                bad = careful and (
                                    fragile[row, k]
                                    or fragile[row, k - 1]
                                    or _apart(color, row, k - 1, k, tolerance, coded)
                                )
                                for place in range(low, high + 1):
                                    w = (place - before) / length
                                    between = slope_before + w * (slope - slope_before)
                                    depth = -np.inf if both_far else gap / between
                                    p = begin + place
                                    if (status[row, p] == MISSED or depth > z[row, p]) and (
                                        key_rows <= 0 or _certain(z[above, p], z[below, p], between, depth, gap, far)
                                    ):
                                        z[row, p] = depth
                                        if bad:
                                            status[row, p] = _FALSIFIED
                                        else:
                                            status[row, p] = REPROJECTED
                                            for channel in range(3):
                                                color[row, p, channel] = (1 - w) * color[
                                                    row, k - 1, channel
                                                ] + w * color[row, k, channel]
                        elif careful:
                            # The nearer of the two surfaces may reach one pixel further than its last point.
                            if z[row, k - 1] >= z[row, k]:
                                low, high, depth = before, before + 1.0, z[row, k - 1]
                            else:
                                low, high, depth = here - 1.0, here, z[row, k]
                            for place in range(max(0, int(np.ceil(low))), min(end - begin - 1, int(np.floor(high))) + 1):
                                p = begin + place
                                if status[row, p] == MISSED or depth > z[row, p]:
                                    z[row, p] = depth
                                    status[row, p] = _FALSIFIED
                    before, slope_before, known = here, slope, True
            if not careful and key_rows <= 0:
                _nearest(color, z, status, x, centers, first, gap, pitch, sources[t], lens, row)
            for p in range(begin, end):
                if status[row, p] < 0:
                    status[row, p] = MISSED
                    missed += 1
        counts[row] = missed


@njit(cache=True)
def _nearest(
    color: Any,
    z: Any,
    status: Any,
    x: Any,
    centers: Any,
    first: Any,
    gap: float,
    pitch: float,
    sources: Any,
    lens: int,
    row: int,
) -> None:
    """The paper's own rule for what no piece has reached: a point fills the pixel that it falls into, nearest wins."""
    begin, end = first[lens], first[lens + 1]
    for s in range(len(sources)):
        source = sources[s]
        if source < 0:
            continue
        shift = centers[lens] - centers[source]
        for k in range(first[source], first[source + 1]):
            if status[row, k] < 0:
                continue
            slope = 0.0 if z[row, k] == -np.inf else gap / z[row, k]
            place = int(np.floor((x[k] + shift + shift * slope - x[begin]) / pitch + 0.5))
            if place < 0 or place >= end - begin:
                continue
            p = begin + place
            if status[row, p] == MISSED or (status[row, p] == REPROJECTED and z[row, k] > z[row, p] + 1e-3 * abs(z[row, p])):
                status[row, p] = REPROJECTED
                z[row, p] = z[row, k]
                for channel in range(3):
                    color[row, p, channel] = color[row, k, channel]


@njit(cache=True, parallel=True)
def _list_missed(status: Any, first: Any, targets: Any, starts: Any, missed: Any) -> None:
    height, width = status.shape
    for row in prange(height):
        place = starts[row]
        for t in range(len(targets)):
            for p in range(first[targets[t]], first[targets[t] + 1]):
                if status[row, p] < 0:
                    missed[place] = row * width + p
                    place += 1
