#!/usr/bin/env bash
# MeshLab: its binary STL files have Materialise's header, and colours of facets by the opposite rule.
#
# Versions: pymeshlab 2025.7.post1 (MeshLab 2025.07), numpy 2.3.5, Python 3.11.
# Believed: a header with COLOR= says that the two bytes after a facet are Materialise's: 15 bits of colour, and a highest
#   bit that is 0 where they count and 1 where the facet has the header's colour. Another program writes the header only
#   where it has colours to tell (Wikipedia, "STL (file format)", section "Color in binary STL").
# What happens: MeshLab writes COLOR= and its grey into each binary STL by default. A red facet gets 0x801f, which is the
#   header's grey by the rule; a mesh without colours gets 0x0000, which is black.
# Who is hurt: whoever opens such a file in a program that keeps to the rule: models without colours are black, and colours
#   are lost. With colormode=False the files have no such header, and VisCAM's colours.
# Seen: "red facet: COLOR= 127 127 127, 0x801f; without colours: COLOR= 127 127 127, 0x0000"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pymeshlab==2025.7.post1 numpy==2.3.5
QT_QPA_PLATFORM=offscreen "$folder/venv/bin/python" - "$folder" <<'PYTHON'
import struct
import sys
from pathlib import Path

import numpy as np
import pymeshlab

corners, triangle = np.eye(3), np.array([[0, 1, 2]])
meshes = {
    "red facet": pymeshlab.Mesh(corners, triangle, f_color_matrix=np.array([[1.0, 0.0, 0.0, 1.0]])),
    "without colours": pymeshlab.Mesh(corners, triangle),
}
found = []
for name, mesh in meshes.items():
    path = Path(sys.argv[1], f"{name}.stl")
    document = pymeshlab.MeshSet()
    document.add_mesh(mesh)
    document.save_current_mesh(str(path))
    data = path.read_bytes()
    (number,) = struct.unpack_from("<H", data, 84 + 48)
    found.append((data[:6], tuple(data[6:9]), number))
    start = f"{data[:6].decode()} {' '.join(map(str, data[6:9]))}"
    print(f"{name}: {start}, {number:#06x}", end="; " if len(found) == 1 else "\n")
sys.exit(0 if found == [(b"COLOR=", (127,) * 3, 0x801F), (b"COLOR=", (127,) * 3, 0)] else 1)
PYTHON
