"""Content of the calibration server: the page, the values of a monitor, and one display file that the page may write.

GET /                  the page
GET /assets/NAME       a script, the style sheet or the icon of the page
GET /calibration.json  panel, initial values, and the token that POST needs
POST /display          {"pitch", "slope" (null if infinite), "center", "order"}: writes the display file
"""

from __future__ import annotations

import hmac
import json
import math
import secrets
import threading
from collections.abc import Callable
from dataclasses import replace
from http import HTTPStatus
from importlib.resources import files
from pathlib import Path
from typing import Any

from lippmann.display.formats.monitor import Monitor
from lippmann.display.formats.monitor_toml import text_of_monitor
from lippmann.display.panel import Panel, SubpixelOffsets, stripe
from lippmann.errors import UsageError
from lippmann.runtime.atomic_write import replacing
from lippmann.viewer.responses import RefusedError, Request, Response, file_response, json_response

#: Orders of sub-pixels in stripes; "none" means that the three lie in one place.
_ORDERS = ("rgb", "bgr", "rbg", "brg", "gbr", "grb", "none")

#: Name of measured sub-pixel places that match no order.
_MEASURED_ORDER = "as they are"

#: Keys of the values that the page posts.
_KEYS = {"pitch", "slope", "center", "order"}


class CalibrationSite:
    """The calibration page of one monitor; a :class:`~lippmann.viewer.responses.Site`.

    Parameters
    ----------
    monitor:
        Initial values.
    output:
        Display file to write; the page can write no other.
    saved:
        Called with the monitor after each write.
    """

    def __init__(self, monitor: Monitor, output: Path, saved: Callable[[Monitor], None]) -> None:
        self._monitor = monitor
        self._output = output
        self._saved = saved
        self._token = secrets.token_urlsafe(32)
        self._lock = threading.Lock()
        folder = files(__package__) / "assets"
        assets = {entry.name: entry.read_text(encoding="utf-8") for entry in folder.iterdir()}
        self._page = {f"/assets/{name}": file_response(name, text) for name, text in assets.items()}
        self._page["/"] = self._page.pop("/assets/page.html")

    def get(self, request: Request) -> Response:
        if request.path == "/calibration.json":
            return json_response(self._start())
        if request.path in self._page:
            return self._page[request.path]
        raise RefusedError(HTTPStatus.NOT_FOUND, "there is nothing here")

    def post(self, request: Request, body: bytes) -> Response:
        if request.path != "/display":
            raise RefusedError(HTTPStatus.NOT_FOUND, "there is nothing here")
        token = request.headers.get("X-Lippmann-Token", "")
        if not hmac.compare_digest(token.encode("utf-8", "replace"), self._token.encode("ascii")):
            raise RefusedError(HTTPStatus.FORBIDDEN, "this page is an old one; reload it")
        monitor = self._monitor_with(_values(body))
        with self._lock, replacing(self._output) as temporary:
            temporary.write_text(text_of_monitor(monitor), encoding="utf-8")
        self._saved(monitor)
        return json_response({"saved": str(self._output)})

    def _start(self) -> dict[str, object]:
        """Panel and initial values for the page, as plain values for JSON."""
        monitor, panel = self._monitor, self._monitor.panel
        orders = _orders(panel)
        order = next((name for name, offsets in orders.items() if _is_same(offsets, panel.subpixel_offsets)), None)
        return {
            "token": self._token,
            "title": monitor.title or monitor.name,
            "output": self._output.name,
            "panel": {
                "width": panel.width,
                "height": panel.height,
                "pixel_pitch": panel.pixel_pitch,
                "cells": panel.cells,
            },
            "orders": orders,
            "order": order,
            "monitor": {"pitch": monitor.pitch, "lean": 1 / monitor.slope, "center": monitor.center % 1.0},
        }

    def _monitor_with(self, values: dict[str, Any]) -> Monitor:
        """The monitor with the posted values; a DisplayError if no monitor can have them."""
        panel, order = self._monitor.panel, values["order"]
        if order is not None:
            orders = _orders(panel)
            if order not in orders:
                rule = f"it must be one of {', '.join(orders) or 'none, since the display has cells of its own'}"
                raise UsageError(f"the order of sub-pixels is {order!r}", rule=rule)
            panel = replace(panel, subpixel_offsets=orders[order])
        monitor = replace(
            self._monitor,
            name=self._output.stem or self._monitor.name,
            panel=panel,
            pitch=values["pitch"],
            slope=math.inf if values["slope"] is None else values["slope"],
            center=values["center"],
        )
        monitor.display()  # checks the number of pixels that a lens covers
        return monitor


def _values(body: bytes) -> dict[str, Any]:
    """Values of a POST; :class:`Monitor` checks the numbers."""
    try:
        values = json.loads(body)
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict) or set(values) != _KEYS or not isinstance(values["order"], (str, type(None))):
        raise UsageError("this is no calibration", rule=f"it must have {', '.join(sorted(_KEYS))}")
    return values


def _orders(panel: Panel) -> dict[str, SubpixelOffsets]:
    """Orders of sub-pixels to choose from, by name; empty for a panel with cells of several kinds."""
    if panel.subpixel_cells is not None:
        return {}
    orders = {name: stripe(name, "order") for name in _ORDERS}
    own = panel.subpixel_offsets
    return orders if any(_is_same(own, offsets) for offsets in orders.values()) else {_MEASURED_ORDER: own, **orders}


def _is_same(one: SubpixelOffsets, other: SubpixelOffsets) -> bool:
    return all(abs(a - b) < 1e-9 for p, q in zip(one, other, strict=True) for a, b in zip(p, q, strict=True))
