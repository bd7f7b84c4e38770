"""Materials of one plain surface node as the Principled BSDF that equals it, which Blender's exporter understands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

#: Values of the Principled BSDF that make it a surface; the colour and the inputs of one name are the surface's own.
_SURFACES: dict[str, dict[str, float]] = {
    "BSDF_DIFFUSE": {"Roughness": 1.0, "Specular IOR Level": 0.0},
    "BSDF_GLOSSY": {"Metallic": 1.0},
    "BSDF_GLASS": {"Transmission Weight": 1.0},
}
_OWN = ("Roughness", "IOR", "Normal")


@contextmanager
def as_principled() -> Iterator[None]:
    """Let such materials have a Principled BSDF; all is as it was at the end."""
    made: list[tuple[Any, Any, Any, Any]] = []
    try:
        for material in bpy.data.materials:
            tree: Any = material.node_tree if material.use_nodes and material.library is None else None
            for output in [] if tree is None else [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]:
                links = output.inputs["Surface"].links
                if links and links[0].from_node.type in _SURFACES:
                    source = links[0].from_socket
                    made.append((tree, output.inputs["Surface"], source, _principled(tree, source.node, output)))
        yield
    finally:
        for tree, surface, source, principled in made:
            tree.nodes.remove(principled)
            tree.links.new(source, surface)


def _principled(tree: Any, node: Any, output: Any) -> Any:
    principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
    values = _SURFACES[node.type]
    for name, value in values.items():
        principled.inputs[name].default_value = value
    own = [(name, name) for name in _OWN if name in node.inputs and name not in values]
    for name, its_name in [("Base Color", "Color"), *own]:
        given = node.inputs[its_name]
        if given.is_linked:
            tree.links.new(given.links[0].from_socket, principled.inputs[name])
        elif name != "Normal":
            principled.inputs[name].default_value = given.default_value
    tree.links.new(principled.outputs[0], output.inputs["Surface"])
    return principled
