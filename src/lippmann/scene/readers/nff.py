"""Reader of NFF, Eric Haines' Neutral File Format, as the Standard Procedural Databases write it.

The format says nothing about the intensity of lights. Haines' recommendation is taken: with n lights, each one and the
ambient light has sqrt(n) / (2 n) (SPD documentation). The frame is right-handed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.tokens import Words
from lippmann.scene.parsing.triangulation import triangulate
from lippmann.scene.values.whitted_scene import ClassicCamera, ClassicScene
from lippmann.scene.values.whitted_surfaces import Background, ClassicLight, ClassicMaterial, Color, Shading, Vector
from lippmann.scene.whitted.builder import ClassicSceneBuilder

_COMMENT = re.compile(r"#[^\n]*")
_STARTS_NUMBER = re.compile(r"[-+.0-9]").match
_RAY_DEPTH = 5  # of the SPD test rules, the eye ray counting 1
_LARGEST_PICTURE = 65536
_MOST_CORNERS = 16384  # concave polygons take time with the square of their corners


def read_nff(path: str | Path) -> ClassicScene:
    """Read an NFF file. It refers to no other.

    Raises
    ------
    SceneError
        With file, line, the word found and what was expected; also for a missing file, and for a scene without
        viewpoint or without any primitive.
    """
    path = Path(path)
    return _NffReader(Words.of_file(path, path.name, comment=_COMMENT), path).read()


@dataclass
class _Polygons:
    """Polygons as read: how many corners each has, its material, and all numbers in one list."""

    sizes: list[int] = field(default_factory=list)
    materials: list[int] = field(default_factory=list)
    numbers: list[float] = field(default_factory=list)


class _NffReader:
    """Reads the entities one by one. Materials wait for the end, when the number of lights is known."""

    def __init__(self, words: Words, path: Path) -> None:
        self._words = words
        self._path = path
        self._camera: ClassicCamera | None = None
        self._resolution = (512, 512)
        self._background: Color = (0.0, 0.0, 0.0)
        self._lights: list[tuple[Vector, Color]] = []
        self._materials: list[ClassicMaterial] = []
        self._spheres: list[tuple[float, ...]] = []
        self._cones: list[tuple[float, ...]] = []
        self._flat = _Polygons()
        self._smooth = _Polygons()

    def read(self) -> ClassicScene:
        words = self._words
        entities: dict[str, Callable[[], None]] = {
            "v": self._viewpoint,
            "b": self._background_color,
            "l": self._light,
            "f": self._fill,
            "s": self._sphere,
            "c": self._cone,
            "p": lambda: self._polygon(self._flat, 3),
            "pp": lambda: self._polygon(self._smooth, 6),
        }
        while words.left:
            if words.peek() not in entities:
                raise words.wrong("an entity: v, b, l, f, s, c, p or pp")
            entities[words.take()]()
        return self._build()

    def _viewpoint(self) -> None:
        words = self._words
        at_line = words.place(back=1)
        eye, target, up = words.vector("FROM"), words.vector("AT"), words.direction("UP")
        angle = words.check(lambda value: 0 < value < 180, "an angle between 0 and 180 degrees", "ANGLE")
        words.number("HITHER")
        words.keyword("RESOLUTION")
        self._resolution = (words.integer(1, _LARGEST_PICTURE), words.integer(1, _LARGEST_PICTURE))
        view = (target[0] - eye[0], target[1] - eye[1], target[2] - eye[2])
        try:
            self._camera = ClassicCamera(
                center=eye,
                view=view,
                up=up,
                angle=angle,
                ray_depth=_RAY_DEPTH,
                handedness="right",
                pixel_point="center",
            )
        except SceneError as error:
            raise SceneError(error.what, where=at_line, rule=error.rule) from None

    def _background_color(self) -> None:
        self._background = self._words.vector()

    def _light(self) -> None:
        center = self._words.vector()
        has_color = _STARTS_NUMBER(self._words.peek())
        self._lights.append((center, self._words.vector() if has_color else (1.0, 1.0, 1.0)))

    def _fill(self) -> None:
        words = self._words
        color = words.vector()
        diffuse, specular, shine = (words.radius() for _ in range(3))
        transmittance = words.check(lambda value: 0 <= value <= 1, "a transmittance from 0 to 1")
        ior = words.radius()
        if transmittance > 0 and ior == 0:
            raise words.wrong("an index of refraction above 0 for a transparent material", back=1)
        self._materials.append(
            ClassicMaterial(
                color=color,
                ambient=diffuse,  # times the ambient intensity, once the lights are counted
                diffuse=diffuse,
                specular=specular,
                phong=specular,
                phong_size=shine,
                opacity=1.0 - transmittance,
                ior=ior if transmittance > 0 else 1.0,  # opaque materials are written with 0 or 1
            )
        )

    def _sphere(self) -> None:
        material = self._material()
        center, radius = self._words.vector(), self._words.number()
        if radius == 0:
            raise self._words.wrong("a radius other than 0", back=1)
        self._spheres.append((*center, radius, material))

    def _cone(self) -> None:
        words = self._words
        material = self._material()
        base, base_radius, apex, apex_radius = words.vector(), words.number(), words.vector(), words.number()
        if base_radius * apex_radius < 0 or base_radius == apex_radius == 0:
            raise words.wrong("a radius of the same sign as that of the base, and not both 0", back=1)
        if base == apex:
            raise words.wrong("an apex away from the base", back=4)
        self._cones.append((*base, *apex, base_radius, apex_radius, material))

    def _polygon(self, polygons: _Polygons, numbers_each: int) -> None:
        words = self._words
        material = self._material()
        size = words.count(numbers_each)
        if not 3 <= size <= _MOST_CORNERS:
            raise words.wrong(f"3 to {_MOST_CORNERS} corners", back=1)
        polygons.materials.append(material)
        polygons.sizes.append(size)
        polygons.numbers += words.floats(size * numbers_each)

    def _material(self) -> int:
        if not self._materials:
            raise self._words.wrong("a material (f) before the first object", back=1)
        return len(self._materials) - 1

    def _build(self) -> ClassicScene:
        builder = ClassicSceneBuilder(self._path.stem, rules="nff", handedness="right")
        if self._camera is None:
            raise SceneError("there is no viewpoint", where=self._path.name, rule="an NFF file has a v block")
        count = len(self._lights)
        intensity = math.sqrt(count) / (2.0 * count) if count else 0.5
        if not count:
            builder.notes.append("no lights: seen by ambient light of 0.5 alone")
        for center, (r, g, b) in self._lights:
            color = (r * intensity, g * intensity, b * intensity)
            builder.light(ClassicLight("point", center=center, color=color))
        material = np.array([builder.material(self._lit(each, intensity)) for each in self._materials], np.int32)

        if self._spheres:
            table = np.array(self._spheres)
            owner = material[table[:, 4].astype(np.int64)]
            builder.spheres(table[:, :3], np.abs(table[:, 3]), owner, inside_only=table[:, 3] < 0)
        if self._cones:
            table = np.array(self._cones)
            base_radius, apex_radius = table[:, 6], table[:, 7]
            builder.tubes(
                table[:, :3],
                table[:, 3:6],
                np.abs(base_radius),
                material[table[:, 8].astype(np.int64)],
                apex_radius=np.abs(apex_radius),
                inside_only=base_radius + apex_radius < 0,
            )
        self._add_polygons(builder, self._flat, material)
        self._add_polygons(builder, self._smooth, material)
        scene = builder.build(
            camera=self._camera,
            resolution=self._resolution,
            background=Background(color=self._background),
            shading=Shading(highlight="phong"),
        )
        if not any(scene.counts().values()):
            raise SceneError("the scene has no geometry", where=self._path.name, rule="at least one primitive")
        return scene

    @staticmethod
    def _lit(material: ClassicMaterial, intensity: float) -> ClassicMaterial:
        return replace(material, ambient=material.ambient * intensity)

    @staticmethod
    def _add_polygons(builder: ClassicSceneBuilder, polygons: _Polygons, material: NDArray[np.int32]) -> None:
        if not polygons.sizes:
            return
        sizes = np.array(polygons.sizes)
        corners = np.array(polygons.numbers).reshape(int(sizes.sum()), -1)
        triangles, owner = triangulate(corners[:, :3], np.arange(len(corners)), sizes)
        positions = corners[triangles, :3]
        area = np.linalg.norm(np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0]), axis=1)
        visible = area > 0
        if not visible.all():
            builder.notes.append(f"{int((~visible).sum())} triangles without area cannot be seen and are left out")
        builder.triangles(
            positions[visible],
            material[np.array(polygons.materials)[owner]][visible],
            normals=corners[triangles, 3:][visible] if corners.shape[1] == 6 else None,
        )
