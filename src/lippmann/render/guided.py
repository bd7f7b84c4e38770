"""Open Image Denoise for one display's picture of one scene: guides are traced once, pictures cleaned as they come."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.render.denoise_views import best_form, denoise_views
from lippmann.render.guides import MOST_SAMPLES, Guides, plan_guides, trace_guides
from lippmann.render.rays import DisplayRays

if TYPE_CHECKING:
    from lippmann.render.classic.build import BuiltClassic
    from lippmann.scene.build import BuiltScene

Floats = NDArray[np.float32]


class GuidedDenoiser:
    """Takes the noise out of pictures; called with ``(H, W, 3)`` linear pixels of the display of ``source``.

    Parameters
    ----------
    built, source, display_from_world, seed, box_filter:
        Those of the picture, for guides that show what its pixels see.
    memory:
        Bytes that may be used.
    threads:
        Of the denoiser.

    Attributes
    ----------
    seconds:
        Spent so far, guides included.
    """

    def __init__(
        self,
        built: BuiltScene | BuiltClassic,
        source: DisplayRays,
        display_from_world: NDArray[np.float64],
        *,
        seed: int,
        box_filter: bool,
        memory: int,
        threads: int,
        progress: ProgressCallback = silent,
    ) -> None:
        self._built = built
        self._source = source
        self._display_from_world = display_from_world
        self._seed = seed
        self._box_filter = box_filter
        self._memory = memory
        self._threads = threads
        self._progress = progress
        self._guides: Guides | None = None
        self._form: Literal["raw", "views"] | None = None
        self.seconds = 0.0

    def __call__(self, pixels: Floats) -> Floats:
        started = time.perf_counter()
        self._progress(Progress("denoise", 0, 1))
        guides = self.guides()
        cleaned = denoise_views(pixels, self._source.display, guides, form=self.form(), threads=self._threads)
        self._progress(Progress("denoise", 1, 1))
        self.seconds += time.perf_counter() - started
        # The network overshoots below black beside bright edges.
        return np.maximum(cleaned, np.float32(0))

    def guides(self) -> Guides:
        """Albedo and normal of what the pixels see."""
        if self._guides is None:
            self._guides = trace_guides(
                self._built,
                self._source,
                plan_guides(self._source, MOST_SAMPLES, self._memory),
                self._display_from_world,
                seed=self._seed,
                box_filter=self._box_filter,
                progress=self._progress,
            )
        return self._guides

    def form(self) -> Literal["raw", "views"]:
        """In which order the pixels are shown to the network, see :mod:`lippmann.render.denoise_views`."""
        if self._form is None:
            self._form = best_form(self._source.display, self.guides())
        return self._form
