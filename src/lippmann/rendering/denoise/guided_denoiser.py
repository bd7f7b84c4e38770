"""Open Image Denoise for the successive states of one picture, with feature buffers ("guides") that are traced once.

The network gets the pixels in panel order: near the lens plane they look like a plain picture. Sky and background
behind all surfaces have no noise. So the network gets the rectangle that contains all surfaces, and its output is used
near surfaces only.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display.micro_image_layout import lens_numbers, lens_numbers_in_full_color
from lippmann.options.choices import Denoiser
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.denoise.oidn import NETWORK_STEP, Effort, denoise
from lippmann.rendering.denoise.tuning import TUNING
from lippmann.rendering.film.feature_buffers import Guides, plan_guides, trace_guides
from lippmann.rendering.film.wavefront import Coverage
from lippmann.rendering.request.tuning import TUNING as REQUEST
from lippmann.rendering.sharing.cross_lens import share_light
from lippmann.rendering.sharing.cross_view import share_views
from lippmann.rendering.sharing.tuning import TUNING as SHARING
from lippmann.rendering.transport.ray_source import DisplayRays, OnePicture, QuiltRays, SubpixelRays

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic

Floats = NDArray[np.float32]

#: Margin in pixels around the surfaces, so that the network sees their background; whole steps of the network.
MARGIN = NETWORK_STEP


class GuidedDenoiser:
    """Denoises pictures ``(H, W, 3)`` linear, one pixel for each of ``source``.

    Parameters
    ----------
    built, source, display_from_world, box_filter:
        Those of the picture, for tracing its guides.
    memory:
        Bytes that may be used.
    threads:
        Of the denoiser.
    kind:
        The network's effort, or "oidn" to choose it by the number of samples.
    shares:
        Micro-images share their light, see :mod:`lippmann.rendering.sharing.cross_lens`, and so do the views of a
        quilt, see :mod:`lippmann.rendering.sharing.cross_view`.

    Attributes
    ----------
    seconds:
        Spent so far, guides included.
    used:
        The effort of the last picture.
    variance:
        Of one sample, by the noise that was taken from the last picture.
    """

    def __init__(
        self,
        built: BuiltScene | BuiltClassic,
        source: OnePicture | QuiltRays,
        display_from_world: NDArray[np.float64],
        *,
        box_filter: bool,
        memory: int,
        threads: int,
        kind: Denoiser,
        shares: bool = False,
        progress: ProgressCallback = silent,
    ) -> None:
        self._built = built
        self._source = source
        self._display_from_world = display_from_world
        self._box_filter = box_filter
        self._memory = memory
        self._threads = threads
        self._kind: Denoiser = kind
        self._shares = shares
        self._lenses: NDArray[np.int32] | None = None
        self._progress = progress
        self._guides: Guides | None = None
        self._mask: NDArray[np.bool_] | None = None
        #: The surfaces in every tile of the source, by the guides.
        self._surfaces: list[SurfacePart | None] = []
        self.seconds = 0.0
        self.used: Effort = "fast"
        self.variance = 0.0

    def __call__(self, pixels: Floats, samples: int, rotated: bool = False) -> Floats:
        """The denoised picture, with its light shared where that is asked for.

        Views of a quilt share their light before denoising, micro-images after it. ``samples`` are those of each pixel
        in two half-buffers, of which this is one, or twice those of a picture in one stream; ``rotated`` is that of
        :func:`~lippmann.rendering.denoise.oidn.denoise`.
        """
        started = time.perf_counter()
        self._progress(Progress("denoise", 0, 1))
        self.used = choose_effort(self._kind, samples)
        guides = self.guides()
        if self._shares and isinstance(self._source, QuiltRays):
            pixels = share_views(pixels, self._source, guides)
        # The network overshoots below black beside bright edges.
        clean = np.maximum(self._denoise_tiles(pixels, guides, rotated), np.float32(0))
        if self._shares and not isinstance(self._source, QuiltRays):
            clean = self._share(clean)
        self.variance = samples / 2 * measure_noise(pixels, clean)
        self._progress(Progress("denoise", 1, 1))
        self.seconds += time.perf_counter() - started
        return clean

    def restrict_to(self, mask: NDArray[np.bool_]) -> None:
        """Denoise the pixels where ``mask (H, W)``, with those around them; the values of others mean nothing."""
        self._mask, self._surfaces = mask, []

    def _share(self, clean: Floats) -> Floats:
        """A denoised picture with the light shared between its micro-images."""
        source = self._source
        assert isinstance(source, DisplayRays | SubpixelRays)
        if self._lenses is None:
            if isinstance(source, SubpixelRays):
                self._lenses = lens_numbers_in_full_color(source.display, source.window)
            else:
                self._lenses = lens_numbers(source.display, source.window, subpixels=source.channels == 3)
        display, columns = source.display, 3 if isinstance(source, SubpixelRays) else 1
        return share_light(
            clean,
            display,
            self.guides(),
            stop=SHARING.stop,
            lenses=self._lenses,
            columns=columns,
            mask=self._mask,
        )

    def coverage(self) -> tuple[Coverage, Coverage] | None:
        """Coverage of every pixel by the guides' rays, one for each half of them; None where it is not known."""
        started = time.perf_counter()
        coverage_halves = self.guides().coverage
        self.seconds += time.perf_counter() - started
        return coverage_halves

    def probe(self, samples: int) -> float:
        """Estimated seconds to denoise both halves, guides included, extrapolated from a small picture."""
        side = 128
        small = np.zeros((side, side, 3), dtype=np.float32)
        effort = choose_effort(self._kind, samples)
        denoise(small, small, small, clean_guides=True, effort=effort, threads=self._threads)  # starts threads
        started = time.perf_counter()
        denoise(small, small, small, clean_guides=True, effort=effort, threads=self._threads)
        return TUNING.runs * (time.perf_counter() - started) * self._source.width * self._source.height / side**2

    def _denoise_tiles(self, pixels: Floats, guides: Guides, rotated: bool) -> Floats:
        source = self._source
        if not self._surfaces:
            mask = self._mask
            parts = [(guides.normal[tile], None if mask is None else mask[tile]) for tile in source.tiles()]
            self._surfaces = [SurfacePart.of(*part) for part in parts]
        result = np.empty_like(pixels)
        for tile, surfaces in zip(source.tiles(), self._surfaces, strict=True):
            result[tile] = denoise_surfaces(
                pixels[tile],
                guides.albedo[tile],
                guides.normal[tile],
                surfaces,
                effort=self.used,
                rotated=rotated,
                threads=self._threads,
            )
        return result

    def guides(self) -> Guides:
        """Albedo and normal of what the pixels see."""
        if self._guides is None:
            self._guides = trace_guides(
                self._built,
                self._source,
                plan_guides(self._source, TUNING.guide_samples, self._memory),
                self._display_from_world,
                box_filter=self._box_filter,
                progress=self._progress,
            )
        return self._guides


def measure_noise(noisy: Floats, clean: Floats) -> float:
    """Noise that a denoiser took from a picture: the squared mean change of the roots of light, which are much like
    codes. The mean square would rest on single paths.
    """
    rows = zip(noisy, clean, strict=True)  # one by one: copies of the picture would count
    return float(np.mean([np.abs(np.subtract(*np.sqrt(np.clip(pair, 0, 1)))).mean() for pair in rows])) ** 2


def choose_effort(kind: Denoiser, samples: int) -> Effort:
    """The effort that ``kind`` names; where it names none, that for the number of samples per pixel."""
    if kind in ("oidn-fast", "oidn-high"):
        return "fast" if kind == "oidn-fast" else "high"
    return "high" if samples >= REQUEST.usual else "fast"


@dataclass(frozen=True, eq=False)
class SurfacePart:
    """The rectangle of a picture that holds all surfaces, and a margin.

    Attributes
    ----------
    place:
        Its rows and columns.
    near:
        ``(h, w, 1)`` bool: pixels of it that show surfaces or are close to one.
    """

    place: tuple[slice, slice]
    near: NDArray[np.bool_]

    @staticmethod
    def of(normal: NDArray[np.generic], mask: NDArray[np.bool_] | None = None) -> SurfacePart | None:
        """The part with all surfaces of a picture, by its normals ``(H, W, 3)``, 0 off surfaces; None without any.

        With ``mask (H, W)``, the part with those pixels of the mask that show a surface or are close to one.
        """
        is_surface = (normal[..., 0] != 0) | (normal[..., 1] != 0) | (normal[..., 2] != 0)
        near = _dilate(is_surface)
        place = _bound_surfaces(is_surface if mask is None else near & mask)
        return None if place is None else SurfacePart(place, near[place][..., None])


def denoise_surfaces(
    color: NDArray[np.generic],
    albedo: NDArray[np.generic],
    normal: NDArray[np.generic],
    surfaces: SurfacePart | None,
    *,
    effort: Effort = "high",
    rotated: bool = False,
    threads: int | None = None,
) -> Floats:
    """The denoised picture; arguments as those of :func:`~lippmann.rendering.denoise.oidn.denoise`.

    The network gets the rectangle of the ``surfaces``, those of ``normal``. Pixels that are not near a surface are left
    as they are, so that no border of that rectangle shows.
    """
    if surfaces is None:
        return np.array(color, dtype=np.float32)
    place = surfaces.place
    images = color[place], albedo[place], normal[place]
    # Guides follow mirrors and glass deterministically, so they are noisy along edges alone.
    clean = denoise(*images, clean_guides=True, effort=effort, rotated=rotated, threads=threads)
    # Copied after the network, whose memory is the largest.
    result = np.array(color, dtype=np.float32)
    np.copyto(result[place], clean, where=surfaces.near)
    return result


def _dilate(is_surface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The mask dilated by one pixel: guides of few samples miss edges that barely reach into a pixel."""
    for axis in (0, 1):
        lines = np.swapaxes(is_surface, 0, axis)
        wide = lines.copy()
        wide[1:] |= lines[:-1]
        wide[:-1] |= lines[1:]
        is_surface = np.swapaxes(wide, 0, axis)
    return is_surface


def _bound_surfaces(is_surface: NDArray[np.bool_]) -> tuple[slice, slice] | None:
    """Rows and columns with all surfaces, and a margin; None if there is none."""
    spans = []
    for axis in (1, 0):
        there = np.flatnonzero(np.any(is_surface, axis=axis))
        if not len(there):
            return None
        first = max(0, (int(there[0]) // MARGIN - 1) * MARGIN)
        spans.append(slice(first, min(is_surface.shape[1 - axis], int(there[-1]) + 1 + MARGIN)))
    return spans[0], spans[1]
