"""Light of one surface point, averaged over the micro-images that show it: the part on the device."""

from __future__ import annotations

from itertools import product

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.syntax import syntax
from lippmann.device.types import Array, UInt32
from lippmann.rendering.sharing.device_pixels import light_of_pixels, upload

#: Sums of squared differences from which on nothing is shared: weights are ``(1 - sum / 10)^8``, which is nearly
#: ``exp(-0.8 sum)`` and takes a fraction of its time.
_FADED = 10.0
#: Weight of a squared distance between normals: 20 for the squares of unit vectors a right angle apart.
_NORMAL = 10.0
#: Heights count as alike within this share of the height and of the gap.
_OF_HEIGHT, _OF_GAP = 0.02, 0.5
#: Weight of a squared distance in pixels along cylindrical lenses, across which it is 1.
_ALONG = 0.3


def share(
    light: NDArray[np.float32],
    normal: NDArray[np.float32],
    height: NDArray[np.float32],
    lens: NDArray[np.int32],
    centers: NDArray[np.float64],
    gap: float,
    reach: tuple[int, int],
    cylindrical: bool,
    stop: float,
) -> NDArray[np.float32]:
    """The weighted mean of ``light`` over all places that show the same point.

    ``light`` and the result are ``(H, W, C)``, C 1 or 3, ``normal`` ``(H, W, 3)``, ``height`` ``(H, W)`` z in
    millimetres, and ``lens`` ``(H, W)`` each pixel's lens as its number in ``centers``, ``(rows, columns, 2)`` in
    pixels to the right and downwards; ``reach`` is in lenses to either side and up and down. A point that pixel q shows
    through lens C lies at ``q + (C' - C) (1 + g / z)`` under lens C'. Where there is no surface (a normal of 0) light
    stays as it is.
    """
    picture = _Picture(light, normal, height, lens, centers, gap, reach, cylindrical, stop)
    return light_of_pixels(picture.mean_light, light.shape)


class _Picture:
    """What pixels show, and the lenses that they lie under, on the device; numbers are opaque, for one kernel."""

    def __init__(
        self,
        light: NDArray[np.float32],
        normal: NDArray[np.float32],
        height: NDArray[np.float32],
        lens: NDArray[np.int32],
        centers: NDArray[np.float64],
        gap: float,
        reach: tuple[int, int],
        cylindrical: bool,
        stop: float,
    ) -> None:
        def opaque(kind: type[Array], *values: float) -> tuple[Array, ...]:
            return tuple(dr.opaque(kind, value) for value in values)

        self._light_type = mi.Color3f if light.shape[2] == 3 else mi.Color1f
        self._light, self._normal, self._height, self._centers = upload(light, normal, height, centers)
        self._lens = mi.Int32(np.ascontiguousarray(lens, dtype=np.int32).ravel())
        self._size = opaque(mi.Int32, *height.shape)
        self._lenses = opaque(mi.Int32, *centers.shape[:2])
        self._reach = opaque(mi.Int32, *reach)
        self._gap, self._down, self._stop = opaque(mi.Float, gap, _ALONG if cylindrical else 1.0, stop)

    @syntax
    def mean_light(self, pixel: UInt32) -> Array:
        """The mean of some pixels, by their numbers in the picture."""
        rows, columns = self._size
        lens_rows, lens_columns = self._lenses
        reach_i, reach_j = self._reach
        row, column = divide(mi.Int32(pixel), columns)
        own = dr.gather(mi.Int32, self._lens, pixel)
        own_center = dr.gather(mi.Point2f, self._centers, own)
        own_j, own_i = divide(own, lens_columns)
        normal = dr.gather(mi.Vector3f, self._normal, pixel)
        light = dr.gather(self._light_type, self._light, pixel)
        z = dr.gather(mi.Float, self._height, pixel)
        is_surface = (normal != 0).x | (normal != 0).y | (normal != 0).z
        is_flat = dr.abs(z) < 1e-3 * self._gap  # seen by one lens alone
        shift = dr.select(is_flat, 1, 1 + self._gap / z)
        per_height = 1 / (dr.abs(z) * _OF_HEIGHT + self._gap * _OF_GAP)
        per_light = self._stop / (1e-3 + dr.squared_norm(light))  # finite in the dark
        # Lenses to either side that see the point, at most.
        seen_by = dr.select(is_flat, 0, mi.Int32(dr.minimum(dr.abs(z) / self._gap + 2, 1e6)))
        reach_i, reach_j = dr.minimum(reach_i, seen_by), dr.minimum(reach_j, seen_by)

        total, color = mi.Float(0), self._light_type(0)
        di, dj = -reach_i, -reach_j
        active = is_surface & (dj <= reach_j)
        # What does not change is no state: else Dr.Jit would record the loop a second time, without it.
        while dr.hint(
            active,
            label="lenses about a point",
            exclude=[
                own_i,
                own_j,
                own_center,
                lens_rows,
                lens_columns,
                rows,
                columns,
                row,
                column,
                reach_i,
                reach_j,
                shift,
                z,
                per_height,
                per_light,
                normal,
                light,
                is_surface,
            ],
        ):
            i, j = own_i + di, own_j + dj
            other = j * lens_columns + i
            is_lens = (i >= 0) & (i < lens_columns) & (j >= 0) & (j < lens_rows)
            center = dr.gather(mi.Point2f, self._centers, other, is_lens)
            u = column + 0.5 + (center.x - own_center.x) * shift
            v = row + 0.5 + (center.y - own_center.y) * shift
            is_seen = is_lens & (u >= -1) & (u < columns + 1) & (v >= -1) & (v < rows + 1)
            if dr.hint(is_seen, exclude=[other, u, v, rows, columns, z, per_height, per_light, normal, light]):
                x, y = mi.Int32(dr.floor(u)), mi.Int32(dr.floor(v))
                for step_y, step_x in product((-1, 0, 1), repeat=2):
                    rx, ry = x + step_x, y + step_y
                    there = ry * columns + rx
                    inside = (rx >= 0) & (rx < columns) & (ry >= 0) & (ry < rows)
                    inside &= dr.gather(mi.Int32, self._lens, there, inside) == other
                    du, dv = rx + 0.5 - u, ry + 0.5 - v
                    dz = (dr.gather(mi.Float, self._height, there, inside) - z) * per_height
                    fade = du * du + self._down * dv * dv + dz * dz
                    if dr.hint(inside & (fade < _FADED), exclude=[there, per_light, normal, light]):
                        fade += _NORMAL * dr.squared_norm(dr.gather(mi.Vector3f, self._normal, there) - normal)
                        here = dr.gather(self._light_type, self._light, there)
                        fade += dr.squared_norm(here - light) * per_light
                        near = dr.maximum(1 - fade / _FADED, 0)
                        near *= near
                        near *= near
                        weight = near * near
                        total += weight
                        color += weight * here
            di += 1
            is_end = di > reach_i
            di = dr.select(is_end, -reach_i, di)
            dj += dr.select(is_end, 1, 0)
            active = is_surface & (dj <= reach_j)
        return dr.select(is_surface, color / total, light)
