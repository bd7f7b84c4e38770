"""Cameras, and the light sources of KHR_lights_punctual."""

from __future__ import annotations

import math

from lippmann.scene.readers.gltf.document import Document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.gltf.nodes import rigid
from lippmann.scene.values.description import Camera, Light, Matrix

_FARTHEST = 1e18  # world units
_SMALLEST_CONE = 1e-3  # radians; a thinner one would light nothing


def read_camera(fields: Fields, node: Fields, world: Matrix) -> Camera:
    """The camera on ``node``, whose matrix is ``world``.

    ``extras.focus_distance`` of the camera, else of its node, gives the focus distance in world units,
    ``extras.lens_shift`` of the node :attr:`Camera.shift`; glTF itself has neither. Near and far planes bound no ray
    and are left out.

    Raises
    ------
    SceneError
        A camera of unknown type, or one without extent.
    """
    name = node.text("name") or fields.text("name") or fields.place
    focus, shift = _focus_distance(fields) or _focus_distance(node), _lens_shift(node)
    kind = fields.text("type")
    lens = fields.child(kind) if kind in ("perspective", "orthographic") else None
    if lens is None:
        raise fields.error("type", "a perspective or orthographic camera with its values belongs here")
    if kind == "perspective":
        angle = lens.optional_number("yfov")
        if angle is None or not 0.0 < angle < math.pi:
            raise lens.error("yfov", "it must lie between 0 and pi")
        aspect = lens.optional_number("aspectRatio")
        if aspect is not None and aspect <= 0.0:
            raise lens.error("aspectRatio", "it must be above 0")
        return Camera(name, rigid(world), fov_y=angle, aspect=aspect, focus_distance=focus, shift=shift)
    width, height = (abs(lens.optional_number(key) or 0.0) for key in ("xmag", "ymag"))
    if width == 0.0 or height == 0.0:
        raise lens.error("xmag" if width == 0.0 else "ymag", "it must not be 0")
    return Camera(name, rigid(world), height=2.0 * height, aspect=width / height, focus_distance=focus, shift=shift)


def _focus_distance(fields: Fields) -> float | None:
    value = _extra(fields, "focus_distance")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value) if 0.0 < value < _FARTHEST else None


def _lens_shift(node: Fields) -> tuple[float, float]:
    value = _extra(node, "lens_shift")
    numbers = value if isinstance(value, list) and len(value) == 2 else [0.0, 0.0]
    if not all(isinstance(each, float) and abs(each) < _FARTHEST for each in numbers):
        return 0.0, 0.0
    return numbers[0], numbers[1]


def _extra(fields: Fields, name: str) -> object:
    """A value of the extras, which may hold anything: one of another kind than ours is another program's."""
    extras = fields.values.get("extras")
    return extras.get(name) if isinstance(extras, dict) else None


def read_light(node: Fields, world: Matrix, document: Document) -> Light | None:
    """The light source on ``node``, whose matrix is ``world``; None without one.

    glTF measures light in candela and lux. Their numbers are taken as W/sr and W/m^2: the scene's other radiances
    (emission, the environment) have no absolute scale either, and exporters write numbers of that size.

    Raises
    ------
    SceneError
        A light that does not exist or is of unknown type, or an impossible cone.
    """
    extension = node.extension("KHR_lights_punctual")
    if extension is None:
        return None
    shared = document.root.extension("KHR_lights_punctual")
    lights = [] if shared is None else shared.children("lights")
    index = extension.integer("light")
    if index >= len(lights):
        raise extension.error("light", f"there are {len(lights)} lights, counted from 0")
    fields = lights[index]
    red, green, blue = fields.numbers("color", 3) or (1.0, 1.0, 1.0)
    if min(red, green, blue) < 0.0:
        raise fields.error("color", "it must not be negative")
    intensity = fields.number("intensity", 1.0, minimum=0.0)
    if fields.has("range"):
        document.notes.add("light falls with the square of the distance, beyond its range, too", fields.place)
    color = (red * intensity, green * intensity, blue * intensity)
    name = node.text("name") or fields.text("name") or fields.place
    kind = fields.text("type")
    if kind == "point":
        return Light("point", color, rigid(world), name=name)
    if kind == "directional":
        return Light("directional", color, rigid(world), name=name)
    if kind != "spot":
        raise fields.error("type", "point, spot or directional belongs here")
    cone = fields.child("spot") or Fields({}, fields.place, fields.file)
    # A right angle written in single precision is a little more than one.
    outer = min(cone.number("outerConeAngle", math.pi / 4, minimum=_SMALLEST_CONE, maximum=1.5708), math.pi / 2)
    inner = min(cone.number("innerConeAngle", 0.0, minimum=0.0), outer)
    return Light("spot", color, rigid(world), inner_angle=inner, outer_angle=outer, name=name)
