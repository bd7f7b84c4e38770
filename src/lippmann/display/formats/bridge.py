"""Looking Glass Bridge, the maker's program that drives its panels: asked for the panels that it finds.

It listens on this machine only and answers PUT requests whose bodies are JSON, as the maker's package
``@lookingglass/bridge`` (0.0.8-alpha.4, MIT) sends them. Where it does not run, the answer takes no time.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

from lippmann.display.display import Display
from lippmann.display.formats.looking_glass import display_of_calibration
from lippmann.errors import DisplayError
from lippmann.json_values import JsonObject

#: The name of the panel that Bridge finds; with a colon and a serial number, that of one among several.
NAME = "bridge"

#: Address at which Bridge listens.
HOST, PORT = "localhost", 33334

#: Seconds to wait for an answer: a running Bridge answers from memory, and nobody waits for one that hangs.
PATIENCE = 0.25

#: Most bytes of an answer; a calibration takes about 2000.
_MOST_BYTES = 1 << 20

_SESSION = "default"


@dataclass(frozen=True)
class BridgePanel:
    """A panel that Bridge finds: its display, named by its serial number, and the top left corner of its screen."""

    display: Display
    corner: tuple[int, int]


class Bridge:
    """A session of Bridge.

    Raises
    ------
    DisplayError
        Bridge does not run, does not answer in time, or not as its maker's package expects; or it finds no panel.
    """

    def __init__(self) -> None:
        self._token = _text(self._put("enter_orchestration", {"name": _SESSION}), "payload")

    def ask(self, endpoint: str, values: JsonObject | None = None) -> Mapping[str, object]:
        """The answer to a request in this session."""
        return self._put(endpoint, {"orchestration": self._token, **(values or {})})

    def panels(self) -> list[BridgePanel]:
        """The Looking Glass panels that are connected, at least one."""
        payload = _inner(self.ask("available_output_devices"), "payload")
        entries = payload if isinstance(payload, Mapping) else {}
        devices = [_inner(entries, key) for key in entries]
        panels = [_panel(each) for each in devices if isinstance(each, Mapping) and "LKG" in _text(each, "hwid")]
        if not panels:
            raise DisplayError(
                "Looking Glass Bridge finds no panel", fix="connect one, and look whether Bridge lists it"
            )
        return panels

    @staticmethod
    def _put(endpoint: str, values: JsonObject) -> Mapping[str, object]:
        import http.client  # takes as long as all else about displays

        where = f"http://{HOST}:{PORT}/{endpoint}"
        connection = http.client.HTTPConnection(HOST, PORT, timeout=PATIENCE)
        try:
            connection.request("PUT", f"/{endpoint}", json.dumps(values), {"Content-Type": "application/json"})
            answer = json.loads(connection.getresponse().read(_MOST_BYTES))
        except (OSError, http.client.HTTPException) as error:
            fix = "start Bridge, or give the panel's visual.json"
            what = f"Looking Glass Bridge does not answer: {error or type(error).__name__}"
            raise DisplayError(what, where=where, fix=fix) from None
        except (ValueError, RecursionError):
            raise DisplayError("the answer is no JSON", where=where, rule="Bridge answers with JSON") from None
        finally:
            connection.close()
        if not isinstance(answer, Mapping):
            raise DisplayError("the answer is no object", where=where, rule="Bridge answers with an object of JSON")
        return answer


def display_of_bridge(name: str) -> Display:
    """The panel of :data:`NAME`, with or without a colon and its serial number.

    Raises
    ------
    DisplayError
        As :class:`Bridge`; or there is not that panel, or several.
    """
    serial = name.partition(":")[2]
    panels = {panel.display.name: panel.display for panel in Bridge().panels()}
    if serial and serial not in panels:
        raise DisplayError.unknown("panel of Bridge", serial, panels)
    if not serial and len(panels) > 1:
        fix = f"say which: {', '.join(f'{NAME}:{each}' for each in panels)}"
        raise DisplayError(f"Bridge finds {len(panels)} panels", where=name, fix=fix)
    return panels[serial] if serial else next(iter(panels.values()))


def panels_or_none() -> list[BridgePanel]:
    """The panels that Bridge finds; none where it does not run or does not answer."""
    try:
        return Bridge().panels()
    except DisplayError:
        return []


def corner_of_screen(panels: list[BridgePanel], width: int, height: int) -> tuple[int, int] | None:
    """Top left corner of the screen of the one panel with so many pixels; None if there is none, or several."""
    corners = [
        each.corner for each in panels if (each.display.panel.width, each.display.panel.height) == (width, height)
    ]
    return corners[0] if len(corners) == 1 else None


def _panel(device: Mapping[str, object]) -> BridgePanel:
    where = f"Bridge's {_text(device, 'hwid')}"
    display = display_of_calibration(_text(device, "calibration"), where=where)
    corner = _inner(device, "windowCoords")
    place = [corner.get(axis) for axis in ("x", "y")] if isinstance(corner, Mapping) else []
    x, y = (int(side) if isinstance(side, (int, float)) else 0 for side in place or (0, 0))
    return BridgePanel(replace(display, title=f"{display.name}, by Bridge"), (x, y))


def _inner(values: Mapping[str, object], key: str) -> object:
    """The value of an entry that is wrapped in an object, as all of Bridge's are."""
    entry = values.get(key)
    return entry.get("value") if isinstance(entry, Mapping) else None


def _text(values: Mapping[str, object], key: str) -> str:
    text = _inner(values, key)
    if not isinstance(text, str):
        raise DisplayError(f"{key} is {text!r}", where="Looking Glass Bridge", rule="it must be a text")
    return text
