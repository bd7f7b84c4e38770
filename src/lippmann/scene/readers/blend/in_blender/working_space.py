"""Colours of the file's working space as Rec. 709's, which glTF has: Blender 5 also works in ACEScg and Rec. 2020."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from mathutils import Color

from .glb import Glb

_STRENGTH = "KHR_materials_emissive_strength"
#: NumPy types of accessors that hold colours.
_KINDS = {5121: "u1", 5123: "<u2", 5126: "<f4"}
#: Colours of materials' extensions.
_COLORS = {
    "KHR_materials_sheen": "sheenColorFactor",
    "KHR_materials_specular": "specularColorFactor",
    "KHR_materials_volume": "attenuationColor",
}


def rec709(color: Sequence[float]) -> list[float]:
    """Linear RGB of the working space in Rec. 709; colours beyond its primaries are cut at 0."""
    return [max(channel, 0.0) for channel in Color(color[:3]).from_scene_linear_to_rec709_linear()]


def rec709_from_scene() -> Any:
    """``(3, 3)``: linear RGB of the working space, as rows, times this is that of Rec. 709."""
    return np.array([Color(axis).from_scene_linear_to_rec709_linear() for axis in np.eye(3)], np.float32)


def vertex_colors_to_rec709(glb: Glb) -> None:
    """Bring the colours of a document's vertices from the working space to Rec. 709."""
    matrix = rec709_from_scene()
    if np.allclose(matrix, np.eye(3), atol=1e-4):
        return
    parts = [part for mesh in glb.root.get("meshes", []) for part in mesh["primitives"]]
    for number in {part["attributes"]["COLOR_0"] for part in parts if "COLOR_0" in part["attributes"]}:
        accessor = glb.root["accessors"][number]
        view = glb.root["bufferViews"][accessor["bufferView"]]
        kind = _KINDS[accessor["componentType"]]
        count, width = accessor["count"], int(accessor["type"][-1])
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        colors = np.frombuffer(glb.data, kind, count * width, start).reshape(count, width)
        most = 1.0 if kind == "<f4" else float(np.iinfo(kind).max)
        converted = np.clip(colors[:, :3] / most @ matrix, 0.0, 1.0) * most
        colors[:, :3] = converted if kind == "<f4" else np.rint(converted)


def materials_to_rec709(glb: Glb) -> None:
    """Bring the colours of a document's materials from the working space to Rec. 709."""
    for material in glb.root.get("materials", []):
        extensions: dict[str, Any] = material.get("extensions", {})
        surface = material.get("pbrMetallicRoughness", {})
        if "baseColorFactor" in surface:
            *color, alpha = surface["baseColorFactor"]
            surface["baseColorFactor"] = [*_at_most_one(rec709(color)), alpha]
        for extension, name in _COLORS.items():
            if name in extensions.get(extension, {}):
                extensions[extension][name] = _at_most_one(rec709(extensions[extension][name]))
        if any(material.get("emissiveFactor", ())):
            color = rec709(material["emissiveFactor"])
            strongest = max(*color, 1.0)
            material["emissiveFactor"] = [channel / strongest for channel in color]
            if strongest > 1.0:
                strength = extensions.setdefault(_STRENGTH, {"emissiveStrength": 1.0})
                strength["emissiveStrength"] *= strongest
                material["extensions"] = extensions
                glb.use_extension(_STRENGTH)


def _at_most_one(color: list[float]) -> list[float]:
    return [min(channel, 1.0) for channel in color]
