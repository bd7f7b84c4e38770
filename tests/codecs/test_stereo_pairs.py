"""Pairs in one file: read by FFmpeg and Pillow, made by Pillow and by hand, and read back."""

from __future__ import annotations

import io
import re
import struct

import av
import numpy as np
import pytest
from PIL import Image

from lippmann.codecs.stereo_pairs import encode_jps, encode_mpo, read_pair
from lippmann.errors import PictureError


def view(color):
    codes = np.full((48, 64, 3), color, np.uint8)
    codes[:24] //= 2
    return codes


LEFT, RIGHT = view((200, 40, 40)), view((40, 60, 220))


def near(codes, expected):
    return codes.shape == expected.shape and np.abs(codes.astype(int) - expected).max() <= 6


def read_back(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    pair = read_pair(tmp_path / name)
    return [each.codes() for each in pair]


def jps(flags, layout=2, kind=1, pictures=(RIGHT, LEFT)):
    """A JPEG file with the stereo descriptor as its first segment, by hand."""
    held = io.BytesIO()
    axis = 0 if layout == 3 else 1
    Image.fromarray(np.concatenate(pictures, axis=axis)).save(held, "JPEG", quality=95, subsampling=0)
    segment = b"_JPSJPS_" + struct.pack(">H", 4) + bytes([0, flags, layout, kind]) + b"\0\0"
    return b"\xff\xd8\xff\xe3" + struct.pack(">H", len(segment) + 2) + segment + held.getvalue()[2:]


def test_jps_has_the_right_eye_on_the_left_as_ffmpeg_reads_it(tmp_path):
    path = tmp_path / "pair.jps"
    path.write_bytes(encode_jps(LEFT, RIGHT))
    with Image.open(path) as picture:
        assert near(np.asarray(picture), np.concatenate([RIGHT, LEFT], axis=1))
        assert picture.applist[1][1] == b"_JPSJPS_\0\4\0\0\2\1\0\0"
    with av.open(str(path), format="jpeg_pipe") as file:
        frame = next(file.decode(video=0))
        # FFmpeg's AVStereo3D: side by side (1), inverted: the right view first.
        kinds, flags = struct.unpack_from("<2i", bytes(frame.side_data["STEREO3D"]))
    assert (kinds, flags & 1) == (1, 1)
    left, right = (each.codes() for each in read_pair(path))
    assert near(left, LEFT)
    assert near(right, RIGHT)


@pytest.mark.parametrize(
    ("flags", "layout", "pictures"),
    [(0, 2, (RIGHT, LEFT)), (4, 2, (LEFT, RIGHT)), (4, 3, (LEFT, RIGHT)), (0, 3, (RIGHT, LEFT))],
)
def test_jps_of_either_order_and_layout(tmp_path, flags, layout, pictures):
    left, right = read_back(tmp_path, "a.jps", jps(flags, layout, pictures=pictures))
    assert near(left, LEFT)
    assert near(right, RIGHT)


def test_jps_of_half_width_and_without_a_word_of_its_own(tmp_path):
    left, right = read_back(tmp_path, "half.jps", encode_jps(LEFT[:, ::2], RIGHT[:, ::2], half=True))
    assert near(left, LEFT)
    assert near(right, RIGHT)
    held = io.BytesIO()
    Image.fromarray(np.concatenate([RIGHT, LEFT], axis=1)).save(held, "JPEG", quality=95, subsampling=0)
    left, _ = read_back(tmp_path, "plain.jps", held.getvalue())
    assert near(left, LEFT)


def test_of_an_mpo_that_holds_more_the_first_two_views_are_taken(tmp_path):
    path, kinds = tmp_path / "camera.mpo", (0x030000, 0x010001, 0x020002, 0x020002)
    pictures = [Image.fromarray(each) for each in (LEFT, LEFT[::4, ::4], RIGHT, LEFT)]
    pictures[0].save(path, "MPO", save_all=True, append_images=pictures[1:])
    data = bytearray(path.read_bytes())
    # Of each picture: attribute, size, offset (0 for the first), no others.
    first = re.search(re.escape(struct.pack("<L", kinds[0])) + b".{4}" + bytes(8), data, re.DOTALL).start()
    for number, kind in enumerate(kinds):
        struct.pack_into("<L", data, first + 16 * number, kind)
    path.write_bytes(data)
    left, right = read_pair(path)
    assert np.abs(left.codes().astype(int) - LEFT).mean() < 8
    assert np.abs(right.codes().astype(int) - RIGHT).mean() < 8
    assert left.notes == ("it holds 3 views: the first two are shown",)


def test_mpo_as_pillow_reads_it(tmp_path):
    path = tmp_path / "pair.mpo"
    path.write_bytes(encode_mpo(LEFT, RIGHT))
    with Image.open(path) as picture:
        assert (picture.format, picture.n_frames) == ("MPO", 2)
        entries = [entry["Attribute"] for entry in picture.mpinfo[0xB002]]
        assert [entry["MPType"] for entry in entries] == ["Multi-Frame Image: (Disparity)"] * 2
        assert [entry["RepresentativeImageFlag"] for entry in entries] == [True, False]
        for number, expected in enumerate((LEFT, RIGHT)):
            picture.seek(number)
            assert near(np.asarray(picture.convert("RGB")), expected)
    left, right = (each.codes() for each in read_pair(path))
    assert near(left, LEFT)
    assert near(right, RIGHT)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.jps", jps(0, kind=0), "a.jps: holds no views side by side"),
        ("a.jps", jps(0, layout=4), "holds no views side by side"),
        ("a.mpo", jps(0), "a.mpo: holds one picture"),
    ],
)
def test_files_that_hold_no_pair(tmp_path, name, data, message):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(PictureError, match=message):
        read_pair(tmp_path / name)
