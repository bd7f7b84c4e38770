"""Samples along the rays of chosen native pixels, by kernels that are recorded once and stay warm.

The rays and the random numbers of a pixel are those that it has in a render: sample number i of a picture in one stream
is the one of :func:`lippmann.rendering.film.wavefront.trace_frame`; the two streams of a picture in batches are those
of :class:`lippmann.rendering.film.sample_batches.FullInBatches`. Placement, light, exposure, seed and the pixels are
inputs of the kernel, so that none of them needs another one.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.frozen_kernel import Frozen, aligned
from lippmann.device.sobol import PIXEL_DIMENSION, SEED_STEP, SampleStream
from lippmann.device.types import Array, Float, Float64, Ray3f, UInt32
from lippmann.display import Display
from lippmann.display.seen_pixels import PixelSet
from lippmann.rendering.transport.first_surface import Surfaces
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import DisplayRays, opaque_rows, world_ray_by
from lippmann.rendering.transport.volume_path import VolumePathIntegrator
from lippmann.scene.matrices import inverse, rotation_of

Floats = NDArray[np.float32]
Matrix = NDArray[np.float64]
Rows = list[list[Float64]]
#: Integrators of physically based light.
LiveIntegrator = PathIntegrator | VolumePathIntegrator

#: Launches after which no more recordings were seen to be needed.
_WARMING_LAUNCHES = 4


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of the n pixels of a wavefront.

    Attributes
    ----------
    sums:
        ``(streams, n, 3)`` float32: sums of linear radiance over the samples of each stream.
    height:
        ``(n,)`` float32: z in mm, in the display's frame, of what the first sample meets; NaN where it meets nothing.
    """

    sums: Floats
    height: Floats


class Lanes:
    """The lanes of a wavefront: so many samples of some pixels in each of so many streams, in this order.

    Parameters
    ----------
    pixels:
        The pixels of a picture.
    part:
        Which of them.
    streams, samples:
        Streams, and samples in each.
    first:
        Number of the first sample.
    """

    def __init__(self, pixels: PixelSet, part: slice, streams: int = 1, samples: int = 1, first: int = 0) -> None:
        self.part = part
        column, row, channel = (values[part] for values in (pixels.column, pixels.row, pixels.channel))
        each = streams * samples
        self._shape = len(column), streams, samples
        stream = np.tile(np.repeat(np.arange(streams, dtype=np.uint32), samples), len(column))
        sample = np.tile(np.arange(first, first + samples, dtype=np.uint32), len(column) * streams)
        places = (values if each == 1 else np.repeat(values, each) for values in (column, row, channel))
        # Held here, since the device reads them in place.
        self._host = [aligned(values) for values in (*places, stream, sample)]
        self.arrays = [mi.UInt32(values) for values in self._host]

    def sums(self, values: Floats) -> Floats:
        """Sums ``(pixels, streams)`` of the values of lanes."""
        return np.asarray(values.reshape(self._shape).sum(axis=2))

    def firsts(self, values: Floats) -> Floats:
        """The values ``(pixels,)`` of each pixel's first lane."""
        return np.asarray(values.reshape(self._shape)[:, 0, 0])


def _two_lanes() -> Lanes:
    pair = np.zeros(2, np.uint32)
    return Lanes(PixelSet(pair, pair, pair, np.zeros((1, 1, 1), np.int32)), slice(0, 2))


class PlacedDisplay:
    """A display's place in the world, as inputs of kernels."""

    def __init__(self, world_from_display: Matrix) -> None:
        matrix = np.asarray(world_from_display, np.float64)
        display_from_world = inverse(matrix)
        #: Rows of the map to the world, and that which gives the height in the display's frame.
        self.rows = opaque_rows(matrix)
        self.height = [dr.opaque(mi.Float, float(value)) for value in display_from_world[2]]
        #: From world directions of normals to the display's frame.
        self.rotation = rotation_of(matrix)[:3, :3].T.astype(np.float32)


class LiveTracer:
    """Traces pixels of one display in one scene.

    Parameters
    ----------
    display:
        The display.
    integrator:
        Gathers the light.
    subpixels:
        Whether sub-pixels have rays of their own.
    box_filter:
        Whether samples are spread over the pixel, not all at its centre.
    """

    def __init__(self, display: Display, integrator: LiveIntegrator, *, subpixels: bool, box_filter: bool) -> None:
        self._rays = _Rays(display, subpixels, box_filter)
        # In a list, that the kernel may read another one's arrays.
        self._integrator = [integrator]
        self.kernel = Frozen(self._sample, self._integrator, changes=True)
        # The first launches change how scenes of several emitters lie on the device.
        for _ in range(_WARMING_LAUNCHES):
            self.trace(_two_lanes(), PlacedDisplay(np.eye(4)), seed=0)

    def trace_by(self, integrator: LiveIntegrator) -> None:
        """Gather light by another integrator of the same scene and depth."""
        self._integrator[0] = integrator

    def trace(self, lanes: Lanes, placed: PlacedDisplay, *, seed: int) -> Samples:
        """The samples of ``lanes``."""
        found = self.kernel(*lanes.arrays, dr.opaque(mi.UInt32, seed), placed.rows, placed.height)
        red, green, blue, height = (np.asarray(values) for values in found)
        sums = np.stack([lanes.sums(values).T for values in (red, green, blue)], axis=-1)
        return Samples(sums, lanes.firsts(height))

    def _sample(
        self,
        column: UInt32,
        row: UInt32,
        channel: UInt32,
        stream_of: UInt32,
        sample: UInt32,
        seed: UInt32,
        rows: Rows,
        height_row: list[Float],
    ) -> tuple[Array, ...]:
        ray, stream = self._rays.sampled((column, row, channel), stream_of, sample, seed, rows)
        stream.half = stream_of
        (integrator,) = self._integrator
        if isinstance(integrator, PathIntegrator):
            radiance, _, hit = integrator.sample_with_hit(ray, stream, mi.Bool(True))
            distance = hit.distance
        else:
            radiance, _ = integrator.sample(ray, stream, mi.Bool(True))
            distance = integrator.scene.ray_intersect_preliminary(ray, coherent=True, active=True).t
        finite = dr.isfinite(radiance.x) & dr.isfinite(radiance.y) & dr.isfinite(radiance.z)
        radiance = dr.select(finite, radiance, mi.Color3f(0))
        hits = dr.isfinite(distance) & (distance < dr.largest(mi.Float) / 2)
        p = ray(dr.select(hits, distance, 0))
        a, b, c, d = height_row
        height = dr.select(hits, a * p.x + b * p.y + c * p.z + d, dr.nan)
        return radiance.x, radiance.y, radiance.z, height


class FeatureTracer:
    """Traces feature buffers of a denoiser for pixels: albedo and normal of what each sees.

    Parameters
    ----------
    display:
        The display.
    surfaces:
        Those of the scene.
    subpixels, box_filter:
        As for the picture.
    """

    def __init__(self, display: Display, surfaces: Surfaces, *, subpixels: bool, box_filter: bool) -> None:
        self._rays = _Rays(display, subpixels, box_filter)
        self._surfaces = surfaces
        self.kernel = Frozen(self._features, surfaces, changes=True)
        for _ in range(_WARMING_LAUNCHES):
            self.trace(_two_lanes(), PlacedDisplay(np.eye(4)), seed=0)

    def trace(self, lanes: Lanes, placed: PlacedDisplay, *, seed: int) -> tuple[Floats, Floats]:
        """Sums of albedo and normal ``(n, 3)`` over the samples of ``lanes``; normals in the display's frame."""
        found = self.kernel(*lanes.arrays, dr.opaque(mi.UInt32, seed), placed.rows)
        sums = np.concatenate([lanes.sums(np.asarray(values)) for values in found], axis=1)
        return sums[:, :3], sums[:, 3:] @ placed.rotation.T

    def _features(
        self,
        column: UInt32,
        row: UInt32,
        channel: UInt32,
        stream_of: UInt32,
        sample: UInt32,
        seed: UInt32,
        rows: Rows,
    ) -> tuple[Array, ...]:
        ray, _ = self._rays.sampled((column, row, channel), stream_of, sample, seed, rows)
        albedo, normal, _, _ = self._surfaces.features(ray)
        # Of the lanes' width, also where all lanes see the same.
        zero = mi.Float(sample) * 0
        return tuple(mi.Float(part) + zero for part in (*albedo, *normal))


class _Rays:
    """Rays of a display's pixels, whose place in the world is an input."""

    def __init__(self, display: Display, subpixels: bool, box_filter: bool) -> None:
        self._source = DisplayRays(display, np.eye(4), subpixels)
        self._box_filter = box_filter

    def sampled(
        self, pixel: tuple[UInt32, UInt32, UInt32], stream_of: UInt32, sample: UInt32, seed: UInt32, rows: Rows
    ) -> tuple[Ray3f, SampleStream]:
        """The ray of a sample of a pixel (column, row, channel), and the random numbers of what follows it."""
        column, row, channel = pixel
        number = (row * self._source.width + column) * self._source.channels + channel
        stream = SampleStream.of_pixels(number, sample, seed + stream_of * SEED_STEP)
        jitter = stream.next_2d(PIXEL_DIMENSION) if self._box_filter else mi.Point2f(0.5)
        return world_ray_by(rows, *self._source.light_rays(column, row, channel, jitter)), stream
