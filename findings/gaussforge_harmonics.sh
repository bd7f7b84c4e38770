#!/usr/bin/env bash
# GaussForge: its compressed PLY files mix the harmonics' colours, and viewers find no splats in its KSPLAT files.
#
# Versions: gaussforge 0.6.0, plyfile 1.1.5 and numpy 2.3.5 (PyPI), @playcanvas/splat-transform 2.7.1,
#   @mkkellogg/gaussian-splats-3d 0.4.7 and three 0.170.0 (npm), Node.js 20, Python 3.
# Believed: a splat keeps its spherical harmonics on the way from a trainer's PLY file to PlayCanvas's compressed PLY,
#   which lists them in the same order: all of red, all of green, all of blue. KSPLAT lists them band by band, and its
#   header says how many splats it has room for.
# What happens: compressed PLY gets red, green and blue of one coefficient after another, so all readers, GaussForge's
#   own among them, take the three colours of the first coefficient for the first three of red. KSPLAT gets them
#   colour by colour, through all bands, and room for 0 splats: GaussianSplats3D, whose format it is, finds none.
#   GaussForge reads its own KSPLAT rightly, and the colours of GaussianSplats3D's wrongly.
# Who is hurt: whoever makes splats smaller for the web or for light-field displays. Colours from the mean direction
#   are right; what differs from view to view, such as glints, gets colours of its own, and nothing is reported.
# Seen: "compressed PLY: red 1, 9, 17, 2 of 1, 2, 3, 4", "KSPLAT: 0 splats of 2, red 1, 2, 3, 10", "read from
#   GaussianSplats3D's KSPLAT: red 1, 2, 3, 9"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --no-save --ignore-scripts @playcanvas/splat-transform@2.7.1 \
  @mkkellogg/gaussian-splats-3d@0.4.7 three@0.170.0 >/dev/null
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check gaussforge==0.6.0 plyfile==1.1.5 numpy==2.3.5
cat >viewer.mjs <<'NODE'
import { readFileSync, writeFileSync } from "node:fs";

globalThis.window = globalThis; // the library asks it for its size, which files do not need
const { PlyParser, SplatBuffer, SplatBufferGenerator } = await import("@mkkellogg/gaussian-splats-3d");
const bytes = (name) => new Uint8Array(readFileSync(name)).buffer;
const splats = PlyParser.parseToUncompressedSplatArray(bytes("scene.ply"), 2);
const own = SplatBufferGenerator.getStandardGenerator(0, 0).generateFromUncompressedSplatArray(splats);
writeFileSync("viewer.ksplat", new Uint8Array(own.bufferData));
const count = (name) => new SplatBuffer(bytes(name)).getSplatCount();
console.log(`${count("viewer.ksplat")} ${count("gaussforge.ksplat")}`);
NODE
venv/bin/python - <<'PYTHON'
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import gaussforge
import numpy as np
from plyfile import PlyData, PlyElement

forge = gaussforge.GaussForge()
SHAPE = {"opacity": 1, "scale_0": -3, "scale_1": -2, "scale_2": -1, "rot_0": 1, "rot_1": 0, "rot_2": 0, "rot_3": 0}
# Two bands: 1 to 8 of red, 9 to 16 of green and 17 to 24 of blue, each divided by 10.
SPLAT = {"x": 1, "y": 2, "z": 3, "nx": 0, "ny": 0, "nz": 0, "f_dc_0": 1, "f_dc_1": 0.2, "f_dc_2": -0.8}
SPLAT |= {f"f_rest_{number}": (number + 1) / 10 for number in range(24)} | SHAPE
splats = np.zeros(2, [(name, "<f4") for name in SPLAT])
for name, value in SPLAT.items():
    splats[name] = value
splats["x"] = 1, 2
PlyData([PlyElement.describe(splats, "vertex")]).write("scene.ply")
ply = Path("scene.ply").read_bytes()


def red(data):
    """The first four coefficients of red, times 10, in the bytes of a PLY file."""
    splat = PlyData.read(BytesIO(data))["vertex"].data[0]
    return [round(float(splat[f"f_rest_{number}"]) * 10) for number in range(4)]


def transform(source, target):
    command = ["node", "node_modules/@playcanvas/splat-transform/bin/cli.mjs", "-q", "-w", "-g", "cpu", source, target]
    subprocess.run(command, check=True)
    return Path(target).read_bytes()


def convert(name, kind):
    return red(forge.convert(Path(name).read_bytes(), kind, "ply")["data"])


Path("gaussforge.compressed.ply").write_bytes(forge.convert(ply, "ply", "compressed.ply")["data"])
Path("gaussforge.ksplat").write_bytes(forge.convert(ply, "ply", "ksplat")["data"])
transform("scene.ply", "transform.compressed.ply")
viewer = subprocess.run(["node", "--no-warnings", "viewer.mjs"], check=True, capture_output=True, text=True)
own, forged = viewer.stdout.split()
right = [1, 2, 3, 4]
assert red(transform("transform.compressed.ply", "transform.ply")) == right
assert convert("transform.compressed.ply", "compressed.ply") == right  # the order of the format, by both readers
assert own == "2" and red(transform("viewer.ksplat", "viewer.ply")) == right
compressed = red(transform("gaussforge.compressed.ply", "forged.ply"))
ksplat = red(transform("gaussforge.ksplat", "ksplat.ply"))
back = convert("viewer.ksplat", "ksplat")
again = convert("gaussforge.compressed.ply", "compressed.ply")
print(f"compressed PLY: red {compressed} of {right}, by GaussForge {again}")
print(f"KSPLAT: {forged} splats of {own}, red {ksplat}; read from GaussianSplats3D's KSPLAT: red {back}")
found = (compressed, again, forged, ksplat, back)
sys.exit(0 if found == ([1, 9, 17, 2], [1, 9, 17, 2], "0", [1, 2, 3, 10], [1, 2, 3, 9]) else 1)
PYTHON
