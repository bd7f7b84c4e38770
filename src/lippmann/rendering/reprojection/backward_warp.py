"""Backward warp: pixels of target micro-images gather points from finished ones, for lenses of any layout. Compiled.

The light line of a target pixel appears under another lens as an epipolar line of pixels, ordered by height. The pixel
marches along it from the nearest point to the farthest, until the line enters a surface that the source lens sees.
Colour and disparity are interpolated bilinearly there, if the four pixels see one surface. So there are no holes and no
offsets of half a pixel.

Where the line passes an outline at its depth, the nearer surface may extend beyond its last pixel. And occluders that
no source has seen are unknown: so some pixels, the *probes*, are traced beforehand, on a sparse grid that visits every
row and column. Points farther away than the probes around them are rejected.
"""

from __future__ import annotations

from math import gcd, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.epipolar_march import color_at, is_trusted, march, mark_nearest
from lippmann.rendering.reprojection.point_image import BACKGROUND, QUEUED, REPROJECTED, TRACED, PointImage, RealArray
from lippmann.rendering.reprojection.rules import Rules, alike, coded_value, is_behind, limit_of_probes, nearer, widen
from lippmann.rendering.reprojection.schedule import Lenses, Step
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.runtime.numba_jit import compiled, uncounted
from lippmann.runtime.row_threads import Bands


class Gathering(NamedTuple):
    """Targets and sources of a step, and the grid of probes.

    Attributes
    ----------
    target:
        ``(lenses,)`` bool: lenses that gather.
    source:
        ``(lenses, n)`` lenses that they gather from, -1: none.
    probe_stride, probe_shift:
        Columns from one probe to the next in a row, and how far they move from row to row.
    probe_reach:
        Rows and columns around a pixel whose probes count.
    """

    target: NDArray[np.bool_]
    source: NDArray[np.int64]
    probe_stride: int
    probe_shift: int
    probe_reach: int


class BackwardWarp:
    """Makes micro-images of lenses of any layout from others."""

    def __init__(self, points: PointImage, field: LensField, bands: Bands, rules: Rules) -> None:
        self._points = points
        self._field = field
        self._bands = bands
        self._rules = rules
        self._probe_stride = rules.probe_stride
        self._probe_shift = scatter_shift(self._probe_stride)
        self._nearest = np.zeros(points.status.shape, dtype=np.float32)

    def probes(self, row: int) -> NDArray[np.int64]:
        """Columns of the probes in a row."""
        return np.arange(row * self._probe_shift % self._probe_stride, self._field.lens.shape[1], self._probe_stride)

    def receive(self, step: Step) -> None:
        """Give the targets of a step the points of their sources."""
        lenses = len(self._field.center)
        target = np.zeros(lenses, dtype=np.bool_)
        target[step.targets] = True
        source = np.full((lenses, 2), -1, dtype=np.int64)
        source[step.targets] = step.sources
        gathering = Gathering(target, source, self._probe_stride, self._probe_shift, round(sqrt(self._probe_stride)))
        arguments = self._points, self._field, gathering, self._rules, self._nearest
        self._bands.lines(gather, len(self._nearest), *arguments)

    def finish(self, lenses: Lenses) -> None:
        """Prepare the micro-images of ``lenses`` as sources."""
        done = np.zeros(len(self._field.center), dtype=np.bool_)
        done[lenses] = True
        self._bands.lines(mark_nearest, len(self._nearest), self._points, self._field, done, self._nearest)


def scatter_shift(stride: int) -> int:
    """Shift in columns of the probes from row to row, for a ``stride``: they visit all columns without large holes.

    Near the golden section of the stride, and coprime with it.
    """
    shift = round((sqrt(5) - 1) / 2 * stride)
    while gcd(shift, stride) > 1:
        shift -= 1
    return shift


@uncounted
def probed_limit(points: PointImage, field: LensField, row: int, column: int, gathering: Gathering) -> float:
    """Disparity of the farthest point to expect at a pixel, from the probes around it; 0 without probes."""
    height, width = points.status.shape
    stride, reach = gathering.probe_stride, gathering.probe_reach
    nearest, farthest = 0.0, 0.0
    for r in range(max(0, row - reach), min(height, row + reach + 1)):
        left = max(0, column - reach)
        c = left + (r * gathering.probe_shift - left) % stride
        while c <= column + reach and c < width:
            if field.lens[r, c] == field.lens[row, column] and points.status[r, c] == TRACED:
                s = np.float64(points.disparity[r, c])
                nearest, farthest = widen(nearest, farthest, s)
            c += stride
    return limit_of_probes(nearest, farthest)


@compiled
def gather(
    first_row: int,
    last_row: int,
    points: PointImage,
    field: LensField,
    gathering: Gathering,
    rules: Rules,
    nearest: RealArray,
) -> None:
    """Give the pixels of the targets the points of their sources.

    Pixels that get a point become :data:`REPROJECTED`, missed ones :data:`QUEUED`; traced ones stay as they are.
    ``nearest (H, W)`` as of :func:`mark_nearest`.
    """
    sources = gathering.source.shape[1]
    depth = np.empty(sources)
    share = np.empty(sources)
    color = np.empty((sources, 3))
    for row in range(first_row, last_row):
        for column in range(points.status.shape[1]):
            if points.status[row, column] != TRACED and gathering.target[field.lens[row, column]]:
                got = _gather_pixel(points, field, gathering, rules, nearest, row, column, depth, share, color)
                points.status[row, column] = REPROJECTED if got else QUEUED


@uncounted
def _gather_pixel(
    points: PointImage,
    field: LensField,
    gathering: Gathering,
    rules: Rules,
    nearest: RealArray,
    row: int,
    column: int,
    depth: RealArray,
    share: RealArray,
    color: RealArray,
) -> bool:
    lens = field.lens[row, column]
    front = 0.0
    outlines, hits, asked = 0, 0, 0
    beside_nearest = BACKGROUND
    doubted = 0
    for k in range(len(depth)):
        share[k] = 0.0
        source = gathering.source[lens, k]
        if source < 0:
            continue
        shift_x = field.center[source, 0] - field.center[lens, 0]
        shift_y = field.center[source, 1] - field.center[lens, 1]
        place, s, beside = march(points, field, nearest, source, column + shift_x, row + shift_y, shift_x, shift_y)
        asked += 1
        if beside != BACKGROUND:
            outlines += 1
            if nearer(beside, beside_nearest):
                beside_nearest = beside
        if not place.is_known:
            continue
        hits += 1
        depth[k] = s
        share[k] = 1.0 / np.sqrt(shift_x * shift_x + shift_y * shift_y)
        if front == 0.0 or nearer(s, front):
            front = s
        if rules.careful and not is_trusted(points, place, rules):
            # A bit per source: the pixel is rejected only if this source's colour is used in the end.
            doubted |= 1 << k
        for channel in range(3):
            color[k, channel] = color_at(points, place, channel)
    if hits == 0:
        return False
    total, mean = 0.0, 0.0
    for k in range(len(depth)):
        if share[k] > 0.0 and not alike(depth[k], front, TUNING.one_surface):
            share[k] = 0.0
        if share[k] == 0.0:
            # Colours without a source may be NaN: 0 times NaN is not 0.
            continue
        if doubted >> k & 1:
            return False
        total += share[k]
        mean += share[k] * depth[k]
    mean /= total
    limit = probed_limit(points, field, row, column, gathering)
    if is_behind(mean, limit):
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
    return True
