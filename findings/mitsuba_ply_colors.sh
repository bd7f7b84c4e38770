#!/usr/bin/env bash
# Mitsuba 3: the colours of a PLY file have three meanings, by the type of number that they are stored in.
#
# Versions: mitsuba 3.9.1, numpy 2.3.5 (PyPI), Python 3.
# Believed: `vertex_color` of a PLY file is the same colour, whether it is stored in 8 bits, as MeshLab and most
#   scanners do, in 16 bits or as a real number: half of the range is half of the range.
# What happens: 8 bits stay 0 to 255, so a grey surface has a reflectance of 128. 16 and 32 bits are divided by their
#   range and taken from sRGB to linear light. Real numbers are taken for linear light. Of all integers one warning
#   says that colours "are expected to be in the [0, 1] range"; only those of 8 bits lie outside of it.
# Who is hurt: whoever renders scans. Those in 8 bits gain light at each bounce; divided by 255, as the warning asks,
#   their sRGB numbers pass for linear light and look pale. Files in 16 bits need neither.
# Seen: "8 bits: 128.000, 16 bits: 0.214, 32 bits: 0.214, real: 0.500"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.3.5
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)


def red(name, kind, half):
    """`vertex_color` in red, of a triangle whose colours are half of what the type of number can hold."""
    colours = ("red", "green", "blue")
    corners = np.zeros(3, [(axis, "<f4") for axis in "xyz"] + [(colour, kind) for colour in colours])
    corners["x"], corners["y"] = [0, 1, 0], [0, 0, 1]
    for colour in colours:
        corners[colour] = half
    properties = "".join(f"property float {axis}\n" for axis in "xyz")
    properties += "".join(f"property {name} {colour}\n" for colour in colours)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex 3\n{properties}"
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    with open("mesh.ply", "wb") as file:
        file.write(header.encode() + corners.tobytes() + b"\x03" + np.array([0, 1, 2], "<i4").tobytes())
    return float(mi.traverse(mi.load_dict({"type": "ply", "filename": "mesh.ply"}))["vertex_color"][0])


found = {
    "8 bits": red("uchar", "u1", 128),
    "16 bits": red("ushort", "<u2", 32768),
    "32 bits": red("uint", "<u4", 2**31),
    "real": red("float", "<f4", 0.5),
}
line = ", ".join(f"{name}: {value:.3f}" for name, value in found.items())
print(line)
sys.exit(0 if line == "8 bits: 128.000, 16 bits: 0.214, 32 bits: 0.214, real: 0.500" else 1)
PYTHON
