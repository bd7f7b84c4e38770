#!/usr/bin/env bash
# Gaussian splats: five converters turn the scene of one PLY file in three ways, two of them within one format.
#
# Versions: @playcanvas/splat-transform 2.7.1 and spz-js 1.2.5 (npm), gaussforge 0.6.0, gsply 0.4.6 and
#   usd-convert-gsplat 0.1.15 with usd-core 26.11 (PyPI), Node.js 20, Python 3.
# Believed: the scene stands as it stood, whichever program makes an SPZ, GLB or USD file of a trainer's PLY file. PLY
#   has x to the right, y down and z ahead; SPZ "stores data in RUB", right, up, back (its README, "Coordinate
#   System"); glTF has y up and the front of things to +z (glTF 2.0, 3.4), USD y up where it says so. So a splat 1 to
#   the right, 2 down and 3 ahead is to lie at y = -2 in all of them.
# What happens: GaussForge, gsply and spz-js write PLY's numbers into SPZ, usd-convert-gsplat into a stage with y up;
#   the first three read SPZ alike, so their own round trips are right. splat-transform turns SPZ by 180 degrees about
#   x, but GLB about z.
# Who is hurt: whoever publishes scans: in viewers that keep to the formats, scenes by the first four programs stand
#   on their heads. Of splat-transform's two files, both with y up, a viewer that goes by the numbers shows one from
#   the front and the other from the back.
# Seen: "splat-transform SPZ (1, -2, -3)", "GaussForge SPZ (1, 2, 3)", "gsply SPZ (1, 2, 3)", "spz-js SPZ (1, 2, 3)",
#   "splat-transform GLB (-1, -2, 3)", "usd-convert-gsplat, upAxis Y (1, 2, 3)"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --no-save --ignore-scripts @playcanvas/splat-transform@2.7.1 \
  spz-js@1.2.5 >/dev/null
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check gaussforge==0.6.0 gsply==0.4.6 usd-convert-gsplat==0.1.15 \
  usd-core==26.11
cat >make.mjs <<'NODE'
import { readFileSync, writeFileSync } from "node:fs";
import { loadPly, serializeSpz } from "spz-js";

const cloud = await loadPly(new Blob([readFileSync("scene.ply")]).stream());
writeFileSync("spz-js.spz", Buffer.from(await serializeSpz(cloud)));
NODE
venv/bin/python - <<'PYTHON'
import gzip
import json
import struct
import subprocess
import sys
from pathlib import Path

import gaussforge
import gsply
import numpy as np
from pxr import Usd, UsdGeom

NAMES = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
NAMES += ["scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
SPLAT = [1, 2, 3, 0, 0, 0, 1, 0.2, -0.8, 1, -3, -2, -1, 1, 0, 0, 0]
header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n"
header += "".join(f"property float {name}\n" for name in NAMES) + "end_header\n"
data = header.encode() + np.array(SPLAT, "<f4").tobytes()
Path("scene.ply").write_bytes(data)


def spz(name):
    """Place of the first splat as an SPZ file of versions 2 and 3 stores it: 24 bits a number."""
    unpacked = gzip.decompress(Path(name).read_bytes())
    places = np.frombuffer(unpacked, np.uint8, 9, 16).reshape(3, 3).astype(np.int32)
    numbers = places[:, 0] | places[:, 1] << 8 | places[:, 2].astype(np.int8).astype(np.int32) << 16
    return tuple((numbers / 2 ** unpacked[13]).round().astype(int).tolist())


def glb(name):
    """Place of the first splat of a GLB file with one node and one primitive, by its accessor."""
    content = Path(name).read_bytes()
    length = struct.unpack_from("<I", content, 12)[0]
    document = json.loads(content[20 : 20 + length])
    assert not {"matrix", "rotation", "scale", "translation"} & set(document["nodes"][0])
    accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    return tuple(round(number) for number in accessor["min"])


transform = ["node", "node_modules/@playcanvas/splat-transform/bin/cli.mjs", "-q", "-g", "cpu", "scene.ply"]
subprocess.run([*transform, "--spz-version", "3", "transform.spz"], check=True)
subprocess.run([*transform, "transform.glb"], check=True)
subprocess.run(["node", "make.mjs"], check=True)
subprocess.run(["venv/bin/usd-convert-gsplat", "-i", "scene.ply", "-o", "scene.usda"], check=True, capture_output=True)
Path("gaussforge.spz").write_bytes(gaussforge.GaussForge().convert(data, "ply", "spz")["data"])
gsply.write_spz("gsply.spz", gsply.plyread("scene.ply"))
stage = Usd.Stage.Open("scene.usda")
place = stage.GetDefaultPrim().GetAttribute("positions").Get()[0]
found = {
    "splat-transform SPZ": spz("transform.spz"),
    "GaussForge SPZ": spz("gaussforge.spz"),
    "gsply SPZ": spz("gsply.spz"),
    "spz-js SPZ": spz("spz-js.spz"),
    "splat-transform GLB": glb("transform.glb"),
    f"usd-convert-gsplat, upAxis {UsdGeom.GetStageUpAxis(stage)}": tuple(round(number) for number in place),
}
for name, where in found.items():
    print(name, where)
sys.exit(0 if list(found.values()) == [(1, -2, -3), *[(1, 2, 3)] * 3, (-1, -2, 3), (1, 2, 3)] else 1)
PYTHON
