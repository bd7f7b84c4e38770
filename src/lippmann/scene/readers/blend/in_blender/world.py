"""Blender's world as an equirectangular picture of linear radiance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

#: Pixels across a picture of one colour (Blender renders no fewer than four rows), and of computed skies.
_PLAIN_WIDTH, _SKY_WIDTH = 8, 2048
#: The widest picture.
_MOST_WIDTH = 4096
#: Samples in each pixel, against jagged edges.
_SAMPLES = 4


def write_world(scene: Any, path: Path, remark: Any) -> bool:
    """Write the world's light as OpenEXR; False of a scene without any.

    Row 0 lies straight up, the middle column along Blender's +y, which glTF calls -z. Cycles renders the picture, with
    an empty scene before the world. ``remark`` takes a line on what is left out.
    """
    world = scene.world
    if world is None:
        return False
    color = _plain_color(world)
    if color is not None and max(color) <= 0.0:
        return False
    if not hasattr(scene, "cycles"):
        remark("the world is left out: this Blender has no Cycles, which renders its light")
        return False
    _render(world, path, _width(world) if color is None else _PLAIN_WIDTH)
    return True


def _plain_color(world: Any) -> list[float] | None:
    """Radiance of a world of one colour; None of another."""
    if not world.use_nodes or world.node_tree is None:
        return [float(channel) for channel in world.color]
    outputs = [node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeOutputWorld"]
    output = next((node for node in outputs if node.is_active_output), None)
    if output is None or not output.inputs["Surface"].is_linked:
        return [0.0, 0.0, 0.0]
    background = output.inputs["Surface"].links[0].from_node
    if background.bl_idname != "ShaderNodeBackground" or any(socket.is_linked for socket in background.inputs):
        return None
    strength = float(background.inputs["Strength"].default_value)
    return [max(float(channel) * strength, 0.0) for channel in background.inputs["Color"].default_value[:3]]


def _render(world: Any, path: Path, width: int) -> None:
    """Render the world all around by Cycles, into a scene of its own."""
    scene = bpy.data.scenes.new("lippmann world")
    lens = bpy.data.cameras.new("lippmann world")
    camera = bpy.data.objects.new("lippmann world", lens)
    try:
        scene.collection.objects.link(camera)
        scene.camera, scene.world = camera, world
        scene.render.engine = "CYCLES"
        scene.cycles.device = "CPU"
        scene.cycles.samples = _SAMPLES
        scene.cycles.use_adaptive_sampling = False
        scene.cycles.use_denoising = False
        lens.type = "PANO"
        # Blender 5 moved this setting from Cycles to the camera itself.
        (lens if hasattr(lens, "panorama_type") else lens.cycles).panorama_type = "EQUIRECTANGULAR"
        camera.rotation_euler = (1.5707963267948966, 0.0, 0.0)
        scene.render.resolution_x, scene.render.resolution_y = width, width // 2
        scene.render.resolution_percentage = 100
        scene.render.use_compositing = scene.render.use_sequencer = False
        write_linear(scene, "RGB")
        scene.render.filepath = str(path)
        bpy.ops.render.render(scene=scene.name, write_still=True)
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(lens)


def write_linear(scene: Any, mode: str) -> None:
    """Let a scene's pictures be OpenEXR of floats in linear Rec. 709, not of the file's working space."""
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", mode, "32"
    settings.color_management = "OVERRIDE"
    settings.linear_colorspace_settings.name = "Linear Rec.709"


def _width(world: Any) -> int:
    """Pixels across: as many as the widest picture of the world has."""
    widths = [
        node.image.size[0]
        for node in world.node_tree.nodes
        if node.bl_idname == "ShaderNodeTexEnvironment" and node.image is not None
    ]
    return min(max(widths, default=_SKY_WIDTH), _MOST_WIDTH) // 2 * 2 or _SKY_WIDTH
