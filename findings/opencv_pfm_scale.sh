#!/usr/bin/env bash
# OpenCV divides PFM files by the scale in their third line: disparities of Middlebury's stereo data come out 255-fold.
#
# Versions: opencv-python-headless 5.0.0.93 and pillow 13.0.0 (PyPI), Python 3.
# Believed: imread(..., IMREAD_UNCHANGED) gives the floats that a PFM stores. Of the third line, only the sign means
#   something (the order of bytes). So says Middlebury's description of its format: the size of the scale is ignored,
#   values are disparities in pixels.
# What happens: OpenCV divides all values by the size of the scale. The writers of Middlebury's kit and pfmLib put 1/255
#   there by default, so a disparity of 40 pixels is read as 10199. Pillow reads 40. With a scale of 1, as of the 4D
#   light field benchmark's files, both agree, which hides it.
# Who is hurt: whoever takes disparity or depth for a light field, a photograph with depth or a judgement of views from
#   such files: depths are 255 times too near, or errors of a method 255 times too large, and nothing is reported.
# Seen: "scale -1: OpenCV 40.0, Pillow 40.0", "scale -0.003922: OpenCV 10198.9, Pillow 40.0"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check opencv-python-headless==5.0.0.93 pillow==13.0.0
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

lines = []
for scale in ("-1", "-0.003922"):
    Path("disparity.pfm").write_bytes(f"Pf\n2 2\n{scale}\n".encode() + np.full(4, 40, "<f4").tobytes())
    opencv = cv2.imread("disparity.pfm", cv2.IMREAD_UNCHANGED)[0, 0]
    pillow = np.asarray(Image.open("disparity.pfm"))[0, 0]
    lines.append(f"scale {scale}: OpenCV {opencv:.1f}, Pillow {pillow:.1f}")
print("\n".join(lines))
seen = ["scale -1: OpenCV 40.0, Pillow 40.0", "scale -0.003922: OpenCV 10198.9, Pillow 40.0"]
sys.exit(0 if lines == seen else 1)
PYTHON
