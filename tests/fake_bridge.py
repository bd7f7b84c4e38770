"""A stand-in for Looking Glass Bridge, after the maker's public package ``@lookingglass/bridge`` 0.0.8-alpha.4."""

from __future__ import annotations

import json
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from lippmann.display.formats import bridge


class FakeBridge:
    """Answers as Bridge does; ``asked`` holds the requests, an endpoint and its values each."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, dict[str, Any]]] = []
        self.token = "a token"
        self.devices: list[dict[str, Any]] = []
        self.raw: bytes | None = None
        self.connect("LKG-P00001", (1920, 0))

    def connect(self, serial: str, corner: tuple[int, int], size: tuple[int, int] = (150, 200)) -> None:
        """Connect one more panel."""
        self.devices.append(device(serial, len(self.devices), corner, size))

    def answer(self, endpoint: str, values: dict[str, Any]) -> dict[str, Any]:
        self.asked.append((endpoint, values))
        if endpoint == "enter_orchestration":
            return wrapped("payload", self.token)
        assert values["orchestration"] == self.token
        if endpoint != "available_output_devices":
            return wrapped("payload", "")
        named = {str(number): {"name": str(number), "value": each} for number, each in enumerate(self.devices)}
        return {"name": endpoint, "payload": {"name": "payload", "type": "VARIANT_MAP", "value": named}}


def wrapped(name: str, value: Any) -> dict[str, Any]:
    return {name: {"name": name, "type": "WSTRING", "value": value}}


def device(serial: str, index: int, corner: tuple[int, int], size: tuple[int, int]) -> dict[str, Any]:
    """A device as Bridge tells of it: all values wrapped, calibration and quilt as JSON texts."""
    numbers = {"pitch": 52.58, "slope": -7.145, "center": 0.42, "viewCone": 40, "invView": 1, "DPI": 324}
    numbers |= {"screenW": size[0], "screenH": size[1], "flipImageX": 0, "flipImageY": 0, "flipSubp": 0}
    calibration = {"serial": serial, "configVersion": "1.0"} | {key: {"value": value} for key, value in numbers.items()}
    quilt = {"quiltAspect": 0.75, "quiltX": 3360, "quiltY": 3360, "tileX": 8, "tileY": 6}
    values = {"hwid": serial, "calibration": json.dumps(calibration), "defaultQuilt": json.dumps(quilt)}
    values |= {"hardwareVersion": "portrait", "index": index, "state": "ok"}
    values |= {"windowCoords": {"x": corner[0], "y": corner[1]}}
    return {name: wrapped(name, value)[name] for name, value in values.items()}


@contextmanager
def running(monkeypatch: Any) -> Any:
    """A running stand-in, at a port that takes the place of Bridge's."""
    fake = FakeBridge()

    class Handler(BaseHTTPRequestHandler):
        def do_PUT(self) -> None:
            values = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            body = fake.raw or json.dumps(fake.answer(self.path[1:], values)).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("localhost", 0), Handler) as server:
        server.block_on_close = False
        thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
        thread.start()
        monkeypatch.setattr(bridge, "PORT", server.server_address[1])
        yield fake
        server.shutdown()
        thread.join()
