"""Gaussians composited along rays, each ray in the order in which it comes to their peaks.

A ray's nodes and Gaussians wait in one heap: nodes by the distance at which it enters their box, Gaussians by that of
their peak along it, which lies in all boxes around them. What leaves the heap is therefore in order, without a limit on
their number; and the walk ends as soon as nothing more would be seen. The alpha of a Gaussian along a ray is opacity
times its value at the peak (Moenne-Loccoz et al. 2024, "3D Gaussian Ray Tracing", section 4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.device.splats.bvh import LEAF, Integers
from lippmann.device.splats.table import LEAST_ALPHA, MOST_ALPHA, SplatTable
from lippmann.runtime.numba_jit import compiled, inlined
from lippmann.runtime.row_threads import Bands
from lippmann.scene.values.splats import COEFFICIENTS, real_harmonics

#: Transmittance below which a ray ends, as in the rasterizer of Kerbl et al. 2023.
_OPAQUE = 1e-4
_HEAP = 1024
#: Harmonics of a direction.
_BASIS = COEFFICIENTS[-1]

Floats = NDArray[np.float32]
Numbers = NDArray[np.float64]
Whole = NDArray[np.int64]


def composite(
    table: SplatTable, origins: Floats, directions: Floats, ends: Floats, threads: int
) -> tuple[Floats, Floats]:
    """Colour ``(n, 3)`` that Gaussians add along rays, and the transmittance ``(n,)`` that they leave.

    Parameters
    ----------
    origins, directions:
        ``(n, 3)``, directions of length 1.
    ends:
        ``(n,)``: Gaussians whose peak lies beyond are not seen.
    threads:
        CPU threads.
    """
    colors = np.empty((len(origins), 3), np.float32)
    transmittances = np.empty(len(origins), np.float32)
    bvh = table.bvh
    bands = Bands(threads)
    bands.pixels(
        _composite,
        len(origins),
        *(origins, directions, ends, table.rows, table.harmonics),
        *(bvh.boxes, bvh.first, bvh.size, bvh.order, colors, transmittances),
    )
    return colors, transmittances


_harmonics = inlined(real_harmonics)


@inlined
def _enters(o: Numbers, inverse: Numbers, box: Floats, end: float) -> float:
    """Distance, 0 or more, at which a ray enters a box; infinite if it does not before ``end``."""
    near, far = 0.0, end
    for k in range(3):
        a, b = (box[0, k] - o[k]) * inverse[k], (box[1, k] - o[k]) * inverse[k]
        near, far = max(near, min(a, b)), min(far, max(a, b))
    return near if near <= far else np.inf


@inlined
def _push(keys: Numbers, items: Whole, count: int, key: float, item: int) -> None:
    """Add an entry to ``count`` others, of which the least is the first."""
    place = count
    while place > 0:
        above = (place - 1) >> 1
        if keys[above] <= key:
            break
        keys[place], items[place] = keys[above], items[above]
        place = above
    keys[place], items[place] = key, item


@inlined
def _drop_first(keys: Numbers, items: Whole, count: int) -> None:
    """Remove the least of ``count`` entries."""
    key, item = keys[count - 1], items[count - 1]
    last = count - 1
    place = 0
    while True:
        below = 2 * place + 1
        if below >= last:
            break
        if below + 1 < last and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[place], items[place] = keys[below], items[below]
        place = below
    keys[place], items[place] = key, item


@inlined
def _peak(rows: Floats, number: int, o: Numbers, d: Numbers) -> tuple[float, float]:
    """Distance of a Gaussian's peak along a ray, and the square of the standard deviations between it and the centre.

    In double precision: the offset is large in standard deviations of a small or flat Gaussian.
    """
    x, y, z = o[0] - rows[number, 0], o[1] - rows[number, 1], o[2] - rows[number, 2]
    along, across, norm = 0.0, 0.0, 0.0
    for k in range(3):
        a, b, c = float(rows[number, 3 + 3 * k]), float(rows[number, 4 + 3 * k]), float(rows[number, 5 + 3 * k])
        offset = a * x + b * y + c * z
        step = a * d[0] + b * d[1] + c * d[2]
        along -= offset * step
        norm += step * step
    peak = along / norm
    x, y, z = x + peak * d[0], y + peak * d[1], z + peak * d[2]
    for k in range(3):
        offset = rows[number, 3 + 3 * k] * x + rows[number, 4 + 3 * k] * y + rows[number, 5 + 3 * k] * z
        across += offset * offset
    return peak, across


@inlined
def _add(
    rows: Floats,
    harmonics: Floats,
    number: int,
    o: Numbers,
    d: Numbers,
    basis: Numbers,
    count: int,
    left: float,
    sums: Numbers,
) -> float:
    """Add a Gaussian's light to ``sums`` behind what lets ``left`` through; what is let through then."""
    _, power = _peak(rows, number, o, d)
    alpha = min(rows[number, 12] * np.exp(-0.5 * power), MOST_ALPHA)
    for k in range(3):
        color = 0.5
        for j in range(count):
            color += basis[j] * harmonics[number, k, j]
        sums[k] += left * alpha * max(color, 0.0)
    return float(left * (1.0 - alpha))


@compiled
def _composite(
    first_ray: int,
    last_ray: int,
    origins: Floats,
    directions: Floats,
    ends: Floats,
    rows: Floats,
    harmonics: Floats,
    boxes: Floats,
    first: Integers,
    size: Integers,
    order: Integers,
    colors: Floats,
    transmittances: Floats,
) -> None:
    keys, items = np.empty(_HEAP), np.empty(_HEAP, np.int64)
    o, d, inverse, basis, sums = np.empty(3), np.empty(3), np.empty(3), np.empty(_BASIS), np.empty(3)
    number_of_harmonics = harmonics.shape[2]
    for ray in range(first_ray, last_ray):
        for k in range(3):
            o[k], d[k] = origins[ray, k], directions[ray, k]
            # Of a ray that runs along a side of boxes, neither side may be at 0 times infinity.
            inverse[k] = 1.0 / d[k] if abs(d[k]) > 1e-20 else 1e20
        values = _harmonics(d[0], d[1], d[2])
        for j in range(_BASIS):
            basis[j] = values[j]
        end = float(ends[ray])
        left = 1.0
        for k in range(3):
            sums[k] = 0.0
        count = 0
        enters = _enters(o, inverse, boxes[0], end)
        if enters < np.inf:
            keys[0], items[0] = enters, 0
            count = 1
        while count > 0:
            item = items[0]
            _drop_first(keys, items, count)
            count -= 1
            if item < 0:
                left = _add(rows, harmonics, -1 - item, o, d, basis, number_of_harmonics, left, sums)
                if left < _OPAQUE:
                    break
                continue
            if count + LEAF > len(keys):
                waiting, waiting_items = keys, items
                keys, items = np.empty(2 * len(waiting)), np.empty(2 * len(waiting), np.int64)
                for place in range(count):
                    keys[place], items[place] = waiting[place], waiting_items[place]
            if size[item] == 0:
                for child in range(first[item], first[item] + 2):
                    enters = _enters(o, inverse, boxes[child], end)
                    if enters < np.inf:
                        _push(keys, items, count, enters, child)
                        count += 1
                continue
            for place in range(first[item], first[item] + size[item]):
                number = order[place]
                peak, power = _peak(rows, number, o, d)
                if 0.0 <= peak <= end and rows[number, 12] * np.exp(-0.5 * power) >= LEAST_ALPHA:
                    _push(keys, items, count, peak, -1 - number)
                    count += 1
        for k in range(3):
            colors[ray, k] = sums[k]
        transmittances[ray] = left
