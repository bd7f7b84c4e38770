"""Records of materials: the inputs of their surfaces, with the values and textures that feed them."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdShade

from lippmann.color.primaries import rec709_from_rgb
from lippmann.color.transfer import decode_srgb
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.readers.usd.stage_surfaces import (
    as_preview,
    is_coded,
    is_read,
    materialx_node,
    primaries_of,
    surface_of,
    unread_inputs,
)

#: Nodes between a surface and what it reads.
_DEEPEST = 8


class MaterialTable:
    """The materials of a stage, read when they are first met.

    Attributes
    ----------
    records:
        One for each material; meshes refer to them by their place.
    color_names:
        The primvars of meshes that any of them takes its colour from, and the display colour.
    """

    def __init__(self, time: Usd.TimeCode, notes: dict[str, None]) -> None:
        self.records: list[Record] = []
        self.color_names: dict[str, None] = {"displayColor": None}
        self._time, self._notes = time, notes
        self._known: dict[str, int] = {}

    def bound(self, prim: Usd.Prim) -> int:
        """The number of the material that is bound to a prim, by itself or by what lies above it; -1 for none."""
        binding = UsdShade.MaterialBindingAPI(prim)
        # Materials for all purposes stand in for those of a preview, whose surfaces are those that are read.
        material = binding.ComputeBoundMaterial(UsdShade.Tokens.preview)[0]
        material = material or binding.ComputeBoundMaterial(UsdShade.Tokens.full)[0]
        if not material:
            return -1
        own = material.GetPrim()
        path = str((own.GetPrimInPrototype() if own.IsInstanceProxy() else own).GetPath())
        if path not in self._known:
            record = self._read(material)
            self._known[path] = -1 if record is None else len(self.records)
            if record is not None:
                self.records.append(record)
        return self._known[path]

    def _read(self, material: UsdShade.Material) -> Record | None:
        name = str(material.GetPath())
        surface, kind = surface_of(material)
        if not is_read(kind):
            what = f"its surface is '{kind}', which is not read" if kind else "it has no surface"
            self._notes[f"material {name}: {what}: display colours are taken"] = None
            return None
        inputs = {each.GetBaseName(): self._source(each, _DEEPEST) for each in surface.GetInputs()}
        known = {key: value for key, value in inputs.items() if value is not None}
        if unread := unread_inputs(kind, known):
            self._notes[f"material {name}: not honoured: {', '.join(unread)}"] = None
        given = as_preview(kind, known)
        if primvar := given.get("diffuseColor", {}).get("primvar"):
            self.color_names[str(primvar)] = None
        return {"name": name, "inputs": given}

    def _source(self, shader_input: UsdShade.Input, depth: int) -> Record | None:
        """The source of an input: a ``value``, a ``texture`` or a ``primvar``; None where nothing does."""
        attributes = UsdShade.Utils.GetValueProducingAttributes(shader_input)
        if not attributes or depth == 0:
            return None
        attribute = attributes[0]
        name, kind = UsdShade.Utils.GetBaseNameAndType(attribute.GetName())
        if kind != UsdShade.AttributeType.Output:
            value, space = attribute.Get(self._time), str(attribute.GetColorSpace())
            if isinstance(value, Sdf.AssetPath):
                if primaries_of(space) is not None:
                    self._notes[f"pictures in the colour space '{space}' are taken as those of Rec. 709"] = None
                return {"asset": asset_record(attribute, value, self._time)}
            if attribute.GetTypeName().isArray:  # of ramps and the like
                return None
            if str(attribute.GetTypeName()).startswith("color"):
                value = type(value)(*_rec709(np.array(value)[:3], space), *list(value)[3:])
            return None if value is None else {"value": _plain(value)}
        node = UsdShade.Shader(attribute.GetPrim())
        node_kind = str(node.GetShaderId()) if node else ""
        inputs = {each.GetBaseName(): self._source(each, depth - 1) for each in node.GetInputs()} if node else {}
        given = {key: value for key, value in inputs.items() if value is not None}
        own = materialx_node(node_kind, name, given, attribute.GetPrim())
        if own is not None:
            return own
        node_kind = node_kind.removeprefix("ND_")
        if node_kind.startswith("UsdUVTexture"):
            st = node.GetInput("st")
            if not (st and st.HasConnectedSource()):  # the schema's own coordinates, of one texel
                given.setdefault("st", {"value": [0.0, 0.0]})
            return {"texture": given, "channel": name}
        if node_kind.startswith("UsdTransform2d"):
            return {"transform": given}
        if node_kind.startswith("UsdPrimvarReader_"):
            return {"primvar": given.get("varname", {}).get("value", ""), "fallback": given.get("fallback")}
        # Most nodes change a colour; as it is, it is nearer to the right one than any default.
        names = () if "normal" in node_kind else ("in", "in1", "in2", "fg", "bg")
        passed = next((given[each] for each in names if "texture" in given.get(each, ())), None)
        then = "" if passed is None else ": their image is shown as it is"
        self._notes[f"shader nodes of type '{node_kind}' are not read{then}"] = None
        return passed


def declare_outputs(stage: Usd.Stage) -> None:
    """Declare the outputs that connections name and nodes lack, as files written by hand do; USD passes over these."""
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for prim in [prim for prim in stage.TraverseAll() if prim.IsA(UsdShade.Shader) or prim.IsA(UsdShade.NodeGraph)]:
            for attribute in prim.GetAuthoredAttributes():
                for source in attribute.GetConnections():
                    node = UsdShade.Shader(stage.GetPrimAtPath(source.GetPrimPath()))
                    name, kind = UsdShade.Utils.GetBaseNameAndType(source.name)
                    if node and kind == UsdShade.AttributeType.Output and not stage.GetAttributeAtPath(source):
                        node.CreateOutput(name, attribute.GetTypeName())


def asset_record(attribute: Usd.Attribute, value: Sdf.AssetPath, time: Usd.TimeCode) -> Record:
    """A file that an attribute names: as it stands there, as USD finds it, and the folder of the layer that says so."""
    stack = attribute.GetPropertyStack(time)
    layer = stack[0].layer.realPath if stack else ""
    folder = os.path.dirname(layer.split("[")[0]) if layer else ""
    return {"name": value.path, "found": value.resolvedPath, "folder": folder}


def _rec709(color: NDArray[np.float32], space: str) -> list[float]:
    """A colour of a colour space as linear Rec. 709; beyond its primaries it is cut at 0."""
    linear = decode_srgb(color) if is_coded(space) else color
    primaries = primaries_of(space)
    return [*map(float, linear if primaries is None else np.maximum(rec709_from_rgb(primaries) @ linear, 0.0))]


def _plain(value: Any) -> Any:
    """A value in terms of JSON."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (Gf.Vec2f, Gf.Vec3f, Gf.Vec4f, Gf.Vec2d, Gf.Vec3d, Gf.Vec4d, Gf.Vec2h, Gf.Vec3h, Gf.Vec4h)):
        return [float(number) for number in value]
    return str(value)
