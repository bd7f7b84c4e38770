#!/usr/bin/env bash
# Pillow: a stereo photograph (MPO) that is saved again says no longer that it is one.
#
# Versions: pillow 13.0.0 (PyPI), Python 3.
# Believed: Pillow reads and writes MPO, so `save(..., save_all=True)` of a 3D camera's file leaves a pair of views.
#   The format (CIPA DC-007, "MP type code") tells pairs from others: both pictures are "Multi-Frame Image:
#   (Disparity)".
# What happens: it writes "Baseline MP Primary Image", which is the type of a photograph with previews, and
#   "Undefined" for the right eye's picture, for those that come from a camera, too, and there is no argument to ask
#   for other types. A plain save(), even to a name that ends in .mpo with the format named, keeps the left view
#   alone.
# Who is hurt: whoever crops, scales or aligns stereo photographs, or makes them of rendered views, by Pillow or by
#   programs on it, such as StereoscoPy: viewers and 3D displays that go by the type show a flat photograph.
# Seen: "camera: Disparity, Disparity; saved again: Primary, Undefined; plain save: 1 picture"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pillow==13.0.0
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import re
import struct
import sys

from PIL import Image

WORDS = {
    "Multi-Frame Image: (Disparity)": "Disparity",
    "Baseline MP Primary Image": "Primary",
    "Undefined": "Undefined",
}


def types(name):
    with Image.open(name) as pair:
        entries = pair.mpinfo[0xB002] if pair.format == "MPO" else []
        return [WORDS[entry["Attribute"]["MPType"]] for entry in entries]


left, right = Image.new("RGB", (64, 48), (200, 30, 30)), Image.new("RGB", (64, 48), (30, 30, 200))
left.save("camera.mpo", save_all=True, append_images=[right])
# The types that a camera writes, in the places of Pillow's: attribute, size, offset (0 for the first), no others.
with open("camera.mpo", "rb") as file:
    data = bytearray(file.read())
place = re.compile(re.escape(struct.pack("<L", 0x030000)) + b".{4}" + bytes(8), re.DOTALL).search(data).start()
struct.pack_into("<L", data, place, 0x20020002)
struct.pack_into("<L", data, place + 16, 0x00020002)
with open("camera.mpo", "wb") as file:
    file.write(data)
with Image.open("camera.mpo") as pair:
    pair.save("again.mpo", save_all=True)
    pair.save("plain.mpo", format="MPO")
with Image.open("plain.mpo") as plain:
    count = getattr(plain, "n_frames", 1)
camera, again = types("camera.mpo"), types("again.mpo")
print(f"camera: {', '.join(camera)}; saved again: {', '.join(again)}; plain save: {count} picture")
sys.exit(0 if camera == ["Disparity"] * 2 and again == ["Primary", "Undefined"] and count == 1 else 1)
PYTHON
