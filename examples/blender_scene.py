"""Makes a scene in Blender: Suzanne in copper on a turntable, glass and pearls around her, an area light and a world.

blender --background --python examples/blender_scene.py -- suzanne.blend [PEARLS]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import bpy

#: Pearls in the rings around her; they share one mesh.
PEARLS = 60


def main(path: Path, pearls: int) -> None:
    """Write the scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene

    bpy.ops.mesh.primitive_monkey_add(size=1.9, location=(0.0, 0.25, 0.86), rotation=(-0.55, 0.0, 0.3))
    suzanne = bpy.context.object
    suzanne.modifiers.new("smooth", "SUBSURF").render_levels = 2
    bpy.ops.object.shade_smooth()
    suzanne.data.materials.append(material("copper", (0.97, 0.6, 0.4), metallic=1.0, roughness=0.3))

    bpy.ops.mesh.primitive_cylinder_add(vertices=128, radius=1.75, depth=0.2, location=(0.0, 0.0, -0.1))
    bpy.context.object.modifiers.new("edge", "BEVEL").width = 0.05
    bpy.context.object.data.materials.append(material("slate", (0.06, 0.07, 0.09), roughness=0.35))

    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.38, location=(0.9, -0.85, 0.38))
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material("glass", (0.8, 1.0, 0.95), roughness=0.0, transmission=1.0))

    bpy.ops.mesh.primitive_torus_add(location=(-0.72, -0.95, 0.13), major_radius=0.36, minor_radius=0.13)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material("enamel", (0.05, 0.25, 0.8), roughness=0.15))

    pearl = pearl_mesh()
    for number in range(pearls):
        radius, angle = 1.36 + 0.15 * (number % 3), 2.0 * math.pi * number / pearls
        item = bpy.data.objects.new(f"pearl {number}", pearl)
        item.location = (radius * math.cos(angle), radius * math.sin(angle), 0.07)
        scene.collection.objects.link(item)

    light = bpy.data.lights.new("window", "AREA")
    light.energy, light.shape, light.size, light.size_y = 800.0, "RECTANGLE", 2.0, 3.0
    window = bpy.data.objects.new("window", light)
    window.location, window.rotation_euler = (-4.5, -3.0, 5.0), (0.75, 0.0, -0.98)
    scene.collection.objects.link(window)

    scene.world = bpy.data.worlds.new("evening")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.2, 0.24, 0.33, 1.0)

    lens = bpy.data.cameras.new("seat")
    lens.angle, lens.dof.use_dof, lens.dof.focus_distance = 0.62, True, 8.6
    scene.camera = bpy.data.objects.new("seat", lens)
    scene.camera.location, scene.camera.rotation_euler = (0.0, -8.3, 3.6), (1.235, 0.0, 0.0)
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = 1536, 2048
    bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), check_existing=False)


def pearl_mesh() -> Any:
    """A small smooth ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=16, radius=0.07)
    bpy.ops.object.shade_smooth()
    ball = bpy.context.object
    mesh = ball.data
    mesh.materials.append(material("pearl", (0.9, 0.85, 0.75), roughness=0.25))
    bpy.data.objects.remove(ball)
    return mesh


def material(
    name: str,
    color: tuple[float, float, float],
    *,
    metallic: float = 0.0,
    roughness: float = 0.5,
    transmission: float = 0.0,
) -> Any:
    """A material of one Principled BSDF."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*color, 1.0)
    inputs["Metallic"].default_value = metallic
    inputs["Roughness"].default_value = roughness
    inputs["Transmission Weight"].default_value = transmission
    return made


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :]
    main(Path(words[0]), int(words[1]) if len(words) > 1 else PEARLS)
