"""What the calibration's server answers: the page, the display it starts from, and one file that it may write.

GET /                  the page
GET /assets/NAME       what the page is made of
GET /calibration.json  panel, values to start from, and the token that saving takes
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
from lippmann.display.panel import Panel, SubpixelOffsets
from lippmann.display.units import stripe
from lippmann.errors import UsageError
from lippmann.runtime.atomic_write import replacing
from lippmann.viewer.http_server import Answer, RefusedError, Request, file_answer, json_answer

#: Orders of sub-pixels that side by side stripes come in, and pixels whose colours lie in one place.
_ORDERS = ("rgb", "bgr", "rbg", "brg", "gbr", "grb", "none")

#: Places that are none of these orders.
_OWN_ORDER = "as they are"

#: What a page may send, and which values.
_SENT = {"pitch", "slope", "center", "order"}


class CalibrationSite:
    """The page for one monitor; a :class:`~lippmann.viewer.http_server.Site`.

    Parameters
    ----------
    monitor:
        The values to start from.
    output:
        The display file to write, and the only one that can be.
    saved:
        Called with the monitor each time that it was written.
    """

    def __init__(self, monitor: Monitor, output: Path, saved: Callable[[Monitor], None]) -> None:
        self._monitor = monitor
        self._output = output
        self._saved = saved
        self._token = secrets.token_urlsafe(32)
        self._lock = threading.Lock()
        folder = files(__package__) / "assets"
        assets = {entry.name: entry.read_text(encoding="utf-8") for entry in folder.iterdir()}
        self._page = {f"/assets/{name}": file_answer(name, text) for name, text in assets.items()}
        self._page["/"] = self._page.pop("/assets/page.html")

    def get(self, request: Request) -> Answer:
        if request.path == "/calibration.json":
            return json_answer(self._start())
        if request.path in self._page:
            return self._page[request.path]
        raise RefusedError(HTTPStatus.NOT_FOUND, "there is nothing here")

    def post(self, request: Request, body: bytes) -> Answer:
        if request.path != "/display":
            raise RefusedError(HTTPStatus.NOT_FOUND, "there is nothing here")
        token = request.headers.get("X-Lippmann-Token", "")
        if not hmac.compare_digest(token.encode("utf-8", "replace"), self._token.encode("ascii")):
            raise RefusedError(HTTPStatus.FORBIDDEN, "this page is an old one; reload it")
        monitor = self._turned(_sent(body))
        with self._lock, replacing(self._output) as temporary:
            temporary.write_text(text_of_monitor(monitor), encoding="utf-8")
        self._saved(monitor)
        return json_answer({"saved": str(self._output)})

    def _start(self) -> dict[str, Any]:
        """What the page starts from, as plain values."""
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
                "cells": panel.subpixel_cells or [[panel.subpixel_offsets]],
            },
            "orders": orders,
            "order": order,
            "monitor": {"pitch": monitor.pitch, "lean": 1 / monitor.slope, "center": monitor.center % 1.0},
        }

    def _turned(self, sent: dict[str, Any]) -> Monitor:
        """The monitor with the values that were sent; a DisplayError if no monitor can have them."""
        panel, order = self._monitor.panel, sent["order"]
        if order is not None:
            offered = _orders(panel)
            if order not in offered:
                rule = f"it must be one of {', '.join(offered) or 'none, since the display has cells of its own'}"
                raise UsageError(f"the order of sub-pixels is {order!r}", rule=rule)
            panel = replace(panel, subpixel_offsets=offered[order])
        monitor = replace(
            self._monitor,
            name=self._output.stem or self._monitor.name,
            panel=panel,
            pitch=sent["pitch"],
            slope=math.inf if sent["slope"] is None else sent["slope"],
            center=sent["center"],
        )
        monitor.display()  # whether a lens covers as many pixels as it can
        return monitor


def _sent(body: bytes) -> dict[str, Any]:
    """The values that a page sent; numbers are looked at by the monitor itself."""
    try:
        values = json.loads(body)
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict) or set(values) != _SENT or not isinstance(values["order"], (str, type(None))):
        raise UsageError("this is no calibration", rule=f"it must have {', '.join(sorted(_SENT))}")
    return values


def _orders(panel: Panel) -> dict[str, SubpixelOffsets]:
    """The orders of sub-pixels that may be chosen, by name: none for a panel whose pixels are of several kinds."""
    if panel.subpixel_cells is not None:
        return {}
    orders = {name: stripe(name, "order") for name in _ORDERS}
    own = panel.subpixel_offsets
    # Places that somebody measured can be kept.
    return orders if any(_is_same(own, offsets) for offsets in orders.values()) else {_OWN_ORDER: own, **orders}


def _is_same(one: SubpixelOffsets, other: SubpixelOffsets) -> bool:
    return all(abs(a - b) < 1e-9 for p, q in zip(one, other, strict=True) for a, b in zip(p, q, strict=True))
