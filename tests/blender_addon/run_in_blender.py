"""Run by Blender: installs the packed add-on, uses it, and takes it away.

Arguments, after ``--``: the packed add-on, the command ``lippmann``, a folder to write into.
"""

import sys
from pathlib import Path

import bpy

PACKED, COMMAND, FOLDER = sys.argv[-3], sys.argv[-2], Path(sys.argv[-1])
NAME = "bl_ext.user_default.lippmann"


def make_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("triangle")
    mesh.from_pydata([(-1, 0, -1), (1, 0, -1), (0, 0, 1)], [], [(0, 1, 2)])
    scene.collection.objects.link(bpy.data.objects.new("triangle", mesh))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -6.0, 0.0), (1.5708, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    hidden = bpy.data.objects.new("hidden", mesh)
    scene.collection.objects.link(hidden)
    hidden.hide_set(True)
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0.5, 0.5, 0.5)
    return scene, hidden


def error_of(run):
    try:
        run()
    except RuntimeError as error:
        return str(error)
    raise AssertionError("it went well")


bpy.ops.extensions.package_install_files(filepath=PACKED, repo="user_default", enable_on_install=True)
scene, hidden = make_scene()
bpy.ops.preferences.addon_enable(module=NAME)
assert "lippmann" in dir(bpy.ops)
preferences = bpy.context.preferences.addons[NAME].preferences
settings = scene.lippmann

preferences.command = str(FOLDER / "gone")
assert "the command lippmann is not found" in error_of(bpy.ops.lippmann.preview)
preferences.command = COMMAND
assert "save the Blender file first" in error_of(bpy.ops.lippmann.render)
settings.output = str(FOLDER / "gone" / "a.png")
assert "there is no folder" in error_of(bpy.ops.lippmann.render)
settings.output = str(FOLDER / "a.png")
settings.display = "no-such-display"
assert "no-such-display" in error_of(bpy.ops.lippmann.render)
assert not bpy.ops.lippmann.cancel.poll()

settings.display, settings.samples = str(FOLDER / "small.toml"), 1
assert bpy.ops.lippmann.render() == {"FINISHED"}
assert (FOLDER / "a.png").is_file()
assert bpy.ops.lippmann.preview() == {"FINISHED"}
assert bpy.ops.lippmann.preview() == {"FINISHED"}
(image,) = (image for image in bpy.data.images if image.name.startswith("Lippmann preview"))
assert image.packed_file is not None
assert image.size[0] > 8
assert hidden.hide_get(), "the scene is left as it was"
assert [each.name for each in bpy.data.scenes] == ["Scene"]

bpy.ops.preferences.addon_disable(module=NAME)
assert not hasattr(bpy.types.Scene, "lippmann")
assert not hasattr(bpy.types, "LIPPMANN_PT_panel")
print("the add-on works")
