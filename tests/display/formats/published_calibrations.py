"""Calibrations of real Looking Glass devices and the vendor's own templates, as published: numbers and their sources.

Each has the keys that its source shows; ``source`` names the public repository and file.
"""

from __future__ import annotations

from typing import Any

#: Pixels of 16-inch panels of the third generation: red and green in one row, blue in the other.
_COLUMNS = [(-0.31, 0.25, 0.28, 0.25, 0.0, -0.25), (-0.31, -0.25, 0.28, -0.25, 0.0, 0.25)]
#: The same panel upright.
_ROWS = [(-0.25, -0.31, -0.25, 0.28, 0.25, 0.0), (0.25, -0.31, 0.25, 0.28, -0.25, 0.0)]
_CELL_KEYS = ("ROffsetX", "ROffsetY", "GOffsetX", "GOffsetY", "BOffsetX", "BOffsetY")


def _calibration(
    source: str,
    serial: str,
    version: str,
    lens: tuple[float, float, float],
    panel: tuple[int, int, float],
    cone: float = 40.0,
    *,
    cells: list[tuple[float, ...]] | None = None,
    mode: float | None = None,
    inv_view: float | None = 1.0,
    flips: bool = True,
) -> dict[str, Any]:
    """``lens``: pitch, slope, center; ``panel``: screenW, screenH, DPI."""
    numbers = dict(zip(("pitch", "slope", "center"), lens, strict=True))
    numbers |= dict(zip(("screenW", "screenH", "DPI"), panel, strict=True)) | {"viewCone": cone, "flipImageX": 0.0}
    if flips:
        numbers |= {"flipImageY": 0.0, "flipSubp": 0.0, "verticalAngle": 0.0}
    if inv_view is not None:
        numbers["invView"] = inv_view
    if mode is not None:
        numbers["CellPatternMode"] = mode
    values: dict[str, Any] = {key: {"value": number} for key, number in numbers.items()}
    if cells is not None:
        values["subpixelCells"] = [dict(zip(_CELL_KEYS, cell, strict=True)) for cell in cells]
    return values | {"configVersion": version, "serial": serial, "source": source}


_TEMPLATES = "Looking-Glass/LKG-Toolkit, LKGDeviceTemplateSystem.cs"
_BRIDGE = "a listing by Bridge 2.4's native library in a public sample of its use"
_HOLOPLAY = "HoloPlay.js and programs with a copy of it"

PUBLISHED = [
    _calibration(
        "mistergiantmedia/QuiltConverter, visual.json",
        *(
            "LKG-J00133",
            "3.0",
            (44.74761962890625, -6.855094909667969, -0.26516956090927126),
            (3840, 2160, 283.0),
            50.0,
        ),
        cells=_COLUMNS,
        mode=2.0,
        inv_view=0.0,
    ),
    _calibration(
        "Flux-Frontiers/quiltwright, tests of its weaver",
        *("LKG-J00332", "3.0", (44.75058319896644, -6.874565686767793, 0.16935753461833172), (3840, 2160, 283.0), 50.0),
        cells=_COLUMNS,
        mode=2.0,
        inv_view=None,
        flips=False,
    ),
    _calibration(
        "ShinghoiXu/Processing2Hologram, LKG_calibration/visual.json",
        *("LKG-PORT-05935", "1.0", (52.56046553048362, -7.1423088016812, 0.47345216539737284), (1536, 2048, 324.0)),
    ),
    _calibration(_BRIDGE, "LKG-P03996", "3.0", (52.5741, -7.19256, 0.565845), (1536, 2048, 324.0)),
    _calibration(_BRIDGE, "LKG-E05304", "3.0", (80.756, -6.66381, 0.131987), (1440, 2560, 491.0), 54.0),
    _calibration(
        "jankais3r, programs for HoloPlay.js without a driver",
        *("LKG-2K-04409", "1.0", (47.56401443481445, -5.480000019073486, 0.374184787273407), (2560, 1600, 338.0)),
    ),
    _calibration(
        "a reader of the device's EEPROM in Rust",
        *("00297", "1.0", (49.81804275512695, 5.044347763061523, 0.176902174949646), (2560, 1600, 338.0)),
    ),
    _calibration(
        _HOLOPLAY, "00112", "1.0", (49.96086120605469, 5.502500057220459, 0.14347827434539795), (2560, 1600, 355.0)
    ),
    _calibration(
        _HOLOPLAY, "00000", "1.0", (49.825218200683597, 5.2160325050354, -0.23396748304367066), (2560, 1600, 338.0)
    ),
    _calibration(
        "the holographic ray caster of the CGV framework, a 15.6-inch device",
        *("LKG-4K", "1.0", (50.0693473815918, -7.521984100341797, 0.07635253667831421), (3840, 2160, 283.0)),
    ),
    _calibration(_TEMPLATES, "LKG-A", "3.0", (50.0, -7.0, 0.5), (3840, 2160, 283.0)),
    _calibration(_TEMPLATES, "LKG-B", "3.0", (42.0, -6.0, 0.3), (7680, 4320, 280.0)),
    _calibration(_TEMPLATES, "LKG-D", "3.0", (42.0, -6.0, 0.3), (7680, 4320, 136.0)),
    _calibration(_TEMPLATES, "LKG-E", "3.0", (80.7, -6.3, -0.3), (1440, 2560, 491.0), 54.0),
    _calibration(_TEMPLATES, "LKG-H", "3.0", (44.72, -7.45, 0.0), (2160, 3840, 283.0), 50.0, cells=_ROWS, mode=4.0),
    _calibration(_TEMPLATES, "LKG-J", "3.0", (44.72, -6.9, 0.5), (3840, 2160, 283.0), 50.0, cells=_COLUMNS, mode=2.0),
    _calibration(_TEMPLATES, "LKG-K", "3.0", (80.7, -6.3, -0.3), (4320, 7680, 280.0), 54.0, cells=_COLUMNS, mode=2.0),
    _calibration(
        _BRIDGE,
        *("LKG-K", "3.0", (80.7, -6.3, -0.3), (4320, 7680, 280.0), 54.0),
        cells=[(0.0, 0.333, 0.0, 0.0, 0.0, -0.333)],
        mode=0.0,
    ),
    _calibration(_BRIDGE, "LKG-L", "3.0", (75.0, -7.2, 0.2), (7680, 4320, 280.0), 50.0, cells=[], mode=0.0),
]

#: The vendor's own lenses per width and slant for some of them: HoloPlay Core's and Bridge's pitch and tilt, as listed
#: in the samples above and in quiltwright's tests.
VENDOR_PITCH_AND_TILT = {
    "LKG-J00332": (600.892, -0.0818233),
    "LKG-P03996": (246.866, -0.185377),
    "LKG-E05304": (234.218, -0.26678094),
}
