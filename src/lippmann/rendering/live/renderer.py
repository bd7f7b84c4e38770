"""Interactive rendering: the scene and its kernels stay on the device between frames."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.visible_pixels import window_pixels
from lippmann.errors import SceneError, UsageError
from lippmann.options.choices import POOLED_LIGHT
from lippmann.rendering.live.develop import develop
from lippmann.rendering.live.live_view import LiveFrame, LiveView, PlacedView
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.rendering.transport.tuning import TUNING as TRANSPORT
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.matrices import rotation_of
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.rendering.live.progressive import Progressive
    from lippmann.rendering.live.scene_kernels import SceneKernels

Floats = NDArray[np.float32]


class LiveRenderer:
    """Renders what a display shows, frame after frame.

    One thread at a time calls it: each call, and each step of a picture, holds the engine's lock, as renders do. Steps
    of several pictures may take turns. None takes much longer than one sample of each pixel that an eye sees, but for
    the first with a scene, a display or an integrator, which compiles kernels.

    Parameters
    ----------
    scene, display:
        What is shown, and on what.
    machine:
        A request of which ``device``, ``threads`` and ``memory`` count.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        As for a render.
    """

    def __init__(
        self,
        scene: Scene,
        display: Display,
        *,
        machine: RenderRequest | None = None,
    ) -> None:
        self._machine = machine or RenderRequest()
        self._display = display
        # Caches for the eyes of some pages, and for the whole panel in motion and at rest.
        self._map = lru_cache(4)(lambda kind, *of, subpixels: kind(*of, subpixels=subpixels))
        self._visible = lru_cache(4)(lambda map, eye: map.pixels_for_eye(eye))
        self._window = lru_cache(2)(window_pixels)
        self._latest: PlacedView | None = None
        self._height: Floats = np.zeros(0, np.float32)
        self.set_scene(scene)

    @property
    def display(self) -> Display:
        """The display."""
        return self._display

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self._scene

    @exclusive()
    def set_scene(self, scene: Scene) -> None:
        """Replace the scene, or the environment or background of the same one.

        Raises
        ------
        UsageError, SceneError, MemoryLimitError, EngineError
            The scene cannot be rendered live; the renderer keeps the previous one.
        """
        self._kernels = self._open(scene)
        self._scene = scene
        self._latest = None

    @exclusive()
    def set_display(self, display: Display) -> None:
        """Show the scene on another display, or on the same one in another size."""
        self._display = display
        self._latest = None

    def frame(self, view: LiveView) -> LiveFrame:
        """A picture of one sample a pixel in direct light, for a view that changes.

        A render with the integrator ``direct`` and one sample a pixel shows the same to the same eye. The weights by
        which several emitters are sampled, and an automatic exposure, stay those of the scene's first view.

        Raises
        ------
        UsageError, SceneError
            The view cannot be shown.
        """
        return next(frame for frame in self.frame_steps(view) if frame is not None)

    def frame_steps(self, view: LiveView) -> Iterator[LiveFrame | None]:
        """The steps of :meth:`frame`: the last one brings the picture, those before None.

        Between them steps of other pictures may be made, of another scene or display, too.
        """
        return self._frame_steps(self._kernels, self._display, view)

    def _frame_steps(self, kernels: SceneKernels, display: Display, view: LiveView) -> Iterator[LiveFrame | None]:
        from lippmann.rendering.live.live_tracer import Lanes

        seconds: dict[str, float] = {}
        with exclusive():
            placed_view = self._place_view(kernels, display, view, _request_moving(view.request), seconds)
            exposure = kernels.expose(placed_view.display, placed_view.request, placed_view.placement, measure=False)
            tracer = kernels.tracer(placed_view.display, placed_view.request)
            count, step = len(placed_view.pixels.column), min(TRANSPORT.lanes, kernels.most_lanes)
            values, heights = np.empty((count, 3), np.float32), np.empty(count, np.float32)
        for start in range(0, count, step):
            if start:
                yield None
            with exclusive(), _time_stage(seconds, "trace"):
                placed_view.light_up(exposure)
                lanes = Lanes(placed_view.pixels, slice(start, start + step))
                traced = tracer.trace(lanes, placed_view.placed, seed=placed_view.request.seed)
                values[lanes.part], heights[lanes.part] = traced.sums[0], traced.height
        self._latest, self._height = placed_view, heights
        with _time_stage(seconds, "encode"):
            codes = develop(values, placed_view.pixels, placed_view.request)
            if view.eye is None and view.row_step > 1:
                height = display.panel.height if view.window is None else view.window.height
                codes = np.repeat(codes, view.row_step, axis=0)[:height]
        yield LiveFrame(codes, 1, False, placed_view.placement, exposure, seconds)

    def refine_steps(self, view: LiveView) -> Iterator[LiveFrame | None]:
        """Endless short steps of progressive rendering for a view at rest.

        Each takes samples or denoises. It gives the picture so far, or None if that did not change. Steps of other
        pictures may come between; see :meth:`frame_steps`.
        """
        return self._refine_steps(self._kernels, self._display, view)

    def _refine_steps(self, kernels: SceneKernels, display: Display, view: LiveView) -> Iterator[LiveFrame | None]:
        progressive = self._begin_rest(kernels, display, view)
        while True:
            yield progressive.step({})

    @exclusive()
    def _begin_rest(self, kernels: SceneKernels, display: Display, view: LiveView) -> Progressive:
        from lippmann.rendering.live.progressive import Progressive

        placed_view = self._place_view(kernels, display, view, _request_resting(view.request), {})
        exposure = kernels.expose(placed_view.display, placed_view.request, placed_view.placement, measure=True)
        return Progressive(placed_view, exposure)

    @exclusive()
    def heights(self, view: LiveView) -> Floats:
        """Depth of each pixel of a view's picture: z in mm in the display's frame.

        Returns
        -------
        ``(height, width)`` float32; NaN without a hit. Depths beyond the display's ``resolvable_depth`` are blurred.
        """
        if self._latest is None or self._latest.view != view:
            self.frame(view)
        assert self._latest is not None
        # Where sub-pixels have rays of their own, the middle one, green, stands for the pixel.
        number = self._latest.pixels.number[..., self._latest.pixels.channels // 2]
        with_nothing = np.append(self._height, np.float32(np.nan))
        return np.asarray(with_nothing[number], np.float32)

    def pick(self, view: LiveView, u: float, v: float) -> float | None:
        """Depth of the point seen at a place of a view's picture: z in mm in the display's frame.

        ``shift`` by minus that depth puts the point into the lens plane.

        Parameters
        ----------
        u, v:
            The place as shares of the picture's width and height, from its top left corner, 0 to 1.

        Returns
        -------
        float | None
            None where nothing is seen there.
        """
        if not (0.0 <= u <= 1.0 and 0.0 <= v <= 1.0):
            raise UsageError(f"({u:g}, {v:g})", where="pick", rule="must be a place in the picture, 0 to 1 each")
        heights = self.heights(view)
        height, width = heights.shape
        height_there = float(heights[min(int(v * height), height - 1), min(int(u * width), width - 1)])
        return height_there if np.isfinite(height_there) else None

    # ---- Stages ----------------------------------------------------------------------------------------------------

    def _open(self, scene: Scene) -> SceneKernels:
        if scene.lies_off_surfaces:
            what = "Gaussian splats" if scene.has_splats else "volumes"
            raise SceneError(
                f"{what} cannot be shown live",
                rule="live pictures show surfaces",
                fix="lippmann preview and lippmann render trace them",
            )
        request = replace(_request_moving(self._machine), device=self._machine.device, threads=self._machine.threads)
        session = open_session(scene, resolve(request, scene, self._display), memory=self._machine.memory)
        from lippmann.rendering.live.scene_kernels import SceneKernels

        return SceneKernels(session)

    def _place_view(
        self, kernels: SceneKernels, display: Display, view: LiveView, request: RenderRequest, seconds: dict[str, float]
    ) -> PlacedView:
        from lippmann.rendering.live.live_tracer import PlacedDisplay

        if not kernels.can_light(view.light):
            raise UsageError(
                "cannot change", parameter="light_strength", rule="spots with a radius keep their strength"
            )
        with _time_stage(seconds, "place"):
            resolved = resolve(request, kernels.session.scene, display)
            placement = kernels.place(display, resolved)
            kernels.light(view.light, rotation_of(placement.world_from_display))
            placed = PlacedDisplay(placement.world_from_display)
        with _time_stage(seconds, "map"):
            subpixels = bool(resolved.subpixels)
            if view.eye is None:
                pixels = self._window(display, view.window, subpixels=subpixels, row_step=view.row_step)
            else:
                pixels = self._visible(self._map(view.eye_map, display, view.size, subpixels=subpixels), view.eye)
        placed_view = PlacedView(kernels, placement.traced(display), view, resolved, placement, placed, pixels)
        kernels.lit_for = placed
        return placed_view


def _request_moving(request: RenderRequest) -> RenderRequest:
    return _request_plain(request, "direct", None)


def _request_resting(request: RenderRequest) -> RenderRequest:
    light = "path" if request.integrator == "auto" else request.integrator
    return _request_plain(request, light, request.depth)


def _request_plain(request: RenderRequest, integrator: str, depth: int | None) -> RenderRequest:
    """The request of a plain full rendering with one sample per pixel."""
    if request.integrator not in ("auto", *POOLED_LIGHT):
        rule = f"live pictures show the light of {' and '.join(POOLED_LIGHT)}"
        raise UsageError(f"'{request.integrator}' does not apply", parameter="integrator", rule=rule)
    return RenderRequest(
        method="full",
        denoise="none",
        integrator=integrator,  # type: ignore[arg-type]  # one of the words above
        depth=depth,
        spp=1,
        seed=request.seed,
        subpixels=request.subpixels,
        pixel_filter=request.pixel_filter,
        exposure=request.exposure,
        tone_map=request.tone_map,
        clamp_indirect=request.clamp_indirect if integrator == "path" else None,
        placement=request.placement,
    )


@contextmanager
def _time_stage(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = time.perf_counter()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - started
