"""Scenes whose mirrors and glass are small in a large world; lengths in metres, +y up."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def _description(parts: list[tuple[Any, Any, Any]], lights: list[Any], eye: Any, target: Any, sky: float = 0.2) -> Any:
    """Of (trimesh, material, places ``(k, 3)``) and lights, seen by a camera whose focus lies at ``target``."""
    from lippmann.scene.values.description import Camera, Environment, Instance, Mesh, SceneDescription

    meshes = [
        Mesh("", mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32), number)
        for number, (mesh, _, _) in enumerate(parts)
    ]
    instances = []
    for number, (_, _, at) in enumerate(parts):
        places = np.tile(np.eye(4), (len(at), 1, 1))
        places[:, :3, 3] = at
        instances += [Instance(number, place) for place in places]
    away = float(np.linalg.norm(np.subtract(eye, target)))
    camera = Camera("eye", _look(eye, target), fov_y=np.radians(40), focus_distance=away)
    return SceneDescription(
        "world",
        meshes=meshes,
        materials=[material for _, material, _ in parts],
        instances=instances,
        lights=lights,
        cameras=[camera],
        environment=Environment(np.full((2, 4, 3), sky, np.float32)),
    )


def _look(eye: Any, target: Any) -> Any:
    """World from camera: its own -z points from ``eye`` to ``target``."""
    eye, target = np.array(eye, float), np.array(target, float)
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
    return pose


def _ground(half: float) -> Any:
    import trimesh

    return trimesh.creation.box((2 * half, 1, 2 * half)).apply_translation((0, -0.5, 0))


def _matt(red: float, green: float, blue: float) -> Any:
    from lippmann.scene.values.description import Material

    return Material("matt", base_color=(red, green, blue), specular=0.0)


def _chrome() -> Any:
    from lippmann.scene.values.description import Material

    return Material("chrome", base_color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)


def _glass() -> Any:
    from lippmann.scene.values.description import Material

    return Material("glass", transmission=1.0, roughness=0.0, ior=1.5, thickness=1.0)


def _point_light(at: Any, intensity: float, radius: float = 0.0) -> Any:
    from lippmann.scene.values.description import Light

    place = np.eye(4)
    place[:3, 3] = at
    return Light("point", (intensity,) * 3, place, radius=radius)


def _sun(irradiance: float = 3.0) -> Any:
    from lippmann.scene.values.description import Light

    return Light("directional", (irradiance,) * 3, _look((0.4, 1.0, 0.3), (0, 0, 0)))


def bottle_on_a_plain() -> Any:
    """One glass ball on a plain that is seen to the horizon, in the sun."""
    import trimesh

    ball = trimesh.creation.icosphere(4, 0.5)
    parts = [(_ground(400), _matt(0.5, 0.45, 0.35), [(0, 0, 0)]), (ball, _glass(), [(0, 0.5, 0)])]
    return _description(parts, [_sun()], (0, 2.5, 8), (0, 0.3, 0))


def city() -> Any:
    """Blocks on a plain with chrome balls on their roofs, in the sun."""
    import trimesh

    random = np.random.default_rng(4)
    x, z = (part.ravel() for part in np.meshgrid(np.arange(-90, 91, 20.0), np.arange(-90, 91, 20.0)))
    heights = random.uniform(6, 30, len(x))
    blocks = [
        trimesh.creation.box((9, h, 9)).apply_translation((a, h / 2, b)) for a, h, b in zip(x, heights, z, strict=True)
    ]
    parts = [
        (_ground(500), _matt(0.4, 0.4, 0.4), [(0, 0, 0)]),
        (trimesh.util.concatenate(blocks), _matt(0.6, 0.5, 0.4), [(0, 0, 0)]),
        (trimesh.creation.icosphere(3, 0.6), _chrome(), np.stack([x, heights + 0.6, z], axis=1)),
    ]
    return _description(parts, [_sun()], (20, 45, 60), (0, 15, 0))


def lanterns() -> Any:
    """Point lights in globes of glass: all that they light comes through glass, and most near them."""
    import trimesh

    at = np.array([(x, 2.0, z) for x in (-20, 0, 20) for z in (-20, 0, 20)], float)
    posts = trimesh.util.concatenate(
        [trimesh.creation.box((0.2, 1.7, 0.2)).apply_translation((x, 0.85, z)) for x, _, z in at]
    )
    outer, inner = trimesh.creation.icosphere(3, 0.3), trimesh.creation.icosphere(3, 0.28)
    inner.invert()
    globe = trimesh.util.concatenate([outer, inner])
    parts = [
        (_ground(300), _matt(0.5, 0.5, 0.5), [(0, 0, 0)]),
        (trimesh.util.concatenate(posts), _matt(0.3, 0.3, 0.3), [(0, 0, 0)]),
        (globe, _glass(), at),
    ]
    return _description(parts, [_point_light(place, 30.0) for place in at], (4, 6, 26), (0, 1, 0), 0.02)


def chandelier() -> Any:
    """Two hundred glass drops about a small light in a large hall."""
    import trimesh

    random = np.random.default_rng(6)
    way = random.normal(size=(200, 3))
    at = (0, 17, 0) + 1.2 * way / np.linalg.norm(way, axis=1, keepdims=True)
    hall = trimesh.creation.box((80, 30, 80))
    hall.invert()
    drops = trimesh.util.concatenate([trimesh.creation.icosphere(2, 0.08).apply_translation(place) for place in at])
    parts = [(hall, _matt(0.7, 0.68, 0.6), [(0, 15, 0)]), (drops, _glass(), [(0, 0, 0)])]
    return _description(parts, [_point_light((0, 17, 0), 900.0, 0.1)], (0, 12, 38), (0, 12, 0), 0.0)


def table_in_a_hall() -> Any:
    """A chrome ball and a glass ball on a table: one throws light all over a large hall, the other onto one spot."""
    import trimesh

    hall = trimesh.creation.box((300, 80, 300))
    hall.invert()
    ball = trimesh.creation.icosphere(4, 0.12)
    parts = [
        (hall, _matt(0.7, 0.68, 0.6), [(0, 39, 0)]),
        (trimesh.creation.box((1.6, 0.05, 1.0)), _matt(0.6, 0.45, 0.3), [(0, -0.025, 0)]),
        (ball, _chrome(), [(0.25, 0.12, 0)]),
        (ball, _glass(), [(-0.2, 0.12, 0.1)]),
    ]
    return _description(parts, [_point_light((-0.9, 1.2, 0.2), 6.0, 0.02)], (0, 0.7, 1.3), (0, 0.05, 0), 0.0)


def marbles_and_a_tower() -> Any:
    """Glass marbles on the ground before the eye, and far off a tower of mirrors that throws the sun over the land."""
    import trimesh

    random = np.random.default_rng(9)
    at = [(x, 0.02, z) for x, z in random.uniform(-0.3, 0.3, (12, 2))]
    tower = trimesh.creation.cylinder(15, 90, sections=96)
    tower.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    parts = [
        (_ground(400), _matt(0.5, 0.45, 0.35), [(0, 0, 0)]),
        (trimesh.creation.icosphere(3, 0.02), _glass(), at),
        (tower, _chrome(), [(-60, 45, -160)]),
    ]
    return _description(parts, [_sun()], (0, 0.5, 1.0), (0, 0.1, 0))


WORLD_SCENES: dict[str, Callable[[], Any]] = {
    "bottle on a plain": bottle_on_a_plain,
    "city": city,
    "lanterns": lanterns,
    "chandelier": chandelier,
    "table in a hall": table_in_a_hall,
    "marbles and a tower": marbles_and_a_tower,
}
