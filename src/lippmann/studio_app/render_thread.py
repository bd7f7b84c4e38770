"""The one thread that renders live frames: its kernels stay warm, the newest view wins, and nothing queues.

Watchers take turns. A turn is a step of a frame: the whole frame of an eye, or a part of all native pixels of a panel,
which then takes several turns. The watcher whose last turn is longest ago goes first.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LippmannError
from lippmann.printable import print_fault
from lippmann.runtime.machine import return_freed_memory

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.rendering.live.live_view import LiveFrame, LiveView
    from lippmann.scene.scene import Scene

#: Seconds that a view has rested before light is gathered: a step of that delays the next move.
REST = 0.12
#: Seconds of gathering after which a picture is as good as it gets here, and samples of each native pixel likewise.
LONGEST_GATHERING, MOST_SAMPLES = 60.0, 2048
#: Seconds after which freed memory is given back: frames, their codes and the denoiser's pictures leave holes.
TIDYING = 5.0

#: Seconds that a frame of a moving picture may take, a thirtieth with what coding and sending it takes: its size
#: shrinks until it does, down to half of the sides.
FRAME_SECONDS, COARSE_SHARE = 0.03, 0.5
#: Below that detail counts more than pace: a frame may take so long, and shrinks down to this share of the sides.
COARSE_FRAME_SECONDS, LEAST_SHARE = 0.05, 0.25
#: Seconds from the beginning of a moving frame of native pixels to its end, turns of other watchers included: half of
#: the second within which a panel follows, as coding, sending and drawing take time, too. One of so many rows is traced
#: until it is kept, and one of ``MOST_ROW_STEP`` however slow the machine is: 64 rows of a Looking Glass Portrait.
NATIVE_FRAME_SECONDS, MOST_ROW_STEP = 0.5, 32


class Renderer(Protocol):
    """Renders live frames; see :class:`lippmann.rendering.live.renderer.LiveRenderer`."""

    def set_scene(self, scene: Scene) -> None:
        """Show another scene."""

    def set_display(self, display: Display) -> None:
        """Show it on another display."""

    def frame_steps(self, view: LiveView) -> Iterator[LiveFrame | None]:
        """A picture at once: each step but the last, which brings it, gives None."""

    def refine_steps(self, view: LiveView) -> Iterator[LiveFrame | None]:
        """Better and better pictures of the same view, without end; None from steps that change nothing."""

    def pick(self, view: LiveView, u: float, v: float) -> float | None:
        """Depth of the point seen at a place, in mm."""


@dataclass(frozen=True)
class ViewRequest:
    """The picture that a watcher asks for.

    Attributes
    ----------
    number:
        Of the view, counted by the watcher.
    scene:
        What tells one scene from another.
    load:
        Loads the scene.
    display, view:
        Of the picture.
    """

    number: int
    scene: Hashable
    load: Callable[[], Scene]
    display: Display
    view: LiveView


@dataclass(frozen=True, eq=False)
class LiveResult:
    """A frame for a watcher: ``is_final`` if no better one follows."""

    number: int
    frame: LiveFrame
    is_final: bool

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """``(height, width, 3)``, sRGB."""
        return self.frame.pixels


@dataclass(eq=False)
class Watcher:
    """One who looks at frames. The callbacks run in the render thread and must return at once.

    Parameters
    ----------
    on_frame:
        Takes each frame.
    on_error:
        Takes the error of a view that cannot be shown; the last good picture stays.
    on_busy:
        Takes one line while a scene is loaded, then None.
    """

    on_frame: Callable[[LiveResult], None]
    on_error: Callable[[LippmannError], None]
    on_busy: Callable[[str | None], None] = lambda _: None
    _request: ViewRequest | None = field(default=None, repr=False)
    _moving: _Frame | None = field(default=None, repr=False)
    _current: ViewRequest | None = field(default=None, repr=False)
    _resting: _Rest | None = field(default=None, repr=False)
    _share: float = 1.0
    _row_step: int = MOST_ROW_STEP
    _pick: tuple[float, float, Callable[[float | None], None]] | None = field(default=None, repr=False)


@dataclass(eq=False)
class _Frame:
    """A frame on its way."""

    request: ViewRequest
    view: LiveView
    steps: Iterator[LiveFrame | None]
    began: float
    busy: float = 0.0


@dataclass(eq=False)
class _Rest:
    """A view that rests ``since`` a time, of which a coarse picture was shown, or one of all its pixels."""

    request: ViewRequest
    since: float
    is_coarse: bool
    steps: Iterator[LiveFrame | None] | None = None
    gathered: float = 0.0


class RenderThread:
    """Renders the newest view of each watcher in turns, and better and better pictures while all rest.

    Parameters
    ----------
    make_renderer:
        Makes the renderer of a first scene and display, in the thread.
    """

    def __init__(self, make_renderer: Callable[[Scene, Display], Renderer]) -> None:
        self._make_renderer = make_renderer
        self._renderer: Renderer | None = None
        self._scene: Hashable = None
        self._display: Display | None = None
        self._watchers: list[Watcher] = []
        self._changed = threading.Condition()
        self._is_ended = False
        self._gathers = True
        self._thread = threading.Thread(target=self._run, name="studio", daemon=True)
        self._thread.start()

    def add(self, watcher: Watcher) -> None:
        """Serve a watcher."""
        with self._changed:
            self._watchers.insert(0, watcher)

    def remove(self, watcher: Watcher) -> None:
        """Serve a watcher no more."""
        with self._changed:
            if watcher in self._watchers:
                self._watchers.remove(watcher)

    def want(self, watcher: Watcher, request: ViewRequest) -> None:
        """Show this to the watcher, instead of anything it wanted before."""
        with self._changed:
            watcher._request, watcher._resting = request, None
            self._changed.notify()

    def pick(self, watcher: Watcher, u: float, v: float, then: Callable[[float | None], None]) -> None:
        """Tell ``then`` the depth seen at a place of the watcher's present picture, mm; see :meth:`Renderer.pick`."""
        with self._changed:
            watcher._pick = u, v, then
            self._changed.notify()

    def gather(self, is_on: bool) -> None:
        """Whether light is gathered at rest; off, the machine is left to a render beside."""
        with self._changed:
            self._gathers = is_on
            self._changed.notify()

    def close(self) -> None:
        """End the thread after the step that it is at."""
        with self._changed:
            self._is_ended = True
            self._watchers.clear()
            self._changed.notify()
        self._thread.join(10.0)

    # ---- In the thread ---------------------------------------------------------------------------------------------

    def _run(self) -> None:
        tidied = time.monotonic()
        while (step := self._next()) is not None:
            watcher, work = step
            if time.monotonic() - tidied > TIDYING:
                return_freed_memory()
                tidied = time.monotonic()
            try:
                work()
            except LippmannError as error:
                watcher.on_error(error)
            except MemoryError:
                watcher.on_error(LippmannError("out of memory; close other programs"))
            except Exception as error:  # noqa: BLE001  a fault in one picture does not end the studio
                print_fault(error, "rendering")
                watcher.on_error(LippmannError("internal error; the terminal says which"))

    def _next(self) -> tuple[Watcher, Callable[[], None]] | None:
        """The next step of work, once there is one; None at the end. Those who waited longest stand first."""
        with self._changed:
            while not self._is_ended:
                for watcher in self._watchers:
                    if watcher._pick is not None and watcher._current is not None:
                        asked, watcher._pick = watcher._pick, None
                        return watcher, lambda w=watcher, x=watcher._current, a=asked: self._tell(w, x, *a)
                    if watcher._moving is not None or watcher._request is not None:
                        self._go_last(watcher)
                        return watcher, lambda w=watcher: self._show(w)
                resting = [(watcher, watcher._resting) for watcher in self._watchers if watcher._resting is not None]
                left = max((rest.since for _, rest in resting), default=0.0) + REST - time.monotonic()
                # A coarse picture is made whole even where a render beside has the machine.
                todo = [(watcher, rest) for watcher, rest in resting if self._gathers or rest.is_coarse]
                if not todo or left > 0:
                    self._changed.wait(left if todo else None)
                    continue
                watcher, rest = todo[0]
                self._go_last(watcher)
                return watcher, lambda w=watcher, r=rest: self._gather(w, r)
        return None

    def _go_last(self, watcher: Watcher) -> None:
        self._watchers.remove(watcher)
        self._watchers.append(watcher)

    def _show(self, watcher: Watcher) -> None:
        """One step of a frame. One that was begun is finished though its watcher wants a newer one."""
        frame, watcher._moving = watcher._moving or self._begin(watcher), None
        began = time.monotonic()
        picture = next(frame.steps)
        now = time.monotonic()
        frame.busy += now - began
        if picture is None:
            watcher._moving = frame
            return
        request = frame.request
        if request.view.eye is None:
            watcher._row_step = _next_row_step(watcher._row_step, now - frame.began)
        else:
            watcher._share = _next_share(watcher._share, frame.busy)
        with self._changed:
            watcher._current = request
            if watcher._request is None:
                watcher._resting = _Rest(request, now, frame.view is not request.view)
        watcher.on_frame(LiveResult(request.number, picture, False))

    def _begin(self, watcher: Watcher) -> _Frame:
        with self._changed:
            request, watcher._request = watcher._request, None
        assert request is not None
        renderer = self._prepare(watcher, request)
        view = _coarser(request.view, watcher)
        return _Frame(request, view, renderer.frame_steps(view), time.monotonic())

    def _gather(self, watcher: Watcher, rest: _Rest) -> None:
        request = rest.request
        if rest.steps is None:
            renderer = self._prepare(watcher, request)
            rest.steps = (renderer.frame_steps if rest.is_coarse else renderer.refine_steps)(request.view)
        began = time.monotonic()
        frame = next(rest.steps)
        rest.gathered += time.monotonic() - began
        if rest.is_coarse and frame is not None:
            rest.is_coarse, rest.steps = False, None
        is_done = rest.gathered > LONGEST_GATHERING or (frame is not None and frame.samples >= MOST_SAMPLES)
        if is_done:
            with self._changed:
                if watcher._resting is rest:
                    watcher._resting = None
        if frame is not None:
            watcher.on_frame(LiveResult(request.number, frame, is_done))

    def _tell(
        self, watcher: Watcher, request: ViewRequest, u: float, v: float, then: Callable[[float | None], None]
    ) -> None:
        then(self._prepare(watcher, request).pick(request.view, u, v))

    def _prepare(self, watcher: Watcher, request: ViewRequest) -> Renderer:
        """The renderer with the scene and the display that are wanted."""
        if self._renderer is None or request.scene != self._scene:
            watcher.on_busy("Opening the scene")
            try:
                scene = request.load()
                if self._renderer is None:
                    self._renderer = self._make_renderer(scene, request.display)
                    self._display = request.display
                else:
                    self._renderer.set_scene(scene)
                self._scene = request.scene
            finally:
                watcher.on_busy(None)
        if request.display is not self._display and request.display != self._display:
            self._renderer.set_display(request.display)
            self._display = request.display
        return self._renderer


def _coarser(view: LiveView, watcher: Watcher) -> LiveView:
    """The view as it is traced while it moves: of an eye in a smaller picture, of native pixels with fewer rows."""
    if view.eye is None:
        return view if watcher._row_step == 1 else replace(view, row_step=watcher._row_step)
    if watcher._share >= 1.0:
        return view
    width, height = (max(1, round(side * watcher._share)) for side in view.size)
    return replace(view, size=(width, height))


def _next_row_step(row_step: int, seconds: float) -> int:
    """Rows of which one is traced in the next moving frame of native pixels, by the seconds that the last one took.

    The first frame of a scene compiles kernels, so that one slow frame never doubles the step more than once; and none
    halves it more than once, as only a part of a frame's time goes with its rays.
    """
    best = math.ceil(row_step * seconds / NATIVE_FRAME_SECONDS)
    return min(MOST_ROW_STEP, max(1, -(-row_step // 2), min(best, 2 * row_step)))


def _next_share(share: float, seconds: float) -> float:
    """Share of the sides of the next moving picture, by the seconds that the last one took.

    Rays, and so seconds, go at most with the square of the sides. The first frame of a scene compiles kernels, so that
    one slow frame never shrinks the next by more than a quarter.
    """
    of_a_second = share / math.sqrt(max(seconds, 1e-4))
    best = of_a_second * math.sqrt(FRAME_SECONDS)
    if best < COARSE_SHARE:
        best = min(COARSE_SHARE, of_a_second * math.sqrt(COARSE_FRAME_SECONDS))
    return min(1.0, max(LEAST_SHARE, 0.75 * share, min(best, 1.1 * share)))
