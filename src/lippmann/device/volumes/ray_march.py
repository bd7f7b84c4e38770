"""Emission and absorption of a volume along rays, in steps of half a voxel.

Between two samples values are taken to run linearly, and the transfer function is integrated over them (Engel et al.
2001, "High-quality pre-integrated volume rendering", equations 5 to 8): the result hardly depends on the step, however
steep the transfer function. Bricks in which nothing can be seen are passed over; the samples lie where they would lie
without that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.device.volumes.table import BRICK_BITS, Numbers, VolumeTable, bin_of
from lippmann.runtime.numba_jit import compiled
from lippmann.runtime.row_threads import Bands
from lippmann.scene.matrices import inverse

#: Longest step along any axis, voxels.
STEP = 0.5
#: Transmittance below which a ray ends.
_OPAQUE = 5e-4
#: Values of two samples that are nearer than this, in bins, are taken to be one.
_SAME = 1e-3
#: A step begins in the brick in which this share of it lies.
_INTO = 1e-6

#: Light: from all around, from the light source, and of highlights; the share of the first two that is seen where there
#: is no surface; the exponent of highlights (Blinn 1977).
_AMBIENT, _DIFFUSE, _SPECULAR, _EVEN, _SHININESS = 0.30, 0.75, 0.20, 0.85, 24.0
#: Change of the value, in shares of the transfer function's range over a voxel, that is half a surface.
_HALF_SURFACE = 0.04

Floats = NDArray[np.float32]


def composite(
    table: VolumeTable,
    origins: Floats,
    directions: Floats,
    ends: Floats,
    toward_light: Numbers,
    threads: int,
) -> tuple[Floats, Floats]:
    """Linear RGB ``(n, 3)`` that a volume adds along rays, and the transmittance ``(n,)`` that it leaves.

    Parameters
    ----------
    origins, directions:
        ``(n, 3)``, directions of length 1.
    ends:
        ``(n,)``: distances at which rays end.
    toward_light:
        ``(3,)``: unit direction toward the light source that shades surfaces.
    threads:
        CPU threads.
    """
    colors = np.empty((len(origins), 3), np.float32)
    transmittances = np.empty(len(origins), np.float32)
    # Length of a voxel along its shortest side.
    finest = float(np.linalg.norm(inverse(table.voxel_from_world)[:3, :3], axis=0).min())
    bands = Bands(threads)
    bands.pixels(
        _composite,
        len(origins),
        *(origins, directions, ends, np.ascontiguousarray(toward_light, dtype=np.float64), finest),
        *(table.grid, table.voxel_from_world, table.bin_scale, table.bin_offset),
        *(table.extinction, table.integral, table.occupied, table.shading, colors, transmittances),
    )
    return colors, transmittances


@compiled
def _value(grid: NDArray[np.generic], x: float, y: float, z: float) -> float:
    """The stored number at a place in voxels: linear between voxels, constant beyond the outer ones."""
    depth, height, width = grid.shape
    x = min(max(x, 0.0), width - 1.0)
    y = min(max(y, 0.0), height - 1.0)
    z = min(max(z, 0.0), depth - 1.0)
    i, j, k = np.uint64(x), np.uint64(y), np.uint64(z)
    u, v, w = x - i, y - j, z - k
    one = np.uint64(1)
    i1 = i + one if u > 0.0 else i
    j1 = j + one if v > 0.0 else j
    k1 = k + one if w > 0.0 else k
    a = (1.0 - u) * grid[k, j, i] + u * grid[k, j, i1]
    b = (1.0 - u) * grid[k, j1, i] + u * grid[k, j1, i1]
    c = (1.0 - u) * grid[k1, j, i] + u * grid[k1, j, i1]
    d = (1.0 - u) * grid[k1, j1, i] + u * grid[k1, j1, i1]
    return float((1.0 - w) * ((1.0 - v) * a + v * b) + w * ((1.0 - v) * c + v * d))


@compiled
def _integral(integral: Numbers, extinction: Numbers, value: float, channel: int, bins: int) -> float:
    """The integral of a column of the transfer function up to a value in bins."""
    inside = min(max(value, 0.0), float(bins))
    bin_ = min(int(inside), bins - 1)
    total = integral[bin_, channel] + (inside - bin_) * extinction[bin_ + 1, channel]
    if value < 0.0:
        return float(total + value * extinction[0, channel])
    if value > bins:
        return float(total + (value - bins) * extinction[bins + 1, channel])
    return float(total)


@compiled
def _shade(
    grid: NDArray[np.generic],
    p: Numbers,
    d: Numbers,
    light: Numbers,
    voxel_from_world: Numbers,
    scale: float,
    bins: int,
    shading: float,
    finest: float,
) -> tuple[float, float]:
    """How bright the volume's own colour is at a place in voxels, and how much white its highlight adds."""
    m = voxel_from_world
    x, y, z = 0.0, 0.0, 0.0
    for axis in range(3):
        difference = 0.0
        for side in range(2):
            sign = 2.0 * side - 1.0
            p[axis] += sign
            difference += sign * _value(grid, p[0], p[1], p[2])
            p[axis] -= sign
        difference *= 0.5 * scale
        x += m[axis, 0] * difference
        y += m[axis, 1] * difference
        z += m[axis, 2] * difference
    length = np.sqrt(x * x + y * y + z * z)
    if length <= 0.0:
        return 1.0 - shading + shading * _EVEN, 0.0
    facing = x * d[0] + y * d[1] + z * d[2]
    # The side that is seen, whichever of the two is denser.
    sign = (1.0 if facing < 0.0 else -1.0) / length
    x, y, z = x * sign, y * sign, z * sign
    lit = max(x * light[0] + y * light[1] + z * light[2], 0.0)
    hx, hy, hz = light[0] - d[0], light[1] - d[1], light[2] - d[2]
    half = np.sqrt(hx * hx + hy * hy + hz * hz)
    glance = max((x * hx + y * hy + z * hz) / half, 0.0) if half > 1e-9 else 0.0
    slope = length * finest / (_HALF_SURFACE * bins)
    surface = slope / (1.0 + slope)
    own = surface * (_AMBIENT + _DIFFUSE * lit) + (1.0 - surface) * _EVEN
    return 1.0 - shading + shading * own, shading * surface * _SPECULAR * glance**_SHININESS


@compiled
def _composite(
    first_ray: int,
    last_ray: int,
    origins: Floats,
    directions: Floats,
    ends: Floats,
    light: Numbers,
    finest: float,
    grid: NDArray[np.generic],
    voxel_from_world: Numbers,
    bin_scale: float,
    bin_offset: float,
    extinction: Numbers,
    integral: Numbers,
    occupied: NDArray[np.bool_],
    shading: float,
    colors: Floats,
    transmittances: Floats,
) -> None:
    bins = len(integral) - 1
    counts, bricks, brick = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3, np.int64)
    for k in range(3):
        counts[k], bricks[k] = grid.shape[2 - k], occupied.shape[2 - k]
    o, d, world, p, start = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    sums, mean = np.empty(3), np.empty(4)
    for ray in range(first_ray, last_ray):
        for k in range(3):
            world[k] = directions[ray, k]
        near, far, longest = 0.0, float(ends[ray]), 0.0
        for k in range(3):
            o[k], d[k] = voxel_from_world[k, 3], 0.0
            for j in range(3):
                o[k] += voxel_from_world[k, j] * origins[ray, j]
                d[k] += voxel_from_world[k, j] * world[j]
            longest = max(longest, abs(d[k]))
        for k in range(3):
            if abs(d[k]) < 1e-12 * longest:
                d[k] = 1e-12 * longest
            a, b = (-0.5 - o[k]) / d[k], (counts[k] - 0.5 - o[k]) / d[k]
            near, far = max(near, min(a, b)), min(far, max(a, b))
        for c in range(3):
            sums[c] = 0.0
        left = 1.0
        if near < far:
            step = STEP / longest
            steps = int(np.ceil((far - near) / step - 1e-9))
            for k in range(3):
                start[k] = o[k] + near * d[k]
            number = 0
            before, is_known = 0.0, False
            while number < steps and left > _OPAQUE:
                # The brick in which the step begins, and how far it reaches.
                may_be_visible = True
                leaves = np.inf
                for k in range(3):
                    place = start[k] + (number + _INTO) * step * d[k]
                    cell = int(min(max(place, 0.0), counts[k] - 1.0))
                    brick[k] = min(cell >> BRICK_BITS, bricks[k] - 1)
                if not occupied[brick[2], brick[1], brick[0]]:
                    for k in range(3):
                        if d[k] > 0.0:
                            edge = (brick[k] + 1) << BRICK_BITS if brick[k] < bricks[k] - 1 else counts[k]
                        else:
                            edge = brick[k] << BRICK_BITS if brick[k] > 0 else -1
                        leaves = min(leaves, (edge - start[k]) / d[k])
                    after = min(int(leaves / step), steps)
                    if after > number:
                        number = after
                        is_known = False
                        may_be_visible = False
                if not may_be_visible:
                    continue
                begins = number * step
                stops = min(begins + step, far - near)
                if not is_known:
                    before = (
                        _value(grid, start[0] + begins * d[0], start[1] + begins * d[1], start[2] + begins * d[2])
                        * bin_scale
                        + bin_offset
                    )
                after_value = (
                    _value(grid, start[0] + stops * d[0], start[1] + stops * d[1], start[2] + stops * d[2]) * bin_scale
                    + bin_offset
                )
                width = after_value - before
                if abs(width) > _SAME:
                    for c in range(4):
                        mean[c] = (
                            _integral(integral, extinction, after_value, c, bins)
                            - _integral(integral, extinction, before, c, bins)
                        ) / width
                else:
                    row = bin_of(0.5 * (before + after_value), bins)
                    for c in range(4):
                        mean[c] = extinction[row, c]
                if mean[0] > 0.0:
                    alpha = 1.0 - np.exp(-mean[0] * (stops - begins))
                    own, white = 1.0, 0.0
                    if shading > 0.0:
                        middle = 0.5 * (begins + stops)
                        for k in range(3):
                            p[k] = start[k] + middle * d[k]
                        own, white = _shade(grid, p, world, light, voxel_from_world, bin_scale, bins, shading, finest)
                    for c in range(3):
                        sums[c] += left * alpha * (own * mean[c + 1] / mean[0] + white)
                    left *= 1.0 - alpha
                before, is_known = after_value, True
                number += 1
        for c in range(3):
            colors[ray, c] = sums[c]
        transmittances[ray] = left if left > _OPAQUE else 0.0
