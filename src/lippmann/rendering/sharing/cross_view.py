"""Joint filter of noisy light over neighbouring views of a quilt, before denoising.

The cameras of a quilt are so close together that neighbours see the same surface points, shifted by a few pixels, under
nearly the same light. So each pixel takes a weighted mean of its own demodulated irradiance (colour over albedo, so
that textures stay sharp) and of that of the same point in the views beside it; nearer views count more. Height and
normal must agree. A surface that is seen in a mirror or through glass has the height of its virtual image, as in
:mod:`.cross_lens`.

The filter comes before the denoiser, whose remaining noise and blur are much the same in all views, so that filtering
its results gains less (docs/background/quilts.md). The error estimate includes the filter's own bias, as of highlights,
which move over a surface from view to view: each half-buffer is filtered by itself, and compared with the other,
unfiltered one. The two views of a stereo pair are always filtered.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide, upload
from lippmann.device.syntax import syntax
from lippmann.device.types import Color3f, UInt32
from lippmann.display.view_cone import cone_tangent
from lippmann.rendering.sharing.cross_lens import light_of_pixels
from lippmann.rendering.sharing.tuning import TUNING

if TYPE_CHECKING:
    from lippmann.rendering.film.feature_buffers import Guides
    from lippmann.rendering.transport.ray_source import QuiltRays

Floats = NDArray[np.float32]


def share_views(pixels: Floats, source: QuiltRays, guides: Guides) -> Floats:
    """The pixels of a quilt, filtered across its views, ``(H, W, 3)`` float32.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` linear RGB >= 0, one for each of ``source``.
    guides:
        Albedo, normal and height of the same pixels.
    """
    assert guides.height is not None
    slopes = ((2 * np.arange(source.views) + 1) / source.views - 1) * cone_tangent(source.display)
    albedo = guides.offset_albedo()
    light = pixels / albedo
    step = 2 * cone_tangent(source.display) / source.views
    display_width, _ = source.display.size_mm
    views = _Views(
        light,
        guides.normal,
        guides.height,
        slopes,
        source.columns,
        1 / source.display.viewing_distance,
        source.view_size[0] / display_width,
        max(int(TUNING.view_reach / step), int(source.display.stereo is not None)),
    )
    shared = light_of_pixels(views.mean_light, light.shape)
    return np.asarray(shared * albedo, dtype=np.float32)


class _Views:
    """The pixels of a quilt on the device; numbers are opaque, so that all quilts share a kernel.

    ``light`` and ``normal`` are ``(H, W, 3)``, ``height`` ``(H, W)`` z in millimetres, of a quilt of ``columns`` views
    in a row; ``slopes`` (N) holds for every view, from the leftmost camera, its sideways offset over its distance.
    A point at height z appears in view j ``(s_k - s_j) z / (1 - z / D)`` millimetres to the right of its place in
    view k. Views up to ``reach`` to the side share.
    """

    def __init__(
        self,
        light: Floats,
        normal: Floats,
        height: Floats,
        slopes: NDArray[np.float64],
        columns: int,
        convergence: float,
        pixels_per_mm: float,
        reach: int,
    ) -> None:
        self._light, self._normal, self._height, self._slopes = (
            upload(part) for part in (light, normal, height, slopes)
        )
        size = height.shape[1] // columns, height.shape[0] // (len(slopes) // columns)
        self._width, self._height_of_view = (dr.opaque(mi.Int32, value) for value in size)
        self._columns, self._count, self._reach = (dr.opaque(mi.Int32, n) for n in (columns, len(slopes), reach))
        self._convergence, self._pixels_per_mm = (dr.opaque(mi.Float, value) for value in (convergence, pixels_per_mm))

    @syntax
    def mean_light(self, pixel: UInt32) -> Color3f:
        """Filtered light of pixels, given by their numbers in the quilt."""
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
        nearest = TUNING.view_pixels / self._pixels_per_mm + TUNING.of_height * dr.abs(z)

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
                weight = dr.select(apart > TUNING.other_normal, 0, weight)
                total += weight
                color += weight * dr.gather(mi.Color3f, self._light, index)
            j += 1
        return color / total
