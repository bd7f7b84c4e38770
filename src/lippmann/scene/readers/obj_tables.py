"""The numbers of an OBJ file: tables of coordinates, and the corners of faces."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.vertex_colors import full_brightness

Integers = NDArray[np.int64]
Points = NDArray[np.float64]


@dataclass
class Lines:
    """The bodies of all lines of one kind, with the line number of each."""

    bodies: list[str] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)

    def add(self, body: str, number: int) -> None:
        self.bodies.append(body)
        self.numbers.append(number)


def read_table(lines: Lines, what: str, least: int, where: str, *, colored: bool = False) -> Points:
    """Numbers ``(n, k)`` of ``v``, ``vt`` or ``vn`` lines; k is the smallest count on any line.

    ``colored``: the last three of six numbers are a colour. If some lines have one, the others are white.
    Colours of up to 255 are divided by 255.

    Raises
    ------
    SceneError
        A line has fewer than ``least`` numbers, a word that is none, or a value that is not finite.
    """
    if not lines.bodies:
        return np.zeros((0, least))
    if not any(map(str.strip, lines.bodies)):  # loadtxt would only warn
        _ragged_table(lines, what, least, where, colored)
    try:
        table = np.loadtxt(lines.bodies, np.float64, ndmin=2, comments=None)
        if len(table) != len(lines.bodies):  # loadtxt skips blank bodies
            table = _ragged_table(lines, what, least, where, colored)
    except ValueError:
        table = _ragged_table(lines, what, least, where, colored)
    if colored and table.shape[1] in (6, 7):
        table[:, 3:6] = np.nan_to_num(table[:, 3:6] / full_brightness(table[:, 3:6]), nan=1.0, posinf=np.inf)
    if table.shape[1] < least:
        raise SceneError(
            f"{what} with {table.shape[1]} numbers", where=f"{where}:{lines.numbers[0]}", rule=f"it takes {least}"
        )
    with np.errstate(over="ignore"):
        bad = np.flatnonzero(~np.isfinite(table.astype(np.float32)).all(axis=1))
    if len(bad):
        raise SceneError(
            f"{what} '{lines.bodies[bad[0]].strip()}'",
            where=f"{where}:{lines.numbers[bad[0]]}",
            rule="coordinates must be finite numbers",
        )
    return np.asarray(table, np.float64)


def _ragged_table(lines: Lines, what: str, least: int, where: str, colored: bool) -> Points:
    rows: list[list[float]] = []
    for body, number in zip(lines.bodies, lines.numbers, strict=True):
        try:
            rows.append([float(word) for word in body.split()])
        except ValueError:
            raise SceneError(f"{what} '{body.strip()[:60]}'", where=f"{where}:{number}", rule="numbers only") from None
        if len(rows[-1]) < least:
            raise SceneError(
                f"{what} with {len(rows[-1])} numbers", where=f"{where}:{number}", rule=f"it takes {least}"
            )
    if colored and any(len(row) >= 6 for row in rows):
        rows = [row[:6] if len(row) >= 6 else [*row[:3], np.nan, np.nan, np.nan] for row in rows]
    width = min(len(row) for row in rows)
    return np.array([row[:width] for row in rows])


def read_corners(faces: Lines, where: str) -> tuple[Integers, Integers]:
    """Corners ``(c, 3)`` as 1-based (position, uv, normal), 0 where not given, and corners per face ``(f,)``."""
    words = [body.split() for body in faces.bodies]
    sizes = np.array([len(face) for face in words], np.int64)
    if (sizes < 3).any():
        bad = int(np.argmax(sizes < 3))
        raise SceneError(
            f"face with {sizes[bad]} corners",
            where=f"{where}:{faces.numbers[bad]}",
            rule="a face has at least 3",
            fix="is the file cut short?",
        )
    flat = [corner for face in words for corner in face]
    corners = _uniform_corners(flat)
    if corners is None:
        corners = _mixed_corners(flat, np.repeat(faces.numbers, sizes), where)
    return corners, sizes


def _uniform_corners(flat: Sequence[str]) -> Integers | None:
    """The corners if all have the same form (``a``, ``a/b``, ``a//c`` or ``a/b/c``) and are numbers, else None."""
    joined = " ".join(flat)
    slashes = {corner.count("/") for corner in flat}
    form = (slashes.pop(), joined.count("//")) if len(slashes) == 1 else None
    slots = {(0, 0): [0], (1, 0): [0, 1], (2, 0): [0, 1, 2], (2, len(flat)): [0, 2]}.get(form) if form else None
    if slots is None:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy only warns of a word that is no number
            numbers = np.fromstring(joined.replace("/", " "), np.int64, sep=" ")
        corners = np.zeros((len(flat), 3), np.int64)
        corners[:, slots] = numbers.reshape(len(flat), len(slots))
    except (ValueError, DeprecationWarning):
        return None
    return corners


def _mixed_corners(flat: Sequence[str], numbers: Integers, where: str) -> Integers:
    """The corners read one at a time."""
    corners = np.zeros((len(flat), 3), np.int64)
    for row, corner in enumerate(flat):
        try:
            places = [int(word) if word else 0 for word in corner.split("/")]
            corners[row, : len(places)] = places
        except (ValueError, OverflowError):
            raise SceneError(
                f"face corner '{corner[:40]}'", where=f"{where}:{numbers[row]}", rule="it is v, v/vt, v//vn or v/vt/vn"
            ) from None
    return corners


def drop_absent(corners: Integers, counts: Sequence[int]) -> list[str]:
    """Drop the indices into a table where some name entries that it lacks, with a note on each such table.

    As in OpenSubdiv's shapes, which have none, and in VTK's of several actors, which count the wrong ones.
    """
    notes = []
    for slot, what in ((1, "texture coordinates"), (2, "normals")):
        column = corners[:, slot]
        if (column < 0).any() or (column > counts[slot]).any():
            notes.append(f"faces name {what} up to {column.max()} of the {counts[slot]} in the file: taken without")
            corners[:, slot] = 0
    return notes


def check_vertices(corners: Integers, count: int, numbers: Integers, where: str) -> None:
    column = corners[:, 0]
    bad = (column < 1) | (column > count)
    if bad.any():
        row = int(np.argmax(bad))
        what = f"face uses vertex {column[row]}"
        raise SceneError(what, where=f"{where}:{numbers[row]}", rule=f"the file has 1 to {count}")
