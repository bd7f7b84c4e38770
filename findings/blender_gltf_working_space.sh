#!/usr/bin/env bash
# Blender: its glTF export writes colours in the working space of the file, and says nothing of it.
#
# Versions: bpy 5.0.1 (Blender 5.0.1 as a Python module), Python 3.11.
# Believed: glTF's base colours and lights are linear with the primaries of Rec. 709, so that an exporter converts them
#   where the file's working space is another (Blender 5 offers ACEScg and Rec. 2020). Blender itself converts a file's
#   colours when its working space changes: it looks the same before and after.
# What happens: the numbers of the working space are written as they are. A red of 0.8 0.1 0.1 becomes 0.529 0.149 0.114,
#   a light of 1 0.2 0.2 becomes 0.690 0.256 0.216.
# Who is hurt: whoever takes a model from a file whose working space is not Rec. 709 to any viewer, engine or print: it is
#   dull there, and nothing in the file tells why.
# Seen: "Linear Rec.709: material 0.800 0.100 0.100, light 1.000 0.200 0.200" and
#   "ACEScg: material 0.529 0.149 0.114, light 0.690 0.256 0.216"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bpy==5.0.1
for space in "Linear Rec.709" ACEScg; do
    "$folder/venv/bin/python" - "$folder/$space.gltf" "$space" >"$folder/log" 2>&1 <<'PYTHON'
import sys

import bpy

bpy.ops.wm.read_factory_settings()
material = bpy.data.objects["Cube"].data.materials[0]
shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
shader.inputs["Base Color"].default_value = (0.8, 0.1, 0.1, 1)
bpy.data.objects["Light"].data.color = (1, 0.2, 0.2)
if sys.argv[2] != "Linear Rec.709":
    bpy.ops.wm.set_working_color_space(working_space=sys.argv[2], convert_colors=True)
bpy.ops.export_scene.gltf(filepath=sys.argv[1], export_format="GLTF_SEPARATE", export_lights=True)
PYTHON
done
python3 - "$folder" <<'PYTHON'
import json
import sys
from pathlib import Path

found = {}
for space in ("Linear Rec.709", "ACEScg"):
    stage = json.loads(Path(sys.argv[1], f"{space}.gltf").read_text(encoding="utf-8"))
    material = stage["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][:3]
    light = stage["extensions"]["KHR_lights_punctual"]["lights"][0]["color"]
    found[space] = [round(value, 2) for value in (*material, *light)]
    words = [" ".join(f"{value:.3f}" for value in color) for color in (material, light)]
    print(f"{space}: material {words[0]}, light {words[1]}")
wanted = [0.53, 0.15, 0.11, 0.69, 0.26, 0.22]
sys.exit(0 if found["Linear Rec.709"] == [0.8, 0.1, 0.1, 1.0, 0.2, 0.2] and found["ACEScg"] == wanted else 1)
PYTHON
