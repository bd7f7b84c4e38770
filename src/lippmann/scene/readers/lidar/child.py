"""The process that reads LAS and LAZ files by ``laspy`` and ``lazrs``: native code, with nothing else in it."""

from __future__ import annotations

import struct
from typing import Any

import laspy
import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.helper_process import serve_arrays

#: Points that are shown: as many as the finest panels have lenses, several times.
MOST_POINTS = 1 << 22
#: Points that are read at a time.
_PART = 1 << 20
#: Where the header counts its records (VLR), and the least bytes of one (LAS 1.4, tables 3 and 8).
_COUNT_AT, _RECORD = 100, 54
#: Classes of noise, far below and far above all else (LAS 1.4, table 17).
_NOISE = (7, 18)
_COLORS = ("red", "green", "blue")


def main() -> None:
    """Answer requests by ``positions`` ``(n, 3)``, ``colors`` ``(n, 3)``, of 16 bits, none if unset, and ``notes``."""
    serve_arrays(_read)


def _read(request: dict[str, Any]) -> dict[str, NDArray[np.generic]]:
    positions: list[NDArray[np.float64]] = [np.zeros((0, 3))]
    colors: list[NDArray[np.uint16]] = [np.zeros((0, 3), np.uint16)]
    noise = 0
    notes: list[str] = []
    _check_records(request["path"])
    with laspy.open(request["path"], read_evlrs=False) as file:
        left = file.header.point_count
        step = max(1, -(-left // MOST_POINTS))
        has_colors = {*_COLORS} <= {*file.header.point_format.dimension_names}
        while left:
            points = file.read_points(min(left, _PART))
            if len(points) < min(left, _PART):
                raise ValueError(f"it ends {left - len(points)} points early")
            left -= len(points)
            # Points that are withheld count as deleted.
            shown = ~np.isin(np.asarray(points.classification), _NOISE) & (np.asarray(points.withheld) == 0)
            noise += int(np.count_nonzero(~shown))
            chosen = np.flatnonzero(shown)[::step]
            positions.append(np.stack([np.asarray(points[axis], np.float64)[chosen] for axis in "xyz"], axis=1))
            if has_colors:
                colors.append(np.stack([np.asarray(points[name], np.uint16)[chosen] for name in _COLORS], axis=1))
    if noise:
        notes.append(f"{noise} points that the file marks as noise or withheld are left out")
    if step > 1:
        notes.append(f"one of {step} points is shown")
    codes = np.concatenate(colors)
    codes = codes if codes.any() else codes[:0]  # of programs that have none, and a format with a place for them
    return {"positions": np.concatenate(positions), "colors": codes, "notes": np.array(notes, np.str_)}


def _check_records(path: str) -> None:
    """Refuse a header that counts more records behind it than the file has room for: ``laspy`` reads on for hours."""
    with open(path, "rb") as file:
        head = file.read(_COUNT_AT + 4)
        if len(head) < _COUNT_AT + 4:
            raise ValueError("it ends within its header")
        (count,) = struct.unpack_from("<I", head, _COUNT_AT)
        if _RECORD * count > file.seek(0, 2):
            raise ValueError(f"its header counts {count} records")
