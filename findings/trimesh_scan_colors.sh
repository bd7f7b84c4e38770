#!/usr/bin/env bash
# trimesh: the colours of a scan's points become brighter on the way from PLY to glTF.
#
# Versions: trimesh 5.2.0 (PyPI), three 0.180.0 (npm), Python 3, Node 18 or newer.
# Believed: a mesh that is read from PLY and exported as GLB keeps its colours.
# What happens: the bytes are handed on as they are. In PLY they are coded as sRGB, as scanners, MeshLab and three.js
#   have it; of COLOR_0 glTF 2.0 says that its values are linear. The grey 128 means 0.216 of white in the PLY and 0.502
#   in the GLB, which every glTF viewer shows as 188. Colours of a texture are not touched, as those are sRGB in both.
# Who is hurt: whoever hands a coloured scan to a viewer on the web or to a renderer: it looks washed out. Converting it
#   back with trimesh hides it, and so does any viewer that is wrong in the same way.
# Seen: "PLY 0.216, GLB 0.502"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0
cd "$folder"
npm install --silent --no-audit --no-fund --no-save three@0.180.0
"$folder/venv/bin/python" - <<'PYTHON'
from pathlib import Path

import trimesh

rows = "\n".join(f"{x} {y} 0 128 128 128" for x, y in ((0, 0), (1, 0), (0, 1)))
head = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property float {axis}\n" for axis in "xyz")
head += "".join(f"property uchar {color}\n" for color in ("red", "green", "blue"))
head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
Path("scan.ply").write_text(head + rows + "\n3 0 1 2\n")
trimesh.load("scan.ply", process=False).export("scan.glb")
PYTHON
cat > try.mjs <<'JAVASCRIPT'
import fs from "node:fs";
globalThis.self = globalThis;
const { PLYLoader } = await import("three/addons/loaders/PLYLoader.js");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const bytes = (name) => { const b = fs.readFileSync(name); return b.buffer.slice(b.byteOffset, b.byteOffset + b.length); };
const ply = new PLYLoader().parse(bytes("scan.ply")).attributes.color.getX(0);
const gltf = await new GLTFLoader().parseAsync(bytes("scan.glb"), "");
let glb;
gltf.scene.traverse((part) => { if (part.isMesh) glb = part.geometry.attributes.color.getX(0); });
console.log(`PLY ${ply.toFixed(3)}, GLB ${glb.toFixed(3)}`);
process.exit(ply.toFixed(3) === "0.216" && glb.toFixed(3) === "0.502" ? 0 : 1);
JAVASCRIPT
node --no-warnings try.mjs
