"""``parameters.cfg`` of the 4D Light Field Benchmark: the cameras of a folder, as an INI file.

The conventions are Blender's: metres; a camera without rotation looks along -z with +y up; rotations are Euler angles
about x, then y, then z. The display frame is that of a camera without rotation, with the lens plane at the focus
distance.
"""

from __future__ import annotations

import configparser
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import PictureError
from lippmann.exchange.cameras import Cameras
from lippmann.runtime.regular_file import check_kind, unreadable

NAME = "parameters.cfg"

#: Focal length in mm and f-number, those of the benchmark's own scenes. Only the ratio of the focal length to the
#: sensor's size matters; all of the scene is in focus.
_FOCAL_LENGTH, _FSTOP = 100.0, 100.0

_COUNTS = {"intrinsics": ("image_resolution_x_px", "image_resolution_y_px"), "extrinsics": ("num_cams_x", "num_cams_y")}
_LENGTHS = {"intrinsics": ("focal_length_mm", "sensor_size_mm"), "extrinsics": ("baseline_mm", "focus_distance_m")}
_PLACES = (
    "center_cam_x_m",
    "center_cam_y_m",
    "center_cam_z_m",
    "center_cam_rx_rad",
    "center_cam_ry_rad",
    "center_cam_rz_rad",
)
_MOST_COUNT = 1 << 20

#: Limit on characters of a line: the parser's time is quadratic in them.
_LONGEST_LINE = 1000
#: Limit on characters of the whole, which has a dozen lines.
_LONGEST = 1 << 16


@dataclass(frozen=True, eq=False)
class Parameters:
    """Number of views ``across`` and ``down``, their ``width`` and ``height`` in pixels, and their cameras."""

    across: int
    down: int
    width: int
    height: int
    cameras: Cameras


def write_parameters(path: Path, parameters: Parameters, meta: Mapping[str, str | float]) -> None:
    """Write ``parameters.cfg``; ``meta`` holds the values of its section ``meta``, which the benchmark's tools read."""
    cameras, larger = parameters.cameras, max(parameters.width, parameters.height)
    focus = cameras.focus_distance
    sensor = _FOCAL_LENGTH * larger * cameras.pixel_pitch / focus
    x, y = (place + 0.0 for place in cameras.center)  # no minus zero
    sections = {
        "intrinsics": {
            "focal_length_mm": _FOCAL_LENGTH,
            "image_resolution_x_px": parameters.width,
            "image_resolution_y_px": parameters.height,
            "sensor_size_mm": sensor,
            "fstop": _FSTOP,
        },
        "extrinsics": {
            "num_cams_x": parameters.across,
            "num_cams_y": parameters.down,
            "baseline_mm": cameras.baseline,
            "focus_distance_m": focus / 1000,
            "center_cam_x_m": x / 1000,
            "center_cam_y_m": y / 1000,
            "center_cam_z_m": focus / 1000,
            "center_cam_rx_rad": 0.0,
            "center_cam_ry_rad": 0.0,
            "center_cam_rz_rad": 0.0,
            # Pixels by which neighbouring frames are shifted: the disparity of infinity, its sign aside.
            "offset": cameras.baseline / cameras.pixel_pitch,
        },
        "meta": meta,
    }
    parser = configparser.ConfigParser(delimiters="=", interpolation=None)
    for section, values in sections.items():
        parser[section] = {key: _value_text(value) for key, value in values.items()}
    with path.open("w", encoding="utf-8") as file:
        parser.write(file)


def read_parameters(path: Path) -> Parameters:
    """Read ``parameters.cfg``.

    Raises
    ------
    PictureError
        If the file is missing or no INI file, or a required value is missing or out of range.
    """
    parser = configparser.ConfigParser(delimiters="=", interpolation=None)
    try:
        check_kind(path, PictureError)
        text = path.read_text(encoding="utf-8")
        if len(text) > _LONGEST or max(map(len, text.splitlines()), default=0) > _LONGEST_LINE:
            raise PictureError("is no list of parameters", where=str(path), rule="it and its lines are short")
        parser.read_string(text)
    except OSError as error:
        raise unreadable(path, error, PictureError) from error
    except (configparser.Error, UnicodeDecodeError):
        raise PictureError("is no list of parameters", where=str(path), rule="it is an INI file") from None
    counts = {key: _count(parser, section, key, path) for section, keys in _COUNTS.items() for key in keys}
    lengths = {key: _length(parser, section, key, path) for section, keys in _LENGTHS.items() for key in keys}
    width, height = counts["image_resolution_x_px"], counts["image_resolution_y_px"]
    focus = 1000 * lengths["focus_distance_m"]
    pixel_pitch = focus * lengths["sensor_size_mm"] / (lengths["focal_length_mm"] * max(width, height))
    if not (math.isfinite(focus) and 0 < pixel_pitch < math.inf):
        rule = "focus distance x sensor size / focal length must be a positive number"
        raise PictureError("its lengths give no pixel size", where=str(path), rule=rule)
    place = [
        _number(parser, "extrinsics", key, path) if parser.has_option("extrinsics", key) else 0.0 for key in _PLACES
    ]
    cameras = Cameras(lengths["baseline_mm"], focus, pixel_pitch, world_from_display=_placement(place, focus))
    return Parameters(counts["num_cams_x"], counts["num_cams_y"], width, height, cameras)


def _placement(place: list[float], focus: float) -> NDArray[np.float64]:
    """``(4, 4)``: millimetres of the display frame, seen from (0, 0, focus), to metres of the cameras' world."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(place[3:]), np.sin(place[3:])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    placement = np.eye(4)
    placement[:3, :3] = 1e-3 * about_z @ about_y @ about_x
    placement[:3, 3] = np.array(place[:3]) - placement[:3, 2] * focus
    return placement


def _number(parser: configparser.ConfigParser, section: str, key: str, path: Path) -> float:
    text = parser.get(section, key, fallback=None)
    if text is None:
        raise PictureError(f"{key} is missing", where=f"{path} [{section}]", rule="the cameras need it")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise PictureError(f"{key} is {text!r}", where=f"{path} [{section}]", rule="it must be a number")
    return value


def _length(parser: configparser.ConfigParser, section: str, key: str, path: Path) -> float:
    value = _number(parser, section, key, path)
    if value <= 0:
        raise PictureError(f"{key} is {value:g}", where=f"{path} [{section}]", rule="it must be above zero")
    return value


def _count(parser: configparser.ConfigParser, section: str, key: str, path: Path) -> int:
    value = _number(parser, section, key, path)
    if value != round(value) or not 1 <= value <= _MOST_COUNT:
        rule = f"it must be a whole number from 1 to {_MOST_COUNT}"
        raise PictureError(f"{key} is {value:g}", where=f"{path} [{section}]", rule=rule)
    return int(value)


def _value_text(value: str | float) -> str:
    # A line break would start another key.
    return " ".join(str(value).split())
