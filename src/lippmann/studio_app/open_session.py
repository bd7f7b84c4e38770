"""A session with all that it needs: a folder for dropped files, a live renderer, and an end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.errors import SceneError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime.atomic_write import check_writable
from lippmann.scene import bundled
from lippmann.scene.readers.load import kind_of_file
from lippmann.studio_app.session import StudioSession
from lippmann.studio_app.state import StudioState
from lippmann.studio_app.uploads import Uploads

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.rendering.live.renderer import LiveRenderer
    from lippmann.scene.scene import Scene

#: Folder of dropped files, beside the outputs.
_DROPPED = "studio-files"


@contextmanager
def open_session(
    state: StudioState,
    folder: Path,
    machine: RenderRequest,
    *,
    allow_outside: bool = False,
    held: Scene | None = None,
    engine_loaded: Callable[[], None] = lambda: None,
) -> Iterator[StudioSession]:
    """A session for as long as the block lasts.

    Parameters
    ----------
    state:
        The first state.
    folder:
        Where renders are written.
    machine:
        Its ``device``, ``threads`` and ``memory`` count.
    allow_outside, held:
        As for :class:`StudioSession`.
    engine_loaded:
        Called in the render thread once the engine is loaded.

    Raises
    ------
    LippmannError
        Before the block, if there is no such display, scene or folder; what a scene's file holds is said on the page.
    """
    state.load_display()
    if held is None and kind_of_file(state.scene) is None and state.scene not in bundled.names():
        raise SceneError.unknown("bundled scene or file", state.scene, bundled.names())
    check_writable(folder / "picture.png")

    def make_renderer(scene: Scene, display: Display) -> LiveRenderer:
        from lippmann.rendering.live.renderer import LiveRenderer

        renderer = LiveRenderer(scene, display, machine=machine)
        engine_loaded()
        return renderer

    outputs = folder.resolve()
    session = StudioSession(
        state,
        uploads=Uploads(outputs / _DROPPED),
        outputs=outputs,
        make_renderer=make_renderer,
        allow_outside=allow_outside,
        held=held,
    )
    try:
        yield session
    finally:
        session.close()
