"""Colours of the file's working space as Rec. 709's, which glTF has: Blender 5 also works in ACEScg and Rec. 2020."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mathutils import Color

from .glb import Glb

_STRENGTH = "KHR_materials_emissive_strength"
#: Colours of materials' extensions.
_COLORS = {
    "KHR_materials_sheen": "sheenColorFactor",
    "KHR_materials_specular": "specularColorFactor",
    "KHR_materials_volume": "attenuationColor",
}


def rec709(color: Sequence[float]) -> list[float]:
    """Linear RGB of the working space in Rec. 709; colours beyond its primaries are cut at 0."""
    return [max(channel, 0.0) for channel in Color(color[:3]).from_scene_linear_to_rec709_linear()]


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
