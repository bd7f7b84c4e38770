"""Ten models as people bring them: files without light or cameras, of all shapes, sizes and colours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from trimesh.creation import box, capsule, cone, cylinder, icosphere, revolve, torus
from trimesh.transformations import rotation_matrix, translation_matrix
from trimesh.visual.material import PBRMaterial

#: Files that somebody else made, below the folder that is given.
GIVEN = {"fancy teapot": "fancy_teapot/scene.gltf", "clearcoat": "clearcoat_test/ClearCoatTest.gltf"}


def models(folder: Path, given: Path | None) -> dict[str, str | Path]:
    """Names of models and what to render: files written into ``folder``, given ones, and a bundled scene."""
    found: dict[str, str | Path] = {"teapot": "teapot"}
    if given is not None:
        found |= {name: given / path for name, path in GIVEN.items()}
    for name, parts in _made().items():
        path = folder / f"{name.replace(' ', '_')}.glb"
        scene = trimesh.Scene()
        for mesh, material in parts:
            mesh.visual = trimesh.visual.TextureVisuals(material=PBRMaterial(**material))
            scene.add_geometry(mesh)
        scene.export(path)
        found[name] = path
    return found


def _made() -> dict[str, list[tuple[trimesh.Trimesh, dict[str, object]]]]:
    grey = {"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5}
    gold = {"baseColorFactor": [0.95, 0.7, 0.3, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.25}
    white = {"baseColorFactor": [0.85, 0.85, 0.83, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.15}
    red = {"baseColorFactor": [0.75, 0.12, 0.08, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.3}
    green = {"baseColorFactor": [0.3, 0.55, 0.2, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9}
    wood = {"baseColorFactor": [0.6, 0.42, 0.28, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6}
    blue = {"baseColorFactor": [0.35, 0.5, 0.85, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.4}
    f = [
        _moved(box(size), *at)
        for size, at in (((1, 6, 1), (0, 3, 0)), ((3, 1, 1), (1.5, 5.5, 0)), ((2, 1, 1), (1, 3, 0)))
    ]
    rings = [_moved(torus(2.0, 0.5), 0, 0, 0), _turned(torus(2.0, 0.5), 90, (0, 1, 0))]
    firs = [_stood(cone(radius, 1.6, sections=64), 0.7 * step, 0) for step, radius in enumerate((1.4, 1.1, 0.8, 0.5))]
    profile = np.array(
        [[0, 0], [0.8, 0], [1.0, 0.5], [1.3, 1.6], [0.6, 2.8], [0.7, 3.2], [0.6, 3.2], [0.5, 2.8], [0, 0.3]]
    )
    vase = _turned(revolve(profile, sections=128), -90, (1, 0, 0))
    figure = [_stood(capsule(1.6, 0.45), 0.6, 0), _moved(icosphere(4, 0.5), 0, 3.0, 0)]
    limbs = [_stood(capsule(1.2, 0.18), -1.2, x) for x in (-0.3, 0.3)] + [_turned(capsule(2.2, 0.15), 90, (0, 1, 0))]
    limbs[-1].apply_translation((-1.1, 1.6, 0))
    house = [
        (_moved(box((4, 2.5, 3)), 0, 1.25, 0), wood),
        (_roof(), red),
        (_moved(box((0.5, 1.5, 0.5)), 1.2, 3.6, 0.4), grey),
    ]
    return {
        "letter": [(trimesh.util.concatenate(f), grey)],
        "rings": [(part, gold) for part in rings],
        "fir": [(part, green) for part in firs] + [(_stood(cylinder(0.25, 1.0), -0.6, 0), wood)],
        "vase": [(vase, white)],
        "figure": [(part, wood) for part in figure + limbs],
        "house": house,
    } | {
        "balls": [
            (_moved(icosphere(4, 1.0), 2.4 * k, 0.5 * k, -1.5 * k), paint) for k, paint in enumerate((blue, white, red))
        ]
    }


def _roof() -> trimesh.Trimesh:
    points = [(x, y, z) for x in (-2.3, 2.3) for y, z in ((2.5, -1.8), (2.5, 1.8), (4.2, 0.0))]
    return trimesh.convex.convex_hull(np.array(points))


def _moved(mesh: trimesh.Trimesh, x: float, y: float, z: float) -> trimesh.Trimesh:
    return mesh.apply_transform(translation_matrix((x, y, z)))


def _turned(mesh: trimesh.Trimesh, degrees: float, axis: tuple[int, int, int]) -> trimesh.Trimesh:
    return mesh.apply_transform(rotation_matrix(np.radians(degrees), axis))


def _stood(mesh: trimesh.Trimesh, y: float, x: float) -> trimesh.Trimesh:
    """A mesh whose axis is z, upright at a height."""
    return _moved(_turned(mesh, -90, (1, 0, 0)), x, y, 0)
