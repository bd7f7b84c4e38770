"""Open Image Denoise for one picture of one scene: guides are traced once, pictures cleaned as they come.

The network is shown pixels as they lie on the panel: near the lens plane they look like a plain picture there. Sky and
background behind all surfaces have no noise: it is shown the rectangle that holds all surfaces, and cleans what is near
one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.device.sobol import named_seed
from lippmann.display.lens_field import lens_numbers, lens_numbers_in_full_color
from lippmann.options.choices import Denoiser
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.denoise.oidn import NETWORK_STEP, Effort, denoise
from lippmann.rendering.denoise.tuning import TUNING
from lippmann.rendering.film.feature_buffers import Guides, plan_guides, trace_guides
from lippmann.rendering.film.wavefront import Coverage
from lippmann.rendering.sharing.cross_lens import share_light
from lippmann.rendering.sharing.cross_view import share_views
from lippmann.rendering.sharing.tuning import TUNING as SHARING
from lippmann.rendering.transport.ray_source import DisplayRays, OnePicture, QuiltRays, SubpixelRays, WindowRays

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic

Floats = NDArray[np.float32]

#: Pixels around the surfaces, so that the network sees what they stand before; whole steps of the network.
MARGIN = NETWORK_STEP
#: Pixels around the surfaces that are cleaned, too: guides of a few samples miss edges that barely reach into one.
EDGE = 2


class GuidedDenoiser:
    """Takes the noise out of pictures; called with ``(H, W, 3)`` linear pixels, one for each of ``source``.

    Parameters
    ----------
    built, source, display_from_world, seed, box_filter:
        Those of the picture, for guides that show what its pixels see.
    memory:
        Bytes that may be used.
    threads:
        Of the denoiser.
    kind:
        The network's effort, or "oidn" for that which the samples are worth.
    shares:
        Micro-images share their light, see :mod:`lippmann.rendering.sharing.cross_lens`, and so do the views of a
        quilt, see :mod:`lippmann.rendering.sharing.cross_view`.

    Attributes
    ----------
    seconds:
        Spent so far, guides included.
    used:
        The effort of the last picture.
    """

    def __init__(
        self,
        built: BuiltScene | BuiltClassic,
        source: OnePicture | QuiltRays,
        display_from_world: NDArray[np.float64],
        *,
        seed: int,
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
        self._seed = seed
        self._box_filter = box_filter
        self._memory = memory
        self._threads = threads
        self._kind: Denoiser = kind
        self._shares = shares
        self._lenses: NDArray[np.int32] | None = None
        self._progress = progress
        self._guides: Guides | None = None
        #: Of every tile of the source, by the guides.
        self._surfaces: list[SurfacePart | None] = []
        self.seconds = 0.0
        self.used: Effort = "fast"

    def __call__(self, pixels: Floats, samples: int, turned: bool = False) -> Floats:
        """A picture without its noise, which has shared its light: views of a quilt before it is clean.

        ``samples`` are those of each pixel, ``turned`` is that of :func:`~lippmann.rendering.denoise.oidn.denoise`.
        """
        started = time.perf_counter()
        self._progress(Progress("denoise", 0, 1))
        self.used = effort_of(self._kind, samples)
        guides = self.guides()
        if self._shares and isinstance(self._source, QuiltRays):
            pixels = share_views(pixels, self._source, guides)
        # The network overshoots below black beside bright edges.
        cleaned = np.maximum(self._cleaned(pixels, guides, turned), np.float32(0))
        if self._shares and not isinstance(self._source, QuiltRays):
            cleaned = self._share(cleaned)
        self._progress(Progress("denoise", 1, 1))
        self.seconds += time.perf_counter() - started
        return cleaned

    def _share(self, clean: Floats) -> Floats:
        """A clean picture that has shared its light."""
        source = self._source
        assert isinstance(source, DisplayRays | WindowRays | SubpixelRays)
        if self._lenses is None:
            window = None if isinstance(source, DisplayRays) else source.window
            if isinstance(source, SubpixelRays):
                self._lenses = lens_numbers_in_full_color(source.display, window)
            else:
                self._lenses = lens_numbers(source.display, window, subpixels=source.channels == 3)
        return share_light(
            clean,
            source.display,
            self.guides(),
            stop=SHARING.stop,
            lenses=self._lenses,
            columns=3 if isinstance(source, SubpixelRays) else 1,
        )

    def coverage(self) -> tuple[Coverage, Coverage] | None:
        """By either half of the rays of the guides."""
        started = time.perf_counter()
        found = self.guides().coverage
        self.seconds += time.perf_counter() - started
        return found

    def probe(self, samples: int) -> float:
        """Seconds that a picture of so many samples takes, cleaned by halves, guides included, by a small one."""
        side = 128
        small = np.zeros((side, side, 3), dtype=np.float32)
        effort = effort_of(self._kind, samples)
        denoise(small, small, small, clean_guides=True, effort=effort, threads=self._threads)  # starts its threads
        started = time.perf_counter()
        denoise(small, small, small, clean_guides=True, effort=effort, threads=self._threads)
        return TUNING.runs * (time.perf_counter() - started) * self._source.width * self._source.height / side**2

    def _cleaned(self, pixels: Floats, guides: Guides, turned: bool) -> Floats:
        source = self._source
        if not self._surfaces:
            self._surfaces = [SurfacePart.of(guides.normal[tile]) for tile in source.tiles()]
        result = np.empty_like(pixels)
        for tile, surfaces in zip(source.tiles(), self._surfaces, strict=True):
            result[tile] = denoise_seen(
                pixels[tile],
                guides.albedo[tile],
                guides.normal[tile],
                surfaces,
                effort=self.used,
                turned=turned,
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
                # Samples of their own: with those of one half of the picture the guides would show its noise, and the
                # denoised other half would agree with it.
                seed=named_seed("guides", self._seed),
                box_filter=self._box_filter,
                progress=self._progress,
            )
        return self._guides


def effort_of(kind: Denoiser, samples: int) -> Effort:
    """The effort that the user's word names, or that so many samples of each pixel deserve where it names none."""
    if kind in ("oidn-fast", "oidn-high"):
        return "fast" if kind == "oidn-fast" else "high"
    return "high" if samples >= TUNING.high_from else "fast"


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
    def of(normal: NDArray[np.generic]) -> SurfacePart | None:
        """By a guide ``(H, W, 3)``, which is 0 where there is no surface; None where there is none at all."""
        is_surface = (normal[..., 0] != 0) | (normal[..., 1] != 0) | (normal[..., 2] != 0)
        place = _rectangle(is_surface)
        return None if place is None else SurfacePart(place, _widened(is_surface[place])[..., None])


def denoise_seen(
    color: NDArray[np.generic],
    albedo: NDArray[np.generic],
    normal: NDArray[np.generic],
    surfaces: SurfacePart | None,
    *,
    effort: Effort = "high",
    turned: bool = False,
    threads: int | None = None,
) -> Floats:
    """The picture without its noise; arguments as those of :func:`~lippmann.rendering.denoise.oidn.denoise`.

    The network is shown the rectangle of the ``surfaces``, those of ``normal``. What is not near one is left as it is,
    so that nothing tells where that rectangle ends.
    """
    result = np.array(color, dtype=np.float32)
    if surfaces is not None:
        place = surfaces.place
        shown = color[place], albedo[place], normal[place]
        # The guides follow mirrors and glass without chance, so what noise they have lies along edges alone.
        cleaned = denoise(*shown, clean_guides=True, effort=effort, turned=turned, threads=threads)
        np.copyto(result[place], cleaned, where=surfaces.near)
    return result


def _widened(is_surface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """With the pixels up to ``EDGE`` beside and above each other."""
    for axis in (0, 1):
        lines = np.swapaxes(is_surface, 0, axis)
        wide = lines.copy()
        for step in range(1, EDGE + 1):
            wide[step:] |= lines[:-step]
            wide[:-step] |= lines[step:]
        is_surface = np.swapaxes(wide, 0, axis)
    return is_surface


def _rectangle(is_surface: NDArray[np.bool_]) -> tuple[slice, slice] | None:
    """Rows and columns with all surfaces, and a margin; None if there is none."""
    spans = []
    for axis in (1, 0):
        there = np.flatnonzero(np.any(is_surface, axis=axis))
        if not len(there):
            return None
        first = max(0, (int(there[0]) // MARGIN - 1) * MARGIN)
        spans.append(slice(first, min(is_surface.shape[1 - axis], int(there[-1]) + 1 + MARGIN)))
    return spans[0], spans[1]
