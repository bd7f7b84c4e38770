"""Cross-bilateral filter of denoised light over the micro-images that show the same surface.

The noise that a denoiser leaves is independent between micro-images, as each has samples of its own. So each pixel
takes a weighted mean of its own demodulated irradiance (colour over albedo, so that textures stay sharp) and of that of
the same surface point in other micro-images and in the pixels around.

The pixel of a point at height z under another lens follows from the geometry. The weight falls with the distance in
pixels and with differences of height, normal and light; by the last, shadow edges and highlights, which move over the
surface from lens to lens, are not smeared. A surface that is seen in a mirror or through glass has the height of its
virtual image, the length of the light's path behind the glass. This is exact for flat ones; elsewhere heights and
normals differ, so that weights vanish.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide, to_numpy, upload
from lippmann.device.syntax import syntax
from lippmann.device.types import Array, UInt32
from lippmann.display import Display
from lippmann.display.micro_image_layout import lens_centers, lens_numbers
from lippmann.rendering.film.memory_model import PREFERRED_LANES
from lippmann.rendering.sharing.tuning import TUNING

if TYPE_CHECKING:
    from lippmann.rendering.film.feature_buffers import Guides

Floats = NDArray[np.float32]


def share_light(
    pixels: Floats,
    display: Display,
    guides: Guides,
    *,
    stop: float,
    lenses: NDArray[np.int32] | None = None,
    columns: int = 1,
    mask: NDArray[np.bool_] | None = None,
) -> Floats:
    """The denoised picture, filtered across its micro-images.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` linear RGB >= 0 of the panel, or of a window of it, without noise; or ``(H, 3 W, 3)`` of its
        sub-pixels in full colour, see :class:`~lippmann.rendering.transport.ray_source.SubpixelRays`.
    guides:
        Albedo, normal and height of the same pixels.
    stop:
        Weight of a squared relative difference of light in the sum that decides a pixel's weight.
    lenses:
        From :func:`~lippmann.display.micro_image_layout.lens_numbers`: of a window, or of sub-pixels that show one
        colour each; of sub-pixels in full colour from its ``lens_numbers_in_full_color``. None for whole pixels of the
        whole panel.
    columns:
        Columns of ``pixels`` for each pixel of the panel: 3 for sub-pixels in full colour, else 1.
    is_open:
        ``(H, W)`` of ``pixels``: those that are filtered; the others stay as they are. None for all.

    Returns
    -------
    float32 of the same shape.
    """
    assert guides.height is not None
    albedo = guides.offset_albedo()
    light = np.ascontiguousarray(pixels / albedo, dtype=np.float32)
    shared = np.empty_like(light)
    is_lenticular = display.lens_array.layout == "lenticular"
    reach = (TUNING.reach, 0 if is_lenticular else TUNING.reach)
    centers = lens_centers(display) * (columns, 1)
    if lenses is None:
        lenses = lens_numbers(display)
    groups = [slice(0, 3)] if len(lenses) == 1 else [slice(c, c + 1) for c in range(3)]
    numbers = None if mask is None else upload(np.flatnonzero(mask).astype(np.uint32))
    for lens, group in zip(lenses, groups, strict=True):
        picture = _Picture(light[..., group], guides.normal, guides.height, lens, centers, display.gap, reach, stop)
        if numbers is None:
            shared[..., group] = light_of_pixels(picture.mean_light, light[..., group].shape)
        else:
            shared[..., group] = light[..., group]
            shape = len(numbers), 1, group.stop - group.start
            shared[mask, group] = light_of_pixels(partial(picture.mean_light_of, numbers), shape)[:, 0]
    return np.asarray(shared * albedo, dtype=np.float32)


class _Picture:
    """Light, features and lens of each pixel on the device; numbers are opaque, so that all pictures share a kernel.

    ``light`` is ``(H, W, C)``, C 1 or 3, ``normal`` ``(H, W, 3)``, ``height`` ``(H, W)`` z in millimetres, and ``lens``
    ``(H, W)`` each pixel's lens as its number in ``centers``, ``(rows, columns, 2)`` in pixels to the right and
    downwards; ``reach`` is in lenses to either side and up and down. A point that pixel q shows through lens C lies at
    ``q + (C' - C) (1 + g / z)`` under lens C'. Where there is no surface (a normal of 0) light stays as it is.
    """

    def __init__(
        self,
        light: Floats,
        normal: Floats,
        height: Floats,
        lens: NDArray[np.int32],
        centers: NDArray[np.float64],
        gap: float,
        reach: tuple[int, int],
        stop: float,
    ) -> None:
        def opaque(kind: type[Array], *values: float) -> tuple[Array, ...]:
            return tuple(dr.opaque(kind, value) for value in values)

        self._light_type = mi.Color3f if light.shape[2] == 3 else mi.Color1f
        parts = light, normal, height, centers
        self._light, self._normal, self._height, self._centers = (upload(part) for part in parts)
        self._lens = upload(lens)
        self._size = opaque(mi.Int32, *height.shape)
        self._lenses = opaque(mi.Int32, *centers.shape[:2])
        self._reach = opaque(mi.Int32, *reach)
        self._gap, self._stop = opaque(mi.Float, gap, stop)

    def mean_light_of(self, numbers: UInt32, place: UInt32) -> Array:
        """Filtered light of the pixels that stand at places of a table of their ``numbers``."""
        return self.mean_light(dr.gather(mi.UInt32, numbers, place))

    @syntax
    def mean_light(self, pixel: UInt32) -> Array:
        """Filtered light of pixels, given by their numbers in the picture."""
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
        per_height = 1 / (dr.abs(z) * TUNING.of_height + self._gap)
        per_light = self._stop / (1e-3 + dr.squared_norm(light))  # finite in the dark
        # Lenses to either side that see the point, at most.
        reach_z = dr.select(is_flat, 0, mi.Int32(dr.minimum(dr.abs(z) / self._gap + 2, 1e6)))
        reach_i, reach_j = dr.minimum(reach_i, reach_z), dr.minimum(reach_j, reach_z)

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
            is_near = is_lens & (u >= -1) & (u < columns + 1) & (v >= -1) & (v < rows + 1)
            if dr.hint(is_near, exclude=[other, u, v, rows, columns, z, per_height, per_light, normal, light]):
                x, y = mi.Int32(dr.floor(u)), mi.Int32(dr.floor(v))
                for step_y, step_x in product((-1, 0, 1), repeat=2):
                    rx, ry = x + step_x, y + step_y
                    there = ry * columns + rx
                    inside = (rx >= 0) & (rx < columns) & (ry >= 0) & (ry < rows)
                    inside &= dr.gather(mi.Int32, self._lens, there, inside) == other
                    du, dv = rx + 0.5 - u, ry + 0.5 - v
                    dz = (dr.gather(mi.Float, self._height, there, inside) - z) * per_height
                    fade = du * du + dv * dv + dz * dz
                    if dr.hint(inside & (fade < TUNING.faded), exclude=[there, per_light, normal, light]):
                        fade += TUNING.faded * dr.squared_norm(dr.gather(mi.Vector3f, self._normal, there) - normal)
                        here = dr.gather(self._light_type, self._light, there)
                        fade += dr.squared_norm(here - light) * per_light
                        near = dr.maximum(1 - fade / TUNING.faded, 0)
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


def light_of_pixels(mean_light: Callable[[UInt32], Array], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """A picture ``(H, W, C)`` of that ``shape``; ``mean_light`` gives the light of pixels by their numbers."""
    light = np.empty((shape[0] * shape[1], shape[2]), dtype=np.float32)
    for first in range(0, len(light), PREFERRED_LANES):
        part = light[first : first + PREFERRED_LANES]
        mean = mean_light(dr.arange(mi.UInt32, len(part)) + dr.opaque(mi.UInt32, first))
        part[:] = to_numpy(mean, len(part))
    return light.reshape(shape)
