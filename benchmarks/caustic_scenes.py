"""Small scenes of light that mirrors and glass throw, as Mitsuba dictionaries; all lie within about one unit of 0."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hard_scenes import DOWN, FRONT, SceneDict, diffuse, lamp, quad, rgb, room


def curved_mirrors() -> SceneDict:
    """Bent sheets of metal on a table, under a small bright ball."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    metal = {"type": "twosided", "bsdf": {"type": "conductor", "material": "Al"}}
    return room() | {
        "bowl": {
            "type": "cylinder",
            "p0": [-0.3, -1, 0],
            "p1": [-0.3, -0.6, 0],
            "radius": 0.5,
            "bsdf": metal,
        },
        "dish": {
            "type": "disk",
            "to_world": place().translate([0.7, -0.3, -0.4]).rotate([0, 1, 0], -50).rotate([1, 0, 0], -20).scale(0.4),
            "bsdf": metal,
        },
        "ball": {"type": "sphere", "center": [0.75, -0.75, 0.4], "radius": 0.25, "bsdf": metal},
        "light": {"type": "sphere", "center": [0.4, 0.9, 0.5], "radius": 0.03, "emitter": lamp(700)},
    }


def mirror_balls() -> SceneDict:
    """A heap of small mirror balls, under a small light and a window."""
    random = np.random.default_rng(8)
    balls = {}
    for number in range(40):
        x, z = random.uniform(-0.8, 0.8, 2)
        y = -0.86 + 0.26 * int(random.integers(0, 3))
        balls[f"ball {number}"] = {
            "type": "sphere",
            "center": [float(x), float(y), float(z)],
            "radius": 0.14,
            "bsdf": {"type": "conductor", "material": "Ag"},
        }
    return (
        room()
        | balls
        | {
            "light": {"type": "sphere", "center": [-0.4, 0.9, 0.5], "radius": 0.04, "emitter": lamp(300)},
            "window": quad((0.4, 1.19, 0), DOWN, 0.25, emitter=lamp(8)),
        }
    )


def jewel() -> SceneDict:
    """A cut stone on dark cloth, under a spot without size."""
    import mitsuba as mi
    import trimesh

    random = np.random.default_rng(3)
    angle = np.linspace(0, 2 * np.pi, 9)[:-1]
    crown = np.stack([0.3 * np.cos(angle + 0.39), np.full(8, 0.25), 0.3 * np.sin(angle + 0.39)], axis=1)
    girdle = np.stack([0.5 * np.cos(angle), np.zeros(8), 0.5 * np.sin(angle)], axis=1)
    corners = np.concatenate([crown, girdle, [[0, -0.5, 0]]]) + random.normal(0, 0.004, (17, 3))
    hull = trimesh.Trimesh(corners, process=False).convex_hull
    hull.unmerge_vertices()
    stone = mi.Mesh("stone", len(hull.vertices), len(hull.faces), props=_stone_properties())
    parameters = mi.traverse(stone)
    parameters["vertex_positions"] = np.add(hull.vertices, [0, -0.45, 0.1]).astype(np.float32).ravel()
    parameters["faces"] = np.asarray(hull.faces, np.uint32).ravel()
    parameters.update()
    spot = mi.ScalarTransform4f().look_at(origin=[-1.2, 1.8, 1.5], target=[0, -0.4, 0.1], up=[0, 1, 0])
    return {
        "type": "scene",
        "cloth": quad((0, -1, 0), ([1, 0, 0], -90.0), 2.5, bsdf=diffuse(0.25, 0.05, 0.08)),
        "back": quad((0, 0, -1.2), FRONT, 2.5, bsdf=diffuse(0.3)),
        "stone": stone,
        "spot": {"type": "spot", "to_world": spot, "intensity": rgb(60), "cutoff_angle": 25},
        "sky": {"type": "constant", "radiance": rgb(0.1)},
    }


def _stone_properties() -> object:
    import mitsuba as mi

    properties = mi.Properties()
    properties["face_normals"] = True
    properties["bsdf"] = mi.load_dict({"type": "dielectric", "int_ior": 2.0})
    return properties


def sunlit_water() -> SceneDict:
    """Waves over a tiled floor, under the sun and the sky."""
    import mitsuba as mi

    side = 48
    x, z = np.meshgrid(np.linspace(-1.3, 1.3, side), np.linspace(-1.3, 1.3, side))
    y = -0.35 + 0.03 * np.sin(9 * x + 2 * z) + 0.025 * np.sin(4 * x - 8 * z + 1)
    corner = np.arange((side - 1) * side).reshape(side - 1, side)[:, :-1].ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + side, corner + 1], axis=1),
            np.stack([corner + 1, corner + side, corner + side + 1], axis=1),
        ]
    )
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "dielectric", "int_ior": 1.33})
    surface = mi.Mesh("water", side * side, len(faces), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(surface)
    parameters["vertex_positions"] = np.stack([x, y, z], axis=-1).astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    tiles = {
        "type": "checkerboard",
        "color0": rgb(0.3, 0.55, 0.6),
        "color1": rgb(0.5, 0.7, 0.72),
        "to_uv": mi.ScalarTransform3f().scale([8, 8]),
    }
    floor = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": tiles}}
    return {
        "type": "scene",
        "floor": quad((0, -1, 0), ([1, 0, 0], -90.0), 1.3, bsdf=floor),
        "back": quad((0, -0.2, -1.3), FRONT, [1.3, 0.8, 1], bsdf=floor),
        "water": surface,
        "sun": {"type": "directional", "direction": [0.3, -1, -0.25], "irradiance": rgb(3.0, 2.8, 2.4)},
        "sky": {"type": "constant", "radiance": rgb(0.2, 0.25, 0.35)},
    }


def chrome_ring() -> SceneDict:
    """A ring on a table with its heart-shaped curve of light, under a small light."""
    chrome = {"type": "twosided", "bsdf": {"type": "conductor", "material": "Cr"}}
    return {
        "type": "scene",
        "table": quad((0, -0.8, 0), ([1, 0, 0], -90.0), 2, bsdf=diffuse(0.6, 0.5, 0.4)),
        "back": quad((0, 0, -1.2), FRONT, 2, bsdf=diffuse(0.5)),
        "ring": {"type": "cylinder", "p0": [0, -0.8, 0], "p1": [0, -0.5, 0], "radius": 0.6, "bsdf": chrome},
        "light": {"type": "sphere", "center": [-1.0, 0.8, 0.8], "radius": 0.03, "emitter": lamp(800)},
        "sky": {"type": "constant", "radiance": rgb(0.1)},
    }


CAUSTIC_SCENES: dict[str, Callable[[], SceneDict]] = {
    "curved_mirrors": curved_mirrors,
    "mirror_balls": mirror_balls,
    "jewel": jewel,
    "sunlit_water": sunlit_water,
    "chrome_ring": chrome_ring,
}
