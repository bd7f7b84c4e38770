"""The studio in a Jupyter notebook: its server in the kernel, shown in an iframe of the cell."""

from __future__ import annotations

import atexit
import html
import os
import re
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.errors import UsageError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.studio_app.open_session import open_session
from lippmann.studio_app.page_values import state_of_values
from lippmann.studio_app.site import StudioSite
from lippmann.studio_app.state import StudioState
from lippmann.viewer.http_server import WebServer
from lippmann.viewer.secret_folder import secret_folder

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from lippmann.scene.scene import Scene

#: Pages that may embed a notebook's studio: those of servers on this machine, Jupyter's among them.
LOCAL_PAGES = ("http://localhost:*", "http://127.0.0.1:*", "https://localhost:*", "https://127.0.0.1:*")

_ORIGIN = re.compile(r"https?://[A-Za-z0-9.-]+(:([0-9]{1,5}|\*))?")

#: Heights of the cell in CSS pixels.
_HEIGHTS = (200, 4000)


class NotebookStudio:
    """A studio that runs in this process until :meth:`close`, or the process's end. Jupyter shows it as its page.

    Each has a server of its own on ``127.0.0.1``, so the browser must run on the machine of the kernel, or the port
    must be forwarded to it under the same number. As a context manager it is closed at the end of the block.
    :func:`lippmann.studio` makes it.

    Parameters
    ----------
    state:
        The first state.
    held:
        A scene without a file, which ``state.scene`` names.
    machine:
        Its ``device``, ``threads`` and ``memory`` count.
    folder:
        Where renders are written.
    height:
        Height of the cell in CSS pixels, 200 to 4000.
    port:
        Port of the server; 0 takes a free one.
    framed_by:
        Origins of further pages that may show the studio, such as ``https://hub.example``; ports may be ``*``.
    allow_outside:
        Whether scenes may name files outside their folders.

    Raises
    ------
    LippmannError
        In one line: a value out of its range, no such scene, display or folder, a port in use.

    Examples
    --------
    >>> with lippmann.studio("teapot") as page:  # doctest: +SKIP
    ...     page.state.display
    'seed-lenticular'
    """

    def __init__(
        self,
        state: StudioState,
        *,
        held: Scene | None = None,
        machine: RenderRequest | None = None,
        folder: Path = Path(),
        height: int = 760,
        port: int = 0,
        framed_by: Iterable[str] = (),
        allow_outside: bool = False,
    ) -> None:
        if not _HEIGHTS[0] <= height <= _HEIGHTS[1]:
            rule = f"it must be {_HEIGHTS[0]} to {_HEIGHTS[1]} pixels"
            raise UsageError(f"{height} is no height of a cell", parameter="height", rule=rule)
        pages = (*LOCAL_PAGES, *_origins(framed_by))
        self._height = height
        self._stack = ExitStack()
        with ExitStack() as stack:
            self._session = stack.enter_context(
                open_session(
                    state,
                    folder,
                    machine or RenderRequest(),
                    allow_outside=allow_outside,
                    held=held,
                    engine_loaded=self._close_at_exit,
                )
            )
            # Frames cross no wire but where the port is forwarded.
            site = StudioSite(self._session, "jpeg" if "SSH_CONNECTION" in os.environ else "rgb")
            server = WebServer(site, port=port, folder=secret_folder(), framed_by=pages)
            stack.callback(server.close)
            self._address = server.address
            self._stack = stack.pop_all()
        self._is_open = True
        self._close_at_exit()
        self._session.warm_up()

    @property
    def address(self) -> str:
        """URL of the page, with its secret: whoever has it can use the studio. It opens in a window of its own, too."""
        return self._address

    @property
    def state(self) -> StudioState:
        """The last state that the page has set: :class:`~lippmann.studio_app.state.StudioState`."""
        return self._session.state

    @property
    def is_open(self) -> bool:
        """Whether the studio runs."""
        return self._is_open

    def close(self) -> None:
        """End the studio: its server, its renders, its files. A second call does nothing."""
        if self._is_open:
            self._is_open = False
            atexit.unregister(self.close)
            self._stack.close()

    def _close_at_exit(self) -> None:
        """Close before all exit functions of now: also before that of the engine, once it is loaded."""
        if self._is_open:
            atexit.unregister(self.close)
            atexit.register(self.close)

    def __enter__(self) -> NotebookStudio:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Lippmann Studio: {self._address if self._is_open else 'closed'}>"

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        """MIME bundle for Jupyter: the page in an iframe, and a line of text."""
        bundle = {"text/plain": repr(self)}
        if self._is_open:
            address, style = html.escape(self._address), "width: 100%; border: 0; border-radius: 8px"
            allowed = "clipboard-write; fullscreen"
            bundle["text/html"] = (
                f'<iframe src="{address}" title="Lippmann Studio" height="{self._height}" style="{style}" '
                f'allow="{allowed}"></iframe>'
            )
        return bundle


def state_of_settings(
    scene: str, display: str | Path, settings: Mapping[str, object], held: Scene | None = None
) -> StudioState:
    """The first state of a scene on a display; the light of a held scene is that of the scene.

    Raises
    ------
    UsageError
        A setting is unknown, or its value is out of its range.
    """
    if held is not None and settings.get("up") is not None:
        raise UsageError("is for files", parameter="up", fix="leave it out")
    values: dict[str, object] = {}
    if held is not None:
        values["light_turn"], values["light_strength"] = held.light.light_turn, held.light.light_strength
        values["environment_strength"] = held.light.environment_strength
    values.update(settings, scene=scene, display=str(display))
    return state_of_values({name: _plain(value) for name, value in values.items()})


def _plain(value: object) -> object:
    """A value as JSON has it."""
    return str(value) if isinstance(value, Path) else list(value) if isinstance(value, tuple) else value


def _origins(framed_by: Iterable[str]) -> tuple[str, ...]:
    if isinstance(framed_by, str):
        raise UsageError(f"{framed_by!r} is no list", parameter="framed_by", fix=f"say [{framed_by!r}]")
    origins = tuple(framed_by)
    for origin in origins:
        if _ORIGIN.fullmatch(origin) is None:
            rule = "a scheme, a host and perhaps a port, such as https://hub.example:8000"
            raise UsageError(f"{origin[:80]!r} is no origin", parameter="framed_by", rule=rule)
    return origins
