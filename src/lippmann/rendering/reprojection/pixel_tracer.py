"""Tracing of arbitrary lists of pixels, such as missed ones."""

from __future__ import annotations

import time

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.frozen_kernel import Frozen, align
from lippmann.device.kernel_ops import divide, transform_point
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Array, Float, Ray3f, UInt32
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.film.batched_picture import STREAMS
from lippmann.rendering.film.wavefront import RayTotals, blacken_invalid, measure_compilation
from lippmann.rendering.reprojection.point_image import BACKGROUND, TRACED, BoolArray, IntArray, PointImage, RealArray
from lippmann.rendering.reprojection.rules import alike, nearer
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.rendering.transport.integrator import ReusableIntegrator
from lippmann.rendering.transport.ray_source import DisplayRays, PixelRays
from lippmann.runtime.numba_jit import uncounted
from lippmann.runtime.row_threads import Bands

Pixels = NDArray[np.uint32]


class PixelTracer:
    """Traces any pixels of a display's picture and writes their points into a point image.

    A pixel has the same samples, and so the same colour, as in a full rendering. Its point is the mean over its
    samples; if these hit different surfaces, the nearest point, and the pixel is fragile.
    """

    def __init__(
        self,
        integrator: ReusableIntegrator,
        source: DisplayRays,
        *,
        samples: int,
        seed: int,
        box_filter: bool,
        most_lanes: int,
        display_from_world: NDArray[np.float64],
        bands: Bands,
        progress: ProgressCallback = silent,
    ) -> None:
        self._progress = progress
        self._bands = bands
        self._integrator = integrator
        self._source = source
        self._samples = samples
        self._box_filter = box_filter
        self._pixels_per_call = max(1, most_lanes // samples)
        self._z_from_world = np.asarray(display_from_world, dtype=np.float64)[2:3]
        self._seed = dr.opaque(mi.UInt32, seed)
        self._kernel = Frozen(self._sample, [integrator, source])
        self.rays = RayTotals()
        self.seconds_compile = 0.0
        self.seconds_trace = 0.0

    def trace(self, numbers: Pixels, points: PointImage) -> None:
        """Fill the pixels ``numbers`` (row * width + column, no pixel twice) of ``points``."""
        for start in range(0, len(numbers), self._pixels_per_call):
            part = numbers[start : start + self._pixels_per_call]
            started = time.perf_counter()
            # For all parts: with the flag changed, the kernel would be recorded again.
            with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
                samples = self._trace(part)
                compiling = measure_compilation(started)
            self.seconds_compile += compiling
            self.seconds_trace += time.perf_counter() - started - compiling
            self._bands.pixels(_enter, len(part), points, part, self._samples, *samples)
            done = self.rays.primary // self._samples
            self._progress(Progress("trace", min(done, points.status.size), points.status.size))

    def _trace(self, numbers: Pixels) -> tuple[NDArray[np.generic], ...]:
        """Red, green, blue, disparity and fragility of all samples, ordered by pixel."""
        pixel = mi.UInt32(align(numbers))
        sample = mi.UInt32(0)
        if self._samples > 1:
            chosen, sample = divide(dr.arange(mi.UInt32, len(numbers) * self._samples), self._samples)
            pixel = dr.gather(mi.UInt32, pixel, chosen)
        dr.make_opaque(pixel, sample)
        radiance, secondary, shadow, finite, disparity, fragile = self._kernel(pixel, sample, self._seed)
        # All at once: a sum of an unevaluated radiance would trace the paths again.
        dr.eval(radiance, secondary, shadow, finite, disparity, fragile)
        lanes = len(numbers) * self._samples
        self.rays.primary += lanes
        self.rays.secondary += _total(secondary)
        self.rays.shadow += _total(shadow)
        self.rays.discarded += lanes - _total(finite)
        return tuple(np.asarray(part) for part in (*radiance, disparity, fragile))

    def _sample(self, pixel: UInt32, sample: UInt32, seed: UInt32) -> tuple[Array, ...]:
        row, column = divide(pixel, mi.UInt32(self._source.uploaded.panel.width))
        number, of_stream = divide(sample, STREAMS)
        stream = SampleStream.of_pixels(pixel, number, seed, of_stream)
        ray = PixelRays(self._source, column, row, mi.UInt32(0), self._box_filter).ray(stream)
        radiance, counts, first = self._integrator.sample_with_hit(ray, stream, mi.Bool(True))
        radiance, finite = blacken_invalid(radiance)
        one, none = mi.UInt32(1), mi.UInt32(0)
        return (
            radiance,
            counts.secondary + none,
            counts.shadow + none,
            dr.select(finite, one, none),
            self._disparity(ray, first.distance),
            dr.select(first.view_dependent, one, none),
        )

    def _disparity(self, ray: Ray3f, distance: Float) -> Float:
        """Gap over the height of the point at ``distance`` along ``ray``."""
        hit = dr.isfinite(distance)
        p = ray(dr.select(hit, distance, 0))
        (z,) = transform_point(self._z_from_world, p)
        z = dr.copysign(dr.maximum(dr.abs(z), 1e-6), z)  # heights of at least a nanometre keep disparities finite
        return dr.select(hit, mi.Float(self._source.uploaded.gap) / z, BACKGROUND)


def _total(counts: IntArray) -> int:
    """Sum over all lanes, on the CPU: for short lists a reduction on the device takes longer than the tracing."""
    return int(np.asarray(counts).sum(dtype=np.uint64))


@uncounted
def _enter(
    first: int,
    last: int,
    points: PointImage,
    numbers: IntArray,
    samples: int,
    red: RealArray,
    green: RealArray,
    blue: RealArray,
    disparity: RealArray,
    fragile: BoolArray,
) -> None:
    width = points.status.shape[1]
    for i in range(first, last):
        row, column = divmod(int(numbers[i]), width)
        r, g, b, total = 0.0, 0.0, 0.0, 0.0
        nearest = disparity[i * samples]
        farthest = nearest
        is_fragile = False
        for k in range(i * samples, (i + 1) * samples):
            r, g, b = r + red[k], g + green[k], b + blue[k]
            s = disparity[k]
            total += s
            if nearer(s, nearest):
                nearest = s
            if nearer(farthest, s):
                farthest = s
            is_fragile |= fragile[k] != 0
        points.color[row, column, 0] = r / samples
        points.color[row, column, 1] = g / samples
        points.color[row, column, 2] = b / samples
        one_surface = alike(nearest, farthest, TUNING.one_surface)
        points.disparity[row, column] = total / samples if one_surface else nearest
        points.fragile[row, column] = is_fragile or not one_surface
        points.status[row, column] = TRACED
