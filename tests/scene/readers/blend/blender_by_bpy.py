"""A ``blender`` for tests, made of Blender's Python module: it knows the options that exports need.

Run by a Python that has ``bpy``: ``python blender_by_bpy.py --background ... [FILE] --python SCRIPT -- REQUEST``.
"""

import runpy
import sys

import bpy


def main(words):
    if words == ["--version"]:
        print(f"Blender {bpy.app.version_string}")
        return
    for option in ("--background", "--factory-startup", "--disable-autoexec"):
        assert words.pop(0) == option
    bpy.ops.wm.read_factory_settings()
    if not words[0].startswith("--"):
        try:
            bpy.ops.wm.open_mainfile(filepath=words.pop(0), use_scripts=False)
        except RuntimeError as error:
            sys.exit(f"Error: {error}")
    assert words[:3] == ["--python-exit-code", "1", "--python"]
    assert words[4] == "--"
    sys.argv = ["blender", *words]
    runpy.run_path(words[3], run_name="__main__")


main(sys.argv[1:])
