"""Light of one surface point, averaged over the micro-images that show it: the compiled part."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import uncounted

#: Sums of squared differences from which on nothing is shared: weights are ``(1 - sum / 10)^8``, which is nearly
#: ``exp(-0.8 sum)`` and takes a fraction of its time.
_FADED = 10.0
#: Weight of a squared distance between normals: 20 for the squares of unit vectors a right angle apart.
_NORMAL = 10.0
#: Heights count as alike within this share of the height and of the gap.
_OF_HEIGHT, _OF_GAP = 0.02, 0.5
#: Weights of a squared distance in pixels across the lenses, and along cylindrical ones.
_ACROSS, _ALONG = 1.0, 0.3
#: Heights nearer to the lens plane than this share of the gap are seen by one lens alone.
_FLAT = 1e-3
#: What keeps relative differences of light finite in the dark.
_DARK = 1e-3


@uncounted
def share_rows(
    first: int,
    last: int,
    light: NDArray[np.float32],
    normal: NDArray[np.float32],
    height: NDArray[np.float32],
    lens: NDArray[np.int32],
    centers: NDArray[np.float32],
    gap: float,
    reach_i: int,
    reach_j: int,
    cylindrical: bool,
    stop: float,
    shared: NDArray[np.float32],
) -> None:
    """Rows ``[first, last)`` of ``shared``: the weighted mean of ``light`` over all places that show the same point.

    ``light`` and ``shared`` are ``(H, W, C)``, ``normal`` ``(H, W, 3)``, ``height`` ``(H, W)`` z in millimetres, and
    ``lens`` ``(H, W)`` each pixel's lens as its number in ``centers``, ``(rows, columns, 2)`` in pixels to the right
    and downwards. A point that pixel q shows through lens C lies at ``q + (C' - C) (1 + g / z)`` under lens C'. Where
    there is no surface (a normal of 0) light stays as it is.
    """
    rows, columns = height.shape
    channels = light.shape[2]
    lens_rows, lens_columns = centers.shape[0], centers.shape[1]
    down = _ALONG if cylindrical else _ACROSS
    for row in range(first, last):
        for column in range(columns):
            own = lens[row, column]
            own_j, own_i = own // lens_columns, own % lens_columns
            facing = 0.0
            for c in range(3):
                facing += abs(normal[row, column, c])
            if facing == 0.0:
                for c in range(channels):
                    shared[row, column, c] = light[row, column, c]
                continue
            z = float(height[row, column])
            seen_by = abs(z) / gap + 2.0  # lenses to either side, at most
            is_flat = abs(z) < _FLAT * gap
            shift = 1.0 if is_flat else 1.0 + gap / z
            per_height = 1.0 / (abs(z) * _OF_HEIGHT + gap * _OF_GAP)
            brightness = _DARK
            for c in range(channels):
                brightness += light[row, column, c] * light[row, column, c]
                shared[row, column, c] = 0.0
            per_light = stop / brightness
            total = 0.0
            for dj in range(-reach_j, reach_j + 1):
                j = own_j + dj
                if j < 0 or j >= lens_rows or abs(dj) > seen_by:
                    continue
                for di in range(-reach_i, reach_i + 1):
                    i = own_i + di
                    if i < 0 or i >= lens_columns or abs(di) > seen_by:
                        continue
                    is_own = di == 0 and dj == 0
                    if is_flat and not is_own:
                        continue
                    u = column + 0.5 + (centers[j, i, 0] - centers[own_j, own_i, 0]) * shift
                    v = row + 0.5 + (centers[j, i, 1] - centers[own_j, own_i, 1]) * shift
                    if not (-1.0 <= u < columns + 1.0 and -1.0 <= v < rows + 1.0):
                        continue
                    x, y = math.floor(u), math.floor(v)
                    for ry in range(max(0, y - 1), min(rows, y + 2)):
                        dv = ry + 0.5 - v
                        for rx in range(max(0, x - 1), min(columns, x + 2)):
                            if lens[ry, rx] != j * lens_columns + i:
                                continue
                            du = rx + 0.5 - u
                            dz = (height[ry, rx] - z) * per_height
                            fade = _ACROSS * du * du + down * dv * dv + dz * dz
                            if fade >= _FADED:
                                continue
                            for c in range(3):
                                dn = normal[ry, rx, c] - normal[row, column, c]
                                fade += _NORMAL * dn * dn
                            for c in range(channels):
                                dl = light[ry, rx, c] - light[row, column, c]
                                fade += dl * dl * per_light
                            if fade >= _FADED:
                                continue
                            near = 1.0 - fade / _FADED
                            near *= near
                            near *= near
                            weight = near * near
                            total += weight
                            for c in range(channels):
                                shared[row, column, c] += weight * light[ry, rx, c]
            for c in range(channels):
                shared[row, column, c] /= total
