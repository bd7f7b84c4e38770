#!/usr/bin/env bash
# OpenEXR's Python binding: channels of luminance and chroma come back wrong, and files that have them cannot be written again.
#
# Versions: OpenEXR 3.5.3 (PyPI), NumPy 2, Python 3.
# Believed: a channel of sampling 2 is given either by the pixels that the file stores (half as many a side, as the
#   binding itself reads them) or by all pixels, of which every second is stored; what was read can be written.
# What happens: pixels of half the size are refused ("channel shapes differ"), those that the binding has just read too.
#   Of pixels of the full size the first quarter in memory is stored, as if it were the picture at half the size: of
#   the numbers 0 to 23 in 4 rows of 6, the file holds 0 1 2 / 3 4 5; every second pixel is 0 2 4 / 12 14 16.
# Who is hurt: whoever writes or copies pictures of luminance and chroma (Y, RY, BY): the colours are those of the
#   picture's uppermost rows, stretched over all of it, without a word.
# Seen: "stored [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]", then "written again: ValueError: channel shapes differ: ...".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check OpenEXR==3.5.3 numpy
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import numpy as np
import OpenEXR

header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
luminance, chroma = np.ones((4, 6), np.float16), np.arange(24, dtype=np.float16).reshape(4, 6)
channels = {"Y": OpenEXR.Channel(luminance), "RY": OpenEXR.Channel("RY", chroma, 2, 2)}
OpenEXR.File(header, channels).write("a.exr")
read = OpenEXR.File("a.exr", separate_channels=True)
stored = read.channels()["RY"].pixels.tolist()
print("stored", stored)
again = ""
try:
    read.write("b.exr")
except ValueError as error:
    again = str(error)
    print("written again: ValueError:", again)
sys.exit(0 if stored != chroma[::2, ::2].tolist() and "channel shapes differ" in again else 1)
PYTHON
