"""Live frames: a scene stays on the device, its kernels stay warm, and pictures come as fast as rays can be traced."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.errors import SceneError, UsageError
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.live.develop import develop
from lippmann.rendering.live.live_view import LiveFrame, LiveView
from lippmann.rendering.live.seen_pixels import EyeMap, PixelSet, window_pixels
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.request.resolve import resolve
from lippmann.rendering.session import open_session
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.matrices import rotation_of
from lippmann.scene.placement import Placement
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.rendering.live.live_tracer import Lanes, PlacedDisplay
    from lippmann.rendering.live.progressive import Progressive
    from lippmann.rendering.live.scene_kernels import SceneKernels

Floats = NDArray[np.float32]
IsStale = Callable[[], bool]

#: Integrators whose light live frames can show.
_LIGHT = ("path", "direct")


@dataclass(frozen=True, eq=False)
class _Stand:
    """Where the display stands in a view, and how the view is traced."""

    view: LiveView
    request: RenderRequest
    placement: Placement
    placed: PlacedDisplay
    pixels: PixelSet


class LiveRenderer:
    """Renders what a display shows, frame after frame.

    One thread at a time calls it: each call holds the engine's lock, as renders do. Between two calls a newer view may
    take the place of an older one, whose samples are then dropped. No call takes much longer than one sample of each
    pixel seen, but for the first with a scene, a display or an integrator, which compiles kernels.

    Parameters
    ----------
    scene, display:
        What is shown, and on what.
    machine:
        Its ``device``, ``threads`` and ``memory`` count.
    progress:
        Told how the scene is built.

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
        progress: ProgressCallback = silent,
    ) -> None:
        self._machine = machine or RenderRequest()
        self._progress = progress
        self._display = display
        self._map: EyeMap | None = None
        self._last_pixels: tuple[object, PixelSet] | None = None
        self._last_lanes: tuple[PixelSet, list[Lanes]] | None = None
        self._shown: _Stand | None = None
        self._height: Floats = np.zeros(0, np.float32)
        self._progressive: Progressive | None = None
        self.set_scene(scene)

    @property
    def display(self) -> Display:
        """The display."""
        return self._display

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self._scene

    @property
    def recordings(self) -> int:
        """How often kernels were recorded for the scene and its displays: not for a view that changes."""
        return self._kernels.recordings

    @exclusive()
    def set_scene(self, scene: Scene) -> None:
        """Show another scene, or the same one with another environment or background.

        Raises
        ------
        UsageError, SceneError, MemoryLimitError, EngineError
            The scene cannot be shown; the renderer keeps the one that it has.
        """
        self._kernels = self._open(scene)
        self._scene = scene
        self._forget()

    @exclusive()
    def set_display(self, display: Display) -> None:
        """Show the scene on another display, or on the same one in another size."""
        self._display = display
        self._kernels.forget_display()
        self._forget()

    @exclusive()
    def frame(self, view: LiveView, is_stale: IsStale = lambda: False, *, settled: bool = False) -> LiveFrame | None:
        """A picture of one sample a pixel in direct light, for a view that changes.

        A render with the integrator ``direct`` and one sample a pixel shows the same to the same eye. Where a scene has
        several emitters, the weights by which they are sampled, and an automatic exposure, stay while a view changes:
        those of a render are found with ``settled``.

        Parameters
        ----------
        view:
            What is looked at.
        is_stale:
            Asked between wavefronts whether the frame is still wanted.
        settled:
            Find the weights of emitters and the exposure anew, which takes some frames' time.

        Returns
        -------
        LiveFrame | None
            None where the frame was not wanted any more.

        Raises
        ------
        UsageError, SceneError
            The view cannot be shown.
        """
        seconds: dict[str, float] = {}
        stand = self._stand(view, _moving(view.request), seconds)
        exposure = self._kernels.expose(self._display, stand.request, stand.placement, measure=settled)
        with _timed(seconds, "trace"):
            found = self._trace_once(stand, is_stale)
        if found is None:
            return None
        values, self._height = found
        self._shown, self._progressive = stand, None
        with _timed(seconds, "encode"):
            codes = develop(values, stand.pixels, stand.request)
        return LiveFrame(codes, 1, False, stand.placement, exposure, seconds)

    @exclusive()
    def refine(self, view: LiveView) -> LiveFrame | None:
        """Gather more light for a view that rests: one short step of work.

        The first call with a view starts anew; each later call adds samples, or takes out the noise of those that there
        are. Call it again and again while the view stays.

        Returns
        -------
        LiveFrame | None
            The picture so far; None after a step that left the picture as it was.
        """
        from lippmann.rendering.live.progressive import Progressive

        seconds: dict[str, float] = {}
        progressive = self._progressive
        if progressive is None or progressive.view != view:
            stand = self._stand(view, _resting(view.request), seconds)
            exposure = self._kernels.expose(self._display, stand.request, stand.placement, measure=True)
            progressive = Progressive(
                view, self._kernels, self._display, stand.request, stand.placement, stand.placed, stand.pixels, exposure
            )
            self._progressive = progressive
        return progressive.step(seconds)

    @exclusive()
    def heights(self, view: LiveView) -> Floats:
        """Depth of what each place of a view's picture shows: z in mm in the display's frame.

        Returns
        -------
        ``(height, width)`` float32; NaN where nothing is seen. Compare with the display's ``resolvable_depth`` for what
        blurs.
        """
        if self._shown is None or self._shown.view != view:
            self.frame(view)
        assert self._shown is not None
        # Where sub-pixels have rays of their own the green one stands for the pixel.
        number = self._shown.pixels.number[..., self._shown.pixels.channels // 2]
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
            raise UsageError(f"({u:g}, {v:g}) will not do", where="pick", rule="a place in the picture, 0 to 1 each")
        heights = self.heights(view)
        height, width = heights.shape
        found = float(heights[min(int(v * height), height - 1), min(int(u * width), width - 1)])
        return found if np.isfinite(found) else None

    def placement(self, view: LiveView) -> Placement:
        """Where the display stands in a view, with the scene's depth range, the resolvable one, and warnings."""
        return self._stand(view, _moving(view.request), {}).placement

    # ---- Stages ----------------------------------------------------------------------------------------------------

    def _open(self, scene: Scene) -> SceneKernels:
        if scene.lies_off_surfaces:
            what = "Gaussian splats" if scene.has_splats else "volumes"
            raise SceneError(
                f"{what} cannot be shown live",
                rule="live pictures show surfaces",
                fix="use preview or render, which trace them",
            )
        request = replace(_moving(self._machine), device=self._machine.device, threads=self._machine.threads)
        session = open_session(
            scene, resolve(request, scene, self._display), memory=self._machine.memory, progress=self._progress
        )
        from lippmann.rendering.live.scene_kernels import SceneKernels

        return SceneKernels(session)

    def _forget(self) -> None:
        self._map, self._last_pixels, self._last_lanes = None, None, None
        self._shown, self._progressive = None, None

    def _stand(self, view: LiveView, request: RenderRequest, seconds: dict[str, float]) -> _Stand:
        from lippmann.rendering.live.live_tracer import PlacedDisplay

        if not self._kernels.can_light(view.light):
            raise UsageError(
                "cannot change", parameter="light_strength", rule="spots with a radius keep their strength"
            )
        with _timed(seconds, "place"):
            resolved = resolve(request, self._scene, self._display)
            placement = self._kernels.place(self._display, resolved)
            self._kernels.light(view.light, rotation_of(placement.world_from_display))
            placed = PlacedDisplay(placement.world_from_display)
        with _timed(seconds, "map"):
            pixels = self._pixels(view, subpixels=bool(resolved.subpixels))
        return _Stand(view, resolved, placement, placed, pixels)

    def _pixels(self, view: LiveView, *, subpixels: bool) -> PixelSet:
        key = (view.eye, view.size, view.window, subpixels)
        if self._last_pixels is not None and self._last_pixels[0] == key:
            return self._last_pixels[1]
        if view.eye is None:
            pixels = window_pixels(self._display, view.window, subpixels=subpixels)
        else:
            if self._map is None or self._map.size != view.size or self._map.subpixels != subpixels:
                self._map = EyeMap(self._display, view.size, subpixels=subpixels)
            pixels = self._map.seen_by(view.eye)
        self._last_pixels = (key, pixels)
        return pixels

    def _trace_once(self, stand: _Stand, is_stale: IsStale) -> tuple[Floats, Floats] | None:
        tracer = self._kernels.tracer(self._display, stand.request)
        count = len(stand.pixels.column)
        values, heights = np.empty((count, 3), np.float32), np.empty(count, np.float32)
        for lanes in self._lanes_of(stand.pixels):
            if is_stale():
                return None
            found = tracer.trace(lanes, stand.placed, seed=stand.request.seed)
            values[lanes.pixels], heights[lanes.pixels] = found.sums[0], found.height
        return values, heights

    def _lanes_of(self, pixels: PixelSet) -> list[Lanes]:
        """Wavefronts of one sample of each pixel: kept, since an eye that rests sees the same pixels of what moves."""
        from lippmann.rendering.live.live_tracer import Lanes

        if self._last_lanes is None or self._last_lanes[0] is not pixels:
            count, step = len(pixels.column), self._kernels.most_lanes
            number = np.arange(count)
            parts = [(number // step == part).astype(np.int64) for part in range(-(-count // step))]
            self._last_lanes = pixels, [Lanes(pixels, 1, once) for once in parts]
        return self._last_lanes[1]


def _moving(request: RenderRequest) -> RenderRequest:
    return _plain(request, "direct", None)


def _resting(request: RenderRequest) -> RenderRequest:
    light = "path" if request.integrator == "auto" else request.integrator
    return _plain(request, light, request.depth)


def _plain(request: RenderRequest, integrator: str, depth: int | None) -> RenderRequest:
    """The request of a picture of every pixel's own samples."""
    if request.integrator not in ("auto", *_LIGHT):
        rule = f"live pictures show the light of {' and '.join(_LIGHT)}"
        raise UsageError(f"'{request.integrator}' will not do", parameter="integrator", rule=rule)
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
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = time.perf_counter()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - started
