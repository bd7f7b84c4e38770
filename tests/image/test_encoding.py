"""Files of prints: mirrored once, with sRGB's profile; files of panels have pixels alone."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from lippmann.codecs.icc import srgb_profile
from lippmann.display import load_display
from lippmann.display.formats.print_sheet import Print
from lippmann.display.panel import PixelWindow
from lippmann.image import IntegralImage, read_picture
from lippmann.image.metadata import Provenance
from lippmann.image.read import open_file
from lippmann.image.streamed import LargePicture, pixels_of_file

DISPLAY = Print(ppi=300, size=(12, 6), lpi=30).display()
MIRRORED = replace(DISPLAY, sheet=replace(DISPLAY.sheet, mirrored=True))


def picture(display, **parts):
    size = display.panel.height, display.panel.width, 3
    codes = np.random.default_rng(5).integers(0, 256, size)
    return IntegralImage(np.float32(codes / 255), display, **parts)


@pytest.mark.parametrize("name", ["p.png", "p.tif", "p.exr", "p.zarr"])
def test_a_mirrored_file_is_read_as_it_was(tmp_path, name):
    depth = np.random.default_rng(6).random((DISPLAY.panel.height, DISPLAY.panel.width), dtype=np.float32)
    image = picture(MIRRORED, maps={"depth": depth})
    plain, mirrored = tmp_path / name, tmp_path / f"mirrored-{name}"
    replace(image, display=DISPLAY).save(plain)
    image.save(mirrored)
    np.testing.assert_array_equal(open_file(mirrored).decode()[0], open_file(plain).decode()[0][:, ::-1])
    first, second = read_picture(plain), read_picture(mirrored)
    np.testing.assert_array_equal(first.pixels, second.pixels)
    if name.endswith("exr"):
        np.testing.assert_array_equal(second.maps["depth"], depth)
    second.save(tmp_path / f"again-{name}")
    again = open_file(tmp_path / f"again-{name}").decode()[0]
    np.testing.assert_array_equal(again, open_file(mirrored).decode()[0])


def test_a_mirrored_file_is_read_piece_by_piece_as_it_was(tmp_path):
    picture(MIRRORED).save(tmp_path / "p.tif")
    file, whole = open_file(tmp_path / "p.tif"), read_picture(tmp_path / "p.tif")
    large = LargePicture(pixels_of_file(file), MIRRORED, np.eye(4), Provenance(), "uint8")
    window = PixelWindow(20, 9, 50, 30)
    np.testing.assert_array_equal(large.rows(9, 39)[:, 20:70], whole.pixels[window.slices])
    rows, columns = np.array([3, 5, 60]), np.array([0, 141, 17])
    np.testing.assert_array_equal(large.take(rows, columns), whole.pixels[rows, columns])


@pytest.mark.parametrize(("name", "bits"), [("p.png", 8), ("p.png", 16), ("p.tif", 8), ("p.tif", 16)])
def test_prints_carry_srgb_and_panels_nothing(tmp_path, name, bits):
    path = tmp_path / name
    picture(DISPLAY).save(path, bits=bits)
    assert open_file(path).icc == srgb_profile()
    if bits == 8:
        with Image.open(path) as opened:
            assert opened.info["icc_profile"] == srgb_profile()
    picture(load_display("seed-lenticular")).save(path, bits=bits)
    assert open_file(path).icc == b""
    # Nor do values that are no colours, or that are of a profile that is not at hand.
    picture(DISPLAY, provenance=Provenance(transfer="linear")).save(path, bits=bits)
    assert open_file(path).icc == b""
    other = replace(DISPLAY, sheet=replace(DISPLAY.sheet, profile="Glossy"))
    picture(other).save(path, bits=bits)
    assert open_file(path).icc == b""
    picture(other).save(path, bits=bits, icc=b"profile" * 9)
    assert open_file(path).icc == b"profile" * 9


def test_the_same_print_is_the_same_file(tmp_path):
    for name in ("a.png", "b.png"):
        picture(DISPLAY).save(tmp_path / name)
        srgb_profile.cache_clear()
        time.sleep(1.1)  # profiles that are made anew say when, to the second
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
