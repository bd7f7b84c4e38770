"""Light of a key frame in the frames after it, while the scene and its light are at rest and the display alone moves.

A diffuse surface then keeps its radiance. So a frame after a key frame traces the feature buffers of all pixels, but
paths for some of them alone: disocclusions, outlines, emitters, edges of shadows, and surfaces that are not diffuse.
All others take the irradiance of the key frame's denoised picture at the same point, times their own albedo; see
:mod:`lippmann.device.pbr.diffuse_pixels`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from lippmann.device.pbr.diffuse_pixels import DiffusePixels, KeyPicture
    from lippmann.display.nearby_views import NearbyViews
    from lippmann.rendering.methods import Job, Traced
    from lippmann.rendering.transport.path import PreparedLight

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]


class KeyLight:
    """Keeps the picture of a key frame, and traces the frames after it with its light."""

    def __init__(self) -> None:
        self._key: tuple[PreparedLight, KeyPicture] | None = None

    def trace_key(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a key frame; parameters as of ``trace_through`` in
        :class:`~lippmann.rendering.request.render_request.RenderRequest`.
        """
        self._key = None  # the pictures of two key frames may not fit the memory
        traced = trace(job)
        self._keep(job, traced)
        return traced

    def trace_next(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a frame that shows the scene of the key frame at rest, with the light of that."""
        if self._key is None or self._key[0] is not _light_of(job):
            return trace(job)
        pixels, is_known = _known_light(self._key[1], job)
        return _trace_others(job, pixels, is_known) if is_known.any() else trace(job)

    def pass_on(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a frame as :meth:`trace_next`; it is the key frame of those after it."""
        traced = self.trace_next(job, trace)
        self._key = None
        self._keep(job, traced)
        return traced

    def _keep(self, job: Job, traced: Traced) -> None:
        """Keep the picture of a job."""
        from lippmann.device.pbr.diffuse_pixels import KeyPicture

        light, views = _light_of(job), _views_of(job)
        if light is not None and views is not None:
            colors = _each_column(job, traced.frame.pixels)
            self._key = light, KeyPicture(_pixels_of(job), colors, views, _columns(job))


def _light_of(job: Job) -> PreparedLight | None:
    """The light of a job whose denoised picture may share it; None for all others."""
    from lippmann.rendering.transport.path import PathIntegrator

    if job.request.denoise == "none" or not isinstance(job.integrator, PathIntegrator):
        return None
    return job.integrator.light


def _views_of(job: Job) -> NearbyViews | None:
    """The views of a job's picture; None of micro-lens arrays whose sub-pixels have rays of their own."""
    from lippmann.display.nearby_views import CameraViews, LensViews
    from lippmann.display.panel import PixelWindow
    from lippmann.rendering.transport.ray_source import DisplayRays, QuiltRays, WindowRays

    source = job.source
    if isinstance(source, QuiltRays):
        return CameraViews(source.display, source.columns, source.rows, source.view_size, source.window)
    if not isinstance(source, DisplayRays | WindowRays) or job.sample_source.channels > 1:
        return None
    whole = PixelWindow(0, 0, source.width, source.height)
    return LensViews(source.display, source.window if isinstance(source, WindowRays) else whole)


def _columns(job: Job) -> int:
    """Columns that are traced of each pixel: 3 of sub-pixels in full colour, else 1."""
    return job.sample_source.width // job.source.width


def _each_column(job: Job, pixels: Floats) -> Floats:
    """What each column that is traced shows of ``pixels`` ``(H, W, 3)``: all colours, or ``(H, 3 W, 1)`` one alone."""
    from lippmann.rendering.transport.ray_source import SubpixelRays

    if not isinstance(job.sample_source, SubpixelRays):
        return pixels
    order = list(job.sample_source.display.panel.subpixel_order)
    return np.ascontiguousarray(pixels[..., order].reshape(len(pixels), -1, 1))


def _pixels_of(job: Job) -> DiffusePixels:
    """What is traced of a job's picture, on the device."""
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.pbr.diffuse_pixels import DiffusePixels
    from lippmann.rendering.transport.ray_source import SubpixelRays

    guides, source, built = job.denoiser.guides(), job.sample_source, job.session.built
    assert guides.height is not None
    assert isinstance(built, BuiltScene)
    albedo = source.own_colors(guides.albedo) if isinstance(source, SubpixelRays) else guides.albedo
    return DiffusePixels(
        built.mitsuba,
        source.rays,
        job.display_from_world,
        guides.height,
        guides.normal,
        _each_column(job, albedo),
    )


def _known_light(key: KeyPicture, job: Job) -> tuple[Floats, Mask]:
    """The light ``(H, columns W, 3)`` by a key frame, and the pixels ``(H, W)`` in which it is known."""
    from lippmann.rendering.sharing.cross_lens import light_of_pixels
    from lippmann.rendering.transport.ray_source import SubpixelRays

    source, albedo = job.sample_source, job.denoiser.guides().albedo
    table = light_of_pixels(partial(key.irradiance, _pixels_of(job), job.request.coding), (*albedo.shape[:2], 4))
    irradiance, is_known = table[..., :3], np.asarray(table[..., 3] > 0)
    if isinstance(source, SubpixelRays):
        # Each column has one colour's own; the others are those beside it.
        irradiance = np.repeat(source.own_colors(irradiance), 3, axis=1)
        is_known = np.all(is_known.reshape(len(is_known), -1, 3), axis=2)
    return irradiance * albedo, is_known


def _trace_others(job: Job, pixels: Floats, is_known: Mask) -> Traced:
    """The picture with ``pixels`` where their light ``is_known``; the others are traced and denoised among them."""
    from lippmann.rendering.film.wavefront import STRIP_ROWS, Coverage
    from lippmann.rendering.methods import SAMPLES_LAYER, Job, denoise_whole, one_stream
    from lippmann.rendering.transport.ray_source import SinglePixelRays, SubpixelRays

    source = job.sample_source
    rows, columns = np.nonzero(~np.repeat(is_known, _columns(job), axis=1))
    order = np.lexsort((rows % STRIP_ROWS, columns, rows // STRIP_ROWS))  # neighbours take much the same paths
    rows, columns = rows[order], columns[order]
    share = float(is_known.mean())
    # Few noisy pixels among clean ones keep more of their noise in the denoiser: up to twice as many samples.
    request = replace(job.request, spp=round((1 + share) * job.request.samples))
    session = replace(job.session, request=request)
    few = SinglePixelRays(source, columns, rows, np.zeros_like(rows))
    note = f"{100 * share:.0f} % of the pixels have the key frame's light, the others {request.spp} samples"
    traced = one_stream(Job(session, job.integrator, few, job.display_from_world), request.judged_by, note)
    frame = traced.frame

    def spread(part: Floats, others: Floats | float) -> Floats:
        whole = np.empty((*pixels.shape[:2], part.shape[-1]), dtype=np.float32)
        whole[...] = others
        whole[rows, columns] = part[0]
        return whole

    frame.pixels = spread(frame.pixels, pixels)
    frame.specular = None if frame.specular is None else spread(frame.specular, 0.0)
    frame.excess = None if frame.excess is None else spread(frame.excess, 0.0)
    if frame.coverage is not None:
        frame.coverage = Coverage(spread(frame.coverage.share, 1.0), frame.coverage.samples)
    frame.maps[SAMPLES_LAYER] = np.where(is_known, np.uint32(0), np.uint32(traced.samples))
    frame.shares = {"traced": 1 - share, "reprojected": share, "interpolated": 0.0}
    traced = denoise_whole(job, traced)
    shown = source.own_colors(pixels) if isinstance(source, SubpixelRays) else pixels
    traced.frame.pixels[is_known] = shown[is_known]
    return traced


__all__ = ["KeyLight"]
