"""Feature buffers of the denoiser (guides): albedo, normal and height, averaged over a pixel's samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import to_numpy
from lippmann.device.types import Color3f, Float, Vector3f
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.film.memory_model import LAYERS, Pass, Plan, Tile, cut_wavefronts
from lippmann.rendering.film.wavefront import Coverage, samples_of_tile, to_rows
from lippmann.rendering.transport.first_surface import Surfaces, make_surfaces
from lippmann.rendering.transport.ray_source import RaySource
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

    def reflected(self) -> FloatArray:
        """``(H, W, 3)``: divisor that demodulates colour into light that can be shared, and the factor back.

        The albedo plus a small offset, as black glossy surfaces reflect light, too.
        """
        return np.asarray(np.clip(self.albedo, 0, 1) + np.float32(0.02), dtype=np.float32)


def plan_guides(source: RaySource, samples: int, memory: int) -> Plan:
    """Tiles and passes for guides of ``samples`` samples per pixel, within ``memory`` bytes.

    Raises
    ------
    MemoryLimitError
        If that is too little for one row.
    """
    kept = source.width * source.height * LAYERS
    return cut_wavefronts(source.width, source.height, samples, channels=source.channels, memory=memory, kept=kept)


def trace_guides(
    built: BuiltScene | BuiltClassic,
    source: RaySource,
    plan: Plan,
    display_from_world: NDArray[np.float64],
    *,
    seed: int = 0,
    box_filter: bool = True,
    progress: ProgressCallback = silent,
) -> Guides:
    """Mean albedo, normal and height of the first surface along a pixel's rays that is neither mirror nor clear glass.

    ``plan`` comes from :func:`plan_guides`; ``box_filter`` is that of the picture. ``seed`` should differ from the
    picture's: else guides and picture share the same sample positions, and so the same noise. A sub-pixel with rays of
    its own gets its own channel of the albedo from them; normal and height are the means of all three.
    """
    surfaces = make_surfaces(built)
    matrix = np.asarray(display_from_world, dtype=np.float64)
    # Normals of the uncompressed scene: with compressed depth, those in the display's frame would hardly differ.
    rotation = rotation_of(inverse(matrix))[:3, :3].T.astype(np.float32)
    albedo = np.zeros((plan.height, plan.width, 3), dtype=np.float32)
    normal = np.zeros_like(albedo)
    height = np.zeros((plan.height, plan.width), dtype=np.float32)
    covered = np.zeros((2, plan.height, plan.width, plan.channels), dtype=np.float32)
    done = 0
    for tile, run in plan:
        rows = slice(tile.first_row, tile.first_row + tile.rows)
        sums = _trace_tile(surfaces, source, plan, tile, run, seed, box_filter, matrix[2])
        shape = (tile.rows, plan.width, plan.channels)
        colors, normals, heights, *halves = (_in_rows(part, shape) for part in sums)
        height[rows] += heights.mean(axis=2) / plan.samples
        if plan.channels == 3:
            colors = np.diagonal(colors, axis1=2, axis2=3)[:, :, None]
        albedo[rows] += colors[:, :, 0] / plan.samples
        normal[rows] += normals.mean(axis=2) @ rotation.T / plan.samples
        for half, hits in zip(covered, halves, strict=True):
            half[rows] += hits
        done += tile.rows * plan.width * plan.channels * run.count
        progress(Progress("guides", done, plan.work))
    first = plan.samples // 2
    samples = first, plan.samples - first
    coverage = [Coverage(hits / np.float32(max(1, n)), n) for hits, n in zip(covered, samples, strict=True)]
    return Guides(albedo, normal, height, (coverage[0], coverage[1]))


def _in_rows(values: Float | Vector3f, shape: tuple[int, int, int]) -> FloatArray:
    """``(rows, columns, channels)`` or ``(rows, columns, channels, 3)`` from sums in the order of lanes."""
    rows, width, channels = shape
    lanes = to_numpy(values, rows * width * channels)
    pixels = to_rows(lanes.reshape(rows * width, -1), width)
    return pixels.reshape(*shape, *lanes.shape[1:])


def _trace_tile(
    surfaces: Surfaces,
    source: RaySource,
    plan: Plan,
    tile: Tile,
    run: Pass,
    seed: int,
    box_filter: bool,
    z_from_world: NDArray[np.float64],
) -> tuple[Color3f, Vector3f, Float, Float, Float]:
    """Sums over the samples of one pass, for every pixel and channel in the order of lanes: colours, world-space
    normals, heights, and hits of any surface by either half of all passes' samples."""
    lanes = tile.rows * plan.width * plan.channels * run.count
    # Pixels, streams and the order of lanes are the same as for a wavefront of paths.
    pixels, stream = samples_of_tile(source, plan, tile, run, seed, box_filter)
    ray = pixels.ray(stream)
    albedo, normal, distance, covered = surfaces.features(ray)
    x, y, z = mi.Point3f(ray.o) + mi.Vector3f(ray.d) * distance
    weights = [dr.opaque(mi.Float, float(weight)) for weight in z_from_world]
    # Beyond 100 m the light lines of all lenses are parallel.
    height = dr.clip(x * weights[0] + y * weights[1] + z * weights[2] + weights[3], -1e5, 1e5)
    is_first = stream.index < dr.opaque(mi.UInt32, plan.samples // 2)
    hits = [dr.select(half, mi.Float(1), mi.Float(0)) for half in (covered & is_first, covered & ~is_first)]
    values = [mi.Float(part) + dr.zeros(mi.Float, lanes) for part in (*albedo, *normal, height, *hits)]
    # All at once: evaluated one by one, the rays would be traced eight times.
    dr.eval(values)
    if run.count > 1:
        values = [dr.block_sum(part, run.count) for part in values]
    return mi.Color3f(*values[:3]), mi.Vector3f(*values[3:6]), *values[6:]
