#!/usr/bin/env bash
# PyAV: a frame of a spatial film (MV-HEVC) has no side data that can be read, so which eye a view is for is not told.
#
# Versions: av 18.1.0 (FFmpeg 8.1.2), NumPy 2, Python 3.
# Believed: with the decoder's option view_ids both views of an MV-HEVC stream come one after the other, and each
#   frame's side_data tells its number and, where the film has the message about reference displays, its eye.
# What happens: both views come, in the order of their layers. But frame.side_data raises ValueError on every frame,
#   even without the option: FFmpeg numbers views by side data of the kind 29, which PyAV does not know. Side data that
#   it does know, such as STEREO3D, cannot be reached either.
# Who is hurt: whoever reads spatial films of telephones and headsets by PyAV, and whoever lists the side data of any
#   film's frames: one spatial one ends the program. Left and right have to be read from the stream's own message.
# Seen: "frames: 1 and 2; colours: [199, 39, 40] and [40, 58, 219]; side_data: ValueError: 29 is not a valid Type"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check av==18.1.0 numpy
"$folder/venv/bin/python" - "$folder/spatial.mov" <<'PYTHON'
import base64
import sys

import av

# One frame of 64 x 48 pixels, the left view red, the right one blue, coded by x265 4.3 (--multiview-config).
FILM = base64.b64decode(
    "AAAAFGZ0eXBxdCAgAAACAHF0ICAAAAAId2lkZQAAAWFtZGF0AAAANkABDBH//wNwAAADAJAAAAMAAAMAHpKBWx4gABgosuDAQAAAE/cAAAMAAA"
    "MD0aAIAAYUAQhK6QAAAClCAQEDcAAAAwCQAAADAAADAB6gIIMWWSqvK5qAgICCAAAH0AAAu4AoCAAAAA1CCQ6Fq8rmoCAgICgYAAAACEQBxXGj"
    "FQCgAAAACEQJSFcYMVAKAAAACU4BsAQEDQAQgAAAAAtOAbIGAFNgAgAggAAAAC1OAbMm4IAQAgAAAwAAAwAAQAgFAJUAACRYAQGUAAUYsAkoCA"
    "XUAAA5YBwqYIAAAAAGTgG0AUuAAAAAMSgBo8J2V1I+yv/f1P/mpocghzyRnnrLW93mH/61C7GpXc8m2JaXgs9voeL5w3YQ9GAAAAA5KAmQgDMJ"
    "2V2Y1IZv8n7femf/ac7EVOqh+Q/KsXNz/35CqIJ1fA+eOkixpI8KuUg1Y2Lumow+ozSeAAADT21vb3YAAABsbXZoZAAAAAAAAAAAAAAAAAAAA+"
    "gAAAAqAAEAAAEAAAAAAAAAAAAAAAABAAAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAIAAAK6dHJhawAAAFx0a2hkAAAAAwAAAAAAAAAAAAAAAQAAAAAAAAAqAAAAAAAAAAAAAAAAAAAAAAABAAAAAAAAAAAAAAAAAAAAAQAAAAAAAA"
    "AAAAAAAAAAQAAAAABAAAAAMAAAAAAAJGVkdHMAAAAcZWxzdAAAAAAAAAABAAAAKgAAAAAAAQAAAAACMm1kaWEAAAAgbWRoZAAAAAAAAAAAAAAA"
    "AAAAMAAAAAIAf/8AAAAAAC1oZGxyAAAAAG1obHJ2aWRlAAAAAAAAAAAAAAAADFZpZGVvSGFuZGxlcgAAAd1taW5mAAAAFHZtaGQAAAABAAAAAA"
    "AAAAAAAAAsaGRscgAAAABkaGxydXJsIAAAAAAAAAAAAAAAAAtEYXRhSGFuZGxlcgAAACRkaW5mAAAAHGRyZWYAAAAAAAAAAQAAAAx1cmwgAAAA"
    "AQAAAXFzdGJsAAABDXN0c2QAAAAAAAAAAQAAAP1oZXYxAAAAAAAAAAEAAAAARkZNUAAAAgAAAAIAAEAAMABIAAAASAAAAAAAAAABAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAGP//AAAAlWh2Y0MBA3AAAACQAAAAAAAe8AD8/fj4AAAPAyAAAQA2QAEMEf//A3AAAAMAkAAAAwAA"
    "AwAekoFbHiAAGCiy4MBAAAAT9wAAAwAAAwPRoAgABhQBCErpIQABAClCAQEDcAAAAwCQAAADAAADAB6gIIMWWSqvK5qAgICCAAAH0AAAu4AoCC"
    "IAAQAIRAHFcaMVAKAAAAASY29scm5jbGMAAQABAAEAAAAYc3R0cwAAAAAAAAABAAAAAQAAAgAAAAAcc3RzYwAAAAAAAAABAAAAAQAAAAEAAAAB"
    "AAAAFHN0c3oAAAAAAAABWQAAAAEAAAAUc3RjbwAAAAAAAAABAAAAJAAAACF1ZHRhAAAAGalzd3IADVXETGF2ZjYyLjEyLjEwMg=="
)
with open(sys.argv[1], "wb") as file:
    file.write(FILM)


def frames(options):
    with av.open(sys.argv[1]) as film:
        stream = film.streams.video[0]
        stream.codec_context.options = options
        return list(film.decode(stream))


one, both = frames({}), frames({"view_ids": "-1"})
left, right = (frame.to_ndarray(format="rgb24")[40, 5].tolist() for frame in both)
told = set()
for frame in one + both:
    try:
        told.add(f"{len(frame.side_data)} items")
    except ValueError as error:
        told.add(f"ValueError: {error}")
print(f"frames: {len(one)} and {len(both)}; colours: {left} and {right}; side_data: {', '.join(sorted(told))}")
sys.exit(0 if len(both) == 2 and left[0] > 150 < right[2] and told == {"ValueError: 29 is not a valid Type"} else 1)
PYTHON
