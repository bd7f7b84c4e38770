"""EXIF orientation: the eight ways, against Pillow's own turning."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageOps

from lippmann.codecs.orientation import lies, of_exif, of_picture, upright


@pytest.mark.parametrize("orientation", range(10))
def test_pictures_are_turned_as_pillow_turns_them(orientation):
    codes = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    picture = Image.fromarray(codes)
    picture.getexif()[0x112] = orientation
    turned = upright(codes, orientation)
    np.testing.assert_array_equal(turned, np.asarray(ImageOps.exif_transpose(picture)))
    assert lies(orientation) == (turned.shape == (3, 2, 3))


def test_the_tag_is_found_and_damage_is_none():
    exif = Image.Exif()
    exif[0x112] = 8
    assert of_exif(exif.tobytes()) == 8
    for data in (b"", b"Exif\0\0", b"MM\0*\0\0\0\xff", b"nonsense", exif.tobytes()[:-9]):
        assert of_exif(data) in (1, 8)
    exif[0x112] = 77
    assert of_exif(exif.tobytes()) == 1


def test_a_tiff_is_not_turned_twice(tmp_path):
    exif = Image.Exif()
    exif[0x112] = 6
    Image.new("RGB", (5, 4)).save(tmp_path / "a.tif", exif=exif)
    with Image.open(tmp_path / "a.tif") as picture:
        assert of_picture(picture) == 6
        picture.load()
        assert of_picture(picture) == 1
        assert picture.size == (4, 5)
