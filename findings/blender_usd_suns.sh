#!/usr/bin/env bash
# Blender: its USD export writes suns at a quarter of their strength, and with half of their angle.
#
# Versions: bpy 5.0.1 (Blender 5.0.1 as a Python module), Python 3.11.
# Believed: a sun of strength 4 W/m^2 and an angle of 0.53 degrees becomes a UsdLux DistantLight with normalize on,
#   intensity 4 and angle 0.53: normalised, its intensity is the irradiance, and its angle is the whole one.
# What happens: intensity 1 and angle 0.265. A point light of 100 W beside it becomes intensity 31.83 = 100 / pi with
#   normalize on, which UsdLux takes for 100 W again: so the balance between suns and lamps is off by 4.
# Who is hurt: whoever renders Blender's stages elsewhere: daylight is two stops too dark beside lamps, its shadows are
#   half as soft. Blender's own import undoes it, so that round trips do not show it.
# Seen: "sun: intensity 1, angle 0.265; point: intensity 31.831, normalize 1"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bpy==5.0.1
"$folder/venv/bin/python" - "$folder/sun.usda" >"$folder/log" 2>&1 <<'PYTHON'
import math
import sys

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
for kind, values in (("SUN", {"energy": 4.0, "angle": math.radians(0.53)}), ("POINT", {"energy": 100.0})):
    light = bpy.data.lights.new(kind, kind)
    for name, value in values.items():
        setattr(light, name, value)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(kind, light))
bpy.ops.wm.usd_export(filepath=sys.argv[1])
PYTHON
python3 - "$folder/sun.usda" <<'PYTHON'
import re
import sys

text = open(sys.argv[1], encoding="utf-8").read()
value = {}
for kind in ("DistantLight", "SphereLight"):
    block = text.partition(f"def {kind}")[2].partition("}")[0]
    value[kind] = {name: float(number) for name, number in re.findall(r"inputs:(\w+) = ([\d.]+)", block)}
sun, point = value["DistantLight"], value["SphereLight"]
print(f"sun: intensity {sun['intensity']:g}, angle {sun['angle']:.3f};", end=" ")
print(f"point: intensity {point['intensity']:.3f}, normalize {point['normalize']:g}")
sys.exit(0 if (sun["intensity"], round(sun["angle"], 3)) == (1.0, 0.265) else 1)
PYTHON
