"""Features of a Blender scene that glTF cannot express, in words."""

from __future__ import annotations

from typing import Any

import bpy

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
#: Nodes that a material without lighting needs beside that of light paths.
_UNLIT_NODES = frozenset({"ShaderNodeBsdfTransparent", "ShaderNodeMixShader"})
#: The working space of files that ask for no other.
_REC709 = "Linear Rec.709"
#: Nodes of compositors that change nothing.
_PASSING = frozenset(
    {"CompositorNodeRLayers", "CompositorNodeComposite", "CompositorNodeViewer"}
    | {"NodeGroupOutput", "NodeReroute", "NodeFrame"}
)
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


def remark_scene(scene: Any, view_layer: Any, remark: Any) -> None:
    """Name what the scene does to its pictures and displays do not show."""
    if scene.render.film_transparent and scene.world is not None:
        remark("its pictures are transparent where the world is shown here (background=0,0,0 hides it)")
    space = bpy.data.colorspace.working_space if hasattr(bpy.data, "colorspace") else _REC709  # from Blender 5 on
    if space != _REC709:
        remark(f"its colours are converted from {space}; light is multiplied in Rec. 709")
    if view_layer.material_override is not None:
        remark(f"the material '{view_layer.material_override.name}' that overrides the view layer's is not applied")
    composited = getattr(scene, "compositing_node_group", None)  # from Blender 5 on
    if composited is None and getattr(scene, "use_nodes", False):
        composited = getattr(scene, "node_tree", None)
    if scene.render.use_compositing and composited is not None:
        own = {node.bl_idname for node in composited.nodes}
        if own - _PASSING:
            remark("the nodes of the compositor are not applied")


def unseen_objects(depsgraph: Any, view_layer: Any, remark: Any) -> set[str]:
    """Names of objects that cameras do not see; those that hide or catch what lies behind them are named."""
    unseen = set()
    for instance in depsgraph.object_instances:
        item = instance.object.original
        if item.type in ("LIGHT", "CAMERA"):
            continue
        if not item.visible_camera or item.indirect_only_get(view_layer=view_layer):
            unseen.add(item.name)
        for flag, what in (
            (item.is_holdout or item.holdout_get(view_layer=view_layer), "a holdout"),
            (item.is_shadow_catcher, "a shadow catcher"),
        ):
            if flag:
                remark(f"object '{item.name}': {what} is shown as any object")
    return unseen


def remark_lights(depsgraph: Any, remark: Any) -> None:
    """Say that shadows are sharp where a light has a size that glTF does not tell, and that areas are seen."""
    for instance in depsgraph.object_instances:
        item = instance.object
        if item.type != "LIGHT":
            continue
        if item.data.type == "AREA":
            remark("area lights are seen, and hide what lies behind them")
        elif (item.data.angle if item.data.type == "SUN" else item.data.shadow_soft_size) > 0.0:
            remark("point, spot and sun lights have no size: their shadows are sharp")
        linking = getattr(item, "light_linking", None)
        if linking is not None and (linking.receiver_collection or linking.blocker_collection):
            remark(f"light '{item.name}': it is linked to some objects, and lights all")


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
        reached = _reach(output.inputs["Surface"])
        is_unlit = any(node.bl_idname == "ShaderNodeLightPath" for node in reached)
        for node in reached:
            if node.bl_idname == "ShaderNodeTexImage" and node.extension == "CLIP":
                remark(f"material '{name}': its picture, clipped at its edges in Blender, goes on with the last pixels")
        unknown = sorted({node.bl_label for node in reached if not _is_known(node, is_unlit=is_unlit)})
        if unknown:
            remark(f"material '{name}': glTF has no word for its nodes ({', '.join(unknown)}); bake them to pictures")
        elif reached and not any(node.bl_idname in _SURFACES for node in reached):
            remark(f"material '{name}': its surface is none that glTF knows")


def _is_known(node: Any, *, is_unlit: bool) -> bool:
    if node.bl_idname == "ShaderNodeGroup":
        return node.node_tree is not None and node.node_tree.name.startswith("glTF")
    return node.bl_idname in _KNOWN_NODES and (is_unlit or node.bl_idname not in _UNLIT_NODES)


def _reach(socket: Any) -> list[Any]:
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
