"""Views in films: the first pair of x265's multi-view stream, decoded by FFmpeg, and the frames of other films."""

from __future__ import annotations

import base64
import struct

import av
import numpy as np
import pytest

from lippmann.codecs.film_views import read_frames
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


def write_film(path, frames, codec="libx264"):
    """A film of frames that are the brighter the later, with a red left half."""
    with av.open(str(path), "w") as film:
        stream = film.add_stream(codec, rate=24, options={"x265-params": "log-level=error"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for number in range(frames):
            codes = np.full((48, 64, 3), 2 * number, np.uint8)
            codes[:, :32, 0] = 200
            film.mux(stream.encode(av.VideoFrame.from_ndarray(codes, format="rgb24")))
        film.mux(stream.encode())
    return path


@pytest.mark.parametrize("codec", ["libx264", "libx265"])
def test_a_film_of_one_view_is_no_pair_but_frames(tmp_path, codec):
    path = write_film(tmp_path / "flat.mp4", 3, codec)
    assert read_pair(path) is None
    frames = read_frames(path)
    assert [frame.size for frame in frames] == [(64, 48)] * 3
    assert not any(frame.notes for frame in frames)
    assert all(is_near(frame.codes()[20, 60], (2 * number,) * 3) for number, frame in enumerate(frames))


def test_frames_of_a_long_film_are_evenly_spaced(tmp_path):
    frames = read_frames(write_film(tmp_path / "long.mp4", 101), 5)
    assert [round(float(frame.codes()[20:, 40:].mean()) / 50) for frame in frames] == [0, 1, 2, 3, 4]
    assert frames[0].notes == ("of the film's 101 frames 5 are shown, evenly spaced",)


def test_films_of_a_turned_telephone_are_upright(tmp_path):
    """The matrix of a track's header turns what is coded by 90 degrees clockwise: the left half comes to the top."""
    path = write_film(tmp_path / "turned.mp4", 2)
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 44  # version, times, number, duration, layer and volume lie between
    assert struct.unpack_from(">5i", data, at) == (1 << 16, 0, 0, 0, 1 << 16)
    struct.pack_into(">5i", data, at, 0, 1 << 16, 0, -(1 << 16), 0)
    path.write_bytes(data)
    (first, _) = read_frames(path)
    assert first.size == (48, 64)
    assert is_near(first.codes()[4, 24], (200, 0, 0))
    assert is_near(first.codes()[60, 24], (0, 0, 0))


@pytest.mark.parametrize("data", [b"", b"no film", FILM[:700], FILM.replace(b"hev1", b"????")])
def test_damaged_films(tmp_path, data):
    (tmp_path / "a.mov").write_bytes(data)
    for read in (read_pair, read_frames):
        with pytest.raises(PictureError, match=r"a\.mov: (cannot be decoded \(.*\)|has no pictures .*); a film"):
            read(tmp_path / "a.mov")
