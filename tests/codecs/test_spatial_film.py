"""The first pair of a spatial film: of x265's multi-view stream, decoded by FFmpeg."""

from __future__ import annotations

import base64

import av
import numpy as np
import pytest

from lippmann.codecs.stereo_pairs import read_pair
from lippmann.errors import PictureError

#: One frame of 64 x 48 pixels, its upper half at half the codes: left 200 40 40, right 40 60 220. Coded by x265 4.3
#: (``--multiview-config``, two files, ``--qp 20 --ctu 16``), the left view as the base layer; QuickTime by FFmpeg 8.1.
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
#: The message about reference displays: left view 0, right view 1; and the other way round.
DISPLAYS, SWAPPED = bytes.fromhex("4e01b004040d0010"), bytes.fromhex("4e01b004040a8010")


def colors(path):
    return [each.codes()[40, 5].tolist() for each in read_pair(path)]


def is_near(codes, expected):
    return np.abs(np.subtract(codes, expected)).max() <= 3


@pytest.mark.parametrize(
    ("message", "order"),
    [(DISPLAYS, 1), (SWAPPED, -1), (DISPLAYS.replace(b"\xb0", b"\xc8"), 1), (DISPLAYS[:4] + bytes(4), 1)],
    ids=["left first", "right first", "no message", "damaged message"],
)
def test_both_views_of_the_first_frame_come_in_the_order_of_the_message(tmp_path, message, order):
    assert FILM.count(DISPLAYS) == 1
    path = tmp_path / "spatial.mov"
    path.write_bytes(FILM.replace(DISPLAYS, message))
    left, right = colors(path)[::order]
    assert is_near(left, (200, 40, 40))
    assert is_near(right, (40, 60, 220))
    pair = read_pair(path)
    assert [each.size for each in pair] == [(64, 48)] * 2
    assert pair[0].notes == ("of the film the first frame is read",)


@pytest.mark.parametrize("codec", ["libx264", "libx265"])
def test_a_film_of_one_view_is_no_pair(tmp_path, codec):
    with av.open(str(tmp_path / "flat.mp4"), "w") as film:
        stream = film.add_stream(codec, rate=24, options={"x265-params": "log-level=error"})
        stream.width, stream.height, stream.pix_fmt = 64, 64, "yuv420p"
        for _ in range(3):
            film.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8), format="rgb24")))
        film.mux(stream.encode())
    with pytest.raises(PictureError, match=r"flat\.mp4: is a film of one view; of films a spatial one"):
        read_pair(tmp_path / "flat.mp4")


@pytest.mark.parametrize("data", [b"", b"no film", FILM[:700], FILM.replace(b"hev1", b"????")])
def test_damaged_films(tmp_path, data):
    (tmp_path / "a.mov").write_bytes(data)
    with pytest.raises(PictureError, match=r"a\.mov: (cannot be decoded \(.*\); a film|is a film of one view)"):
        read_pair(tmp_path / "a.mov")
