"""The calibration of a Looking Glass (``visual.json``) as a display.

The formula of such a file, with x and y in [0, 1] from the lower left corner of the panel:

    pitch' = pitch (screenW / DPI) cos(atan(1 / slope))         lenses along the panel's width
    tilt = screenH / (screenW slope), negated if flipImageX     slant of the lenses
    phase = (x + c / (3 screenW) + y tilt) pitch' - center      of sub-pixel c; the second term negated if flipImageX
    phase = (x + dx_c / screenW + (y + dy_c / screenH) tilt) pitch' - center      with the cells of newer panels
    view = 1 - (phase mod 1)                                    0 is the leftmost camera, 1 the rightmost

The phase mod 1 is the place of a sub-pixel under its lens, from the left edge (0) to the right (1): in millimetres the
micro-images are 25.4 / pitch wide and lean by -atan(1 / slope). A sub-pixel on the right under a lens is seen from
the left, so the lens itself reverses the order; ``invView`` = 1 means that. Files of version 3 hold 0, 1 or nothing
there, for devices of one kind, and the vendor's shaders of that time do not read it.

The file holds neither gap nor viewing distance. The gap is that of lenses whose field is ``viewCone`` for an eye that
moves sideways, as the cameras of the views do; the directions in it are even in the tangent, as an ideal lens's are.
The viewing distance is that of the camera which the vendor documents: the panel fills 14 degrees of its height.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import replace

from lippmann.display.display import Display
from lippmann.display.formats.monitor import CONES, PITCHES, Monitor
from lippmann.display.panel import Offset, Panel, SubpixelCells, SubpixelOffsets
from lippmann.display.validation import Table, finite, whole_count
from lippmann.errors import DisplayError

_INCH = 25.4

#: Height of the documented camera's picture, in degrees.
CAMERA_FIELD = 14.0

#: Beginnings of serials whose sub-pixels lie in no plain stripe: without their cells up to 6 of 48 views are wrong.
_NEEDS_CELLS = ("LKG-H", "LKG-J", "LKG-K")

#: The first version of the file in which ``invView`` means nothing.
_VERSION_WITHOUT_ORDER = 3

_CELL_KEYS = ("ROffsetX", "ROffsetY", "GOffsetX", "GOffsetY", "BOffsetX", "BOffsetY")

#: For each CellPatternMode the cells of a pattern's columns (outer) and rows (inner), rows counted upwards.
_PATTERNS: dict[int, list[list[int]]] = {
    0: [[0]],
    1: [[0, 1], [1, 0]],
    2: [[0], [1]],
    3: [[0, 1, 2, 3], [2, 3, 0, 1]],
    4: [[0, 1]],
}


def display_of_calibration(text: str, *, where: str) -> Display:
    """The display of a calibration's JSON text.

    Raises
    ------
    DisplayError
        If the text is no JSON, or a value is missing, not wrapped, zero or nonsensical; names ``where`` and the key.
    """
    values = _parse_json(text, where)
    try:
        return _display(values)
    except DisplayError as error:
        place = f"{where} [{error.where}]" if error.where else where
        raise DisplayError(error.what, where=place, rule=error.rule, fix=error.fix) from None


def _parse_json(text: str, where: str) -> Table:
    try:
        values = json.loads(text.lstrip("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise DisplayError(f"not valid JSON: {error}", where=where) from None
    if not isinstance(values, dict):
        raise DisplayError("this is no calibration", where=where, rule="it must be one JSON object")
    return values


def _display(values: Table) -> Display:
    serial = values.get("serial", "")
    if not isinstance(serial, str):
        raise DisplayError(f"serial is {serial!r}", where="serial", rule="it must be a text")
    width, height = _read_count(values, "screenW"), _read_count(values, "screenH")
    dpi = _read_within(values, "DPI", 10, 10_000)
    pitch = _read_within(values, "pitch", *PITCHES)
    cone = _read_within(values, "viewCone", *CONES)
    slope = _read_number(values, "slope")
    is_mirrored = _read_flag(values, "flipImageX", optional=True)
    _check_orientation(values)
    if is_mirrored:
        slope = -slope
    cells = _read_cells(values, height, serial)
    stripe, shift = _stripe(is_mirrored, _read_flag(values, "flipSubp", optional=True))

    pixel = _INCH / dpi
    monitor = Monitor(
        name=serial or "looking-glass",
        title=f"Looking Glass {serial}".strip(),
        panel=Panel(width, height, pixel, stripe, cells),
        pitch=pitch,
        slope=slope,
        center=_read_number(values, "center"),
        view_cone=cone,
        viewing_distance=height * pixel / (2 * math.tan(math.radians(CAMERA_FIELD) / 2)),
    )
    # With a plain stripe the file's x is that of red, ours that of green.
    to_green = 0.0 if cells else shift * monitor.lenses_right
    return replace(monitor, center=monitor.center - to_green).display()


def _check_orientation(values: Table) -> None:
    if _version(values) < _VERSION_WITHOUT_ORDER and not _read_flag(values, "invView"):
        rule = "a lens shows on the left what lies on its right, which is invView 1"
        raise DisplayError("invView is 0", where="invView", rule=rule, fix="calibrations of devices have 1")
    if _read_flag(values, "flipImageY", optional=True):
        raise DisplayError("flipImageY is 1", where="flipImageY", rule="only 0 is understood", fix="turn the picture")


def _version(values: Table) -> int:
    """The file's major version; 1 if it says none."""
    match = re.match(r"\d{1,3}", str(values.get("configVersion", "")))
    return int(match[0]) if match else 1


def _stripe(is_mirrored: bool, is_swapped: bool) -> tuple[SubpixelOffsets, float]:
    """Places of R, G and B in the pixel, and how far right of the file's own place (that of R) they lie, in pixels."""
    step = -1 / 3 if is_mirrored else 1 / 3
    red, green, blue = (-step, 0.0), (0.0, 0.0), (step, 0.0)
    return ((blue, green, red) if is_swapped else (red, green, blue)), step


def _read_cells(values: Table, height: int, serial: str) -> SubpixelCells | None:
    """The panel's pattern of cells, None if it has a plain stripe."""
    key, listed = "subpixelCells", values.get("subpixelCells")
    if not listed and serial.startswith(_NEEDS_CELLS):
        rule = f"panels of the kind {serial[:5]} have cells of sub-pixels"
        raise DisplayError("subpixelCells is missing", where=key, rule=rule, fix="take the file from the device")
    if listed is None:
        return None
    if not isinstance(listed, list):
        raise DisplayError(f"subpixelCells is {listed!r}", where=key, rule="it must be a list of cells")
    if not listed:
        return None
    # The vendor's own reader takes either spelling.
    mode_key = "cellPatternMode" if "cellPatternMode" in values else "CellPatternMode"
    mode = _read_number(values, mode_key)
    if mode not in _PATTERNS:
        raise DisplayError(f"{mode_key} is {mode:g}", where=mode_key, rule="it must be 0, 1, 2, 3 or 4")
    is_swapped = _read_flag(values, "flipSubp", optional=True)
    cells = [_read_cell(cell, f"{key}[{number}]", is_swapped) for number, cell in enumerate(listed)]
    pattern = _PATTERNS[int(mode)]
    rows = len(pattern[0])
    # The file counts rows from below, the panel from above.
    upward = [(height - 1 - row) % rows for row in range(rows)]
    return tuple(tuple(cells[column[y] % len(cells)] for column in pattern) for y in upward)


def _read_cell(cell: object, key: str, is_swapped: bool) -> SubpixelOffsets:
    if not isinstance(cell, Mapping):
        raise DisplayError(f"a cell is {cell!r}", where=key, rule=f"it must have the keys {', '.join(_CELL_KEYS)}")
    numbers = []
    for name in _CELL_KEYS:
        if name not in cell:
            raise DisplayError(f"{name} is missing", where=key, rule=f"a cell has the keys {', '.join(_CELL_KEYS)}")
        numbers.append(finite(cell[name], f"{key}.{name}"))
    # Up in the file, down in the panel.
    red, green, blue = _pair(numbers[0:2]), _pair(numbers[2:4]), _pair(numbers[4:6])
    return (blue, green, red) if is_swapped else (red, green, blue)


def _pair(right_up: list[float]) -> Offset:
    return right_up[0], -right_up[1]


def _read_number(values: Table, key: str) -> float:
    """The finite number of ``{"value": number}``."""
    if key not in values:
        raise DisplayError(f"{key} is missing", where=key, rule='it must be {"value": number}')
    value = values[key]
    if not isinstance(value, Mapping) or "value" not in value:
        raise DisplayError(f"{key} is {value!r}", where=key, rule='it must be wrapped: {"value": number}')
    return finite(value["value"], key)


def _read_within(values: Table, key: str, least: float, most: float) -> float:
    value = _read_number(values, key)
    if not least <= value <= most:
        raise DisplayError(f"{key} is {value:g}", where=key, rule=f"it must lie between {least:g} and {most:g}")
    return value


def _read_count(values: Table, key: str) -> int:
    value = _read_number(values, key)
    return whole_count(int(value) if value.is_integer() else value, key)


def _read_flag(values: Table, key: str, *, optional: bool = False) -> bool:
    if optional and key not in values:
        return False
    value = _read_number(values, key)
    if value not in (0, 1):
        raise DisplayError(f"{key} is {value:g}", where=key, rule="it must be 0 or 1")
    return value == 1
