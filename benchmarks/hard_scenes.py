"""Small scenes that make an estimate of the error hard, as Mitsuba dictionaries; all lie within about one unit of 0."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

SceneDict = dict[str, Any]


def rgb(*values: float) -> SceneDict:
    return {"type": "rgb", "value": list(values) if len(values) > 1 else values[0]}


def diffuse(*values: float) -> SceneDict:
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(*values)}}


def quad(center: tuple[float, float, float], turn: tuple[list[float], float], size: Any, **more: Any) -> SceneDict:
    import mitsuba as mi

    pose = mi.ScalarTransform4f().translate(list(center)).rotate(*turn).scale(size)
    return {"type": "rectangle", "to_world": pose, **more}


def lamp(radiance: float) -> SceneDict:
    return {"type": "area", "radiance": rgb(radiance)}


FRONT, UP, DOWN = ([1, 0, 0], 0.0), ([1, 0, 0], -90.0), ([1, 0, 0], 90.0)
RIGHT, LEFT = ([0, 1, 0], 90.0), ([0, 1, 0], -90.0)


def room(*, ceiling: bool = True, back: SceneDict | None = None) -> SceneDict:
    """Walls of a box open to the front."""
    walls = {
        "type": "scene",
        "floor": quad((0, -1, 0), UP, 1.5, bsdf=diffuse(0.7)),
        "back": quad((0, 0, -1.2), FRONT, 1.5, bsdf=back or diffuse(0.7)),
        "left": quad((-1.2, 0, 0), RIGHT, 1.5, bsdf=diffuse(0.7, 0.15, 0.1)),
        "right": quad((1.2, 0, 0), LEFT, 1.5, bsdf=diffuse(0.15, 0.6, 0.15)),
    }
    if ceiling:
        walls["ceiling"] = quad((0, 1.2, 0), DOWN, 1.5, bsdf=diffuse(0.7))
    return walls


def mixed() -> SceneDict:
    """Diffuse, rough metal, mirror and glass in a lit box."""
    return room() | {
        "metal": {"type": "sphere", "center": [-0.5, -0.6, 0], "radius": 0.4, "bsdf": {"type": "roughconductor"}},
        "glass": {"type": "sphere", "center": [0.35, -0.6, 0.3], "radius": 0.4, "bsdf": {"type": "dielectric"}},
        "mirror": {"type": "sphere", "center": [0.5, 0.3, -0.6], "radius": 0.4, "bsdf": {"type": "conductor"}},
        "lamp": quad((0, 1.19, 0), DOWN, 0.3, emitter=lamp(12)),
    }


def mirrors() -> SceneDict:
    """Two facing mirrors with a lamp and a ball between them."""
    return room(ceiling=False) | {
        "left": quad((-0.8, 0, 0), RIGHT, 1.5, bsdf={"type": "conductor", "specular_reflectance": rgb(0.9)}),
        "right": quad((0.8, 0, 0), LEFT, 1.5, bsdf={"type": "conductor", "specular_reflectance": rgb(0.9)}),
        "ball": {"type": "sphere", "center": [0, -0.5, -0.2], "radius": 0.4, "bsdf": diffuse(0.2, 0.4, 0.8)},
        "lamp": {"type": "sphere", "center": [0.3, 0.5, 0], "radius": 0.08, "emitter": lamp(30)},
    }


def crack() -> SceneDict:
    """A closed room lit from outside through a slit in its ceiling."""
    return room(ceiling=False) | {
        "lid a": quad((-0.8, 1.2, 0), DOWN, [0.78, 2, 1], bsdf=diffuse(0.7)),
        "lid b": quad((0.8, 1.2, 0), DOWN, [0.78, 2, 1], bsdf=diffuse(0.7)),
        "door": quad((0, 0, 3), FRONT, 3, bsdf=diffuse(0.5)),
        "ball": {"type": "sphere", "center": [0.5, -0.6, 0], "radius": 0.4, "bsdf": diffuse(0.7, 0.6, 0.2)},
        "lamp": quad((0, 2.2, 0), DOWN, 1.0, emitter=lamp(40)),
    }


def water() -> SceneDict:
    """A ball of coloured glass, under a small bright lamp that only caustic paths reach through it."""
    return room() | {
        "glass": {
            "type": "sphere",
            "center": [0, -0.4, 0.1],
            "radius": 0.5,
            "bsdf": {"type": "dielectric", "int_ior": 1.33, "specular_transmittance": rgb(0.9, 0.5, 0.3)},
        },
        "lamp": {"type": "sphere", "center": [0.3, 0.9, 0.2], "radius": 0.04, "emitter": lamp(400)},
    }


def stripes() -> SceneDict:
    """A fine striped texture under the sharp shadow of a small lamp."""
    import mitsuba as mi

    texels = np.zeros((1, 64, 3), dtype=np.float32)
    texels[:, ::2] = 0.9
    texels[:, 1::2] = 0.05
    texture = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(texels),
        "raw": True,
        "filter_type": "nearest",
        "to_uv": mi.ScalarTransform3f().scale([3, 1]),
    }
    striped = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": texture}}
    return room(ceiling=False, back=striped) | {
        "bar": quad((0.1, 0.1, -0.5), ([0, 0, 1], 30.0), [0.1, 1, 1], bsdf=diffuse(0.5)),
        "sun": {"type": "point", "position": [1, 2, 4], "intensity": rgb(20)},
    }


def canopy() -> SceneDict:
    """A few thousand small leaves over a floor, under sun and sky."""
    import mitsuba as mi

    random = np.random.default_rng(5)
    count = 3000
    centers = random.uniform([-1.2, -0.2, -1], [1.2, 1.0, 0.6], (count, 3))
    corners = centers[:, None] + random.normal(0, 0.05, (count, 3, 3))
    mesh = mi.Mesh("leaves", 3 * count, count, props=_leaf_properties())
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = corners.astype(np.float32).ravel()
    parameters["faces"] = np.arange(3 * count, dtype=np.uint32)
    parameters.update()
    return {
        "type": "scene",
        "leaves": mesh,
        "floor": quad((0, -1, 0), UP, 2, bsdf=diffuse(0.5, 0.4, 0.3)),
        "sun": {"type": "directional", "direction": [-0.3, -1, -0.2], "irradiance": rgb(3)},
        "sky": {"type": "constant", "radiance": rgb(0.2, 0.3, 0.5)},
    }


def _leaf_properties() -> Any:
    import mitsuba as mi

    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(diffuse(0.2, 0.6, 0.1))
    return properties


def hidden_lamp() -> SceneDict:
    """A diffuse room whose only light is a very small lamp found by chance alone, being behind frosted glass."""
    return room() | {
        "shade": {
            "type": "sphere",
            "center": [0, 0.6, 0],
            "radius": 0.3,
            "bsdf": {"type": "roughdielectric", "alpha": 0.3},
        },
        "lamp": {"type": "sphere", "center": [0, 0.6, 0], "radius": 0.12, "emitter": lamp(60)},
        "sky": {"type": "constant", "radiance": rgb(0.15)},
    }


HARD_SCENES: dict[str, Callable[[], SceneDict]] = {
    "mixed": mixed,
    "mirrors": mirrors,
    "crack": crack,
    "water": water,
    "stripes": stripes,
    "canopy": canopy,
    "hidden_lamp": hidden_lamp,
}
