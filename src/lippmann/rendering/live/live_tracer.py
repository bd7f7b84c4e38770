"""Samples along the rays of arbitrary native pixels, by kernels that are recorded once.

A pixel has the rays and random numbers of a render: with one stream those of
:func:`lippmann.rendering.film.wavefront.trace_frame`, with two streams those of
:class:`lippmann.rendering.film.sample_batches.BatchedRender`. Placement, light, exposure, seed and pixels are inputs of
the kernel, so that changing them needs no other kernel.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.frozen_kernel import Frozen, align
from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream
from lippmann.device.types import Array, Float, Float64, Ray3f, UInt32
from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.display.visible_pixels import PixelSet, window_pixels
from lippmann.rendering.film.wavefront import blacken_invalid
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

#: Launches that warm a kernel up; later ones need no recording.
_WARMING_LAUNCHES = 4


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of the n pixels of a wavefront.

    Attributes
    ----------
    sums:
        ``(streams, n, 3)`` float32: sums of linear radiance over the samples of each stream.
    height:
        ``(n,)`` float32: z in mm, in the display's frame, of the first sample's hit; NaN without a hit.
    """

    sums: Floats
    height: Floats


class Lanes:
    """The lanes of a wavefront, ordered pixel, stream, sample.

    Parameters
    ----------
    pixels:
        The pixels of a picture.
    part:
        The slice of them that is traced.
    streams, samples:
        Number of streams, and of samples in each.
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
        # Kept alive, as the device reads them in place.
        self._host = [align(values) for values in (*places, stream, sample)]
        self.arrays = [mi.UInt32(values) for values in self._host]

    def sums(self, values: Floats) -> Floats:
        """Sums over samples, ``(pixels, streams)``, of one value per lane."""
        return np.asarray(values.reshape(self._shape).sum(axis=2))

    def firsts(self, values: Floats) -> Floats:
        """The value of each pixel's first lane, ``(pixels,)``, from one per lane."""
        return np.asarray(values.reshape(self._shape)[:, 0, 0])


class PlacedDisplay:
    """A display's place in the world, as inputs of kernels."""

    def __init__(self, world_from_display: Matrix) -> None:
        matrix = np.asarray(world_from_display, np.float64)
        display_from_world = inverse(matrix)
        #: Rows of world_from_display, and the z row of its inverse.
        self.rows = opaque_rows(matrix)
        self.height = [dr.opaque(mi.Float, float(value)) for value in display_from_world[2]]
        #: Rotation of normals from the world to the display's frame.
        self.rotation = rotation_of(matrix)[:3, :3].T.astype(np.float32)


class _PixelTracer:
    """A kernel over pixels of one display, whose place in the world is an input of it.

    Parameters
    ----------
    display:
        The display.
    reads:
        What the kernel reads, see :class:`~lippmann.device.frozen_kernel.Frozen`.
    subpixels:
        Whether sub-pixels have rays of their own.
    box_filter:
        Whether samples are spread over the pixel, not all at its centre.
    """

    def __init__(self, display: Display, reads: object, subpixels: bool, box_filter: bool) -> None:
        self._source, self._box_filter = DisplayRays(display, np.eye(4), subpixels), box_filter
        self.kernel = Frozen(self._sample_pixels, [reads, self._source], changes=True)
        # In scenes of several emitters the first launches change the layout of arrays on the device.
        lanes = Lanes(window_pixels(display, PixelWindow(0, 0, 1, 1), subpixels=False), slice(None))
        for _ in range(_WARMING_LAUNCHES):
            self._launch(lanes, PlacedDisplay(np.eye(4)), seed=0)

    def _launch(self, lanes: Lanes, placed: PlacedDisplay, *, seed: int) -> list[Floats]:
        """Values of :meth:`_sample` for each lane."""
        values = self.kernel(*lanes.arrays, dr.opaque(mi.UInt32, seed), placed.rows, placed.height)
        return [np.asarray(each) for each in values]

    def _sample_pixels(
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
        number = self._source.number(column, row) * self._source.channels + channel
        stream = SampleStream.of_pixels(number, sample, seed, stream_of)
        jitter = stream.next_2d(PIXEL_DIMENSION) if self._box_filter else mi.Point2f(0.5)
        ray = world_ray_by(rows, *self._source.light_rays(column, row, channel, jitter))
        # Broadcast values of width 1 to all lanes.
        zero = mi.Float(sample) * 0
        return tuple(mi.Float(part) + zero for part in self._sample(ray, stream, height_row))

    def _sample(self, ray: Ray3f, stream: SampleStream, height_row: list[Float]) -> tuple[Float, ...]:
        raise NotImplementedError


class LiveTracer(_PixelTracer):
    """Traces radiance and depth of pixels by an ``integrator``."""

    def __init__(self, display: Display, integrator: LiveIntegrator, subpixels: bool, box_filter: bool) -> None:
        # In a list, so that the recorded kernel can read another integrator's arrays.
        self._integrator = [integrator]
        super().__init__(display, self._integrator, subpixels, box_filter)

    def trace_by(self, integrator: LiveIntegrator) -> None:
        """Replace the integrator by another one of the same scene and depth."""
        self._integrator[0] = integrator

    def trace(self, lanes: Lanes, placed: PlacedDisplay, *, seed: int) -> Samples:
        """The samples of ``lanes``."""
        *radiance, height = self._launch(lanes, placed, seed=seed)
        sums = np.stack([lanes.sums(values).T for values in radiance], axis=-1)
        return Samples(sums, lanes.firsts(height))

    def _sample(self, ray: Ray3f, stream: SampleStream, height_row: list[Float]) -> tuple[Float, ...]:
        (integrator,) = self._integrator
        if isinstance(integrator, PathIntegrator):
            radiance, _, hit = integrator.sample_with_hit(ray, stream, mi.Bool(True))
            distance = hit.distance
        else:
            radiance, _ = integrator.sample(ray, stream, mi.Bool(True))
            distance = integrator.scene.ray_intersect_preliminary(ray, coherent=True, active=True).t
        radiance, _ = blacken_invalid(radiance)
        hits = dr.isfinite(distance) & (distance < dr.largest(mi.Float) / 2)
        p = ray(dr.select(hits, distance, 0))
        a, b, c, d = height_row
        return *radiance, dr.select(hits, a * p.x + b * p.y + c * p.z + d, dr.nan)


class FeatureTracer(_PixelTracer):
    """Traces feature buffers of a denoiser: albedo and normal of what pixels see of the ``surfaces``."""

    def __init__(self, display: Display, surfaces: Surfaces, subpixels: bool, box_filter: bool) -> None:
        self._surfaces = surfaces
        super().__init__(display, surfaces, subpixels, box_filter)

    def trace(self, lanes: Lanes, placed: PlacedDisplay, *, seed: int) -> tuple[Floats, Floats]:
        """Sums of albedo and normal ``(n, 3)`` over the samples of ``lanes``; normals in the display's frame."""
        sums = np.concatenate([lanes.sums(values) for values in self._launch(lanes, placed, seed=seed)], axis=1)
        return sums[:, :3], sums[:, 3:] @ placed.rotation.T

    def _sample(self, ray: Ray3f, stream: SampleStream, height_row: list[Float]) -> tuple[Float, ...]:
        albedo, normal, *_ = self._surfaces.features(ray)
        return *albedo, *normal
