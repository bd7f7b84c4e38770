"""Transfer functions from TOML and JSON files."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.values.volume import Per, TransferFunction
from lippmann.scene.volumes.presets import linear_of_hex

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SUFFIXES = (".toml", ".json")

_MOST_BYTES = 1 << 20
_MOST_POINTS = 4096
_KEYS = ("points", "per", "shading")
_POINT = 'a list [value, "#rrggbb", opacity]'


def read_transfer_function(path: Path) -> TransferFunction:
    """A transfer function of a file with ``points`` (each ``[value, "#rrggbb", opacity]``), ``per`` and ``shading``.

    Raises
    ------
    SceneError
        The file is missing, damaged, or says something else than a transfer function.
    """
    where = path.name
    data = read_bytes(path)
    if len(data) > _MOST_BYTES:
        raise SceneError(f"has {len(data)} bytes", where=where, rule=f"a transfer function has at most {_MOST_BYTES}")
    try:
        text = data.decode("utf-8-sig")
        tables = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError(f"cannot be read ({str(error)[:200]})", where=where, rule="TOML, or JSON (.json)") from None
    if not isinstance(tables, Mapping):
        raise SceneError("holds no table", where=where, rule=f"the keys {', '.join(_KEYS)}")
    SceneError.refuse_unknown("key", tables, _KEYS, where=where)
    points = tables.get("points")
    if not isinstance(points, list) or not 2 <= len(points) <= _MOST_POINTS:
        raise SceneError(f"lists no 2 to {_MOST_POINTS} points", where=f"{where}: points", rule=_POINT)
    rows = [_point(point, number, where) for number, point in enumerate(points, 1)]
    values = np.array([value for value, _, _ in rows])
    if (np.diff(values) <= 1e-30).any():
        raise SceneError("are not in order", where=f"{where}: points", rule="each value above the one before")
    per = tables.get("per", "mm")
    if per not in ("mm", "percent"):
        raise SceneError(f"{str(per)[:40]!r}", where=f"{where}: per", rule="mm, or percent of the longest side")
    shading = tables.get("shading", 1.0)
    if not _is_number(shading) or not 0.0 <= shading <= 1.0:
        raise SceneError(f"{str(shading)[:40]}", where=f"{where}: shading", rule="a number from 0 to 1")
    colors = np.array([linear_of_hex(color) for _, color, _ in rows])
    opacities = np.array([opacity for _, _, opacity in rows])
    return TransferFunction(values, colors, opacities, cast("Per", per), float(shading), path.name)


def _point(point: object, number: int, where: str) -> tuple[float, str, float]:
    if not isinstance(point, list) or len(point) != 3:
        raise SceneError(f"number {number} is no point", where=f"{where}: points", rule=_POINT)
    value, color, opacity = point
    if not _is_number(value) or abs(value) > 1e30:
        raise SceneError(f"number {number} has no value", where=f"{where}: points", rule="a finite number")
    if not isinstance(color, str) or not re.fullmatch(r"#[0-9a-fA-F]{6}", color):
        raise SceneError(f"number {number} has no colour", where=f"{where}: points", rule='"#rrggbb"')
    if not _is_number(opacity) or not 0.0 <= opacity <= 1.0:
        raise SceneError(f"number {number} has no opacity", where=f"{where}: points", rule="a number of 0 to 1")
    return float(value), color, float(opacity)


def _is_number(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return -1e300 < value < 1e300  # whole numbers of any size, and no NaN
