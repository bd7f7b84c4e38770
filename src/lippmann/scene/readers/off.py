"""Object files (``.off``) of Geomview, text, as libigl, CGAL, MeshLab and collections of models write them.

Read from the manual of Geomview, "OFF Files". The reader is Lippmann's own because trimesh's leaves the colours out.
"""

from __future__ import annotations

import re
from pathlib import Path

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.parsing.ply_body import read_body
from lippmann.scene.parsing.ply_header import Element, Header, Property
from lippmann.scene.parsing.vertex_colors import GREY_CODES
from lippmann.scene.readers.ply import describe_polygons
from lippmann.scene.values.description import SceneDescription

#: The first word tells what vertices have; the counts may follow it without a space, as in ModelNet's files.
_KEY = re.compile(rb"\s*(ST)?(C)?(N)?(4?n?)OFF(?![^\s\d])")
_REMARK = re.compile(rb"#.*")
_COLOR = ("red", "green", "blue", "alpha")

#: Digits of a number of entries, at most.
_LONGEST = 10

Row = list[bytes]


def read_off(path: Path) -> SceneDescription:
    """Read an OFF mesh with its vertex normals, texture coordinates, and colours of vertices or faces.

    Colours are taken as sRGB-coded. Without faces the vertices are a cloud of points, as in PLY. It names no other
    file.

    Raises
    ------
    SceneError
        The file is missing, foreign, binary, cut short, holds no vertices, or vertices of other than three coordinates.
    """
    where = path.name
    text = _REMARK.sub(b"", read_bytes(path))
    key = _KEY.match(text)
    if key is None:
        raise SceneError("is no OFF file", where=where, rule="it begins with OFF, or a word such as COFF or NOFF")
    counts, *rows = [line.split() for line in text[key.end() :].splitlines() if line.strip()] or [[]]
    if counts[:1] == [b"BINARY"]:
        raise SceneError("is a binary OFF file", where=where, rule="text is read", fix="save it as text")
    if key[4]:
        raise SceneError(f"is a file of {key[0].decode().strip()}", where=where, rule="vertices have x, y and z")
    if len(counts) < 2 or not all(word.isdigit() and len(word) < _LONGEST for word in counts[:2]):
        raise SceneError("does not say how many vertices and faces it has", where=where, rule="OFF is followed by both")
    vertices = rows[: int(counts[0])]
    faces = _faces(rows[len(vertices) :], int(counts[1]))
    names = ["x", "y", "z", *(("nx", "ny", "nz") if key[3] else ())]
    after = min(map(len, vertices), default=0) - len(names) - (2 if key[1] else 0)
    colors = _COLOR[:after] if key[2] or after in (3, 4) else ()
    of_vertices = _properties(colors, [row[len(names) : len(names) + len(colors)] for row in vertices])
    plain = [Property(name, "f8", None) for name in names]
    of_uvs = [Property(name, "f8", None) for name in ("s", "t") if key[1]]
    outline, of_faces = _outlines(faces)
    header = Header(
        [
            Element("vertex", int(counts[0]), [*plain, *of_vertices, *of_uvs]),
            Element("face", int(counts[1]), [Property("vertex_indices", "i4", "i4"), *of_faces]),
        ]
    )
    body = b"\n".join(b" ".join(row) for row in (*vertices, *outline))
    return describe_polygons(header, read_body(body, header, where), path)


def _properties(names: tuple[str, ...], colors: list[Row]) -> list[Property]:
    """Properties of colours: whole numbers up to 255, or parts of 1, which have points or are 0 and 1 alone."""
    words = {word for color in colors for word in color}
    is_real = words <= {b"0", b"1"} or any(b"." in word for word in words)
    return [Property(name, "f8" if is_real else "u1", None) for name in names]


def _faces(rows: list[Row], count: int) -> list[Row]:
    """A row for each face, whose corners may go on in the next lines."""
    faces: list[Row] = []
    rest = iter(rows)
    while len(faces) < count and (face := next(rest, [])):
        while len(face) < _size(face) and (more := next(rest, [])):
            face = [*face, *more]
        faces.append(face)
    return faces


def _size(face: Row) -> int:
    """How many words its number of corners and these are."""
    return 1 + int(face[0]) if face[0].isdigit() and len(face[0]) < _LONGEST else len(face)


def _outlines(faces: list[Row]) -> tuple[list[Row], list[Property]]:
    """The corners of faces, each with a colour if any has one; those without are grey."""
    colors = [face[_size(face) :] if len(face) - _size(face) in (3, 4) else [] for face in faces]
    properties = _properties(_COLOR if any(colors) else (), colors)
    if not properties:
        return faces, []
    full = properties[0].brightest
    grey = [str(full * float(code)).encode() for code in GREY_CODES]
    opaque = str(full).encode()
    rows = [
        [*face[: _size(face)], *(color or grey)[:3], *(color[3:] or [opaque])]
        for face, color in zip(faces, colors, strict=True)
    ]
    return rows, properties
