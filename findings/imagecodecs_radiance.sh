#!/usr/bin/env bash
# imagecodecs: rgbe_decode() takes XYZ of a Radiance picture for RGB, and refuses the format's older runs of pixels.
#
# Versions: imagecodecs 2026.3.6, NumPy 2, Python 3.
# Believed: a decoder of Radiance pictures (.hdr) knows both formats that a header may name, 32-bit_rle_rgbe and
#   32-bit_rle_xyze, and both codings that the format's description has: runs of bytes, and the older runs of pixels,
#   where a pixel of mantissas 1 1 1 repeats the one before as often as its exponent says.
# What happens: a white pixel that is stored as XYZ (0.95, 1, 1.09) comes back as these numbers, as if they were RGB, and
#   nothing is said. A row with a run of pixels ends in a read error.
# Who is hurt: whoever lights a scene by a sky of xyze: it turns blue. Skies of programs that write runs of pixels cannot
#   be read.
# Seen: "xyze: [0.953, 1.0, 1.094]; run of pixels: RgbeError"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check imagecodecs==2026.3.6
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import imagecodecs


def decoded(format, width, body):
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_{format}\n\n-Y 1 +X {width}\n".encode()
    try:
        return imagecodecs.rgbe_decode(head + body)[0].round(3).tolist()
    except Exception as error:
        return type(error).__name__


# Mantissas of 256 parts times two to the exponent less 128: 122, 128, 140 and 129 are 0.953, 1 and 1.094.
xyze = decoded("xyze", 1, bytes([122, 128, 140, 129]))[0]
run = decoded("rgbe", 4, bytes([128, 64, 32, 129, 1, 1, 1, 3]))
print(f"xyze: {[round(x, 3) for x in xyze]}; run of pixels: {run}")
sys.exit(0 if [round(x, 2) for x in xyze] == [0.95, 1.0, 1.09] and run == "RgbeError" else 1)
PYTHON
