"""Primitives of Tachyon scene files."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.parsing.tokens import Words
from lippmann.scene.readers.tachyon.files import SceneFiles
from lippmann.scene.readers.tachyon.fractal_terrain import landscape
from lippmann.scene.readers.tachyon.textures import TextureTable
from lippmann.scene.values.whitted_shapes import Numbers
from lippmann.scene.whitted.builder import ClassicSceneBuilder

_SHORTEST_EDGE = 1e-9  # Tachyon drops triangles with a shorter one
_WIDEST_LANDSCAPE = 1024  # samples per side: the displacement takes time with the square of the longer one
_LARGEST_LANDSCAPES = 1 << 19  # samples of all landscapes of a scene together
_DEGREES = 3.1415926 / 180.0  # as the program has it
_NO_COMMENT = re.compile(r"(?!)")

Row = tuple[float, ...]


class ShapeReader:
    """Reads primitives and collects them as rows, one list per kind, until :meth:`finish`.

    ``clip_group`` is the group that primitives read from now on belong to (-1: none).
    """

    def __init__(self, builder: ClassicSceneBuilder, textures: TextureTable, files: SceneFiles) -> None:
        self.clip_group = -1
        self._builder = builder
        self._textures = textures
        self._files = files
        self._rows: dict[str, list[Row]] = {}
        self._left_out: dict[str, int] = {}
        self._landscape_samples = 0

    def sphere(self, words: Words, holder: Path) -> None:
        """``SPHERE CENTER V RAD r TEX``."""
        center, radius = words.vector("CENTER"), words.radius("RAD")
        material = self._textures.texture(words, holder)
        if self._visible(radius > 0, "spheres of radius 0"):
            self._row("sphere", (*center, radius), material)

    def plane(self, words: Words, holder: Path) -> None:
        """``PLANE CENTER V NORMAL V TEX``."""
        center, normal = words.vector("CENTER"), words.direction("NORMAL")
        self._row("plane", (*center, *normal), self._textures.texture(words, holder))

    def cylinder(self, words: Words, holder: Path) -> None:
        """``CYLINDER CENTER V AXIS V RAD r TEX``, without end."""
        center, axis, radius = words.vector("CENTER"), words.direction("AXIS"), words.radius("RAD")
        material = self._textures.texture(words, holder)
        if self._visible(radius > 0, "cylinders of radius 0"):
            self._row("cylinder", (*center, *axis, radius), material)

    def tube(self, words: Words, holder: Path) -> None:
        """``FCYLINDER BASE V APEX V RAD r TEX``."""
        base, apex, radius = words.vector("BASE"), words.vector("APEX"), words.radius("RAD")
        self._tube(base, apex, radius, self._textures.texture(words, holder))

    def polycylinder(self, words: Words, holder: Path) -> None:
        """``POLYCYLINDER POINTS n V×n RAD r TEX``: a sphere at every point, an open cylinder between neighbours."""
        points = words.numbers(words.count(3, "POINTS"), 3).tolist()
        radius = words.radius("RAD")
        material = self._textures.texture(words, holder)
        if not self._visible(radius > 0, "polycylinders of radius 0"):
            return
        for point in points:
            self._row("sphere", (*point, radius), material)
        for base, apex in pairwise(points):
            self._tube(base, apex, radius, material)

    def ring(self, words: Words, holder: Path) -> None:
        """``RING CENTER V NORMAL V INNER r OUTER r TEX``."""
        center, normal = words.vector("CENTER"), words.direction("NORMAL")
        inner, outer = words.radius("INNER"), words.radius("OUTER")
        material = self._textures.texture(words, holder)
        if self._visible(inner < outer, "rings with no width"):
            self._row("ring", (*center, *normal, inner, outer), material)

    def box(self, words: Words, holder: Path) -> None:
        """``BOX MIN V MAX V TEX``."""
        low, high = words.vector("MIN"), words.vector("MAX")
        if any(a > b for a, b in zip(low, high, strict=True)):
            raise words.wrong("a corner that is not below MIN", back=3)
        self._row("box", (*low, *high), self._textures.texture(words, holder))

    def flat_triangle(self, words: Words, holder: Path) -> None:
        """``TRI V0 V V1 V V2 V TEX``."""
        corners = (*words.vector("V0"), *words.vector("V1"), *words.vector("V2"))
        self._row("flat", corners, self._textures.texture(words, holder))

    def smooth_triangle(self, words: Words, holder: Path) -> None:
        """``STRI V0 V V1 V V2 V N0 V N1 V N2 V TEX``."""
        corners = self._smooth_corners(words)
        self._row("smooth", corners, self._textures.texture(words, holder))

    def colored_triangle(self, words: Words, holder: Path) -> None:
        """``VCSTRI``: as STRI, then C0 C1 C2 and a body without colour."""
        corners = self._smooth_corners(words)
        colors = (*words.vector("C0"), *words.vector("C1"), *words.vector("C2"))
        self._row("colored", (*corners, *colors), self._textures.vertex_colored(words))

    def vertex_array(self, words: Words, holder: Path) -> None:
        """``VERTEXARRAY NUMVERTS n COORDS .. NORMALS .. {COLORS | TEXTURE | TRISTRIP | TRIMESH}* END_VERTEXARRAY``."""
        count = words.count(6, "NUMVERTS")
        words.keyword("COORDS")
        vertices = words.numbers(count, 3)
        words.keyword("NORMALS")
        normals = words.numbers(count, 3)
        material = self._textures.default()
        colors: Numbers | None = None
        while not words.has("END_VERTEXARRAY"):
            if words.has("COLORS"):
                colors = words.numbers(count, 3)
            elif words.has("TEXTURE"):
                material = self._textures.body(words, holder)
            elif words.has("TRISTRIP"):
                faces = _strip_faces(words.indices(words.count(1), 1, count)[:, 0])
                self._mesh(vertices, faces, material, normals, colors)
            elif words.has("TRIMESH"):
                faces = words.indices(words.count(3), 3, count)
                self._mesh(vertices, faces, material, normals, colors)
            else:
                raise words.wrong("COLORS, TEXTURE, TRISTRIP, TRIMESH or END_VERTEXARRAY")

    def scape(self, words: Words, holder: Path) -> None:
        """``SCAPE RES m n SCALE wx wy CENTER V TEX``."""
        words.keyword("RES")
        columns, rows = (words.integer(2, _WIDEST_LANDSCAPE) for _ in range(2))
        self._landscape_samples += columns * rows
        if self._landscape_samples > _LARGEST_LANDSCAPES:
            raise words.wrong(f"at most {_LARGEST_LANDSCAPES} samples in all landscapes together", back=1)
        width, depth = words.positive("SCALE"), words.positive()
        center = words.vector("CENTER")
        material = self._textures.texture(words, holder)
        field = landscape(columns, rows, width, depth, center)
        self._mesh(field.vertices, field.faces, material, field.normals, None)

    def triangle_file(self, words: Words, holder: Path) -> None:
        """``TPOLYFILE SCALE V ROT V CENTER V FILE name TEX``: triangles of another file, scaled, turned, moved."""
        scale, turn, center = words.vector("SCALE"), words.vector("ROT"), words.vector("CENTER")
        words.keyword("FILE")
        where = words.place()
        path = self._files.find(words.name("the name of a file"), holder, where=where, what="triangle file")
        material = self._textures.texture(words, holder)
        inner = self._files.words(path, comment=_NO_COMMENT, where=where)
        corners = []
        while inner.left:
            inner.integer(3, 3)
            corners.append(inner.numbers(3, 3))
        if corners:
            triangles = (np.array(corners) * scale) @ _rotation(turn).T + center
            self._triangles(triangles[:, [1, 0, 2]], material, None, None)

    def finish(self) -> None:
        """Hand all rows to the builder, and note the primitives left out."""
        build = self._builder
        for kind, rows in self._rows.items():
            table = np.array(rows, np.float64)
            shared, material, group = table[:, :-2], table[:, -2].astype(np.int32), table[:, -1].astype(np.int32)
            part = [shared[:, i : i + 3] for i in range(0, shared.shape[1], 3)]
            if kind == "sphere":
                build.spheres(part[0], shared[:, 3], material, clip_group=group)
            elif kind == "plane":
                build.planes(part[0], part[1], material, clip_group=group)
            elif kind == "cylinder":
                build.cylinders(part[0], part[1], shared[:, 6], material, clip_group=group)
            elif kind == "tube":
                build.tubes(part[0], part[1], shared[:, 6], material, clip_group=group)
            elif kind == "ring":
                build.rings(part[0], part[1], shared[:, 6], shared[:, 7], material, clip_group=group)
            elif kind == "box":
                build.boxes(part[0], part[1], material, clip_group=group)
            else:
                corners = shared.reshape(len(shared), -1, 3, 3)
                normals = corners[:, 1] if corners.shape[1] > 1 else None
                colors = corners[:, 2] if corners.shape[1] > 2 else None
                self._triangles(corners[:, 0], material, normals, colors, group)
        for what, count in self._left_out.items():
            build.notes.append(f"{count} {what} cannot be seen and are left out")

    def _smooth_corners(self, words: Words) -> Row:
        positions = (*words.vector("V0"), *words.vector("V1"), *words.vector("V2"))
        return (*positions, *words.vector("N0"), *words.vector("N1"), *words.vector("N2"))

    def _row(self, kind: str, values: Row, material: int) -> None:
        self._rows.setdefault(kind, []).append((*values, material, self.clip_group))

    def _tube(self, base: Row, apex: Row, radius: float, material: int) -> None:
        if self._visible(radius > 0 and tuple(base) != tuple(apex), "cylinders of radius or length 0"):
            self._row("tube", (*base, *apex, radius), material)

    def _visible(self, good: bool, what: str, count: int = 1) -> bool:
        if not good:
            self._left_out[what] = self._left_out.get(what, 0) + count
        return good

    def _mesh(
        self, vertices: Numbers, faces: NDArray[np.int64], material: int, normals: Numbers, colors: Numbers | None
    ) -> None:
        self._triangles(vertices[faces], material, normals[faces], None if colors is None else colors[faces])

    def _triangles(
        self,
        corners: Numbers,
        material: int | NDArray[np.int32],
        normals: Numbers | None,
        colors: Numbers | None,
        clip_group: NDArray[np.int32] | None = None,
    ) -> None:
        """Add triangles without those that have no extent."""
        edges = corners - np.roll(corners, 1, axis=1)
        proper = (np.linalg.norm(edges, axis=2) >= _SHORTEST_EDGE).all(axis=1)
        self._visible(bool(proper.all()), "triangles with corners that coincide", int((~proper).sum()))
        self._builder.triangles(
            corners[proper],
            np.broadcast_to(material, len(corners))[proper],
            normals=None if normals is None else normals[proper],
            colors=None if colors is None else colors[proper],
            clip_group=np.broadcast_to(self.clip_group if clip_group is None else clip_group, len(corners))[proper],
        )


SHAPES: dict[str, Callable[[ShapeReader, Words, Path], None]] = {
    "SPHERE": ShapeReader.sphere,
    "PLANE": ShapeReader.plane,
    "CYLINDER": ShapeReader.cylinder,
    "FCYLINDER": ShapeReader.tube,
    "POLYCYLINDER": ShapeReader.polycylinder,
    "RING": ShapeReader.ring,
    "BOX": ShapeReader.box,
    "TRI": ShapeReader.flat_triangle,
    "STRI": ShapeReader.smooth_triangle,
    "VCSTRI": ShapeReader.colored_triangle,
    "VERTEXARRAY": ShapeReader.vertex_array,
    "SCAPE": ShapeReader.scape,
    "TPOLYFILE": ShapeReader.triangle_file,
}
"""The keyword of each primitive and the method that reads what follows it."""


def _strip_faces(strip: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles of a strip; every second one is turned so that all face the same way."""
    first, second, third = strip[:-2].copy(), strip[1:-1].copy(), strip[2:]
    odd = slice(1, None, 2)
    first[odd], second[odd] = strip[1:-1][odd], strip[:-2][odd]
    return np.stack([first, second, third], axis=-1) if len(strip) > 2 else np.zeros((0, 3), np.int64)


def _rotation(degrees: tuple[float, float, float]) -> Numbers:
    """Tachyon's matrix of three angles about x, y and z; it is no pure rotation where the y angle is not 0."""
    a, b, c = (angle * _DEGREES for angle in degrees)
    return np.array(
        [
            [
                math.cos(b) * math.cos(c),
                math.sin(a) * math.sin(b) * math.cos(c) - math.cos(a) * math.sin(c),
                math.sin(a) * math.sin(c) + math.cos(a) * math.cos(c) * math.sin(b),
            ],
            [
                math.cos(b) * math.sin(c),
                math.cos(a) * math.cos(c) + math.sin(a) * math.sin(b) * math.sin(c),
                math.cos(a) * math.sin(b) * math.sin(c) - math.sin(a) * math.cos(c),
            ],
            [math.sin(b), math.sin(a) * math.cos(b), math.cos(a) * math.cos(b)],
        ]
    )
