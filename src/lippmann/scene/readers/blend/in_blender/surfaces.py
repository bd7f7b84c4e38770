"""Surfaces of any nodes as one Principled BSDF, which Blender's exporter understands.

A mix of surfaces becomes one surface of mixed values. What the exporter has no word for among the nodes of a value is
baked: see :mod:`.baking`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from .baking import Studio, bake
from .node_reach import by_identifier, group_output, is_plain, reach

_BLACK, _WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
_EMISSION, _DARK = ("Emission Color", "Emission Strength"), (_BLACK, 0.0)
_DULL = {"Roughness": 1.0, "Specular IOR Level": 0.0}
#: Surfaces of one node by its type: the values that a Principled BSDF needs beside the node's own inputs.
_SURFACES: dict[str, dict[str, Any]] = {
    "BSDF_DIFFUSE": _DULL,
    "BSDF_GLOSSY": {"Metallic": 1.0},
    "BSDF_METALLIC": {"Metallic": 1.0},
    "BSDF_GLASS": {"Transmission Weight": 1.0},
    "BSDF_REFRACTION": {"Transmission Weight": 1.0},
    **dict.fromkeys(("BSDF_TRANSLUCENT", "SUBSURFACE_SCATTERING", "BSDF_SHEEN", "BSDF_TOON", "BSDF_HAIR"), _DULL),
}
#: Of these, those that are shown as a diffuse surface of the same colour.
_DIFFUSE = ("BSDF_TRANSLUCENT", "BSDF_SHEEN", "BSDF_TOON", "BSDF_HAIR")
_OWN = ("Roughness", "IOR", "Normal")
#: Values of a surface that lacks a part.
_NONE = {
    "Metallic": 0.0,
    "Transmission Weight": 0.0,
    "Coat Weight": 0.0,
    "Sheen Weight": 0.0,
    "Subsurface Weight": 0.0,
    "Alpha": 1.0,
}
_NOTHING = {"Base Color": _BLACK, **_DULL}
_SOCKETS = {"RGBA": "NodeSocketColor", "VECTOR": "NodeSocketVector"}

#: Values of a Principled BSDF by its inputs' names: a number, linear RGB or an output in the material's own tree.
Surface = dict[str, Any]


@contextmanager
def as_principled(depsgraph: Any, remark: Any) -> Iterator[None]:
    """Let materials of other nodes have a Principled BSDF; all is as it was at the end.

    ``remark`` takes a line on what is shown otherwise.
    """
    rewritten: list[_Rewrite] = []
    used = _used_materials(depsgraph)
    try:
        with Studio() as studio:
            for name in sorted(used):
                material, meshes = used[name]
                if material.library is None and material.node_tree is not None and material.use_nodes:
                    _remark_missing(material, remark)
                    outputs = [node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL"]
                    if any(_needs_rewrite(output) for output in outputs):
                        rewritten.append(_Rewrite(material, remark))
                        rewritten[-1].apply(studio, meshes)
        yield
    finally:
        for rewrite in reversed(rewritten):
            rewrite.undo()


def refraction_indices(depsgraph: Any) -> dict[str, float]:
    """Index of refraction of each material of a Principled BSDF, by the material's name."""
    indices = {}
    for name, (material, _) in _used_materials(depsgraph).items():
        output = material.node_tree.get_output_node("CYCLES") if material.use_nodes and material.node_tree else None
        links = output.inputs["Surface"].links if output is not None else ()
        if links and links[0].from_node.type == "BSDF_PRINCIPLED":
            indices[name] = float(links[0].from_node.inputs["IOR"].default_value)
    return indices


def _used_materials(depsgraph: Any) -> dict[str, tuple[Any, list[tuple[Any, int]]]]:
    """Materials by their names, each with the meshes that have it and its place among theirs."""
    used: dict[str, tuple[Any, list[tuple[Any, int]]]] = {}
    for instance in depsgraph.object_instances:
        item = instance.object
        for place, slot in enumerate(getattr(item, "material_slots", ())):
            if slot.material is not None:
                _, meshes = used.setdefault(slot.material.name, (slot.material.original, []))
                mesh = (item.data.original.name, place)
                if item.type == "MESH" and mesh not in meshes:
                    meshes.append(mesh)
    return used


def _remark_missing(material: Any, remark: Any) -> None:
    """Name the pictures that a material's surface wants and that cannot be read."""
    output = material.node_tree.get_output_node("CYCLES")
    if output is not None and output.inputs["Surface"].is_linked:
        for image in reach(output.inputs["Surface"].links[0].from_socket).images:
            if not image.size[0] and image.source != "TILED":
                remark(f"material '{material.name}': its picture '{image.name}' is not found and left out")


def _needs_rewrite(output: Any) -> bool:
    links = output.inputs["Surface"].links
    if not links:
        return False
    node = links[0].from_node
    if node.type in ("BSDF_PRINCIPLED", "EMISSION", "BACKGROUND") and not node.mute:
        strength = node.inputs.get("Emission Strength", node.inputs.get("Strength"))
        return strength.is_linked or not all(is_plain(entry) for entry in node.inputs)
    return not _is_unlit(node)


def _is_unlit(node: Any) -> bool:
    """Whether the exporter knows a surface that is seen as it glows and lights nothing."""
    if node.type == "MIX_SHADER":
        clear, seen = (entry.links[0].from_node if entry.is_linked else None for entry in node.inputs[1:3])
        if clear is not None and clear.type == "BSDF_TRANSPARENT" and seen is not None:
            node = seen
    if node.type != "MIX_SHADER" or not node.inputs[0].is_linked or not node.inputs[2].is_linked:
        return False
    factor, seen = node.inputs[0].links[0].from_socket, node.inputs[2].links[0].from_node
    return factor.node.type == "LIGHT_PATH" and factor.name == "Is Camera Ray" and seen.type in ("EMISSION", "RGB")


class _Rewrite:
    """One material's Principled BSDF in the place of its own surface."""

    def __init__(self, material: Any, remark: Any) -> None:
        self.material, self.tree, self._remark = material, material.node_tree, remark
        self._nodes: list[Any] = []
        self._images: list[Any] = []
        self._outlets: list[tuple[Any, Any]] = []
        self._surfaces: list[tuple[Any, Any]] = []

    def apply(self, studio: Studio, meshes: list[tuple[Any, int]]) -> None:
        """Put it there."""
        self._studio = studio
        output = self.tree.get_output_node("CYCLES") or self.tree.get_output_node("EEVEE")
        surface = self._surface(output.inputs["Surface"], ()) or _NOTHING
        principled = self.add("ShaderNodeBsdfPrincipled")
        for name, value in surface.items():
            if name in principled.inputs:
                self.give(principled.inputs[name], value)
        bake(self, principled, studio, meshes)
        for node in self.tree.nodes:
            if node.type == "OUTPUT_MATERIAL":
                entry = node.inputs["Surface"]
                self._surfaces.append((entry, entry.links[0].from_socket if entry.is_linked else None))
                self.tree.links.new(principled.outputs[0], entry)

    def undo(self) -> None:
        """Let all be as it was."""
        for node in self._nodes:
            self.tree.nodes.remove(node)
        for entry, source in self._surfaces:
            if source is not None:
                self.tree.links.new(source, entry)
        for tree, item in self._outlets:
            tree.interface.remove(item)
        for image in self._images:
            bpy.data.images.remove(image)

    def remark(self, line: str) -> None:
        """Say what is shown otherwise."""
        self._remark(f"material '{self.material.name}': {line}")

    def add(self, kind: str, **settings: Any) -> Any:
        """A new node of the material's own tree."""
        node = self.tree.nodes.new(kind)
        self._nodes.append(node)
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def new_image(self, width: int, height: int, space: str) -> Any:
        """A new picture, for a node of the tree."""
        image = bpy.data.images.new(self.material.name, width, height, alpha=True)
        self._images.append(image)
        image.alpha_mode, image.colorspace_settings.name = "CHANNEL_PACKED", space
        return image

    def give(self, entry: Any, value: Any) -> None:
        """Set an input, or link it."""
        if _is_output(value):
            self.tree.links.new(value, entry)
        elif entry.type == "RGBA":
            entry.default_value = (*_as_color(value), 1.0)
        else:
            entry.default_value = _as_number(value) if entry.type == "VALUE" else value

    def _surface(self, entry: Any, path: tuple[Any, ...]) -> Surface | None:
        """The surface that an input for one is linked to; None without any. ``path``: the groups around it."""
        entry, output, path = _follow(entry, path)
        if output is None:
            return None
        node = output.node
        if output.type == "RGBA":
            return {**_NOTHING, "Emission Color": self._value(entry, path), "Emission Strength": 1.0}
        if node.type == "MIX_SHADER":
            factor = self._fold(self._value(node.inputs[0], path))
            return self._mix(node, factor, *(self._surface(each, path) or _NOTHING for each in node.inputs[1:3]))
        if node.type == "ADD_SHADER":
            one, other = (self._surface(each, path) for each in node.inputs[:2])
            return self._sum(node, one, other) if one and other else one or other
        return self._leaf(node, path)

    def _leaf(self, node: Any, path: tuple[Any, ...]) -> Surface | None:
        values = {entry.name: self._value(entry, path) for entry in node.inputs if entry.type != "SHADER"}
        values = {name: value for name, value in values.items() if value is not None}
        kind = node.type
        if kind == "BSDF_PRINCIPLED":
            return values
        if kind == "BSDF_TRANSPARENT":
            color = values["Color"]
            if not _is_output(color) and max(color) - min(color) > 0.1:
                self.remark(f"node '{node.name}': its colour is left out")
            return {"Alpha": self._blend(color, 1.0, 0.0, "VALUE")}
        if kind in ("EMISSION", "BACKGROUND"):
            return {**_NOTHING, "Emission Color": values["Color"], "Emission Strength": values["Strength"]}
        if kind not in _SURFACES:
            if kind == "BSDF_HAIR_PRINCIPLED":
                return {"Base Color": values["Color"], **_DULL}
            self.remark(f"node '{node.name}': glTF has no word for its surface, which is black")
            return None
        if kind in _DIFFUSE:
            self.remark(f"node '{node.name}': its surface is shown as a diffuse one")
        own = {name: values[name] for name in _OWN if name in values}
        return {**own, "Base Color": values.get("Color", values.get("Base Color")), **_SURFACES[kind]}

    def _mix(self, node: Any, factor: Any, one: Surface, other: Surface) -> Surface:
        if not _is_output(factor) and factor in (0.0, 1.0):
            return other if factor else one
        for clear, solid, share in ((one, other, factor), (other, one, self._blend(factor, 1.0, 0.0, "VALUE"))):
            if "Base Color" not in clear:
                alpha = self._blend(share, clear["Alpha"], solid.get("Alpha", 1.0), "VALUE")
                return {**solid, "Alpha": alpha}
        for gloss, base in ((other, one), (one, other)):
            if gloss.get("Metallic") == 1.0 and base.get("Metallic", 0.0) == 0.0:
                index = self._fresnel_index(factor if gloss is other else self._blend(factor, 1.0, 0.0, "VALUE"))
                if index is not None:
                    return _under_gloss(base, gloss, index, gloss["Base Color"])
        mixed: Surface = {}
        for name in {**one, **other}:
            if not name.startswith("Emission"):
                pair = [a.get(name, _NONE.get(name, b.get(name))) for a, b in ((one, other), (other, one))]
                mixed[name] = pair[0] if name.endswith(("Normal", "Tangent")) else self._blend(factor, *pair)
        return self._glow(mixed, factor, one, other)

    def _glow(self, mixed: Surface, factor: Any, one: Surface, other: Surface) -> Surface:
        """``mixed`` with the mixed emission of two surfaces."""
        first, second = _emission(one), _emission(other)
        if first is None and second is None:
            return {**mixed, "Emission Strength": 0.0}
        if (first is None or second is None) and not _is_output(factor):
            (color, strength), share = (first, 1.0 - factor) if first else (second or _DARK, factor)
            return {**mixed, "Emission Color": color, "Emission Strength": self._product(strength, share, "VALUE")}
        colors = [self._product(color, strength, "RGBA") for color, strength in (first or _DARK, second or _DARK)]
        glow = self._blend(factor, colors[0], colors[1], "RGBA")
        return {**mixed, "Emission Color": glow, "Emission Strength": 1.0}

    def _sum(self, node: Any, one: Surface, other: Surface) -> Surface:
        for glow, base in ((one, other), (other, one)):
            added, own = _emission(glow), _emission(base)
            if glow.get("Base Color") == _BLACK and added is not None and "Base Color" in base:
                if own is None:
                    return {**base, **dict(zip(_EMISSION, added, strict=True))}
                colors = [self._product(each[0], each[1], "RGBA") for each in (added, own)]
                total = self._join("ADD", colors[0], colors[1], "RGBA")
                return {**base, "Emission Color": total, "Emission Strength": 1.0}
        for gloss, base in ((other, one), (one, other)):
            color, is_layer = gloss.get("Base Color"), "Base Color" in base and base.get("Metallic", 0.0) == 0.0
            if gloss.get("Metallic") == 1.0 and is_layer and isinstance(color, tuple) and 0.0 < max(color) < 1.0:
                tint = tuple(channel / max(color) for channel in color)
                return _under_gloss(base, gloss, _index(max(color)), tint)
        solid = one if "Base Color" in one else other
        self.remark(f"node '{node.name}': one of the surfaces that it adds is shown alone")
        return solid

    def _fresnel_index(self, factor: Any) -> float | None:
        """Index of refraction of a surface that reflects this share; None if it is not one."""
        if not _is_output(factor):
            return _index(factor) if 0.0 < factor <= 0.5 else None
        for node in reach(factor).nodes:
            if node.type == "FRESNEL":
                return float(min(max(node.inputs["IOR"].default_value, 1.0), 3.0))
            if node.type == "LAYER_WEIGHT":
                return float(min(1.0 / max(1.0 - node.inputs["Blend"].default_value, 1e-3), 3.0))
        return None

    def _fold(self, value: Any) -> Any:
        """A factor, as a number from 0 to 1 where it is one."""
        if _is_output(value):
            if not reach(value).is_constant:
                return value
            value = _as_number(self._studio.mean(self, value))
        return min(max(value, 0.0), 1.0)

    def _value(self, entry: Any, path: tuple[Any, ...]) -> Any:
        """The value of an input; None of a vector of its own."""
        kind = entry.type
        entry, output, path = _follow(entry, path)
        if output is None:
            if kind == "VECTOR" or not hasattr(entry, "default_value"):
                return None
            return _constant(entry.default_value, kind)
        if output.node.type in ("RGB", "VALUE"):
            return _constant(output.default_value, kind)
        for group in reversed(path):
            inner = group.node_tree
            item = inner.interface.new_socket(
                "lippmann", in_out="OUTPUT", socket_type=_SOCKETS.get(output.type, "NodeSocketFloat")
            )
            self._outlets.append((inner, item))
            inner.links.new(output, by_identifier(group_output(inner).inputs, item.identifier))
            output = by_identifier(group.outputs, item.identifier)
        return output

    def _blend(self, factor: Any, one: Any, other: Any, kind: str | None = None) -> Any:
        """``one`` to ``other``, by a factor from 0 to 1; of three colours or of numbers."""
        if one is None or other is None or one == other:
            return other if one is None else one
        if not _is_output(factor):
            share = _as_number(factor)
            if share in (0.0, 1.0):
                return other if share else one
            if not _is_output(one) and not _is_output(other):
                if not isinstance(one, tuple):
                    return one + share * (other - one)
                return tuple(a + share * (b - a) for a, b in zip(one, other, strict=True))
        return self._join("MIX", one, other, kind or _kind(one, other), factor)

    def _product(self, one: Any, other: Any, kind: str) -> Any:
        for value, rest in ((one, other), (other, one)):
            if not _is_output(value):
                if value in (1.0, _WHITE):
                    return rest
                if not _is_output(rest):
                    pair = zip(_as_color(value), _as_color(rest), strict=True)
                    product = tuple(a * b for a, b in pair)
                    return product if kind == "RGBA" else product[0]
        return self._join("MULTIPLY", one, other, kind)

    def _join(self, operation: str, one: Any, other: Any, kind: str, factor: Any = 1.0) -> Any:
        """The output of a new node that mixes two values."""
        if kind == "VALUE" and operation != "MIX":
            node = self.add("ShaderNodeMath", operation=operation)
            entries, output = node.inputs[:2], node.outputs[0]
        else:
            is_color = kind == "RGBA"
            node = self.add("ShaderNodeMix", data_type="RGBA" if is_color else "FLOAT", clamp_factor=True)
            if is_color:
                node.blend_type = operation
            entries, output = node.inputs[6:8] if is_color else node.inputs[2:4], node.outputs[2 if is_color else 0]
            self.give(node.inputs[0], factor)
        for entry, value in zip(entries, (one, other), strict=True):
            self.give(entry, value)
        return output


def _follow(entry: Any, path: tuple[Any, ...]) -> tuple[Any, Any, tuple[Any, ...]]:
    """The end of an input's links through reroutes, muted nodes, out of groups and, of surfaces, into them.

    An input and the output that it is linked to, or None; and the groups around that.
    """
    is_surface = entry.type == "SHADER"
    while entry.is_linked:
        output = entry.links[0].from_socket
        node = output.node
        if node.mute:
            passed = [link.from_socket for link in node.internal_links if link.to_socket == output]
            if not passed:
                return entry, None, path
            entry = passed[0]
        elif node.type == "REROUTE":
            entry = node.inputs[0]
        elif node.type == "GROUP_INPUT" and path:
            entry, path = by_identifier(path[-1].inputs, output.identifier), path[:-1]
        elif node.type == "GROUP" and is_surface:
            if node.node_tree is None:
                return entry, None, path
            entry, path = by_identifier(group_output(node.node_tree).inputs, output.identifier), (*path, node)
        else:
            return entry, output, path
    return entry, None, path


def _under_gloss(base: Surface, gloss: Surface, index: float, tint: Any) -> Surface:
    """A surface under a glossy layer of an index of refraction, as of lacquer or plastic."""
    own = {"IOR": index, "Specular IOR Level": 0.5, "Specular Tint": tint, "Roughness": gloss.get("Roughness", 0.5)}
    return {**gloss, **base, "Metallic": 0.0, **own}


def _emission(surface: Surface) -> tuple[Any, Any] | None:
    color, strength = surface.get("Emission Color", _WHITE), surface.get("Emission Strength", 0.0)
    return None if strength == 0.0 or color == _BLACK else (color, strength)


def _index(reflectance: float) -> float:
    """Index of refraction of a reflectance at normal incidence (Fresnel)."""
    root = math.sqrt(reflectance)
    return (1.0 + root) / (1.0 - root)


def _constant(value: Any, kind: str) -> Any:
    """A default value as the constant of a socket's kind."""
    value = value if isinstance(value, (int, float)) else tuple(value)[:3]
    if kind == "VALUE":
        return _as_number(value)
    return _as_color(value) if kind == "RGBA" else value


def _is_output(value: Any) -> bool:
    """Whether a value is an output of a node, and no constant."""
    return hasattr(value, "is_output")


def _as_color(value: Any) -> tuple[float, ...]:
    return tuple(value)[:3] if hasattr(value, "__len__") else (float(value),) * 3


def _as_number(value: Any) -> float:
    return sum(value) / len(value) if hasattr(value, "__len__") else float(value)


def _kind(*values: Any) -> str:
    is_color = any(isinstance(value, tuple) or getattr(value, "type", "VALUE") == "RGBA" for value in values)
    return "RGBA" if is_color else "VALUE"
