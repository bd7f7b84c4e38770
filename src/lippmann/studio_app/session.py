"""A studio's session: its state, the files that it was given, the thread that renders, and full renders."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.display import Display, list_displays
from lippmann.display.formats.bridge import NAME as BRIDGE
from lippmann.display.formats.bridge import panels_or_none
from lippmann.display.formats.load import is_short_form
from lippmann.errors import LippmannError, UsageError
from lippmann.options.scene import SceneOptions
from lippmann.scene import bundled
from lippmann.scene.volumes.presets import PRESETS
from lippmann.studio_app.command_line import render_command
from lippmann.studio_app.dropped_scene import ENVIRONMENTS
from lippmann.studio_app.page_values import title_of
from lippmann.studio_app.render_jobs import ENDINGS, QUILT_RENDER, Job, JobRunner, Kind, of_quilts
from lippmann.studio_app.render_thread import Renderer, RenderThread, ViewRequest, Watcher
from lippmann.studio_app.state import FILES, PLACED_BY, StudioState
from lippmann.studio_app.state_toml import state_of_text
from lippmann.studio_app.uploads import Dropped, Uploads
from lippmann.viewing.replay import default_eye

if TYPE_CHECKING:
    from lippmann.rendering.live.live_view import LiveView
    from lippmann.scene.scene import Scene

#: Remedy for a scene that has no file.
WITHOUT_FILE = "call lippmann.render with it, or open the studio with a file"

#: Width and height of the picture that warms kernels up.
_FIRST_SIZE = (256, 256)


class StudioSession:
    """State and work of one studio, which several pages may watch. Safe for use from several threads.

    Parameters
    ----------
    state:
        The first state. Its files are open to the pages; other files are not.
    uploads:
        Keeps dropped files.
    outputs:
        Folder that renders are written into.
    make_renderer:
        Makes the live renderer of a scene and a display.
    allow_outside:
        Whether scenes may name files outside their folders.
    held:
        A scene without a file, which the first state's ``scene`` only names: it is shown, but a command line cannot
        render it, and no file of a state can name it.
    """

    def __init__(
        self,
        state: StudioState,
        *,
        uploads: Uploads,
        outputs: Path,
        make_renderer: Callable[[Scene, Display], Renderer],
        allow_outside: bool = False,
        held: Scene | None = None,
    ) -> None:
        self._lock = threading.Lock()
        self._state = state
        self._allow_outside = allow_outside
        self._held, self._held_name = held, state.scene
        self._displays: dict[str, Display] = {}
        self._presets = {display.name: display for display in list_displays()}
        self.panels = panels_or_none()
        self._presets |= {f"{BRIDGE}:{panel.display.name}": panel.display for panel in self.panels}
        self._files = {name for name in (getattr(state, each) for each in FILES) if name is not None}
        self._titles: dict[str, str] = {}
        self.uploads = uploads
        self.job_listeners: list[Callable[[Job], None]] = []
        self.state_listeners: list[Callable[[], None]] = []
        self.jobs = JobRunner(outputs, self._job_changed)
        self.thread = RenderThread(make_renderer)

    @property
    def state(self) -> StudioState:
        """The last state that was set."""
        with self._lock:
            return self._state

    def set_state(self, state: StudioState) -> None:
        """Take over a state.

        Raises
        ------
        UsageError, DisplayError
            It names a file that was not opened, or its display does not exist.
        """
        if state == self._state:
            return
        self.check_files(state)
        self.display(state)
        with self._lock:
            self._state = state
        for listener in tuple(self.state_listeners):
            listener()

    def check_files(self, state: StudioState) -> None:
        """Raise :class:`UsageError` if a state names a file that was not opened."""
        with self._lock:
            scenes = {*self._files, *bundled.names()}
            opened = dict.fromkeys(FILES, self._files) | {
                "scene": scenes,
                "display": {*self._files, *self._presets},
                "transfer_function": {*self._files, *PRESETS},
            }
        for name, known in opened.items():
            value = getattr(state, name)
            if value is None or value in known or (name == "display" and is_short_form(value)):
                continue
            if self.uploads.holds(Path(value)):
                continue
            rule = "the page opens what the command was given, and what is dropped onto it"
            raise UsageError(f"'{Path(value).name[:80]}' was not opened", parameter=name, rule=rule)

    def try_dropped(self, dropped: Dropped, then: Callable[[LippmannError | None], None]) -> dict[str, object]:
        """Show a dropped file once, to nobody.

        Parameters
        ----------
        dropped:
            The file.
        then:
            Called in the render thread with the error, or None where the file can be shown.

        Returns
        -------
        dict
            The settings that change where it is shown: another scene is placed as if it were the first one.
        """
        path = str(dropped.path)
        changes: dict[str, object] = {"environment": path}
        if dropped.path.suffix.lower() not in ENVIRONMENTS:
            plain = StudioState()
            changes = {"scene": path, **{name: getattr(plain, name) for name in PLACED_BY}}
        with self._lock:
            self._titles[path] = dropped.name
        self.try_state(replace(self.state, **changes), then)  # type: ignore[arg-type]
        return changes

    def title(self, state: StudioState) -> str:
        """Name of a state's scene for people: of a dropped one the whole name that it had."""
        with self._lock:
            return self._titles.get(state.scene) or title_of(state)

    def display(self, state: StudioState) -> Display:
        """The display of a state."""
        with self._lock:
            display = self._displays.get(state.display)
        if display is None:
            display = state.load_display()
            with self._lock:
                self._displays[state.display] = display
        return display

    def display_names(self) -> list[tuple[str, list[tuple[str, str]]]]:
        """Presets for a list: groups of names and titles."""
        kinds = ("Panels and lens arrays", "Looking Glass", "Eye-tracked monitors", "Prints")
        groups: dict[str, list[tuple[str, str]]] = {kind: [] for kind in kinds}
        for name, display in self._presets.items():
            kind = kinds[2] if display.stereo else kinds[3] if "print" in name else kinds[0]
            kind = kinds[1] if name.startswith(("looking", BRIDGE)) else kind
            groups[kind].append((name, display.title or name))
        return list(groups.items())

    def request_view(self, number: int, state: StudioState, view: LiveView) -> ViewRequest:
        """The scene to render for a view of a state."""
        key = (state.scene, SceneOptions.part_of(state))

        def load() -> Scene:
            return state.load_scene(allow_outside=self._allow_outside, source=self._held_scene(state))

        return ViewRequest(number, key, load, self.display(state), view)

    def command(self, state: StudioState) -> list[str] | None:
        """The command line that renders a state; None for a scene that has no file."""
        return None if self._held_scene(state) is not None else self._render_command(state)

    def check_has_file(self, state: StudioState, what: str) -> None:
        """Raise :class:`UsageError` if the scene of a state has no file, which ``what`` needs."""
        if self._held_scene(state) is not None:
            raise UsageError(f"{what} needs a scene that is a file", parameter="scene", fix=WITHOUT_FILE)

    def render(self, kind: Kind, state: StudioState) -> None:
        """Begin a full render of a state; a UsageError if one is running."""
        self.check_has_file(state, "a render from the page")
        words = self._render_command(state)
        ending: str | None = None
        is_pair = self.display(state).stereo is not None
        if is_pair and kind == "picture":
            kind = "quilt"
        if kind == "quilt" or (is_pair and kind == "turntable"):
            from lippmann.quilts.quilt import quilt_of_display

            ending = f"{quilt_of_display(self.display(state), None, None).ending}{ENDINGS[kind]}"
        elif kind == "print" and not self.display(state).name.startswith("print"):
            raise UsageError(f"{self.display(state).name} is no print", fix="choose a print, or render a picture")
        display = state.display if state.display in self._presets else self.display(state).name
        self.jobs.start(kind, words, f"{Path(self.title(state)).stem}-{display}", ending)

    def warm_up(self) -> None:
        """Begin to load the scene and to compile its kernels, before a page asks for a frame."""
        self.try_state(self.state, lambda _: None)

    def try_state(self, state: StudioState, then: Callable[[LippmannError | None], None]) -> None:
        """Render a state once, for nobody; ``then`` gets what went wrong, or None, in the render thread."""

        def end(error: LippmannError | None) -> None:
            self.thread.remove(watcher)
            then(error)

        watcher = Watcher(lambda _: end(None), end)
        self.thread.add(watcher)
        view = state.view(default_eye(self.display(state)), _FIRST_SIZE)
        self.thread.want(watcher, self.request_view(0, state, view))

    def close(self) -> None:
        """End all work."""
        self.jobs.close()
        self.thread.close()

    def _render_command(self, state: StudioState) -> list[str]:
        words = render_command(state, allow_outside=self._allow_outside)
        return words if self.display(state).stereo is None else [*QUILT_RENDER, *of_quilts(words[2:])]

    def _held_scene(self, state: StudioState) -> Scene | None:
        return self._held if state.scene == self._held_name else None

    def _job_changed(self, job: Job) -> None:
        self.thread.gather(job.phase != "running")
        for listener in tuple(self.job_listeners):
            listener(job)


def open_state(text: str, current: StudioState) -> StudioState:
    """State of a TOML file's text. A scene file is the present one, if that has its name.

    Raises
    ------
    UsageError
        The text is no state.
    """
    state = state_of_text(text)
    same = Path(state.scene).name == Path(current.scene).name
    return replace(state, scene=current.scene) if same else state
