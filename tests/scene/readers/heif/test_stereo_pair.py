"""Spatial photographs: HEIF files with a group of two views, as pillow-heif tells it."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from PIL import Image

from lippmann.codecs.icc import profile_of_cicp
from lippmann.errors import PictureError
from lippmann.scene.readers.heif import read_heif_pair


def view(color):
    codes = np.full((48, 64, 3), color, np.uint8)
    codes[:24] //= 2
    return codes


LEFT, RIGHT = view((200, 40, 40)), view((40, 60, 220))


def with_group(data, *items):
    """A HEIF file with a group ``ster`` of items, which libheif does not write: its places of data move behind it."""
    body = struct.pack(f">4sL2L{len(items)}L", b"ster", 0, 9, len(items), *items)
    body = struct.pack(">L", len(body) + 4) + body
    box = struct.pack(">L4s", len(body) + 8, b"grpl") + body
    meta = data.index(b"meta") - 4
    (length,) = struct.unpack_from(">L", data, meta)
    grown = bytearray(data[: meta + length] + box + data[meta + length :])
    struct.pack_into(">L", grown, meta, length + len(box))
    place = grown.index(b"iloc") + 4
    assert bytes(grown[place : place + 6]) == b"\0\0\0\0\x44\x40"  # version 0; offsets, lengths and bases of 4 bytes
    (count,) = struct.unpack_from(">H", grown, place + 6)
    for item in range(place + 8, place + 8 + 18 * count, 18):  # number, file, base, one extent
        (offset,) = struct.unpack_from(">L", grown, item + 10)
        struct.pack_into(">L", grown, item + 10, offset + len(box))
    return bytes(grown)


def test_a_pair_is_read_by_its_group(tmp_path):
    pillow_heif = pytest.importorskip("pillow_heif", minversion="1.8")
    file = pillow_heif.from_pillow(Image.fromarray(RIGHT))
    file.add_from_pillow(Image.fromarray(LEFT))
    path = tmp_path / "spatial.heic"
    file.save(path, quality=100)
    assert read_heif_pair(path) is None
    path.write_bytes(with_group(path.read_bytes(), 2, 1))
    left, right = (each.codes() for each in read_heif_pair(path))
    assert np.abs(left.mean(axis=(0, 1)) - LEFT.mean(axis=(0, 1))).max() < 8
    assert np.abs(right.mean(axis=(0, 1)) - RIGHT.mean(axis=(0, 1))).max() < 8
    path.write_bytes(with_group(path.read_bytes()[:-40], 2, 1))
    with pytest.raises(PictureError, match=r"spatial\.heic: cannot be decoded"):
        [each.codes() for each in read_heif_pair(path)]


def test_colours_that_code_points_say_are_kept(tmp_path):
    """Those of a pair were taken for sRGB, whatever the file said without an ICC profile."""
    pillow_heif = pytest.importorskip("pillow_heif", minversion="1.8")
    file = pillow_heif.from_pillow(Image.fromarray(RIGHT))
    file.add_from_pillow(Image.fromarray(LEFT))
    path = tmp_path / "spatial.heic"
    file.save(path, quality=100, color_primaries=12, transfer_characteristics=13)  # Display P3, of the first picture
    path.write_bytes(with_group(path.read_bytes(), 2, 1))
    assert [profile_of_cicp(12, 13) == each.icc for each in read_heif_pair(path)] == [False, True]
