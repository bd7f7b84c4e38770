"""Feature buffers of the denoiser (guides): albedo, normal and height, averaged over a pixel's samples.

All pixels have the same evenly spaced points. Random points would put noise into the buffers, which the denoiser takes
for edges; with equal points neighbours differ by the scene alone, and their rays go side by side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import to_numpy
from lippmann.device.sobol import lattice_point
from lippmann.device.syntax import syntax
from lippmann.device.types import Color3f, Float, UInt32, Vector3f
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.film.memory_model import LAYERS, Plan, SampleRange, cut_wavefronts
from lippmann.rendering.film.wavefront import Coverage, lay_out_wavefront, reorder_to_rows, select_colors
from lippmann.rendering.transport.first_surface import Surfaces, make_surfaces
from lippmann.rendering.transport.ray_source import PixelRays, RaySource
from lippmann.scene.matrices import inverse, rotation_of

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic

FloatArray = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Guides:
    """``albedo`` and ``normal``, ``(H, W, 3)`` float32 each; components in [0, 1] and in [-1, 1] (display frame).

    ``height`` is ``(H, W)`` float32: apparent z (mm), of reflections behind their mirror. ``coverage`` is that of the
    first and of the second half of the guides' samples. Both are None where they are not known.
    """

    albedo: FloatArray
    normal: FloatArray
    height: FloatArray | None = None
    coverage: tuple[Coverage, Coverage] | None = None

    def offset_albedo(self) -> FloatArray:
        """Divisor that demodulates colour into irradiance, ``(H, W, 3)``, and factor that modulates it again.

        It is the albedo plus a small offset, because black glossy surfaces reflect light, too.
        """
        return np.asarray(np.clip(self.albedo, 0, 1) + np.float32(0.02), dtype=np.float32)


def plan_guides(source: RaySource, samples: int, memory: int) -> Plan:
    """Tiles for guides of ``samples`` samples per pixel, within ``memory`` bytes. A lane takes all those of its pixel.

    Raises
    ------
    MemoryLimitError
        If that is too little for one row.
    """
    kept = source.width * source.height * LAYERS
    plan = cut_wavefronts(source.width, source.height, 1, channels=source.channels, memory=memory, kept=kept)
    return replace(plan, samples=samples)


def trace_guides(
    built: BuiltScene | BuiltClassic,
    source: RaySource,
    plan: Plan,
    display_from_world: NDArray[np.float64],
    *,
    box_filter: bool = True,
    progress: ProgressCallback = silent,
) -> Guides:
    """Mean albedo, normal and height of the first surface along a pixel's rays that is neither mirror nor clear glass.

    ``plan`` comes from :func:`plan_guides`; ``box_filter`` is that of the picture. A sub-pixel with rays of its own
    gets its own channel of the albedo from them; normal and height are the means of all three.
    """
    surfaces = make_surfaces(built)
    matrix = np.asarray(display_from_world, dtype=np.float64)
    # Normals of the uncompressed scene: with compressed depth, those in the display's frame would hardly differ.
    rotation = rotation_of(inverse(matrix))[:3, :3].T.astype(np.float32)
    albedo = np.zeros((plan.height, plan.width, 3), dtype=np.float32)
    normal = np.zeros_like(albedo)
    height = np.zeros((plan.height, plan.width), dtype=np.float32)
    covered = np.zeros((2, plan.height, plan.width, plan.channels), dtype=np.float32)
    samples = plan.samples - plan.samples // 2, plan.samples // 2
    weights = [dr.opaque(mi.Float, float(weight)) for weight in matrix[2]]
    for tile in plan.tiles:
        rows = slice(tile.first_row, tile.first_row + tile.rows)
        # The order of pixels is the same as for a wavefront of paths.
        pixels, _ = lay_out_wavefront(source, plan, tile, SampleRange(0, 1), 0, box_filter)
        sums = _sum_samples(surfaces, pixels, weights, dr.opaque(mi.UInt32, plan.samples))
        dr.eval(sums)  # all at once: evaluated one by one, the rays would be traced nine times
        shape = (tile.rows, plan.width, plan.channels)
        colors, normals, heights, *halves = (_in_rows(part, shape) for part in sums)
        height[rows] = heights.mean(axis=2) / plan.samples
        albedo[rows] = select_colors(colors) / plan.samples
        normal[rows] = normals.mean(axis=2) @ rotation.T / plan.samples
        for half, hits, number in zip(covered, halves, samples, strict=True):
            half[rows] = hits / max(1, number)
        progress(Progress("guides", rows.stop, plan.height))
    return Guides(albedo, normal, height, (Coverage(covered[0], samples[0]), Coverage(covered[1], samples[1])))


def _in_rows(values: Float | Vector3f, shape: tuple[int, int, int]) -> FloatArray:
    """``(rows, columns, channels)`` or ``(rows, columns, channels, 3)`` from sums in the order of lanes."""
    rows, width, channels = shape
    lanes = to_numpy(values, rows * width * channels)
    pixels = reorder_to_rows(lanes.reshape(rows * width, -1), width)
    return pixels.reshape(*shape, *lanes.shape[1:])


@syntax
def _sum_samples(
    surfaces: Surfaces, pixels: PixelRays, z_from_world: list[Float], samples: UInt32
) -> tuple[Color3f, Vector3f, Float, Float, Float]:
    """Sums over all samples of each lane's pixel: colours, world-space normals, heights, and hits of any surface by
    the even and by the odd ones. Summed in the kernel: reading samples back to sum them took longer than the rays."""
    albedo, normal = mi.Color3f(0), mi.Vector3f(0)
    height, even_hits, odd_hits = mi.Float(0), mi.Float(0), mi.Float(0)
    number = mi.UInt32(0)
    while dr.hint(number < samples, label="guides", exclude=[surfaces, pixels, z_from_world, samples]):
        ray = pixels.through(lattice_point(number, samples))
        color, facing, distance, covered = surfaces.features(ray)
        x, y, z = mi.Point3f(ray.o) + mi.Vector3f(ray.d) * distance
        # Beyond 100 m the light lines of all lenses are parallel.
        height += dr.clip(x * z_from_world[0] + y * z_from_world[1] + z * z_from_world[2] + z_from_world[3], -1e5, 1e5)
        albedo += color
        normal += facing
        hits, is_odd = dr.select(covered, mi.Float(1), mi.Float(0)), mi.Float(number & 1)
        even_hits += hits * (1 - is_odd)
        odd_hits += hits * is_odd
        number += 1
    return albedo, normal, height, even_hits, odd_hits
