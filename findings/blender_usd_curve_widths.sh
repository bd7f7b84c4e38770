#!/usr/bin/env bash
# Blender: its USD export makes all curves two units wide, whatever their bevel.
#
# Versions: bpy 5.3.0 (Blender 5.3.0 as a Python module), Python 3.13.
# Believed: a curve with a bevel of 0.1 is a tube of that radius in Blender, so its widths in the stage are 0.2; one
#   without a bevel, which Blender's renderers do not show, has none.
# What happens: both are BasisCurves with widths of 2: twice the factor 1 that scales the bevel at each point.
# Who is hurt: whoever renders Blender's stages elsewhere: cables are thicker than the room that they hang in, and paths
#   that only lead cameras are seen. Curves converted to meshes before the export come out right.
# Seen: "bevel 0.1: widths 2; no bevel: widths 2"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.13 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bpy==5.3.0
"$folder/venv/bin/python" - "$folder" >"$folder/log" 2>&1 <<'PYTHON'
import sys

import bpy

for bevel in (0.1, 0.0):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = bevel
    bpy.ops.wm.usd_export(filepath=f"{sys.argv[1]}/{bevel:g}.usda")
PYTHON
python3 - "$folder" <<'PYTHON'
import re
import sys

widths = {}
for bevel in ("0.1", "0"):
    text = open(f"{sys.argv[1]}/{bevel}.usda", encoding="utf-8").read()
    block = text.partition("def BasisCurves")[2]
    listed = re.search(r"float\[\] widths = \[([^]]*)\]", block)[1]
    widths[bevel] = sorted({float(number) for number in listed.split(",")})
print(f"bevel 0.1: widths {widths['0.1'][0]:g}; no bevel: widths {widths['0'][0]:g}")
sys.exit(0 if widths == {"0.1": [2.0], "0": [2.0]} else 1)
PYTHON
