#!/usr/bin/env bash
# pillow-heif: a HEIC file saved with `exif=` an Image.Exif lies on its side, with the same Exif as bytes it stands.
#
# Versions: pillow-heif 1.8.1, pillow 13.0.0 (PyPI), Python 3.
# Believed: `image.save(name, exif=picture.getexif())` keeps a photograph upright. Pillow takes an Image.Exif and its
#   bytes alike, and so does pillow-heif's documentation of `save` ("Accepts None, bytes or PIL.Image.Exif class").
# What happens: with bytes pillow-heif writes the orientation as HEIF has it, the property "irot". With an Image.Exif it
#   writes none: the orientation is left in the Exif, which readers of HEIF must not apply (ISO/IEC 23008-12), nor does
#   pillow-heif when it reads the file. No error, no warning.
# Who is hurt: whoever converts telephones' JPEG photographs to HEIC by Pillow's own idiom: those that were taken upright
#   lie on their side in every viewer that follows the standard.
# Seen: "bytes: 40 x 60, irot; Image.Exif: 60 x 40, no irot"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pillow==13.0.0 pillow-heif==1.8.1
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from pathlib import Path

import pillow_heif
from PIL import Image

pillow_heif.register_heif_opener()
exif = Image.Exif()
exif[0x0112] = 6  # stored lying; shown turned by 90 degrees to the right
Image.new("RGB", (60, 40), (200, 30, 30)).save("photo.jpg", exif=exif)
said = []
for name, given in (("bytes", exif.tobytes()), ("Image.Exif", Image.open("photo.jpg").getexif())):
    with Image.open("photo.jpg") as photo:
        photo.save("photo.heic", exif=given)
    turned = "irot" if b"irot" in Path("photo.heic").read_bytes() else "no irot"
    with Image.open("photo.heic") as saved:
        said.append(f"{name}: {saved.width} x {saved.height}, {turned}")
print("; ".join(said))
sys.exit(0 if said == ["bytes: 40 x 60, irot", "Image.Exif: 60 x 40, no irot"] else 1)
PYTHON
