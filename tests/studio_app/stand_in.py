"""A studio whose pictures are drawn by NumPy: everything but the tracing of rays is the real one."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import ClientConnection, connect

from lippmann.rendering.live.live_view import LiveFrame, LiveView
from lippmann.scene.placement import Placement
from lippmann.studio_app.session import StudioSession
from lippmann.studio_app.site import StudioSite
from lippmann.studio_app.state import StudioState
from lippmann.studio_app.uploads import Uploads
from lippmann.viewer.http_server import WebServer

FOLDER = "secret"
TINY = "print:lpi=30,ppi=300,size=10x8mm"


def placement(depth: float = 10.0) -> Placement:
    return Placement(np.eye(4), (-depth, depth / 2), (-8.0, 8.0), "fit", ("depth_scale=1 shows it whole",))


class StandIn:
    """Pictures whose red tells the turn, whose green tells the eye, and that are drawn at once."""

    def __init__(self, scene: Any, display: Any) -> None:
        self.scene, self.display = scene, display
        self.calls: list[str] = []
        self.samples = 1

    def set_scene(self, scene: Any) -> None:
        self.calls.append("scene")
        self.scene = scene

    def set_display(self, display: Any) -> None:
        self.calls.append("display")
        self.display = display

    def frame(self, view: LiveView) -> LiveFrame:
        self.samples = 1
        return self._draw(view)

    def refine(self, view: LiveView) -> LiveFrame:
        self.samples += 1023
        return self._draw(view)

    def frame_steps(self, view: LiveView) -> Iterator[LiveFrame | None]:
        yield self.frame(view)

    def refine_steps(self, view: LiveView) -> Iterator[LiveFrame | None]:
        while True:
            yield self.refine(view)

    def pick(self, view: LiveView, u: float, v: float) -> float | None:
        return None if u < 0.5 else 3.0

    def _draw(self, view: LiveView) -> LiveFrame:
        if view.eye is not None:
            width, height = view.size
        elif view.window is not None:
            width, height = view.window.width, view.window.height
        else:
            width, height = self.display.panel.width, self.display.panel.height
        pixels = np.zeros((height, width, 3), np.uint8)
        pixels[..., 0] = int(view.request.placement.turn[0]) % 256
        pixels[..., 1] = 128 if view.eye is None else int(128 + view.eye[0]) % 256
        pixels[::2, ::2, 2] = 255
        return LiveFrame(pixels, self.samples, False, placement(), 0.0, {"trace": 0.001})


@dataclass
class Running:
    """A studio and its server; renders are written into ``outputs``."""

    session: StudioSession
    server: WebServer
    outputs: Path

    @property
    def address(self) -> str:
        return self.server.address

    def connect(self, path: str = "live", **options: Any) -> ClientConnection:
        """A WebSocket as the page opens it."""
        base = f"127.0.0.1:{self.server.port}"
        options = {"origin": f"http://{base}", "open_timeout": 10, **options}
        return connect(f"ws://{base}/{FOLDER}/{path}", **options)


@contextmanager
def running(folder: Path, state: StudioState | None = None, make: Any = StandIn) -> Iterator[Running]:
    """A studio with its server; ``folder`` is for its files."""
    for name in ("uploads", "outputs"):
        (folder / name).mkdir(exist_ok=True)
    session = StudioSession(
        state or StudioState(display=TINY),
        uploads=Uploads(folder / "uploads"),
        outputs=folder / "outputs",
        make_renderer=make,
    )
    with WebServer(StudioSite(session), folder=FOLDER) as server:
        yield Running(session, server, folder / "outputs")
    session.close()


def said(socket: ClientConnection, kind: str, seconds: float = 60.0) -> Any:
    """The next message of a type; ``frame`` for bytes."""
    while True:
        message = socket.recv(seconds)
        if isinstance(message, bytes):
            if kind == "frame":
                return message
            continue
        read = json.loads(message)
        if read["type"] == kind:
            return read


def view(state: Any, number: int = 1, **changes: Any) -> str:
    """A message that asks for a view."""
    return json.dumps(
        {"type": "view", "number": number, "state": state, "eye": [0, 0, 300], "size": [40, 30], "window": None}
        | changes
    )
