"""The room: framed pictures, parquet, a round table with four balls of which one is a mirror, two stools, one light.

The side walls splay toward the viewer like those of a stage, because a display whose views are parallel would otherwise
see them edge on. Ceiling and rear wall lie far outside the picture; the mirrors show them. Millimetres of the paper's
display, +y up, the floor at y = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lippmann.scene.bundled import textures
from lippmann.scene.bundled.stage import Stage, vector_of
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import ClassicImage, ClassicLight, ClassicMaterial, ClassicTexture
from lippmann.scene.whitted.builder import ClassicSceneBuilder

NAME = "room"


@dataclass(frozen=True)
class Layout:
    """Sizes and places in mm.

    The back wall lies at ``back``; there the side walls are ``half_width`` from the middle, and they leave it by
    ``splay`` mm per mm toward the viewer. ``parquet`` is the size of one repeat of the floor. Pictures are squares in
    frames of radius ``frame``: ``back_picture`` wide with their middles (x, y) at ``back_pictures``, and
    ``side_picture`` wide at the height and depth (y, z) of ``side_pictures``. The table is (radius, height, thickness,
    z of its axis), a stool (radius, height, x of its axis on either side, z). Places on the table count from its axis:
    the disc (x, z, inner radius, outer radius) and the balls (x, z, radius), of which the last is the mirror.
    """

    back: float = -36.7
    half_width: float = 45.0
    splay: float = 0.9
    ceiling: float = 260.0
    rear: float = 440.0
    parquet: float = 30.0
    frame: float = 1.3
    back_picture: float = 34.0
    back_pictures: tuple[tuple[float, float], tuple[float, float]] = ((-22.0, 87.0), (22.0, 87.0))
    side_picture: float = 26.0
    side_pictures: tuple[float, float] = (84.0, -24.0)
    table: tuple[float, float, float, float] = (25.0, 38.0, 3.0, -9.0)
    stool: tuple[float, float, float, float] = (8.5, 20.0, 42.0, 11.0)
    disc: tuple[float, float, float, float] = (-15.5, 1.0, 1.2, 5.5)
    balls: tuple[tuple[float, float, float], ...] = (
        (-8.0, 9.0, 3.2),
        (0.0, 13.0, 3.2),
        (8.0, 9.0, 3.2),
        (0.0, -5.0, 10.0),
    )


LAYOUT = Layout()
STAGE = Stage(target=(0.0, 63.9, 0.0), elevation=16.0)

WALL = ClassicMaterial(color=(0.90, 0.88, 0.84), ambient=0.22, diffuse=0.72)
CEILING = ClassicMaterial(color=(1.0, 1.0, 1.0), ambient=0.4, diffuse=0.5)
SKIRTING = ClassicMaterial(color=(0.42, 0.26, 0.14), ambient=0.2, diffuse=0.7)
TABLE = ClassicMaterial(color=(0.95, 0.57, 0.22), ambient=0.2, diffuse=0.75)
METAL = ClassicMaterial(color=(0.9, 0.9, 0.92), ambient=0.15, diffuse=0.6, specular=0.15, phong=0.5, phong_size=40.0)
SEAT = ClassicMaterial(color=(0.62, 0.12, 0.13), ambient=0.2, diffuse=0.75)
GOLD = ClassicMaterial(
    color=(0.83, 0.62, 0.25), ambient=0.2, diffuse=0.7, phong=0.5, phong_size=30.0, phong_kind="metal"
)
BALLS = tuple(
    ClassicMaterial(color=color, ambient=0.2, diffuse=0.8, phong=0.8, phong_size=40.0)
    for color in ((0.9, 0.05, 0.05), (0.05, 0.75, 0.08), (0.08, 0.12, 0.95))
)
MIRROR = ClassicMaterial(ambient=0.05, diffuse=0.1, specular=0.75, phong=0.3, phong_size=40.0)
LIGHTS = (ClassicLight("point", (0.95, 0.93, 0.9), center=(-60.0, 190.0, 150.0), radius=4.0),)
RAY_DEPTH = 5

# Tachyon chooses an image's MIP level by path length times SCALE. Small scales, made up for by long axes, keep the
# pictures sharp: one texel is about as large as one pixel of the display anyway.
_SCALE = 0.001

Rows = NDArray[np.float64]
Pixels = NDArray[np.uint8]


def make() -> ClassicScene:
    """Return the furnished room."""
    builder = ClassicSceneBuilder(NAME, handedness="right")
    _add_shell(builder)
    _add_pictures(builder)
    _add_table(builder)
    _add_stools(builder)
    return builder.build(LIGHTS, camera=STAGE.classic_camera(ray_depth=RAY_DEPTH))


def _add_shell(builder: ClassicSceneBuilder) -> None:
    floor = _image_material(
        builder,
        "parquet",
        textures.parquet(),
        corner=(0.0, 0.0, 0.0),
        along=np.array([LAYOUT.parquet, 0.0, 0.0]),
        down=np.array([0.0, 0.0, LAYOUT.parquet]),
        ambient=0.3,
        diffuse=0.8,
    )
    builder.planes((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), floor)
    builder.planes((0.0, LAYOUT.ceiling, 0.0), (0.0, -1.0, 0.0), builder.material(CEILING))
    wall = builder.material(WALL)
    foot = np.array([LAYOUT.half_width, 0.0, LAYOUT.back])
    centers = np.array([(0, 0, LAYOUT.back), (0, 0, LAYOUT.rear), foot, foot * (-1, 1, 1)])
    normals = [(0, 0, 1), (0, 0, -1), (-1, 0, LAYOUT.splay), (1, 0, LAYOUT.splay)]
    builder.planes(centers, normals, wall)

    toward = foot + np.array([LAYOUT.splay, 0.0, 1.0]) * 34.0  # beyond the edge of the picture
    skirting = np.array([toward, foot, foot * (-1, 1, 1), toward * (-1, 1, 1)])
    _rod(builder, skirting, 1.4, builder.material(SKIRTING))


def _add_pictures(builder: ClassicSceneBuilder) -> None:
    up = np.array([0.0, 1.0, 0.0])
    right = np.array([1.0, 0.0, 0.0])
    for (x, y), paint in zip(LAYOUT.back_pictures, (textures.moonrise, textures.hills), strict=True):
        _hang(builder, paint, np.array([x, y, LAYOUT.back]), LAYOUT.back_picture, right, up)
    y, z = LAYOUT.side_pictures
    x = LAYOUT.half_width + LAYOUT.splay * (z - LAYOUT.back)
    along = np.array([LAYOUT.splay, 0.0, 1.0]) / np.hypot(LAYOUT.splay, 1.0)
    _hang(builder, textures.composition, np.array([x, y, z]), LAYOUT.side_picture, along, up)
    _hang(builder, textures.planet, np.array([-x, y, z]), LAYOUT.side_picture, along * (1, 1, -1), up)


def _hang(
    builder: ClassicSceneBuilder, paint: Callable[[], Pixels], middle: Rows, size: float, right: Rows, up: Rows
) -> None:
    """Hang a square picture on a wall; ``right`` and ``up`` are unit vectors in it, as its viewer sees them."""
    raised = middle + np.cross(right, up) * LAYOUT.frame / 2
    corners = np.array([raised + size / 2 * (i * right + j * up) for i, j in ((-1, 1), (-1, -1), (1, -1), (1, 1))])
    # A hair wider than the picture, so that rounding cannot wrap its edges round to the other side.
    wide = 1.0001 * size
    material = _image_material(
        builder,
        paint.__name__,
        paint(),
        corner=corners[0],
        along=right * wide,
        down=-up * wide,
        ambient=0.45,
        diffuse=0.55,
    )
    builder.mesh(corners, [(0, 1, 2), (0, 2, 3)], material)
    _rod(builder, np.concatenate([corners, corners[:1]]), LAYOUT.frame, builder.material(GOLD))


def _add_table(builder: ClassicSceneBuilder) -> None:
    radius, height, thickness, z = LAYOUT.table
    wood, metal = builder.material(TABLE), builder.material(METAL)
    top, below = (0.0, height, z), (0.0, height - thickness, z)
    builder.rings([top, below], [(0, 1, 0), (0, -1, 0)], 0.0, radius, wood)
    builder.tubes(below, top, radius, wood)
    _rod(builder, np.array([(0.0, 1.6, z), below]), 1.8, metal)
    for x in (-14.0, 14.0):
        _rod(builder, np.array([(x, 1.6, z - 10.0), (-x, 1.6, z + 10.0)]), 1.6, metal)
    for (x, dz, ball), material in zip(LAYOUT.balls, (*BALLS, MIRROR), strict=True):
        builder.spheres((x, height + ball, z + dz), ball, builder.material(material))
    x, dz, inner, outer = LAYOUT.disc
    builder.rings((x, height + 0.2, z + dz), (0, 1, 0), inner, outer, builder.material(MIRROR))


def _add_stools(builder: ClassicSceneBuilder) -> None:
    radius, height, x, z = LAYOUT.stool
    seat, metal = builder.material(SEAT), builder.material(METAL)
    for side in (-x, x):
        builder.rings((side, height, z), (0, 1, 0), 0.0, radius, seat)
        builder.tubes((side, height - 2.5, z), (side, height, z), radius, seat)
        for leg in np.radians((30.0, 150.0, 270.0)):
            spread = np.array([np.cos(leg), 0.0, np.sin(leg)])
            ends = np.array([(side, 0.9, z), (side, height - 2.0, z)]) + spread * radius * np.array([[0.9], [0.5]])
            _rod(builder, ends, 0.9, metal)


def _rod(builder: ClassicSceneBuilder, points: Rows, radius: float, material: int) -> None:
    """A bent rod through ``points (n, 3)``: tubes between them, balls at them."""
    builder.tubes(points[:-1], points[1:], radius, material)
    builder.spheres(points, radius, material)


def _image_material(
    builder: ClassicSceneBuilder,
    name: str,
    pixels: Pixels,
    *,
    corner: ArrayLike,
    along: Rows,
    down: Rows,
    ambient: float,
    diffuse: float,
) -> int:
    """A picture whose top left corner lies at ``corner`` and whose sides are the vectors ``along`` and ``down``."""
    texture = ClassicTexture(
        "planar-image",
        center=vector_of(corner),
        scale=(_SCALE, _SCALE, _SCALE),
        u_axis=vector_of(along / (along @ along) / _SCALE),
        v_axis=vector_of(down / (down @ down) / _SCALE),
        image=builder.image(ClassicImage(name, pixels[None])),
    )
    return builder.material(ClassicMaterial(ambient=ambient, diffuse=diffuse, texture=texture))
