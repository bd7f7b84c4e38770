"""Monitors as display files: the table ``[monitor]`` in place of ``[panel]`` and ``[lens_array]``.

::

    title = "A 15.6-inch panel behind a slanted sheet"

    [monitor]
    width = 3840
    height = 2160
    pixel_pitch = "282.4 dpi"
    subpixel_offsets = "rgb"         # as of a panel; subpixel_cells too
    pitch = 45.5                     # lenses per inch as seen; or a text with a unit: lpi, mm, px ...
    slope = -6.0                     # inf for upright lenses
    center = 0.37
    view_cone = 35                   # degrees
    viewing_distance = "60 cm"
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

from lippmann.display.display import INFINITE
from lippmann.display.formats.monitor import DEFAULT_CONE, DEFAULT_DISTANCE, Monitor
from lippmann.display.panel import RGB_STRIPE, Panel, stripe
from lippmann.display.validation import (
    INCH,
    MILLIMETRES,
    Arguments,
    Table,
    check_text,
    finite,
    length,
    millimetres,
    plain_number,
    positive,
    refuse_unknown,
    table_of,
    whole_count,
)
from lippmann.errors import DisplayError
from lippmann.json_values import JsonObject, JsonValue

#: The table's name.
TABLE = "monitor"

_NEEDED = ("width", "height", "pixel_pitch", "pitch", "slope", "center")
_KEYS = (*_NEEDED, "view_cone", "viewing_distance", "subpixel_offsets", "subpixel_cells")

#: Of a number of pixels; more are not even read.
_MOST_DIGITS = 9

#: Keys of the short form, as people write them, with those of the table.
SHORT_KEYS = {
    "dpi": "pixel_pitch",
    "pitch": "pitch",
    "slope": "slope",
    "center": "center",
    "cone": "view_cone",
    "viewing-distance": "viewing_distance",
    "subpixels": "subpixel_offsets",
}


def monitor_of_tables(values: Table) -> Monitor:
    """The monitor of a file's values: ``name``, ``title`` and the table ``monitor``.

    Raises
    ------
    DisplayError
        If a key is missing or unknown, or a value is out of its range; ``where`` is the dotted key.
    """
    refuse_unknown(values, ("name", "title", TABLE))
    table = table_of(values[TABLE], TABLE, _KEYS, _NEEDED)
    try:
        return _monitor(values, table)
    except DisplayError as error:
        where = error.where if error.where in ("name", "title") else f"{TABLE}.{error.where.rpartition('.')[2]}"
        raise DisplayError(error.what, where=where, rule=error.rule, fix=error.fix) from None


def monitor_of_texts(texts: Mapping[str, str]) -> Monitor:
    """The monitor of the short form: ``size`` (``3840x2160``) and the keys of :data:`SHORT_KEYS`.

    Raises
    ------
    DisplayError
        As :func:`monitor_of_tables`; ``where`` is the key as written here.
    """
    keys = ("size", *SHORT_KEYS)
    refuse_unknown(texts, keys)
    for key in ("size", "dpi", "pitch", "slope", "center"):
        if key not in texts:
            raise DisplayError(f"{key} is missing", where=key, rule="it has no default", fix="add it")
    width, times, height = texts["size"].strip().lower().partition("x")
    if not (times and _is_count(width) and _is_count(height)):
        rule = "width x height in pixels, such as 3840x2160"
        raise DisplayError(f"{texts['size']!r} is no number of pixels", where="size", rule=rule)
    table: dict[str, object] = {"width": int(width), "height": int(height)}
    for key, value in texts.items():
        if key == "dpi":
            table["pixel_pitch"] = f"{plain_number(value, key)!r} dpi"
        elif key in ("slope", "center", "cone") and value != INFINITE:
            table[SHORT_KEYS[key]] = plain_number(value, key)
        elif key != "size":
            table[SHORT_KEYS[key]] = value
    try:
        return monitor_of_tables({"name": TABLE, TABLE: table})
    except DisplayError as error:
        last = error.where.rpartition(".")[2]
        where = {"width": "size", "height": "size", **{there: here for here, there in SHORT_KEYS.items()}}[last]
        raise DisplayError(error.what, where=where, rule=error.rule, fix=error.fix) from None


def _is_count(text: str) -> bool:
    return text.isdecimal() and len(text) <= _MOST_DIGITS


def text_of_monitor(monitor: Monitor) -> str:
    """Text of a display file that gives exactly this monitor again."""
    panel = monitor.panel
    values: JsonObject = {
        "width": panel.width,
        "height": panel.height,
        "pixel_pitch": panel.pixel_pitch,
        "subpixel_offsets": panel.subpixel_offsets,
        "subpixel_cells": panel.subpixel_cells,
        "pitch": monitor.pitch,
        "slope": monitor.slope,
        "center": monitor.center,
        "view_cone": monitor.view_cone,
        "viewing_distance": INFINITE if math.isinf(monitor.viewing_distance) else monitor.viewing_distance,
    }
    lines = [f"name = {_to_toml(monitor.name)}", f"title = {_to_toml(monitor.title)}", "", f"[{TABLE}]"]
    lines += [f"{key} = {_to_toml(value)}" for key, value in values.items() if value is not None]
    return "\n".join(lines) + "\n"


def _to_toml(value: JsonValue) -> str:
    """A value as TOML, which writes strings and lists as JSON does, and knows ``inf``."""
    # One character that JSON writes as it is and TOML does not.
    return "inf" if value == math.inf else json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _monitor(values: Arguments, table: Arguments) -> Monitor:
    pixel = positive(millimetres(table["pixel_pitch"], "pixel_pitch", per_inch=("dpi", "ppi")), "pixel_pitch")
    offsets = table.get("subpixel_offsets", RGB_STRIPE)
    panel = Panel(
        whole_count(table["width"], "width"),
        whole_count(table["height"], "height"),
        pixel,
        stripe(offsets, "subpixel_offsets") if isinstance(offsets, str) else offsets,
        table.get("subpixel_cells"),
    )
    distance = table.get("viewing_distance", DEFAULT_DISTANCE)
    slope, title = table["slope"], values.get("title", "")
    check_text(title, "title")
    monitor = Monitor(
        name=values["name"],
        title=title,
        panel=panel,
        pitch=_lenses_per_inch(table["pitch"], pixel),
        slope=math.inf if slope == INFINITE else slope,
        center=table["center"],
        view_cone=table.get("view_cone", DEFAULT_CONE),
        viewing_distance=math.inf if distance == INFINITE else millimetres(distance, "viewing_distance"),
    )
    monitor.display()  # checks how many pixels a lens covers
    return monitor


def _lenses_per_inch(pitch: object, pixel: float) -> float:
    """A bare number is in lenses per inch; a text may have another unit."""
    if not isinstance(pitch, str):
        return finite(pitch, "pitch")
    scales = {**MILLIMETRES, "px": pixel}
    spacing = length(pitch, "pitch", scales, per_inch=("lpi",), unit="lpi")
    if spacing == 0:
        raise DisplayError(f"pitch is {pitch!r}", where="pitch", rule="it must be above zero")
    return INCH / spacing
