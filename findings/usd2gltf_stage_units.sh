#!/usr/bin/env bash
# usd2gltf: stages in centimetres with z up become glTF scenes in metres that lie down, in other light.
#
# Versions: usd2gltf 0.3.5 with usd-core 26.11 (PyPI), Python 3.
# Believed: a converter minds the stage's `metersPerUnit` and `upAxis`, since glTF knows metres and y up alone (glTF
#   2.0, 3.4), and turns light into its unit: a USD SphereLight has a luminance (UsdLux: `intensity` in nits at
#   exposure 0), a glTF point light candela. A board 100 x 200 units wide and high, of 0.01 m each, z up, is to be 1 m
#   wide and 2 m high; a ball of 10 units in radius and intensity 100 shines with 100 pi 0.1^2 = 3.14 candela.
# What happens: positions and intensities are written as they stand, and no node scales or turns them: 100 m wide, 200
#   m deep, 0 high, and 100 candela. There is no option to ask for anything else.
# Who is hurt: whoever brings stages with z up or in centimetres, as Isaac Sim and Maya have them, to viewers and
#   displays by way of glTF: the scene is 100 times too large or lies down, and the ratio of its lights is wrong; a
#   light that grows gets no brighter.
# Seen: "size (100.0, 0.0, 200.0) in x, y, z; nodes that scale or turn: 0; light 100.0 candela"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check usd2gltf==0.3.5 usd-core==26.11
cd "$folder"
cat >scene.usda <<'USD'
#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "World"
{
    def Mesh "Board"
    {
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (100, 0, 0), (0, 0, 200)]
    }
    def SphereLight "Ball"
    {
        float inputs:intensity = 100
        float inputs:radius = 10
    }
}
USD
venv/bin/usd2gltf -i scene.usda -o scene.gltf >/dev/null
venv/bin/python - <<'PYTHON'
import json
import sys
from pathlib import Path

document = json.loads(Path("scene.gltf").read_text())
place = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
size = tuple(high - low for low, high in zip(place["min"], place["max"], strict=True))
turned = sum(bool({"matrix", "rotation", "scale"} & set(node)) for node in document["nodes"])
light = document["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"]
print(f"size {size} in x, y, z; nodes that scale or turn: {turned}; light {light} candela")
sys.exit(0 if size == (100.0, 0.0, 200.0) and turned == 0 and light == 100.0 else 1)
PYTHON
