"""What is done to a traced frame before it becomes a picture: noise taken out, layers added."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.progress import ProgressCallback
from lippmann.render.denoise_views import best_form, denoise_views
from lippmann.render.full import Frame
from lippmann.render.guides import plan_guides, trace_guides
from lippmann.render.layers import plan_layers, trace_layers
from lippmann.render.rays import DisplayRays
from lippmann.render.settings import RenderSettings

if TYPE_CHECKING:
    from lippmann.render.classic.build import BuiltClassic
    from lippmann.scene.build import BuiltScene


class Finish:
    """The last steps of one picture. ``options`` says what they did, for the picture's provenance."""

    def __init__(
        self,
        built: BuiltScene | BuiltClassic,
        source: DisplayRays,
        settings: RenderSettings,
        display_from_world: NDArray[np.float64],
        memory: int,
        progress: ProgressCallback,
    ) -> None:
        self._built = built
        self._source = source
        self._settings = settings
        self._display_from_world = display_from_world
        self._memory = memory
        self._progress = progress
        self.options: dict[str, Any] = {}

    def denoise(self, frame: Frame, threads: int) -> None:
        """Take the noise out of ``frame``, guided by what its pixels see."""
        settings = self._settings
        guides = trace_guides(
            self._built,
            self._source,
            plan_guides(self._source, settings.spp, self._memory),
            self._display_from_world,
            seed=settings.seed,
            box_filter=settings.pixel_filter == "box",
            progress=self._progress,
        )
        form = best_form(self._source.display, guides)
        pixels = denoise_views(frame.pixels, self._source.display, guides, form=form, threads=threads)
        # The network overshoots below black beside bright edges.
        frame.pixels = np.maximum(pixels, 0)
        self.options |= {"denoise": settings.denoise, "denoise_form": form}

    def add_layers(self, frame: Frame) -> None:
        """Add to the maps of ``frame`` what the middle of each pixel sees."""
        plan = plan_layers(self._source, self._memory)
        frame.maps |= trace_layers(self._built, self._source, plan, self._display_from_world, self._progress)
