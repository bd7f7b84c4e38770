"""Values that Blender's exporter leaves out of a glTF document, or changes: lights, focus, and the unit of length."""

from __future__ import annotations

import math
import struct
from typing import Any

from .glb import Glb

#: Corners of the polygon in place of a disc.
_AROUND = 32

_PUNCTUAL = "KHR_lights_punctual"
_STRENGTH = "KHR_materials_emissive_strength"
_SPECULAR = "KHR_materials_specular"
_VOLUME = "KHR_materials_volume"
_IOR = "KHR_materials_ior"
_UNLIT = "KHR_materials_unlit"
#: Index of refraction of materials that tell none.
_PLAIN_INDEX = 1.5


def add_lights(glb: Glb, lights: dict[str, dict[str, Any]], unit: float) -> None:
    """Put light sources on the nodes that bear the names of their objects.

    Parameters
    ----------
    lights:
        By the object's name, ``kind``: "point", "spot", "directional" or "area"; ``color``, linear RGB; ``strength``:
        W/sr, W/m^2 ("directional") or W/(m^2 sr) ("area"); ``inner`` and ``outer`` half-angles of a spot's cone,
        radians; ``width`` and ``height`` of an area, ``is_round``.
    unit:
        Metres to a unit of length: what falls with the square of the distance grows with it.
    """
    extensions = glb.root.get("extensions", {})
    extensions.pop(_PUNCTUAL, None)
    punctual: list[dict[str, Any]] = []
    for node in glb.root.get("nodes", []):
        _drop_light(node)
        light = lights.get(node.get("name", ""))
        if light is None or "mesh" in node or "camera" in node:
            continue
        if light["kind"] == "area":
            node["mesh"] = _area_mesh(glb, node["name"], light)
            continue
        node.setdefault("extensions", {})[_PUNCTUAL] = {"light": len(punctual)}
        punctual.append(_punctual(node["name"], light, unit))
    required = [name for name in glb.root.get("extensionsRequired", []) if name != _PUNCTUAL]
    used = [name for name in glb.root.get("extensionsUsed", []) if name != _PUNCTUAL]
    if punctual:
        extensions[_PUNCTUAL] = {"lights": punctual}
        used.append(_PUNCTUAL)
    for key, value in (("extensions", extensions), ("extensionsUsed", used), ("extensionsRequired", required)):
        glb.root.pop(key, None)
        if value:
            glb.root[key] = value


def add_default_material(glb: Glb) -> None:
    """Give faces without a material that of Cycles, a dull grey; glTF's own is white metal."""
    bare = [part for mesh in glb.root.get("meshes", []) for part in mesh["primitives"] if "material" not in part]
    if bare:
        surface = {"baseColorFactor": [0.8, 0.8, 0.8, 1], "metallicFactor": 0, "roughnessFactor": 1}
        dull = {"name": "default", "pbrMetallicRoughness": surface, "extensions": {_SPECULAR: {"specularFactor": 0}}}
        glb.use_extension(_SPECULAR)
        index = glb.append("materials", dull)
        for part in bare:
            part["material"] = index


def add_interiors(glb: Glb) -> None:
    """Let what transmits light be solid, as it is in Cycles: glTF takes it for thin walls where none says its depth."""
    for material in glb.root.get("materials", []):
        extensions = material.get("extensions", {})
        if "KHR_materials_transmission" in extensions and _VOLUME not in extensions:
            extensions[_VOLUME] = {"thicknessFactor": 1.0}
            glb.use_extension(_VOLUME)


def add_indices(glb: Glb, indices: dict[str, float]) -> None:
    """Give materials, by their names, their index of refraction: the exporter leaves it out of plain surfaces."""
    for material in glb.root.get("materials", []):
        index = indices.get(material.get("name", ""), _PLAIN_INDEX)
        if index != _PLAIN_INDEX and not material.get("extensions", {}).keys() & {_IOR, _UNLIT}:
            material.setdefault("extensions", {})[_IOR] = {"ior": max(index, 1.0)}
            glb.use_extension(_IOR)


def add_focus(glb: Glb, distances: dict[str, float], unit: float) -> None:
    """Give cameras, by their objects' names, the distance of their focus."""
    for node in glb.root.get("nodes", []):
        if "camera" in node and node.get("name") in distances:
            node.setdefault("extras", {})["focus_distance"] = distances[node["name"]] * unit


def set_frames(glb: Glb, frames: dict[str, tuple[float, ...]], unit: float) -> None:
    """Give cameras, by their objects' names, what their pictures hold; see :func:`.lights.camera_frames`."""
    for node in glb.root.get("nodes", []):
        if "camera" not in node or node.get("name") not in frames:
            continue
        lens = glb.root["cameras"][node["camera"]]
        scale = unit if lens["type"] == "orthographic" else 1.0
        x, y, half_width, half_height = (value * scale for value in frames[node["name"]])
        if lens["type"] == "orthographic":
            lens["orthographic"] |= {"xmag": half_width, "ymag": half_height}
        else:
            lens["perspective"] |= {"yfov": 2.0 * math.atan(half_height), "aspectRatio": half_width / half_height}
        if x or y:
            node.setdefault("extras", {})["lens_shift"] = [x, y]


def leave_out_unseen(glb: Glb, names: set[str], remark: Any) -> None:
    """Take the meshes of objects that cameras do not see off their nodes, unless they glow."""
    for node in glb.root.get("nodes", []):
        if "mesh" not in node or node.get("name") not in names:
            continue
        parts = glb.root["meshes"][node["mesh"]]["primitives"]
        materials = [glb.root["materials"][part["material"]] for part in parts if "material" in part]
        if any(any(material.get("emissiveFactor", ())) for material in materials):
            remark(f"object '{node['name']}': cameras do not see it in Blender; it glows, and is shown")
        else:
            del node["mesh"]
            remark(f"object '{node['name']}': cameras do not see it: it is left out, and so are its shadows")


def leave_out(glb: Glb, names: set[str], instancers: set[str]) -> None:
    """Take the meshes off the nodes of objects that no render of the view layer shows.

    Parameters
    ----------
    names:
        Of those objects. Their nodes stay, as others may hang on them.
    instancers:
        Names of objects that show a collection: what stands below their nodes is shown, whatever its own is.
    """
    nodes = glb.root.get("nodes", [])
    waiting = [index for scene in glb.root.get("scenes", []) for index in scene.get("nodes", [])]
    while waiting:
        node = nodes[waiting.pop()]
        name = node.get("name", "")
        if name in names:
            node.pop("mesh", None)
        elif name in instancers:
            continue
        waiting += node.get("children", [])


def scale_to_metres(glb: Glb, unit: float) -> None:
    """Bring a document whose unit of length is ``unit`` metres to metres."""
    if unit == 1.0:
        return
    for scene in glb.root.get("scenes", []):
        children = scene.get("nodes", [])
        if children:
            scene["nodes"] = [glb.append("nodes", {"name": "metres", "scale": [unit] * 3, "children": children})]


def _drop_light(node: dict[str, Any]) -> None:
    extensions = node.get("extensions", {})
    extensions.pop(_PUNCTUAL, None)
    if not extensions:
        node.pop("extensions", None)


def _punctual(name: str, light: dict[str, Any], unit: float) -> dict[str, Any]:
    scale = 1.0 if light["kind"] == "directional" else unit**2
    strongest = max(light["color"]) or 1.0
    written: dict[str, Any] = {
        "name": name,
        "type": light["kind"],
        "color": [channel / strongest for channel in light["color"]],
        "intensity": light["strength"] * strongest * scale,
    }
    if light["kind"] == "spot":
        written["spot"] = {"innerConeAngle": light["inner"], "outerConeAngle": light["outer"]}
    return written


def _area_mesh(glb: Glb, name: str, light: dict[str, Any]) -> int:
    """A surface that glows along the node's -z, and is black otherwise."""
    strongest = max(light["color"]) or 1.0
    material = {
        "name": name,
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0, "roughnessFactor": 1},
        "emissiveFactor": [channel / strongest for channel in light["color"]],
        "extensions": {
            _STRENGTH: {"emissiveStrength": light["strength"] * strongest},
            _SPECULAR: {"specularFactor": 0},
        },
    }
    glb.use_extension(_STRENGTH)
    glb.use_extension(_SPECULAR)
    points = _outline(light["width"] / 2.0, light["height"] / 2.0, is_round=light["is_round"])
    # Counter-clockwise as seen from where it shines.
    faces = [index for corner in range(1, len(points) - 1) for index in (0, corner + 1, corner)]
    positions = struct.pack(f"<{3 * len(points)}f", *(value for x, y in points for value in (x, y, 0.0)))
    xs, ys = zip(*points, strict=True)
    place = {
        "bufferView": glb.add_view(positions),
        "componentType": 5126,
        "count": len(points),
        "type": "VEC3",
        "min": [min(xs), min(ys), 0.0],
        "max": [max(xs), max(ys), 0.0],
    }
    indices = {
        "bufferView": glb.add_view(struct.pack(f"<{len(faces)}H", *faces)),
        "componentType": 5123,
        "count": len(faces),
        "type": "SCALAR",
    }
    primitive = {
        "attributes": {"POSITION": glb.append("accessors", place)},
        "indices": glb.append("accessors", indices),
        "material": glb.append("materials", material),
    }
    # Blender's cameras do not see such a light: displays are fitted to what else there is.
    return glb.append("meshes", {"name": name, "primitives": [primitive], "extras": {"fitted": False}})


def _outline(x: float, y: float, *, is_round: bool) -> list[tuple[float, float]]:
    """Corners of a rectangle, or of a polygon of an ellipse's area, counter-clockwise seen from +z."""
    if not is_round:
        return [(-x, -y), (x, -y), (x, y), (-x, y)]
    step = 2.0 * math.pi / _AROUND
    # A regular polygon in a circle of radius r has the area n/2 r^2 sin(2 pi / n).
    grown = math.sqrt(step / math.sin(step))
    return [(x * grown * math.cos(k * step), y * grown * math.sin(k * step)) for k in range(_AROUND)]
