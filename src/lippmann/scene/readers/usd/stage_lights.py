"""Records of light sources and cameras."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, UsdLux

from lippmann.scene.readers.usd.records import Record
from lippmann.scene.readers.usd.stage_shading import asset_record

#: Inputs of each type of light source, besides those that all have.
_INPUTS = {
    "DistantLight": ("angle",),
    "SphereLight": ("radius",),
    "DiskLight": ("radius",),
    "RectLight": ("width", "height"),
    "CylinderLight": ("radius", "length"),
    "DomeLight": (),
    "DomeLight_1": (),
    "Mesh": (),
}


#: Properties of a light source that are not read: attributes, and relationships.
_IGNORED = (
    *("inputs:diffuse", "inputs:specular"),
    *("inputs:shadow:enable", "inputs:shadow:color", "inputs:shadow:distance", "inputs:shadow:falloff"),
    *("inputs:shaping:ies:file", "inputs:shaping:focus"),
)
_LINKS = ("lightLink", "shadowLink")
_IGNORED_TARGETS = (
    "light:filters",
    *(f"collection:{link}:{end}" for link in _LINKS for end in ("includes", "excludes")),
)

#: Stops of a camera's exposure beyond which it is no camera's.
_MOST_STOPS = 32


def light_record(prim: Usd.Prim, world: NDArray[np.float64], time: Usd.TimeCode, notes: dict[str, None]) -> Record:
    """A light source of a stage; of a type that is not read, a record without ``kind``, and a note."""
    kind = str(prim.GetTypeName())
    if kind not in _INPUTS:
        notes[f"light sources of type {kind} are not read"] = None
        return {"kind": None}

    def value(name: str, default: Any) -> Any:
        stored = prim.GetAttribute(name).Get(time) if prim.HasAttribute(name) else None
        return default if stored is None else stored

    color = Gf.Vec3f(value("inputs:color", Gf.Vec3f(1.0)))
    if value("inputs:enableColorTemperature", False):
        warm = UsdLux.BlackbodyTemperatureAsRgb(value("inputs:colorTemperature", 6500.0))
        color = Gf.CompMult(color, Gf.Vec3f(warm))
    record: Record = {
        "kind": kind,
        "name": str(prim.GetPath()),
        "world": world.ravel().tolist(),
        "color": [float(number) for number in color],
        "strength": float(value("inputs:intensity", 1.0)) * 2.0 ** float(value("inputs:exposure", 0.0)),
        "normalize": bool(value("inputs:normalize", False)),
        "is_point": bool(value("treatAsPoint", False)),
        "cone": float(value("inputs:shaping:cone:angle", 90.0)),
        "softness": float(value("inputs:shaping:cone:softness", 0.0)),
        "material": str(value("light:materialSyncMode", "materialGlowTintsLight")),
        "pole": str(value("poleAxis", "Y")),
        "format": str(value("inputs:texture:format", "automatic")),
        **{name: float(value(f"inputs:{name}", 1.0)) for name in _INPUTS[kind]},
    }
    texture = prim.GetAttribute("inputs:texture:file")
    path = texture.Get(time) if texture else None
    if path is not None and path.path:
        record["texture"] = asset_record(texture, path, time)
    ignored = [name for name in _IGNORED if _is_changed(prim, name, time)]
    for name in _IGNORED_TARGETS:
        if prim.HasRelationship(name) and prim.GetRelationship(name).HasAuthoredTargets():
            ignored.append(name)
    if ignored:
        notes[f"{prim.GetPath()}: {', '.join(ignored)} not honoured"] = None
    return record


def camera_record(
    camera: UsdGeom.Camera, world: NDArray[np.float64], time: Usd.TimeCode, notes: dict[str, None]
) -> Record:
    """A camera: apertures and focal length in tenths of a scene unit, as a stage has them; its exposure in stops."""
    lens = camera.GetCamera(time)
    scale = float(camera.ComputeLinearExposureScale(time))
    if len(camera.GetClippingPlanesAttr().Get(time) or []):
        notes[f"{camera.GetPath()}: clippingPlanes not honoured"] = None
    is_exposed = 2.0**-_MOST_STOPS <= scale <= 2.0**_MOST_STOPS
    if not is_exposed:
        notes[f"{camera.GetPath()}: an exposure of {scale:g} times the light is passed over"] = None
    return {
        "name": camera.GetPrim().GetName(),
        "world": world.ravel().tolist(),
        "is_perspective": lens.projection == Gf.Camera.Perspective,
        "width": float(lens.horizontalAperture),
        "height": float(lens.verticalAperture),
        "focal_length": float(lens.focalLength),
        "focus_distance": float(lens.focusDistance),
        "offsets": [float(lens.horizontalApertureOffset), float(lens.verticalApertureOffset)],
        "exposure": math.log2(scale) if is_exposed else 0.0,
    }


def _is_changed(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> bool:
    """Whether an attribute has another value than the schema gives it."""
    value = prim.GetAttribute(name).Get(time) if prim.HasAttribute(name) else None
    usual = prim.GetPrimDefinition().GetAttributeFallbackValue(name)
    return value not in (None, usual) and getattr(value, "path", "set") != ""
