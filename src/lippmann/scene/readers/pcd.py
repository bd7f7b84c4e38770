"""Clouds of points in files of the Point Cloud Library (``.pcd``), text, binary and packed.

Read from "The PCD (Point Cloud Data) file format" (pointclouds.org); packed ones are LZF, field after field.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.parsing.ply_header import Element, Header, Property
from lippmann.scene.readers.ply import describe_polygons
from lippmann.scene.values.description import SceneDescription

_DATA = re.compile(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", re.MULTILINE)
#: The longest header.
_MOST_HEADER = 1 << 16
_NORMALS = {"normal_x": "nx", "normal_y": "ny", "normal_z": "nz"}
_SHIFTS = {"red": 16, "green": 8, "blue": 0}


def read_pcd(path: Path) -> SceneDescription:
    """Read a cloud of points with colours (``rgb``, ``rgba``), which are taken as sRGB-coded.

    Raises
    ------
    SceneError
        The file is missing, foreign, damaged or cut short, or holds no points.
    MemoryLimitError
        It holds more than the memory that is left.
    """
    where, data = path.name, read_bytes(path)
    mark = _DATA.search(data[:_MOST_HEADER])
    if mark is None:
        raise SceneError("is no PCD file", where=where, rule="its header ends by a line DATA")
    lines = [line.split() for line in data[: mark.start()].decode("latin-1").splitlines()]
    entries = {words[0]: words[1:] for words in lines if words}
    try:
        names = entries["FIELDS"]
        counts = [int(word) for word in entries.get("COUNT", ["1"] * len(names))]
        kinds = [f"<{kind.lower()}{size}" for kind, size in zip(entries["TYPE"], entries["SIZE"], strict=True)]
        listed = zip(names, kinds, counts, strict=True)
        # Padding has the name _, several times.
        fields = [
            (f"_{place}" if name == "_" else name, kind, (count,)) for place, (name, kind, count) in enumerate(listed)
        ]
        number, dtype = int(entries["POINTS"][0]), np.dtype(fields)
        if number < 0:
            raise ValueError(f"{number} points")
        check_input(2 * number * dtype.itemsize, f"{number} points", where=where)
        table = _columns(data[mark.end() :], mark[1].decode().lower(), dtype, number)
    except (KeyError, ValueError, TypeError, IndexError, struct.error) as error:
        raise SceneError(f"is no PCD file that makes sense ({error})", where=where, fix="is it whole?") from None
    vertex = {_NORMALS.get(name, name): column for name, column in table.items() if not name.startswith("_")}
    for name in {"rgb", "rgba"} & {*vertex}:
        column = vertex.pop(name)
        # Three bytes of a whole number, or of the bits of a single float; some programs store it wider.
        codes = column.astype("<f4" if column.dtype.kind == "f" else "<u4").view("<u4")
        vertex |= {color: (codes >> shift & 255).astype(np.uint8) for color, shift in _SHIFTS.items()}
    properties = [Property(name, column.dtype.str[1:], None) for name, column in vertex.items()]
    columns = {name: column.astype(np.float64) for name, column in vertex.items()}
    return describe_polygons(Header([Element("vertex", number, properties)]), {"vertex": columns}, path)


def _columns(body: bytes, form: str, dtype: np.dtype[np.void], number: int) -> dict[str, NDArray[np.generic]]:
    """Values ``(number,)`` of each field, the first of those that have several."""
    kinds = [(name, dtype[name]) for name in dtype.names or ()]
    if form == "binary":
        table = np.frombuffer(body, dtype, number)
        return {name: np.ascontiguousarray(table[name][:, 0]) for name, _ in kinds}
    columns, place = {}, 0
    if form == "ascii":
        words = np.array(body.split()).reshape(number, -1)
        for name, kind in kinds:
            columns[name] = words[:, place].astype(kind.base)
            place += kind.shape[0]
    elif form == "binary_compressed":
        from imagecodecs import LzfError, lzf_decode

        packed, size = struct.unpack_from("<II", body)
        if size < number * dtype.itemsize:
            raise ValueError(f"{size} bytes for {number} points")
        try:
            body = lzf_decode(body[8 : 8 + packed], out=size)
        except LzfError as error:
            raise ValueError(str(error)) from None
        if len(body) != size:
            raise ValueError(f"{len(body)} of {size} bytes")
        for name, kind in kinds:
            columns[name] = np.frombuffer(body, kind, number, place)[:, 0]
            place += number * kind.itemsize
    else:
        raise ValueError(f"its data are {form}")
    return columns
