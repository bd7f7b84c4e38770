"""The picture of material parameters in ``docs/reference/materials.md``: a row of balls for each.

Time on two cores: an estimated minute.

python benchmarks/material_sheet.py
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from lippmann import api
from lippmann.color.transfer import quantize
from lippmann.scene.values.description import Camera, Instance, Material, Mesh, SceneDescription

PICTURE = Path(__file__).parent.parent / "docs" / "images" / "materials.png"
COLUMNS, SIZE, SPP = 7, 140, 256

METAL = Material(base_color=(0.95, 0.75, 0.45), metallic=1.0, roughness=0.3)
GLASS = Material(base_color=(0.85, 0.95, 1.0), transmission=1.0, thickness=1.0)
PAINT = Material(base_color=(0.6, 0.05, 0.05), roughness=0.6)
CLOTH = Material(base_color=(0.15, 0.05, 0.2), roughness=1.0, sheen_color=(0.7, 0.6, 0.9))
PLASTIC = Material(base_color=(0.02, 0.02, 0.02), roughness=0.15)


def rows() -> list[list[Material]]:
    """Materials ``COLUMNS`` in a row."""
    steps = [number / (COLUMNS - 1) for number in range(COLUMNS)]
    return [
        [replace(METAL, roughness=x) for x in steps],
        [replace(GLASS, roughness=x) for x in steps],
        [replace(PAINT, clearcoat=1.0, clearcoat_roughness=x) for x in steps],
        [replace(CLOTH, sheen_roughness=0.1 + 0.9 * x) for x in steps],
        [replace(METAL, anisotropy=0.9, anisotropy_rotation=math.pi * x) for x in steps],
        [replace(PLASTIC, iridescence=1.0, iridescence_thickness_maximum=150 + 500 * x) for x in steps],
    ]


def ball(material: int) -> Mesh:
    """A smooth ball of radius 1 whose u runs around it."""
    steps = 96
    theta, phi = np.meshgrid(np.linspace(0, np.pi, steps), np.linspace(0, 2 * np.pi, 2 * steps), indexing="ij")
    normals = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], -1)
    index = np.arange(theta.size).reshape(theta.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.uint32)
    uvs = np.column_stack([phi.ravel() / (2 * np.pi), theta.ravel() / np.pi]).astype(np.float32)
    points = np.float32(normals.reshape(-1, 3))
    return Mesh("ball", points, faces, material, points, (uvs,))


def main() -> None:
    materials = [material for row in rows() for material in row]
    instances, meshes = [], []
    for number in range(len(materials)):
        row, column = divmod(number, COLUMNS)
        place = np.eye(4)
        place[:3, 3] = 2.2 * (column - (COLUMNS - 1) / 2), -2.2 * (row - (len(rows()) - 1) / 2), 0
        instances.append(Instance(number, place))
        meshes.append(ball(number))
    height = 2.2 * len(rows())
    frame = np.eye(4)
    frame[2, 3] = 40.0
    camera = Camera("sheet", frame, fov_y=2 * math.atan(height / 2 / 40.0), aspect=COLUMNS / len(rows()))
    description = SceneDescription("materials", meshes, materials, instances, cameras=[camera])
    scene = api.load_scene(description, environment="studio")
    picture = api.preview(scene, size=(COLUMNS * SIZE, len(rows()) * SIZE), spp=SPP, camera="sheet")
    Image.fromarray(quantize(picture.pixels, 8, "srgb")).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
