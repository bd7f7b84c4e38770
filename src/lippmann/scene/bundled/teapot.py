"""The teapot: Newell's patches on a half-mirroring checkerboard, the scene that everyone has seen before.

Two lights fall on the same geometry: :func:`describe` gives glazed porcelain in a studio for physically based light,
:func:`make` the classic metal pot under two lights. Millimetres of the paper's display, +y up, the floor at y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.bundled.stage import Stage
from lippmann.scene.bundled.teapot_patches import tessellate
from lippmann.scene.values.description import (
    Environment,
    FloatArray,
    Instance,
    Material,
    Matrix,
    Mesh,
    SceneDescription,
)
from lippmann.scene.values.whitted_lighting import Background, ClassicLight
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import ClassicMaterial
from lippmann.scene.whitted.builder import ClassicSceneBuilder

NAME = "teapot"


@dataclass(frozen=True)
class Layout:
    """Sizes and places, in mm and degrees.

    ``unit`` is the length of Newell's unit, ``turn`` swings the spout from +x toward the viewer. The floor is
    ``columns`` x ``rows`` tiles of ``tile`` mm, its middle moved by ``floor_shift`` toward the viewer; the tile at the
    far left is light.
    """

    unit: float = 16.0
    subdivisions: int = 16
    turn: float = 25.0
    tile: float = 12.0
    columns: int = 10
    rows: int = 6
    floor_shift: float = 10.0


LAYOUT = Layout()
STAGE = Stage(target=(2.0, 24.0, 22.1), elevation=29.0)

GLAZE = ClassicMaterial(
    color=(0.76, 0.44, 0.26), ambient=0.08, diffuse=0.62, specular=0.28, phong=0.45, phong_size=22.0, phong_kind="metal"
)
LIGHT_TILE = ClassicMaterial(color=(0.92, 0.92, 0.90), ambient=0.08, diffuse=0.45, specular=0.5)
DARK_TILE = ClassicMaterial(color=(0.10, 0.14, 0.25), ambient=0.08, diffuse=0.45, specular=0.5)
LIGHTS = (
    ClassicLight("point", (0.84, 0.81, 0.76), center=(-150.0, 210.0, 190.0)),
    ClassicLight("point", (0.50, 0.53, 0.58), center=(190.0, 160.0, 90.0)),
)
SKY = Background(color=(0.08, 0.30, 0.62))
RAY_DEPTH = 6


def pot_from_newell() -> Matrix:
    """Carries the tessellation of :mod:`~lippmann.scene.bundled.teapot_patches` into the scene."""
    turn = np.radians(LAYOUT.turn)
    matrix = np.diag([LAYOUT.unit, LAYOUT.unit, LAYOUT.unit, 1.0])
    matrix[:3, :3] @= [[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]]
    return matrix


def tiles(*, light: bool) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Return the floor's light or dark tiles as triangles facing up: positions ``(4 t, 3)``, faces ``(2 t, 3)``."""
    row, column = np.divmod(np.arange(LAYOUT.rows * LAYOUT.columns), LAYOUT.columns)
    mask = (row + column) % 2 == (0 if light else 1)
    corner = np.stack([column - LAYOUT.columns / 2, np.zeros(len(row)), row - LAYOUT.rows / 2], axis=1)[mask]
    around = np.array([(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)])
    positions = (corner[:, None, :] + around) * LAYOUT.tile + (0.0, 0.0, LAYOUT.floor_shift)
    faces = 4 * np.arange(len(corner))[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])
    return positions.reshape(-1, 3), faces.reshape(-1, 3).astype(np.uint32)


def make() -> ClassicScene:
    """Return the classic teapot: polished copper on half-mirroring tiles under two lights."""
    builder = ClassicSceneBuilder(NAME, handedness="right")
    for is_light, material in ((True, LIGHT_TILE), (False, DARK_TILE)):
        corners, faces = tiles(light=is_light)
        builder.mesh(corners, faces, builder.material(material))
    pot, matrix = tessellate(LAYOUT.subdivisions), pot_from_newell()[:3, :3]
    normals = pot.normals @ matrix.T / LAYOUT.unit
    builder.mesh(pot.positions @ matrix.T, pot.faces, builder.material(GLAZE), normals=normals)
    for light in LIGHTS:
        builder.light(light)
    return builder.build(background=SKY, camera=STAGE.classic_camera(ray_depth=RAY_DEPTH))


def describe() -> SceneDescription:
    """Return the physically based teapot: glazed porcelain and polished tiles in a studio."""
    pot = tessellate(LAYOUT.subdivisions)
    light_tiles, dark_tiles = tiles(light=True), tiles(light=False)
    meshes = [
        Mesh(
            "teapot",
            pot.positions.astype(np.float32),
            pot.faces,
            material=0,
            normals=pot.normals.astype(np.float32),
        ),
        Mesh("light tiles", light_tiles[0].astype(np.float32), light_tiles[1], material=1),
        Mesh("dark tiles", dark_tiles[0].astype(np.float32), dark_tiles[1], material=2),
    ]
    materials = [
        Material(
            "porcelain",
            base_color=(0.30, 0.52, 0.42),
            roughness=0.15,
            double_sided=True,
        ),
        Material("light tiles", base_color=(0.86, 0.84, 0.78), metallic=0.6, roughness=0.12),
        Material("dark tiles", base_color=(0.05, 0.05, 0.06), metallic=0.6, roughness=0.12),
    ]
    return SceneDescription(
        NAME,
        meshes=meshes,
        materials=materials,
        instances=[Instance(0, pot_from_newell()), Instance(1, np.eye(4)), Instance(2, np.eye(4))],
        cameras=[STAGE.camera()],
        environment=Environment(_studio(), name="studio"),
        background=(0.10, 0.13, 0.17),
    )


def _studio(height: int = 256) -> FloatArray:
    """Paint a studio: a grey shell, brighter above, with two soft boxes and a strip whose reflections model the glaze.

    Equirectangular ``(height, 2 height, 3)`` radiance, row 0 up, the middle column toward -z.
    """
    elevation = np.pi / 2 - (np.arange(height) + 0.5) * np.pi / height
    azimuth = (np.arange(2 * height) + 0.5) * np.pi / height - np.pi
    up = np.sin(elevation)[:, None, None]
    shell = 0.10 + 0.30 * np.clip(0.5 + 0.5 * up, 0, 1) ** 2
    pixels = shell * np.ones((1, 2 * height, 1)) * np.array([0.86, 0.95, 1.1])

    def soft_box(
        center: tuple[float, float], half_size: tuple[float, float], radiance: tuple[float, float, float]
    ) -> None:
        # Edges fade over two degrees, so that their reflections do not look cut out.
        across = np.abs((azimuth - np.radians(center[0]) + np.pi) % (2 * np.pi) - np.pi)
        along = np.abs(elevation - np.radians(center[1]))
        fade = [
            np.clip((np.radians(half) - distance) / np.radians(2.0) + 0.5, 0, 1)
            for half, distance in zip(half_size, (across, along), strict=True)
        ]
        pixels[...] += (fade[1][:, None] * fade[0][None, :])[..., None] * np.array(radiance)

    soft_box((-130.0, 45.0), (38.0, 26.0), (4.6, 4.3, 3.8))
    soft_box((75.0, 30.0), (8.0, 24.0), (3.0, 3.4, 4.2))
    soft_box((0.0, 62.0), (60.0, 10.0), (2.0, 2.1, 2.3))
    radiance: FloatArray = pixels.astype(np.float32)
    return radiance
