"""What a Blender scene shows and glTF cannot say."""

from __future__ import annotations

from typing import Any

#: Objects that are seen in Blender's pictures, by type.
_UNREAD = {
    "VOLUME": "a volume",
    "CURVES": "hair",
    "GREASEPENCIL": "a drawing of the grease pencil",
    "GPENCIL": "a drawing of the grease pencil",
    "POINTCLOUD": "a cloud of points",
}

#: Nodes of materials that Blender's exporter understands, where they stand as it expects them.
_KNOWN_NODES = frozenset(
    f"ShaderNode{name}"
    for name in (
        *("OutputMaterial", "BsdfPrincipled", "Emission", "Background", "BsdfTransparent", "MixShader", "LightPath"),
        *("TexImage", "NormalMap", "Mapping", "TexCoord", "UVMap", "VertexColor", "Attribute", "RGB", "Value"),
        *("SeparateColor", "SeparateRGB", "CombineColor", "CombineRGB", "Math", "Mix", "MixRGB"),
    )
) | {"NodeReroute", "NodeFrame"}
_SURFACES = ("ShaderNodeBsdfPrincipled", "ShaderNodeEmission", "ShaderNodeBackground")


def remark_objects(depsgraph: Any, remark: Any) -> None:
    """Name the objects that are left out."""
    for instance in depsgraph.object_instances:
        item = instance.object
        if item.type in _UNREAD:
            remark(f"object '{item.name}': {_UNREAD[item.type]} is left out")
        for system in getattr(item, "particle_systems", ()):
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                remark(f"object '{item.name}': hair is left out")


def remark_lights(depsgraph: Any, remark: Any) -> None:
    """Say that shadows are sharp where a light has a size that glTF does not tell."""
    for instance in depsgraph.object_instances:
        item = instance.object
        if item.type == "LIGHT" and item.data.type != "AREA":
            size = item.data.angle if item.data.type == "SUN" else item.data.shadow_soft_size
            if size > 0.0:
                remark("point, spot and sun lights have no size: their shadows are sharp")
                return


def remark_materials(depsgraph: Any, remark: Any) -> None:
    """Name the materials whose nodes glTF cannot say."""
    materials = {}
    for instance in depsgraph.object_instances:
        for slot in getattr(instance.object, "material_slots", ()):
            if slot.material is not None:
                materials[slot.material.name] = slot.material
    for name, material in sorted(materials.items()):
        tree = material.node_tree if material.use_nodes else None
        output = None if tree is None else tree.get_output_node("CYCLES")
        if output is None:
            continue
        if output.inputs["Volume"].is_linked:
            remark(f"material '{name}': its volume is left out")
        if output.inputs["Displacement"].is_linked:
            remark(f"material '{name}': its displacement is left out")
        reached = _reached(output.inputs["Surface"])
        unknown = sorted({node.bl_label for node in reached if not _is_known(node)})
        if unknown:
            remark(f"material '{name}': glTF has no word for its nodes ({', '.join(unknown)}); bake them to pictures")
        elif reached and not any(node.bl_idname in _SURFACES for node in reached):
            remark(f"material '{name}': its surface is none that glTF knows")


def _is_known(node: Any) -> bool:
    if node.bl_idname == "ShaderNodeGroup":
        return node.node_tree is not None and node.node_tree.name.startswith("glTF")
    return node.bl_idname in _KNOWN_NODES


def _reached(socket: Any) -> list[Any]:
    """Nodes that a socket depends on."""
    reached: dict[str, Any] = {}
    waiting = [link.from_node for link in socket.links]
    while waiting:
        node = waiting.pop()
        if node.name in reached:
            continue
        reached[node.name] = node
        waiting += [link.from_node for entry in node.inputs for link in entry.links]
    return list(reached.values())
