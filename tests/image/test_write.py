import errno
import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import replace

import imagecodecs
import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from PIL import Image

from lippmann.codecs.exr import read_exr_header
from lippmann.color.transfer import dequantize, quantize
from lippmann.errors import OutputError
from lippmann.image import IntegralImage, Provenance, open_file, read_metadata, read_picture, write_picture
from lippmann.image.write import format_for, write_plain_picture

KINDS = [("a.png", 8), ("a.png", 16), ("a.exr", 16), ("a.exr", 32), ("a.tif", 8), ("a.tiff", 16), ("a.TIF", 32)]


def expected(image, stored):
    if stored in ("uint8", "uint16"):
        transfer = image.provenance.transfer
        return dequantize(quantize(image.pixels, 8 if stored == "uint8" else 16, transfer), transfer)
    return image.pixels.astype(stored).astype(np.float32)


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
@pytest.mark.parametrize(("name", "bits"), KINDS)
def test_everything_comes_back(tmp_path, display, picture, provenance, name, bits, transfer):
    image = picture(display("hexagonal"), provenance=replace(provenance, transfer=transfer))
    path = tmp_path / name
    write_picture(image, path, bits=bits)
    back = read_picture(path)
    stored = {8: "uint8", 16: "float16" if name.endswith("exr") else "uint16", 32: "float32"}[bits]
    assert back.stored == stored
    np.testing.assert_array_equal(back.pixels, expected(image, stored))
    assert back.display == image.display
    assert back.provenance == image.provenance
    np.testing.assert_array_equal(back.world_from_display, image.world_from_display)
    # Once stored, writing it again in the same way changes no value.
    again = tmp_path / f"again-{name}"
    back.save(again, bits if name == "a.TIF" else None)
    np.testing.assert_array_equal(read_picture(again).pixels, back.pixels)
    assert sorted(os.listdir(tmp_path)) == sorted([name, again.name])


def test_other_programs_see_the_same_png(tmp_path, display, picture):
    image = picture(display("square", pixel_pitch=25.4 / 96))
    image.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as other:
        np.testing.assert_array_equal(np.asarray(other), quantize(image.pixels, 8, "srgb"))
        assert other.info["dpi"] == pytest.approx((96, 96), rel=1e-3)
        assert other.info["srgb"] == 0
        assert json.loads(other.text["lippmann"])["display"]["name"] == "test-square"
    image.save(tmp_path / "b.png", bits=16)
    codes = imagecodecs.png_decode((tmp_path / "b.png").read_bytes())
    assert codes.dtype == np.uint16
    np.testing.assert_array_equal(codes, quantize(image.pixels, 16, "srgb"))


def test_linear_codes_are_not_marked_as_srgb(tmp_path, display, picture):
    picture(display(), provenance=Provenance(transfer="linear")).save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as other:
        assert "srgb" not in other.info


def test_other_programs_see_the_same_tiff(tmp_path, display, picture):
    image = picture(display("square", pixel_pitch=25.4 / 720))
    image.save(tmp_path / "a.tif")
    with Image.open(tmp_path / "a.tif") as other:
        np.testing.assert_array_equal(np.asarray(other), quantize(image.pixels, 8, "srgb"))
        assert other.info["dpi"] == pytest.approx((720, 720), rel=1e-6)
        assert json.loads(other.tag_v2[270])["lippmann"] == 1


def test_other_programs_see_the_same_exr(tmp_path, display, picture):
    image = picture(display("square", pixel_pitch=25.4 / 96))
    image.save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr")) as other:
        np.testing.assert_array_equal(other.channels()["RGB"].pixels, image.pixels)
        assert other.header()["xDensity"] == pytest.approx(96)
        assert json.loads(other.header()["lippmann"])["world_from_display"] == image.world_from_display.tolist()


def test_maps_travel_in_exr_and_only_there(tmp_path, display, picture):
    array = display("square")
    shape = (array.panel.height, array.panel.width)
    depth = np.linspace(0, 1, shape[0] * shape[1], dtype=np.float32).reshape(shape)
    depth[0, 0] = np.inf  # nothing was hit there
    maps = {"depth": depth, "normal": np.random.default_rng(1).random((*shape, 3), dtype=np.float32)}
    maps |= {"shape-id": np.arange(depth.size, dtype=np.uint32).reshape(shape) + 2**31, "uv": maps["normal"][..., :2]}
    image = picture(array, maps=maps)
    image.save(tmp_path / "a.exr", bits=16)
    back = read_picture(tmp_path / "a.exr")
    assert set(back.maps) == set(maps)
    for name, values in maps.items():
        assert back.maps[name].dtype == values.dtype
        np.testing.assert_array_equal(back.maps[name], values)
    assert open_file(tmp_path / "a.exr").layers == ("depth", "normal", "shape-id", "uv")
    assert set(read_exr_header(tmp_path / "a.exr").channels) >= {"depth.V", "normal.X", "normal.Z", "uv.Y", "R"}
    image.save(tmp_path / "a.png")
    assert not read_picture(tmp_path / "a.png").maps


def test_half_floats_are_clipped_to_their_largest(tmp_path, display):
    array = display("square", lenses=(1, 1), pixels=1)
    IntegralImage(np.float32([[[1e6, -1e6, 1]]]), array).save(tmp_path / "a.exr", bits=16)
    assert read_picture(tmp_path / "a.exr").pixels.tolist() == [[[65504, -65504, 1]]]


@pytest.mark.parametrize(
    ("name", "bits", "source", "stored"),
    [
        ("a.png", None, "float32", "uint8"),
        ("a.png", None, "uint16", "uint16"),
        ("a.png", None, "float16", "uint8"),
        ("a.exr", None, "uint8", "float32"),
        ("a.exr", None, "float16", "float16"),
        ("a.tif", None, "float32", "uint8"),
        ("a.tif", None, "uint16", "uint16"),
        ("a.tif", 32, "uint8", "float32"),
        ("a.PNG", 16, "uint8", "uint16"),
    ],
)
def test_what_is_stored(tmp_path, name, bits, source, stored):
    assert format_for(tmp_path / name, bits, source=source)[1] == stored


@pytest.mark.parametrize(
    ("name", "bits", "message"),
    [
        ("a.jpg", None, r"unknown ending '.jpg', did you mean '.png'\?; known are .png, .exr, .tif, .tiff"),
        ("a", None, "no ending; known are .png"),
        ("a.png", 32, "32 bits per channel are not possible; png has 8 or 16"),
        ("a.exr", 8, "8 bits per channel are not possible; exr has 16 or 32"),
        ("missing/a.png", None, "there is no folder"),
    ],
)
def test_output_that_cannot_be(tmp_path, display, picture, name, bits, message):
    with pytest.raises(OutputError, match=message):
        picture(display()).save(tmp_path / name, bits)
    assert os.listdir(tmp_path) == []


WRITE_TOO_MUCH = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from lippmann.errors import OutputError
from lippmann.image.write import write_plain_picture
import imagecodecs, OpenEXR, tifffile
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
pixels = np.random.default_rng(0).random((300, 300, 3), dtype=np.float32)
for name in sys.argv[1:]:
    try:
        write_plain_picture(pixels, Path(name))
    except OutputError as error:
        print(f"refused: {error}")
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="the system has no limit on the size of files")
def test_a_disk_that_takes_no_more_leaves_the_old_file(tmp_path):
    paths = [tmp_path / name for name in ("a.png", "a.exr", "a.tif")]
    for path in paths:
        path.write_bytes(b"the old one")
    words = [sys.executable, "-c", WRITE_TOO_MUCH, *map(str, paths)]
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    assert run.stderr == ""
    for path, line in zip(paths, run.stdout.splitlines(), strict=True):
        assert line.startswith("refused: ")
        assert str(path) in line
        assert path.read_bytes() == b"the old one"
    assert sorted(tmp_path.iterdir()) == sorted(paths)


def test_a_plain_picture_carries_no_display(tmp_path):
    pixels = np.random.default_rng(1).random((4, 6, 3), dtype=np.float32)
    for name in ("a.png", "a.exr", "a.tif"):
        write_plain_picture(pixels, tmp_path / name)
        assert open_file(tmp_path / name).metadata is None
    with Image.open(tmp_path / "a.png") as other:
        np.testing.assert_array_equal(np.asarray(other), quantize(pixels, 8, "srgb"))


def test_every_number_of_a_display_comes_back_exactly(tmp_path, random_displays, picture):
    @settings(deadline=None, max_examples=20)
    @given(random_displays())
    def check(display):
        image = picture(display)
        for name in ("a.png", "a.exr", "a.tif"):
            image.save(tmp_path / name)
            assert read_metadata(tmp_path / name).display == display

    check()


def test_an_error_of_the_library_while_writing_is_an_output_error(tmp_path, display, picture, monkeypatch):
    def fails(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("lippmann.codecs.tiff.write_tiff", fails)
    with pytest.raises(OutputError, match="no space is left"):
        picture(display()).save(tmp_path / "a.tif")
    assert os.listdir(tmp_path) == []


def test_infinite_distances_are_plain_json(tmp_path, display, picture):
    assert math.isinf(display().viewing_distance)
    picture(display()).save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as other:
        json.loads(other.text["lippmann"], parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
