"""Views of a glTF scene by Blender's Cycles: run by ``cycles.py`` with a Python that has the package ``bpy``.

Time on two cores: as long as its job takes; a view of 16 samples about 12 seconds.

python cycles_views.py JOB.json

The job names the scene, the light, the cameras, the size of a view, samples and threads; views are written as
``view_00.exr`` and so on, and ``seconds.json`` beside them says what each took, of the clock and of all threads.
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import bpy
from mathutils import Matrix


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text())
    folder = Path(job["folder"])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=job["scene"])
    scene = bpy.context.scene
    _settings(scene, job)
    _light(scene, job)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    seconds, cpu_seconds = [], []
    for number in job["views"]:
        _aim(camera, job["cameras"][number], job)
        scene.render.filepath = str(folder / f"view_{number:02}.exr")
        started, used = time.perf_counter(), time.process_time()
        bpy.ops.render.render(write_still=True)
        seconds.append(time.perf_counter() - started)
        cpu_seconds.append(time.process_time() - used)
    found = {"views": seconds, "cpu_views": cpu_seconds, "blender": bpy.app.version_string}
    (folder / "seconds.json").write_text(json.dumps(found))


def _settings(scene: Any, job: dict[str, Any]) -> None:
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = job["size"]
    render.threads_mode, render.threads = "FIXED", job["threads"]
    # The scene stays as it is from view to view, and so does what Cycles made of it.
    render.use_persistent_data = True
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    cycles.device = "CPU"
    cycles.samples = job["spp"]
    cycles.use_adaptive_sampling = job["adaptive"]
    cycles.seed = job["seed"]
    cycles.max_bounces = job["depth"]
    cycles.use_denoising = job["denoise"]
    if job["denoise"]:
        cycles.denoiser = "OPENIMAGEDENOISE"


def _light(scene: Any, job: dict[str, Any]) -> None:
    """The picture of the surroundings lights the scene; the camera sees an even colour behind it."""
    world = bpy.data.worlds.new("world")
    scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    picture = nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.load(job["environment"])
    picture.image.colorspace_settings.name = "Non-Color"
    place, turn = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    # Blender's middle column lies at +x, ours at -z of the file, which is Blender's +y.
    turn.inputs["Rotation"].default_value[2] = math.radians(-90)
    links.new(place.outputs["Generated"], turn.inputs["Vector"])
    links.new(turn.outputs["Vector"], picture.inputs["Vector"])
    light, behind = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeBackground")
    links.new(picture.outputs["Color"], light.inputs["Color"])
    behind.inputs["Color"].default_value = (*job["background"], 1.0)
    path, mix = nodes.new("ShaderNodeLightPath"), nodes.new("ShaderNodeMixShader")
    links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    links.new(light.outputs[0], mix.inputs[1])
    links.new(behind.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs[0])


def _aim(camera: Any, view: dict[str, Any], job: dict[str, Any]) -> None:
    """An off-axis camera: it looks straight ahead, and its film is moved to the side."""
    up = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))  # +y up in the file, +z in Blender
    camera.matrix_world = up @ Matrix(view["world_from_camera"])
    data = camera.data
    data.sensor_fit = "VERTICAL"
    data.angle = job["field"]
    data.shift_x = view["shift"]
    data.clip_start, data.clip_end = job["clip"]


if __name__ == "__main__":
    main()
