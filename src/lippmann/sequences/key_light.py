"""Light of a key frame in the frames after it, which trace paths for the other pixels alone.

Two kinds of films share light. Where the scene and its light are at rest and the display alone moves, a diffuse surface
keeps its radiance: pixels take the irradiance of the key frame's denoised picture at the same point, times their own
albedo (:mod:`lippmann.device.pbr.diffuse_pixels`). Disocclusions, outlines, emitters, edges of shadows, and surfaces
that are not diffuse are traced. Where the display is at rest, pixels whose light does not change keep it
(:mod:`lippmann.sequences.still_pixels`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.sequences.cuts import Moment, is_light_at_rest
from lippmann.sequences.tuning import TUNING

if TYPE_CHECKING:
    from lippmann.device.pbr.diffuse_pixels import DiffusePixels, KeyPicture
    from lippmann.display.nearby_views import NearbyViews
    from lippmann.rendering.methods import Job, Traced
    from lippmann.rendering.transport.path import PreparedLight
    from lippmann.rendering.transport.ray_source import OnePicture, QuiltRays, SinglePixelRays

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]


class KeyLight(ABC):
    """Keeps the picture of a key frame, and traces the frames after it with its light."""

    #: Whether pixels keep their noise, too, so that it would jump at the next key frame with another seed.
    keeps_noise = False
    #: Every so many frames one passes on the light that it took.
    frames_of_link = TUNING.frames_of_key
    #: Share of a key frame's squared error in the pixels that have been traced since: these alone flicker.
    traced_error = 1.0
    #: What is kept of the key frame.
    _key: object | None = None

    @property
    def has_light(self) -> bool:
        """Whether the last key frame's light is kept: not of pictures that are traced whole."""
        return self._key is not None

    def trace_key(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a key frame; parameters as of ``trace_through`` in
        :class:`~lippmann.rendering.request.render_request.RenderRequest`.
        """
        self._forget()  # the pictures of two key frames may not fit the memory
        traced = trace(job)
        self._keep(job, traced)
        return traced

    def pass_on(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a frame as :meth:`trace_next`; it is the key frame of those after it."""
        traced = self.trace_next(job, trace)
        self._forget()
        self._keep(job, traced)
        return traced

    @abstractmethod
    def trace_next(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a frame after a key frame for which :meth:`holds` is true, with the light of that."""

    @abstractmethod
    def holds(self, key: Moment, moment: Moment) -> bool:
        """Whether a frame may take light of a key frame, as far as their scenes and displays tell."""

    @abstractmethod
    def _keep(self, job: Job, traced: Traced) -> None:
        """Keep the picture of a job."""

    def _forget(self) -> None:
        self._key = None


class LightOfSurfaces(KeyLight):
    """The irradiance of diffuse surfaces of a scene at rest, for a display that moves."""

    frames_of_link = TUNING.frames_of_link

    def __init__(self) -> None:
        self._key: tuple[PreparedLight, KeyPicture] | None = None

    def trace_next(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        if self._key is None or self._key[0] is not light_of(job):
            return trace(job)
        pixels, is_known = _gather_light(self._key[1], job)
        return trace_others(job, pixels, is_known) if is_known.any() else trace(job)

    def holds(self, key: Moment, moment: Moment) -> bool:
        return is_light_at_rest(key, moment)

    def _keep(self, job: Job, traced: Traced) -> None:
        from lippmann.device.pbr.diffuse_pixels import KeyPicture

        light, views = light_of(job), _find_views(job)
        if light is not None and views is not None:
            colors = _split_columns(job, traced.frame.pixels)
            self._key = light, KeyPicture(_make_pixels(job), colors, views, count_columns(job))


def light_of(job: Job) -> PreparedLight | None:
    """The light of a job whose denoised picture may share it; None for all others."""
    from lippmann.rendering.transport.path import PathIntegrator

    if job.request.denoise == "none" or not isinstance(job.integrator, PathIntegrator):
        return None
    return job.integrator.light


def _find_views(job: Job) -> NearbyViews | None:
    """The views of a job's picture; None of micro-lens arrays whose sub-pixels have rays of their own."""
    from lippmann.display.nearby_views import CameraViews, LensViews
    from lippmann.rendering.transport.ray_source import DisplayRays, QuiltRays

    source = job.source
    if isinstance(source, QuiltRays):
        return CameraViews(source.display, source.columns, source.rows, source.view_size, source.window)
    if not isinstance(source, DisplayRays) or job.sample_source.channels > 1:
        return None
    return LensViews(source.display, source.window)


def count_columns(job: Job) -> int:
    """Columns that are traced of each pixel: 3 of sub-pixels in full colour, else 1."""
    return job.sample_source.width // job.source.width


def _split_columns(job: Job, pixels: Floats) -> Floats:
    """``pixels (H, W, 3)`` in traced columns: as they are, or ``(H, 3 W, 1)`` one colour for each sub-pixel."""
    from lippmann.rendering.transport.ray_source import SubpixelRays

    if not isinstance(job.sample_source, SubpixelRays):
        return pixels
    order = list(job.sample_source.display.panel.subpixel_order)
    return np.ascontiguousarray(pixels[..., order].reshape(len(pixels), -1, 1))


def _make_pixels(job: Job) -> DiffusePixels:
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
        _split_columns(job, albedo),
    )


def _gather_light(key: KeyPicture, job: Job) -> tuple[Floats, Mask]:
    """The light ``(H, columns W, 3)`` by a key frame, and the pixels ``(H, W)`` in which it is known."""
    from lippmann.rendering.sharing.cross_lens import light_of_pixels
    from lippmann.rendering.transport.ray_source import SubpixelRays

    source, albedo = job.sample_source, job.denoiser.guides().albedo
    table = light_of_pixels(partial(key.irradiance, _make_pixels(job), job.request.coding), (*albedo.shape[:2], 4))
    irradiance, is_known = table[..., :3], np.asarray(table[..., 3] > 0)
    if isinstance(source, SubpixelRays):
        # Each column has one colour's own; the others are those beside it.
        irradiance = np.repeat(source.own_colors(irradiance), 3, axis=1)
        is_known = np.all(is_known.reshape(len(is_known), -1, 3), axis=2)
    return irradiance * albedo, is_known


def rays_of(source: OnePicture | QuiltRays, is_chosen: Mask) -> Iterator[tuple[SinglePixelRays, tuple[Places, Places]]]:
    """Rays of the chosen pixels ``(H, W)`` of a source, no more at once than a wavefront takes.

    Yields the rays, and the rows and columns ``(n,)`` of their pixels.
    """
    from lippmann.rendering.film.memory_model import preferred_lanes
    from lippmann.rendering.film.wavefront import STRIP_ROWS
    from lippmann.rendering.transport.ray_source import SinglePixelRays

    rows, columns = np.nonzero(is_chosen)
    order = np.lexsort((rows % STRIP_ROWS, columns, rows // STRIP_ROWS))  # neighbours take much the same paths
    for start in range(0, len(order), preferred_lanes()):
        part = order[start : start + preferred_lanes()]
        places = rows[part], columns[part]
        yield SinglePixelRays(source, *places[::-1], np.zeros_like(part)), places


def trace_others(job: Job, pixels: Floats, is_known: Mask) -> Traced:
    """The picture with ``pixels`` where their light ``is_known``; the others are traced and denoised among them."""
    from lippmann.rendering.film.wavefront import Frame
    from lippmann.rendering.methods import SAMPLES_LAYER, Traced, denoise_whole
    from lippmann.rendering.transport.ray_source import SubpixelRays

    source = job.sample_source
    colors = source.own_colors(pixels) if isinstance(source, SubpixelRays) else pixels
    share = float(is_known.mean())
    shares = {"traced": 1 - share, "reprojected": share, "interpolated": 0.0}
    # Few noisy pixels among clean ones keep more of their noise in the denoiser: up to the key frame's samples.
    request = replace(job.request, spp=round(min(1 + share, 1 / TUNING.samples_kept) * job.request.samples))
    note = f"{100 * share:.0f} % of the pixels have the key frame's light, the others {request.samples} samples"
    if is_known.all():
        frame = Frame(colors, shares=shares)
        frame.maps[SAMPLES_LAYER] = np.zeros(is_known.shape, np.uint32)
        return Traced(frame, request.samples, notes=(request.judged_by, note))
    is_traced = ~np.repeat(is_known, count_columns(job), axis=1)
    few = replace(job, session=replace(job.session, request=request))
    traced = _trace_some(few, pixels, is_traced, sum_coverage(job), note)
    traced.frame.shares = shares
    job.denoiser.restrict_to(is_traced)
    traced = denoise_whole(job, traced)
    traced.frame.pixels[is_known] = colors[is_known]
    return traced


def _trace_some(job: Job, pixels: Floats, is_traced: Mask, coverage: Floats, note: str) -> Traced:
    """The picture in one stream, not denoised, with ``pixels (H, columns W, 3)`` but where ``is_traced``.

    ``coverage (H, columns W)`` is that of the others.
    """
    from lippmann.rendering.film.wavefront import Coverage, Frame
    from lippmann.rendering.methods import SAMPLES_LAYER, Traced, trace_one_stream

    whole, samples = Frame(np.array(pixels, np.float32)), job.request.samples
    for few, places in rays_of(job.sample_source, is_traced):
        part = trace_one_stream(replace(job, source=few)).frame
        whole.pixels[places] = part.pixels[0]
        if part.specular is not None and part.excess is not None:
            if whole.specular is None or whole.excess is None:
                whole.specular, whole.excess = np.zeros((2, *pixels.shape), np.float32)
            whole.specular[places], whole.excess[places] = part.specular[0], part.excess[0]
        if part.coverage is not None:
            whole.coverage = whole.coverage or Coverage(coverage[..., None].copy(), samples)
            whole.coverage.share[places] = part.coverage.share[0]
        whole.rays += part.rays
        whole.seconds_compile += part.seconds_compile
        whole.seconds_trace += part.seconds_trace
    by_pixel = is_traced.reshape(len(is_traced), -1, count_columns(job)).any(axis=2)
    whole.maps[SAMPLES_LAYER] = np.where(by_pixel, np.uint32(samples), np.uint32(0))
    return Traced(whole, samples, notes=(job.request.judged_by, note))


def sum_coverage(job: Job) -> Floats:
    """Coverage ``(H, columns W)`` by surfaces of any kind."""
    coverage = job.denoiser.coverage()
    assert coverage is not None  # guides of one set of rays have it
    return (coverage[0] + coverage[1]).share[..., 0]


__all__ = ["KeyLight", "LightOfSurfaces", "count_columns", "light_of", "rays_of", "trace_others"]
