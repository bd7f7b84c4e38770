"""Clouds of points as rows of numbers (``.xyz``, ``.pts``, ``.asc``, ``.csv``), as scanners and surveyors write them.

There is no standard: a row is x, y, z, and then intensity, colours and normals in some order. A line of names above
the rows says where x, y and z stand.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.runtime.plugins import function_of
from lippmann.scene.parsing.files import decode_text, read_bytes
from lippmann.scene.parsing.ply_header import Element, Header, Property
from lippmann.scene.readers.ply import describe_polygons
from lippmann.scene.values.description import SceneDescription

#: A row of points: three numbers or more.
_ROW = re.compile(r"\s*[-+.\d][^\s,;]*(?:[\s,;]+[-+.\d][^\s,;]*){2,}\s*")
#: Lines before the first row, and bytes that a byte of text takes.
_MOST_HEAD, _BYTES_PER_BYTE = 20, 8
_MOLECULES = "lippmann.scene.readers.molecules.reader:read_molecule"
_COLORS, _NORMALS = ("red", "green", "blue"), ("nx", "ny", "nz")


def read_xyz(path: Path) -> SceneDescription:
    """A file of molecules, which begins with the number of atoms, or a cloud of points.

    Raises
    ------
    SceneError
        As :func:`lippmann.scene.readers.molecules.reader.read_molecule` and :func:`read_text_cloud`.
    """
    first = read_bytes(path, 256).removeprefix(b"\xef\xbb\xbf").lstrip().split(b"\n")[0].decode("latin-1")
    if _ROW.fullmatch(first) or first.startswith(("#", "//")):
        return read_text_cloud(path)
    molecule: SceneDescription = function_of(_MOLECULES)(path)
    return replace(molecule, up=(0.0, 1.0, 0.0))  # which molecules do not have


def read_text_cloud(path: Path) -> SceneDescription:
    """Read a cloud of points with colours (whole numbers up to 255, sRGB-coded) and normals (of length 1).

    Raises
    ------
    SceneError
        The file is missing, has no rows of three numbers, or one that is of other numbers than the first.
    MemoryLimitError
        It holds more than the memory that is left.
    """
    where = path.name
    text = decode_text(read_bytes(path), where)
    check_input(_BYTES_PER_BYTE * len(text), "its points", where=where)
    head = text[:8192].splitlines()[:_MOST_HEAD]
    start = next((number for number, line in enumerate(head) if _ROW.fullmatch(line)), None)
    if start is None:
        raise SceneError("is no cloud of points", where=where, rule="its rows are x, y, z and more numbers")
    if "," in head[start] or ";" in head[start]:
        text = text.replace(",", " ").replace(";", " ")
    try:
        table = np.loadtxt(io.StringIO(text), skiprows=start, comments=("#", "//"), ndmin=2)
    except ValueError as error:
        fix = "has it decimal commas, or is it cut short?"
        raise SceneError(f"is no cloud of points ({error})", where=where, fix=fix) from None
    table = _places_first(table, head[start - 1] if start else "")
    columns = {axis: table[:, place] for place, axis in enumerate("xyz")}
    after_intensity = path.suffix.lower() == ".pts"
    colors = _triple(table, _is_color, (4, 3, 6, 7) if after_intensity else (3, 4, 6, 7))
    normals = _triple(table, _is_direction, (3, 4, 6, 7))
    for names, first in ((_COLORS, colors), (_NORMALS, normals)):
        if first is not None:
            columns |= {name: table[:, first + place] for place, name in enumerate(names)}
    properties = [Property(name, "u1" if name in _COLORS else "f8", None) for name in columns]
    scene = describe_polygons(Header([Element("vertex", len(table), properties)]), {"vertex": columns}, path)
    if unread := table.shape[1] - len(columns):
        scene = replace(scene, notes=[*scene.notes, f"{unread} of {table.shape[1]} columns are not shown"])
    return scene


def _places_first(table: NDArray[np.float64], line: str) -> NDArray[np.float64]:
    """The table with the columns first that the line above its rows calls x, y and z."""
    names = re.findall(r"[^\s,;\"'#/]+", line.lower())
    if len(names) != table.shape[1] or not {"x", "y", "z"} <= set(names):
        return table
    first = [names.index(axis) for axis in "xyz"]
    return table[:, first + [place for place in range(len(names)) if place not in first]]


def _triple(
    table: NDArray[np.float64], fits: Callable[[NDArray[np.float64]], bool], places: tuple[int, ...]
) -> int | None:
    """The first of three columns that fit, of the given places."""
    return next((at for at in places if at + 3 <= table.shape[1] and fits(table[:, at : at + 3])), None)


def _is_color(columns: NDArray[np.float64]) -> bool:
    """Whole numbers up to 255, not all of them directions along an axis."""
    is_whole = bool(((columns == np.rint(columns)) & (columns >= 0.0) & (columns <= 255.0)).all())
    return is_whole and not _is_direction(columns)


def _is_direction(columns: NDArray[np.float64]) -> bool:
    """Nearly all of length 1."""
    return bool((np.abs(np.linalg.norm(columns, axis=1) - 1.0) < 0.01).mean() > 0.9)
