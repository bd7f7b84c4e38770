"""Primitives: one of every shape, texture and light that the classic light models know, on a shelf in front of a wall.

Spheres, tubes, a cone, an endless cylinder, rings, a cube, a plane, flat, smooth and coloured triangles, a bent rod, a
coloured height field; every texture but the grit, whose grains differ from run to run, and the volume. One unit is
24 mm of the paper's display (the procedural textures have a fixed size of about a unit), +y up, the shelf at y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.bundled import textures
from lippmann.scene.bundled.stage import Stage, level_rectangle
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import (
    Background,
    ClassicImage,
    ClassicLight,
    ClassicMaterial,
    ClassicTexture,
    TextureKind,
    Vector,
)
from lippmann.scene.whitted.builder import ClassicSceneBuilder, unit

NAME = "primitives"

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """Places (x, z) on the shelf, in units.

    The shelf's corners are given as (x, z). ``wall`` is the distance of the endless plane that closes the scene, from
    the middle of the lens plane along the direction of view.
    """

    shelf: tuple[tuple[float, float], tuple[float, float]] = ((-2.7, -1.45), (2.7, 1.15))
    wall: float = 2.25
    column: tuple[float, float] = (-2.35, -0.95)
    globe: tuple[float, float] = (-1.4, -0.65)
    drum: tuple[float, float] = (-0.2, -0.8)
    mirror: tuple[float, float] = (1.0, -0.65)
    cone: tuple[float, float] = (2.15, -0.8)
    cube: tuple[float, float] = (-2.15, 0.6)
    checkers: tuple[float, float] = (-1.15, 0.5)
    field: tuple[float, float] = (0.0, 0.5)
    rod: tuple[float, float] = (1.05, 0.45)
    stand: tuple[float, float] = (2.05, 0.5)


LAYOUT = Layout()
STAGE = Stage(target=(0.0, 1.25, 0.15), elevation=30.0, unit=24.0)

SHELF = ClassicMaterial(color=(0.75, 0.76, 0.78), ambient=0.15, diffuse=0.6, specular=0.15)
WALL = ClassicMaterial(color=(0.42, 0.50, 0.62), ambient=0.35, diffuse=0.45)
MIRROR = ClassicMaterial(ambient=0.05, diffuse=0.1, specular=0.8, phong=0.6, phong_size=80.0)
GLASS = ClassicMaterial(color=(0.35, 0.75, 0.65), ambient=0.1, diffuse=0.3, opacity=0.4, phong=0.7, phong_size=60.0)
LIGHTS = (
    ClassicLight("point", (0.55, 0.53, 0.50), center=(-5.0, 8.0, 6.0)),
    ClassicLight(
        "spot",
        (0.75, 0.70, 0.55),
        center=(3.5, 6.5, 4.0),
        direction=tuple(unit((-3.0, -6.2, -4.6), "the spot's direction").tolist()),
        falloff_start=8.0,
        falloff_end=22.0,
    ),
    ClassicLight("directional", (0.28, 0.30, 0.36), direction=tuple(unit((-0.5, -1.0, -0.4), "sunlight").tolist())),
)
BACK_COLOR = Background(color=(0.2, 0.25, 0.32))
RAY_DEPTH = 5


def make() -> ClassicScene:
    """Return the shelf of primitives."""
    builder = ClassicSceneBuilder(NAME, handedness="right")
    toward_viewer = STAGE.rotation[:, 2]
    behind = np.array(STAGE.target) - LAYOUT.wall * toward_viewer
    builder.planes(behind, toward_viewer, builder.material(WALL))
    (x0, _), (x1, z1) = LAYOUT.shelf
    shelf = builder.material(SHELF)
    builder.mesh(*level_rectangle(*LAYOUT.shelf), shelf)
    # A little below the top: where two surfaces touch along a line, rounding would choose between their colours.
    builder.tubes((x0, -0.081, z1), (x1, -0.081, z1), 0.08, shelf)
    _add_back_row(builder)
    _add_front_row(builder)
    return builder.build(LIGHTS, background=BACK_COLOR, camera=STAGE.classic_camera(ray_depth=RAY_DEPTH))


def _add_back_row(builder: ClassicSceneBuilder) -> None:
    x, z = LAYOUT.column
    # It leans like the wall, or its upper part would come out in front of the points where rays begin.
    builder.cylinders((x, 0.0, z), STAGE.rotation[:, 1], 0.26, _add_texture(builder, "marble", (x, 0.0, z)))

    x, z = LAYOUT.globe
    center = (x, 0.6, z)
    image = builder.image(ClassicImage("composition", textures.composition()[None]))
    builder.spheres(center, 0.6, _add_texture(builder, "spherical-image", center, image=image, scale=(2.0, 1.0, 1.0)))

    x, z = LAYOUT.drum
    wood = _add_texture(builder, "wood", (x, 0.0, z))
    builder.tubes((x, 0.0, z), (x, 1.4, z), 0.42, wood)
    builder.rings((x, 1.4, z), (0.0, 1.0, 0.0), 0.0, 0.42, wood)
    # An upright ring stands on the drum.
    paint = builder.material(ClassicMaterial(color=(0.9, 0.55, 0.1), ambient=0.15, diffuse=0.7, phong=0.4))
    builder.rings((x, 1.95, z), (0.35, 0.0, 1.0), 0.3, 0.54, paint)

    x, z = LAYOUT.mirror
    builder.spheres((x, 0.7, z), 0.7, builder.material(MIRROR))

    x, z = LAYOUT.cone
    image = builder.image(ClassicImage("parquet", textures.parquet()[None]))
    wrapped = _add_texture(builder, "cylindrical-image", (x, 0.0, z), image=image, scale=(3.0, 1.2, 1.0))
    builder.tubes((x, 0.0, z), (x, 2.4, z), 0.48, wrapped, apex_radius=0.0)


def _add_front_row(builder: ClassicSceneBuilder) -> None:
    x, z = LAYOUT.cube
    cloudy = _add_texture(builder, "noise", (x, 0.0, z), color=(0.95, 0.45, 0.40))
    builder.boxes((x - 0.3, 0.0, z - 0.3), (x + 0.3, 0.6, z + 0.3), cloudy)

    x, z = LAYOUT.checkers
    builder.spheres((x, 0.35, z), 0.35, _add_texture(builder, "checker", (x, 0.35, z)))
    # A plate lies under it.
    builder.rings((x, 0.01, z), (0.0, 1.0, 0.0), 0.0, 0.6, _add_texture(builder, "cylindrical-checker", (x, 0.0, z)))

    x, z = LAYOUT.field
    vertices, faces, normals, colors = height_field((x, z), size=1.0, cells=24)
    matt = builder.material(ClassicMaterial(ambient=0.15, diffuse=0.8))
    builder.mesh(vertices, faces, matt, normals=normals, colors=colors)

    x, z = LAYOUT.rod
    steps = np.linspace(0.0, 1.0, 17)
    turns = 2 * np.pi * 2.0 * steps
    bends = np.stack([x + 0.26 * np.cos(turns), 0.08 + 0.85 * steps, z + 0.26 * np.sin(turns)], axis=1)
    copper = builder.material(
        ClassicMaterial(
            color=(0.85, 0.45, 0.3), ambient=0.15, diffuse=0.7, phong=0.6, phong_size=25.0, phong_kind="metal"
        )
    )
    builder.tubes(bends[:-1], bends[1:], 0.08, copper)
    builder.spheres(bends, 0.08, copper)

    _add_triangles(builder, *LAYOUT.stand)


def _add_triangles(builder: ClassicSceneBuilder, x: float, z: float) -> None:
    """Four triangles in a fan: a flat and clear one, a smooth one, a coloured one, and one that bears a picture."""
    top = np.array([x, 1.35, z - 0.1])
    feet = np.array([(-0.65, 0, -0.1), (-0.35, 0, 0.25), (0, 0, 0.35), (0.4, 0, 0.3), (0.65, 0, 0.05)])
    feet += np.array([x, 0.0, z])
    corners = np.stack([np.tile(top, (4, 1)), feet[:-1], feet[1:]], axis=1)

    builder.triangles(corners[0], builder.material(GLASS))

    glossy = ClassicMaterial(color=(0.25, 0.4, 0.85), ambient=0.12, diffuse=0.6, phong=0.6, phong_size=20.0)
    bulge = unit(corners[1] - (x, 0.5, z - 0.6), "a normal")
    builder.triangles(corners[1], builder.material(glossy), normals=bulge)

    matt = builder.material(ClassicMaterial(ambient=0.15, diffuse=0.8))
    builder.triangles(corners[2], matt, normals=unit(corners[2] - (x, 0.5, z - 0.6), "a normal"), colors=np.eye(3))

    image = builder.image(ClassicImage("hills", textures.hills()[None]))
    picture = _add_texture(
        builder,
        "planar-image",
        (x + 0.1, 1.0, z - 0.2),
        image=image,
        scale=(1.1, 1.0, 1.0),
        u_axis=(0.6, 0.0, -0.8),
        v_axis=(0.0, -1.0, 0.0),
    )
    builder.triangles(corners[3], picture)


def height_field(
    middle: tuple[float, float], size: float, cells: int
) -> tuple[Points, NDArray[np.int64], Points, Points]:
    """Rings of waves on a square that fall almost to the shelf at its edges, ``cells`` x ``cells`` cells.

    Returns vertices, faces, normals and colours (by height) per vertex.
    """
    grid = np.linspace(-0.5, 0.5, cells + 1)
    u, v = np.meshgrid(grid, grid)
    radius = np.maximum(np.hypot(u, v), 1e-9)
    ripple, amplitude = 5.0 * np.pi, 0.3
    window_u, window_v = 1 - 4 * u * u, 1 - 4 * v * v
    wave = 0.55 + 0.45 * np.cos(ripple * radius)
    # Just above the shelf, even at the edges: in one plane with it rounding would choose between their colours.
    height = 0.005 + amplitude * window_u * window_v * wave
    wave_slope = -0.45 * ripple * np.sin(ripple * radius) / radius
    slope_u = amplitude * window_v * (-8 * u * wave + window_u * wave_slope * u)
    slope_v = amplitude * window_u * (-8 * v * wave + window_v * wave_slope * v)
    normals = unit(np.stack([-slope_u, np.full_like(u, size), -slope_v], axis=-1), "a normal")
    vertices = np.stack([middle[0] + size * u, height, middle[1] + size * v], axis=-1)
    low, high = np.array((0.10, 0.30, 0.65)), np.array((0.95, 0.90, 0.55))
    share = ((height - height.min()) / np.ptp(height))[..., None]
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)])
    return (
        vertices.reshape(-1, 3),
        faces,
        normals.reshape(-1, 3),
        (low * (1 - share) + high * share).reshape(-1, 3),
    )


def _add_texture(
    builder: ClassicSceneBuilder,
    kind: TextureKind,
    center: Vector,
    *,
    color: Vector = (1.0, 1.0, 1.0),
    scale: Vector = (1.0, 1.0, 1.0),
    image: int | None = None,
    u_axis: Vector = (1.0, 0.0, 0.0),
    v_axis: Vector = (0.0, 1.0, 0.0),
) -> int:
    texture = ClassicTexture(kind, center=center, scale=scale, image=image, u_axis=u_axis, v_axis=v_axis)
    return builder.material(
        ClassicMaterial(color=color, ambient=0.2, diffuse=0.75, phong=0.25, phong_size=40.0, texture=texture)
    )
