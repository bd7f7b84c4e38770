import contextlib
import errno
import json
import math
import os
import signal
import struct
import subprocess
import sys
import zlib
from dataclasses import replace

import imagecodecs
import numpy as np
import OpenEXR
import pytest
import tifffile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from lippmann.errors import LippmannError, OutputError, PictureError
from lippmann.exr import read_exr_header, write_exr
from lippmann.image import IntegralImage, Provenance, read_info, read_metadata, read_picture, write_picture
from lippmann.image.color import dequantize, quantize
from lippmann.image.formats import format_for, write_plain_picture
from lippmann.image.png import encode_png, read_png_header

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


@pytest.mark.parametrize(("name", "bits"), KINDS)
def test_metadata_is_read_without_the_pixels(tmp_path, display, picture, name, bits, monkeypatch):
    image = picture(display("lenticular", distance=600.0))
    path = tmp_path / name
    write_picture(image, path, bits=bits)
    for module, function in (("image.png", "read_png"), ("exr", "read_exr"), ("image.tiff", "read_tiff")):
        monkeypatch.setattr(f"lippmann.{module}.{function}", lambda _: pytest.fail("pixels were read"))
    metadata, info = read_metadata(path), read_info(path)
    assert metadata.display == image.display
    assert metadata.provenance == image.provenance
    assert (info.width, info.height, info.layers) == (12, 9, ())
    assert info.stored == {8: "uint8", 16: "float16" if name.endswith("exr") else "uint16", 32: "float32"}[bits]


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
    assert read_info(tmp_path / "a.exr").layers == ("depth", "normal", "shape-id", "uv")
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
        ("a.jpg", None, r"the ending '.jpg' is unknown; known are .png, .exr, .tif, .tiff"),
        ("a", None, "the name has no ending; known are .png"),
        ("a.png", 32, "32 bits per channel are not possible; png has 8 or 16"),
        ("a.exr", 8, "8 bits per channel are not possible; exr has 16 or 32"),
        ("missing/a.png", None, "is not there"),
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
from lippmann.image.formats import write_plain_picture
import imagecodecs, OpenEXR, tifffile
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
pixels = np.random.default_rng(0).random((300, 300, 3), dtype=np.float32)
try:
    write_plain_picture(pixels, Path(sys.argv[1]))
except OutputError as error:
    sys.exit(f"refused: {error}")
"""


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="the system has no limit on the size of files")
@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.tif"])
def test_a_disk_that_takes_no_more_leaves_the_old_file(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"the old one")
    run = subprocess.run([sys.executable, "-c", WRITE_TOO_MUCH, str(path)], capture_output=True, text=True, check=False)
    assert run.stderr.startswith("refused: ")
    assert run.stderr.count("\n") == 1
    assert str(path) in run.stderr
    assert os.listdir(tmp_path) == [name]
    assert path.read_bytes() == b"the old one"


def test_a_missing_empty_or_foreign_file(tmp_path):
    for name, content, message in (
        ("missing.png", None, "missing.png: is not there"),
        ("empty.png", b"", "empty.png: is empty"),
        ("text.png", b"hello", "text.png: is no picture that is known here"),
        ("jpeg.png", b"\xff\xd8\xff\xe0" + bytes(100), "PNG, OpenEXR, TIFF and Zarr are read"),
    ):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(PictureError, match=message):
            read_picture(tmp_path / name)
    with pytest.raises(PictureError, match="cannot be read: Is a directory"):
        read_picture(tmp_path)


@pytest.mark.parametrize(("name", "bits"), KINDS)
def test_a_file_cut_anywhere_is_one_line_of_error(tmp_path, display, picture, capfd, name, bits):
    write_picture(picture(display("lenticular", lenses=(16, 11))), tmp_path / name, bits=bits)
    whole = (tmp_path / name).read_bytes()
    cut = tmp_path / f"cut-{name}"
    for length in [*range(1, 40), *range(40, len(whole) - 1, 97), len(whole) - 5]:
        cut.write_bytes(whole[:length])
        with pytest.raises(PictureError) as caught:
            read_picture(cut)
        assert "\n" not in str(caught.value)
        assert str(cut) in str(caught.value)
    assert capfd.readouterr() == ("", "")


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.tif"])
def test_damage_anywhere_is_refused_or_harmless(tmp_path, display, picture, name, data):
    path = tmp_path / name
    write_picture(picture(display("square")), path)
    damaged = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place] = data.draw(st.integers(0, 255))
    path.write_bytes(damaged)
    # Any other exception fails the test.
    with contextlib.suppress(PictureError):
        assert read_picture(path).pixels.shape == (9, 12, 3)


def test_a_picture_without_a_display(tmp_path, display, picture):
    array = display("square")
    codes = np.random.default_rng(2).integers(0, 256, (9, 12, 3), dtype=np.uint8)
    path = tmp_path / "foreign.png"
    Image.fromarray(codes).save(path)
    for read in (read_picture, read_metadata):
        with pytest.raises(PictureError, match=r"foreign.png: has no display in it; say --display"):
            read(path)
    image = read_picture(path, display=array)
    np.testing.assert_array_equal(quantize(image.pixels, 8, "srgb"), codes)
    assert image.display == array
    assert image.provenance == Provenance()
    assert read_info(path).metadata is None
    with pytest.raises(PictureError, match=r"foreign.png: has 12 x 9 pixels; the display test-square has 15 x 9"):
        read_picture(path, display=display("square", lenses=(5, 3)))


def test_a_display_given_replaces_the_one_in_the_file(tmp_path, display, picture, provenance):
    picture(display("square")).save(tmp_path / "a.png")
    other = display("lenticular")
    image = read_picture(tmp_path / "a.png", display=other)
    assert image.display == other
    assert image.provenance == provenance


def save_with(tmp_path, name, codes):
    path = tmp_path / name
    if name.endswith("png"):
        path.write_bytes(imagecodecs.png_encode(codes.squeeze()))
    elif name.endswith("exr"):
        letters = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}[codes.shape[2]]
        write_exr(path, {letter: codes[..., k] for k, letter in enumerate(letters)}, text={})
    else:
        tifffile.imwrite(path, codes if codes.shape[2] > 1 else codes[..., 0])
    return path


@pytest.mark.parametrize(
    ("name", "dtype", "top"),
    [("a.png", np.uint8, 255), ("a.png", np.uint16, 65535), ("a.exr", np.float32, 1), ("a.tif", np.uint8, 255)],
)
def test_grey_and_opaque_pictures_of_other_programs(tmp_path, display, name, dtype, top):
    grey = (np.random.default_rng(3).random((9, 12)) * top).astype(dtype)
    rgb = np.stack([grey] * 3, axis=-1)
    opaque = np.full_like(grey, top)
    array = display("square")
    pictures = [grey[..., None], rgb, np.dstack([rgb, opaque])] + (
        [np.dstack([grey, opaque])] if name != "a.tif" else []
    )
    results = [read_picture(save_with(tmp_path, name, values), display=array).pixels for values in pictures]
    for result in results:
        np.testing.assert_array_equal(result, results[0])
        np.testing.assert_array_equal(result[..., 0], result[..., 2])
    holes = np.dstack([rgb, opaque])
    holes[4, 4, 3] = 0
    with pytest.raises(PictureError, match="partly transparent"):
        read_picture(save_with(tmp_path, name, holes), display=array)


def test_what_no_panel_shows_is_refused(tmp_path, display):
    array = display("square")
    values = np.zeros((9, 12, 3), dtype=np.float64)
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="rgb")
    with pytest.raises(PictureError, match=r"a.tif: holds values of the type float64; tiff is read with uint8"):
        read_picture(tmp_path / "a.tif", display=array)
    tifffile.imwrite(tmp_path / "b.tif", np.zeros((4, 9, 12, 3), dtype=np.uint8), photometric="rgb", planarconfig=1)
    assert read_picture(tmp_path / "b.tif", display=array).pixels.shape == (9, 12, 3)  # the first of four pages
    plane = np.zeros((9, 12), dtype=np.float32)
    write_exr(tmp_path / "a.exr", {"R": plane, "G": plane}, text={})
    with pytest.raises(PictureError, match=r"a.exr: has the channels G, R; R, G and B of one type are needed"):
        read_picture(tmp_path / "a.exr", display=array)
    write_exr(tmp_path / "b.exr", {"R": plane, "G": plane, "B": plane + np.nan}, text={})
    with pytest.raises(PictureError, match=r"b.exr: 108 pixels are not finite, the first in column 0, row 0"):
        read_picture(tmp_path / "b.exr", display=array)
    with pytest.raises(PictureError, match="not finite"):
        write_plain_picture(np.full((2, 2, 3), np.inf, np.float32), tmp_path / "c.png")


def png_claiming(width, height, body=b"\x78\x9c"):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def test_sizes_that_the_file_cannot_hold_are_refused_unread(tmp_path, display):
    path = tmp_path / "bomb.png"
    path.write_bytes(png_claiming(20000, 20000))
    with pytest.raises(PictureError, match=r"claims 20000 x 20000 pixels but has only \d+ bytes"):
        read_picture(path, display=display())
    path.write_bytes(png_claiming(2**31 - 1, 2**31 - 1))
    with pytest.raises(PictureError, match="at most 536870912 pixels"):
        read_picture(path, display=display())
    path.write_bytes(png_claiming(0, 5))
    with pytest.raises(PictureError, match="no proper header"):
        read_picture(path, display=display())


def test_a_text_that_unpacks_to_too_much_is_not_unpacked(tmp_path, display):
    packed = zlib.compress(b"[" * (1 << 26), 9)
    whole = encode_png(np.zeros((9, 12, 3), np.uint8), text={})
    data = b"lippmann\0\1\0\0\0" + packed
    chunk = struct.pack(">I", len(data)) + b"iTXt" + data + struct.pack(">I", zlib.crc32(b"iTXt" + data))
    (tmp_path / "a.png").write_bytes(whole[:33] + chunk + whole[33:])
    assert len(read_png_header(tmp_path / "a.png").text["lippmann"]) == 1 << 24
    with pytest.raises(PictureError, match="has no display in it"):
        read_picture(tmp_path / "a.png")


def test_a_damaged_text_is_noticed(tmp_path, display, picture):
    path = tmp_path / "a.png"
    picture(display("square")).save(path)
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b'"spp":64', b'"spp":46'))
    with pytest.raises(PictureError, match="the check sum of its iTXt chunk is wrong"):
        read_metadata(path)


def test_texts_packed_by_other_programs_are_read(tmp_path, display, picture):
    image = picture(display("square"))
    image.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as other:
        from PIL.PngImagePlugin import PngInfo

        info = PngInfo()
        info.add_itxt("lippmann", other.text["lippmann"], zip=True)
        other.save(tmp_path / "b.png", pnginfo=info)
    assert read_picture(tmp_path / "b.png").provenance == image.provenance


GOOD = {"lippmann": 1, "display": ..., "world_from_display": np.eye(4).tolist(), "provenance": {}}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lippmann": 2}, "version 2; up to 1 is read; get a newer Lippmann"),
        ({"lippmann": "1"}, "version '1'"),
        ({"lippmann": True}, "version True"),
        ({"display": None}, "its metadata makes no sense"),
        ({"display": {"name": "x"}}, "missing"),
        ({"display.name": [1]}, "makes no sense"),
        ({"display.gap": -1}, "gap"),
        ({"display.gap": "6.8"}, "gap"),
        ({"display.panel": {"width": 12, "height": 9}}, "pixel_pitch"),
        ({"display.panel": [12, 9]}, "panel"),
        ({"display.extra": 1}, "extra"),
        ({"world_from_display": [[1, 0], [0, 1]]}, "similarity"),
        ({"world_from_display": np.diag([1, 2, 1, 1]).tolist()}, "similarity"),
        ({"world_from_display": np.diag([-1, 1, 1, 1]).tolist()}, "similarity"),
        ({"world_from_display": np.zeros((4, 4)).tolist()}, "similarity"),
        ({"world_from_display": [["a"] * 4] * 4}, "no matrix"),
        ({"world_from_display": [[10**400] * 4] * 4}, "no matrix"),
        ({"provenance": 3}, "mapping"),
        ({"provenance": {"spp": "many"}}, "provenance: spp is 'many'"),
        ({"display.panel.width": 13}, "the display test-square has 13 x 9"),
    ],
)
def test_metadata_that_makes_no_sense(tmp_path, display, changes, message):
    values = {**GOOD, "display": display("square").to_dict()}
    for name, value in changes.items():
        *tables, last = name.split(".")
        table = values
        for step in tables:
            table = table[step]
        table[last] = value
    path = tmp_path / "a.png"
    path.write_bytes(encode_png(np.zeros((9, 12, 3), np.uint8), text={"lippmann": json.dumps(values)}))
    with pytest.raises(PictureError, match=message) as caught:
        read_picture(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1]", "[" * 100000, '{"other": 1}', '{"lippmann": NaN}', "null"])
def test_a_text_of_another_kind_is_no_metadata(tmp_path, display, text):
    path = tmp_path / "a.png"
    path.write_bytes(encode_png(np.zeros((9, 12, 3), np.uint8), text={"lippmann": text}))
    assert read_info(path).metadata is None


def test_a_plain_picture_carries_no_display(tmp_path):
    pixels = np.random.default_rng(1).random((4, 6, 3), dtype=np.float32)
    for name in ("a.png", "a.exr", "a.tif"):
        write_plain_picture(pixels, tmp_path / name)
        assert read_info(tmp_path / name).metadata is None
    with Image.open(tmp_path / "a.png") as other:
        np.testing.assert_array_equal(np.asarray(other), quantize(pixels, 8, "srgb"))


def test_every_number_of_a_display_comes_back_exactly(tmp_path, random_displays, picture):
    @settings(deadline=None, max_examples=30)
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

    monkeypatch.setattr("lippmann.image.tiff.write_tiff", fails)
    with pytest.raises(OutputError, match="no space is left"):
        picture(display()).save(tmp_path / "a.tif")
    assert os.listdir(tmp_path) == []


def test_infinite_distances_are_plain_json(tmp_path, display, picture):
    assert math.isinf(display().viewing_distance)
    picture(display()).save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as other:
        json.loads(other.text["lippmann"], parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def test_all_errors_are_ours(tmp_path):
    path = tmp_path / "a.exr"
    path.write_bytes(b"\x76\x2f\x31\x01\x02\x18\x00\x00" + bytes(64))
    with pytest.raises(LippmannError, match="deep or multi-part"):
        read_picture(path)
