"""Light of one surface point, averaged over the views of a quilt that see it: the part on the device."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.syntax import syntax
from lippmann.device.types import Color3f, UInt32
from lippmann.rendering.sharing.device_pixels import light_of_pixels, upload

#: The squared difference of normals from which on they are those of different surfaces: an angle of 25 degrees.
_OTHER_NORMAL = 0.19
#: Heights count as alike within so many pixels and this share of them.
_PIXELS, _OF_HEIGHT = 2.0, 0.01


def share(
    light: NDArray[np.float32],
    normal: NDArray[np.float32],
    height: NDArray[np.float32],
    slopes: NDArray[np.float64],
    columns: int,
    convergence: float,
    pixels_per_mm: float,
    reach: int,
) -> NDArray[np.float32]:
    """The weighted mean of ``light`` over the views up to ``reach`` to the side.

    ``light``, ``normal`` and the result are ``(H, W, 3)``, ``height`` ``(H, W)`` z in millimetres, of a quilt of
    ``columns`` views in a row; ``slopes`` (N) says for every view, the leftmost camera's first, how far aside its
    camera stands over how far away. What view k sees at height z at some place, view j sees
    ``(s_k - s_j) z / (1 - z / D)`` millimetres to the right of it in its picture.
    """
    views = _Views(light, normal, height, slopes, columns, convergence, pixels_per_mm, reach)
    return light_of_pixels(views.mean_light, light.shape)


class _Views:
    """What the views of a quilt show, on the device; numbers are opaque, for one kernel."""

    def __init__(
        self,
        light: NDArray[np.float32],
        normal: NDArray[np.float32],
        height: NDArray[np.float32],
        slopes: NDArray[np.float64],
        columns: int,
        convergence: float,
        pixels_per_mm: float,
        reach: int,
    ) -> None:
        self._light, self._normal, self._height, self._slopes = upload(light, normal, height, slopes)
        size = height.shape[1] // columns, height.shape[0] // (len(slopes) // columns)
        self._width, self._height_of_view = (dr.opaque(mi.Int32, value) for value in size)
        self._columns, self._count, self._reach = (dr.opaque(mi.Int32, n) for n in (columns, len(slopes), reach))
        self._convergence, self._pixels_per_mm = (dr.opaque(mi.Float, value) for value in (convergence, pixels_per_mm))

    @syntax
    def mean_light(self, pixel: UInt32) -> Color3f:
        """The mean of some pixels, by their numbers in the quilt."""
        row, column = divide(mi.Int32(pixel), self._columns * self._width)
        above, line = divide(row, self._height_of_view)
        aside, place = divide(column, self._width)
        # The leftmost camera's view is at the bottom left.
        last_row = self._count // self._columns - 1
        k = (last_row - above) * self._columns + aside
        own_slope = dr.gather(mi.Float, self._slopes, k)
        normal = dr.gather(mi.Normal3f, self._normal, pixel)
        z = dr.gather(mi.Float, self._height, pixel)
        per_slope = z / (1 - z * self._convergence) * self._pixels_per_mm
        nearest = _PIXELS / self._pixels_per_mm + _OF_HEIGHT * dr.abs(z)

        total, color = mi.Float(1), dr.gather(mi.Color3f, self._light, pixel)
        j, last = dr.maximum(0, k - self._reach), dr.minimum(self._count - 1, k + self._reach)
        while j <= last:
            shift = (own_slope - dr.gather(mi.Float, self._slopes, j)) * per_slope
            there = place + mi.Int32(dr.floor(dr.clip(shift, -1e6, 1e6) + 0.5))
            view_above, view_aside = divide(j, self._columns)
            index = ((last_row - view_above) * self._height_of_view + line) * self._columns + view_aside
            index = index * self._width + there
            sees = (j != k) & (there >= 0) & (there < self._width)
            sees &= dr.abs(dr.gather(mi.Float, self._height, index, sees) - z) <= nearest
            if sees:
                apart = dr.squared_norm(dr.gather(mi.Normal3f, self._normal, index) - normal)
                weight = 1 - mi.Float(dr.abs(j - k)) / (mi.Float(self._reach) + 1)
                weight = dr.select(apart > _OTHER_NORMAL, 0, weight)
                total += weight
                color += weight * dr.gather(mi.Color3f, self._light, index)
            j += 1
        return color / total
