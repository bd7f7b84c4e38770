#!/usr/bin/env bash
# Pillow: DDS textures of BC1, BC2 and BC3 blocks are refused where their header names them sRGB-coded, as colours are.
#
# Versions: Pillow 13.0.0.
# Believed: Pillow reads BC1 to BC3 blocks, with the old header (DXT1, DXT3, DXT5) and with the extended one (DX10). The
#   formats BC1_UNORM_SRGB, BC2_UNORM_SRGB and BC3_UNORM_SRGB have the same blocks, and differ in a number of the header
#   that tells how codes are meant. Pillow takes BC7_UNORM_SRGB and R8G8B8A8_UNORM_SRGB, and keeps that in mind as gamma.
# What happens: the three are refused with NotImplementedError.
# Who is hurt: whoever reads models of games in Python (trimesh and others open textures through Pillow): colour textures
#   that texconv or NVIDIA's tools write as sRGB are missing, while roughness and other data beside them are read.
# Seen: "BC1 read, BC1 sRGB NotImplementedError" and the same of BC2 and BC3, "BC7 read, BC7 sRGB read"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pillow==13.0.0
"$folder/venv/bin/python" - <<'PYTHON'
import io
import struct
import sys

from PIL import Image

# Number of the plain format and of the one that is named sRGB-coded (DXGI_FORMAT); one block of 4 x 4 pixels.
KINDS = {
    "BC1": (71, 72, struct.pack("<HHI", 0xF800, 0x001F, 0)),
    "BC2": (74, 75, b"\xff" * 8 + struct.pack("<HHI", 0xF800, 0x001F, 0)),
    "BC3": (77, 78, b"\xff\xff" + bytes(6) + struct.pack("<HHI", 0xF800, 0x001F, 0)),
    "BC7": (98, 99, b"\x40" + b"\xff" * 15),
}


def dds(number, block):
    flags = 0x1 | 0x2 | 0x4 | 0x1000 | 0x80000
    head = struct.pack("<4s7I44x", b"DDS ", 124, flags, 4, 4, len(block), 0, 0)
    pixel_format = struct.pack("<2I4s5I", 32, 0x4, b"DX10", 0, 0, 0, 0, 0)
    return head + pixel_format + struct.pack("<I16x", 0x1000) + struct.pack("<5I", number, 3, 0, 1, 0) + block


def outcome(data):
    try:
        with Image.open(io.BytesIO(data)) as picture:
            picture.load()
    except Exception as error:
        return type(error).__name__
    return "read"


found = {}
for name, (plain, coded, block) in KINDS.items():
    found[name] = outcome(dds(plain, block)), outcome(dds(coded, block))
    print(f"{name} {found[name][0]}, {name} sRGB {found[name][1]}")
refused = ("read", "NotImplementedError")
sys.exit(0 if found == {"BC1": refused, "BC2": refused, "BC3": refused, "BC7": ("read", "read")} else 1)
PYTHON
