"""The one thread that renders live frames: its kernels stay warm, the newest view wins, and nothing queues."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LippmannError
from lippmann.printable import one_line
from lippmann.runtime.heap import return_freed_memory

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


class Renderer(Protocol):
    """Renders live frames; see :class:`lippmann.rendering.live.renderer.LiveRenderer`."""

    def set_scene(self, scene: Scene) -> None:
        """Show another scene."""

    def set_display(self, display: Display) -> None:
        """Show it on another display."""

    def frame(self, view: LiveView, is_stale: Callable[[], bool]) -> LiveFrame | None:
        """A picture at once."""

    def refine(self, view: LiveView) -> LiveFrame | None:
        """A better picture of the same view."""

    def pick(self, view: LiveView, u: float, v: float) -> float | None:
        """Depth of the point seen at a place, in mm."""


@dataclass(frozen=True)
class Wanted:
    """What a watcher wants to see.

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
class Shown:
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

    on_frame: Callable[[Shown], None]
    on_error: Callable[[LippmannError], None]
    on_busy: Callable[[str | None], None] = lambda _: None
    _wanted: Wanted | None = field(default=None, repr=False)
    _shown: Wanted | None = field(default=None, repr=False)
    _resting: Wanted | None = field(default=None, repr=False)
    _since: float = 0.0
    _gathered: float = 0.0
    _share: float = 1.0
    _pick: tuple[float, float, Callable[[float | None], None]] | None = field(default=None, repr=False)


class RenderThread:
    """Renders the newest view of each watcher, and better and better pictures of the last one while all rest.

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
            self._watchers.append(watcher)

    def remove(self, watcher: Watcher) -> None:
        """Serve a watcher no more."""
        with self._changed:
            if watcher in self._watchers:
                self._watchers.remove(watcher)

    def want(self, watcher: Watcher, wanted: Wanted) -> None:
        """Show this to the watcher, instead of anything it wanted before."""
        with self._changed:
            watcher._wanted, watcher._resting = wanted, None
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
                what = " ".join(f"{type(error).__name__}: {error}".split())
                print(one_line(f"lippmann: internal error while rendering: {what}; report it"), file=sys.stderr)
                watcher.on_error(LippmannError("internal error; the terminal says which"))

    def _next(self) -> tuple[Watcher, Callable[[], None]] | None:
        """The next step of work, once there is one; None at the end."""
        with self._changed:
            while not self._is_ended:
                for watcher in self._watchers:
                    if watcher._wanted is not None:
                        wanted, watcher._wanted = watcher._wanted, None
                        return watcher, lambda w=watcher, x=wanted: self._show(w, x)
                    if watcher._pick is not None and watcher._shown is not None:
                        u, v, then = watcher._pick
                        watcher._pick = None
                        return watcher, lambda r=watcher._shown, u=u, v=v, t=then: self._tell(r, u, v, t)
                resting = [watcher for watcher in self._watchers if watcher._resting is not None]
                if not resting or not self._gathers:
                    self._changed.wait()
                    continue
                watcher = max(resting, key=lambda each: each._since)
                left = watcher._since + REST - time.monotonic()
                if left > 0:
                    self._changed.wait(left)
                    continue
                return watcher, lambda w=watcher, r=watcher._resting: self._gather(w, r)
        return None

    def _show(self, watcher: Watcher, wanted: Wanted) -> None:
        renderer = self._prepare(watcher, wanted)
        view = _smaller(wanted.view, watcher._share)
        began = time.monotonic()
        # An eye's picture is done soon: it is shown even if the eye has moved on, or a steady move would show nothing.
        frame = renderer.frame(view, lambda: self._is_ended or (view.eye is None and watcher._wanted is not None))
        if frame is None:
            return
        watcher._share = _next_share(watcher._share, time.monotonic() - began)
        with self._changed:
            watcher._shown, watcher._since, watcher._gathered = wanted, time.monotonic(), 0.0
            if watcher._wanted is None:
                watcher._resting = wanted
        watcher.on_frame(Shown(wanted.number, frame, False))

    def _gather(self, watcher: Watcher, wanted: Wanted) -> None:
        renderer = self._prepare(watcher, wanted)
        began = time.monotonic()
        frame = renderer.refine(wanted.view)
        watcher._gathered += time.monotonic() - began
        is_done = watcher._gathered > LONGEST_GATHERING or (frame is not None and frame.samples >= MOST_SAMPLES)
        if is_done:
            with self._changed:
                if watcher._resting is wanted:
                    watcher._resting = None
        if frame is not None:
            watcher.on_frame(Shown(wanted.number, frame, is_done))

    def _tell(self, wanted: Wanted, u: float, v: float, then: Callable[[float | None], None]) -> None:
        assert self._renderer is not None
        then(self._renderer.pick(wanted.view, u, v))

    def _prepare(self, watcher: Watcher, wanted: Wanted) -> Renderer:
        """The renderer with the scene and the display that are wanted."""
        if self._renderer is None or wanted.scene != self._scene:
            watcher.on_busy("Opening the scene")
            try:
                scene = wanted.load()
                if self._renderer is None:
                    self._renderer = self._make_renderer(scene, wanted.display)
                    self._display = wanted.display
                else:
                    self._renderer.set_scene(scene)
                self._scene = wanted.scene
            finally:
                watcher.on_busy(None)
        if wanted.display is not self._display and wanted.display != self._display:
            self._renderer.set_display(wanted.display)
            self._display = wanted.display
        return self._renderer


def _smaller(view: LiveView, share: float) -> LiveView:
    """The view of an eye in a smaller picture; native pixels stay as they are."""
    if view.eye is None or share >= 1.0:
        return view
    width, height = (max(1, round(side * share)) for side in view.size)
    return replace(view, size=(width, height))


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
