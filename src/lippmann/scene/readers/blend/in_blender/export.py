"""Export of Blender's present scene: ``scene.glb``, ``world.exr`` if the world shines, and notes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from .additions import (
    add_default_material,
    add_focus,
    add_indices,
    add_interiors,
    add_lights,
    leave_out,
    leave_out_unseen,
    scale_to_metres,
    set_frames,
)
from .glb import Glb
from .lights import camera_frames, describe_lights, focus_distances
from .plain_values import plain_values
from .remarks import remark_lights, remark_materials, remark_objects, remark_scene, unseen_objects
from .render_view import as_rendered
from .surfaces import as_principled, refraction_indices
from .working_space import materials_to_rec709, vertex_colors_to_rec709
from .world import write_world

SCENE, WORLD = "scene.glb", "world.exr"


@dataclass(frozen=True)
class Exported:
    """The result of :func:`export_scene`.

    Attributes
    ----------
    scene, world:
        The GLB file, and the picture of the world (None of a world without light).
    camera:
        The name of the active camera; empty without one.
    exposure:
        Stops by which Blender raises its pictures of the scene.
    notes:
        Lines on what is left out.
    """

    scene: Path
    world: Path | None
    camera: str
    exposure: float
    notes: tuple[str, ...]


def export_scene(folder: Path, *, is_animated: bool = False) -> Exported:
    """Write the scene of ``bpy.context`` into a folder: modifiers applied, without what renders do not show.

    Parameters
    ----------
    is_animated:
        Write the frames of the scene's range as one animation; else the present frame alone.
    """
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    notes: dict[str, None] = {}

    def remark(line: str) -> None:
        notes[line] = None

    path = folder / SCENE
    unit = float(scene.unit_settings.scale_length) if scene.unit_settings.system != "NONE" else 1.0
    with as_rendered(scene, view_layer), as_principled(bpy.context.evaluated_depsgraph_get(), remark):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for remark_on in (remark_objects, remark_materials, remark_lights):
            remark_on(depsgraph, remark)
        lights, indices = describe_lights(depsgraph, remark), refraction_indices(depsgraph)
        focus, frames = focus_distances(scene), camera_frames(scene)
        unseen = unseen_objects(depsgraph, view_layer, remark)
        remark_scene(scene, view_layer, remark)
        layer_objects = set(view_layer.objects)
        aside = {item.name for item in scene.objects if item not in layer_objects}
        instancers = {item.name for item in layer_objects if item.instance_type == "COLLECTION"}
        with plain_values(remark):
            bpy.ops.export_scene.gltf(filepath=str(path), **_options(is_animated=is_animated))
    if not is_animated and any(item.animation_data and item.animation_data.action for item in scene.objects):
        remark(f"the scene is shown at its frame {scene.frame_current}: frames of motion are for sequences")
    glb = Glb.read(path)
    leave_out(glb, aside, instancers)
    leave_out_unseen(glb, unseen, remark)
    materials_to_rec709(glb)
    vertex_colors_to_rec709(glb)
    add_default_material(glb)
    add_interiors(glb)
    add_indices(glb, indices)
    add_lights(glb, lights, unit)
    add_focus(glb, focus, unit)
    set_frames(glb, frames, unit)
    scale_to_metres(glb, unit)
    glb.write(path)
    world = folder / WORLD
    has_world = write_world(scene, world, remark)
    camera: Any = scene.camera
    return Exported(
        path,
        world if has_world else None,
        "" if camera is None else camera.name,
        float(scene.view_settings.exposure),
        tuple(notes),
    )


def _options(*, is_animated: bool) -> dict[str, Any]:
    options: dict[str, Any] = {
        "export_format": "GLB",
        "export_apply": True,
        "export_cameras": True,
        "export_lights": True,
        "export_yup": True,
        "export_gn_mesh": True,
        "use_active_scene": True,
        "use_renderable": True,
        "export_animations": is_animated,
        # Without animation the exporter has bones at rest: a still shows meshes as armatures bend them.
        "export_skins": is_animated,
        # Else the exporter goes to frame 0.
        "export_current_frame": not is_animated,
    }
    if is_animated:
        # All objects together, over the frames of the scene, from time 0.
        options |= {"export_animation_mode": "SCENE", "export_anim_slide_to_zero": True, "export_force_sampling": True}
    return options
