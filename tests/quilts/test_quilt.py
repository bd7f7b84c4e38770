"""Quilts: names, sizes, and where the views lie."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from lippmann.color.transfer import dequantize
from lippmann.display import load_display
from lippmann.errors import OutputError, PictureError, UsageError
from lippmann.quilts.files import read_quilt
from lippmann.quilts.quilt import (
    DEVICE_QUILTS,
    Quilt,
    QuiltLayout,
    check_size,
    ending_of_name,
    layout_of_name,
    names_layout,
    quilt_of_display,
)

LAYOUT = QuiltLayout(8, 6, 0.75)


def test_what_the_sides_leave_over_lies_right_and_on_top():
    pixels = np.zeros((512, 512, 3), dtype=np.float32)
    quilt = Quilt(pixels, QuiltLayout(5, 9, 1.6))
    assert quilt.view_size == (102, 56)
    for number in range(45):
        quilt.view(number)[...] = number + 1
    assert (pixels[:, 510:] == 0).all()
    assert (pixels[:8] == 0).all()
    assert (pixels[8:, :510] > 0).all()
    assert pixels[511, 0, 0] == 1
    assert pixels[8, 509, 0] == 45


def test_rows_of_all_views_are_those_of_each():
    codes = np.random.default_rng(3).integers(0, 256, (512, 512, 3)).astype(np.uint8)
    quilt = Quilt(codes, QuiltLayout(5, 9, 1.6))
    rows = quilt.view_rows(7, 20)
    for number in range(45):
        np.testing.assert_array_equal(rows[number], quilt.view(number)[7:20])
    np.testing.assert_array_equal(quilt.pixels, dequantize(codes, "srgb"))
    np.testing.assert_array_equal(quilt, quilt.pixels)  # as NumPy takes it


@pytest.mark.parametrize(
    ("display", "size", "layout", "name", "written"),
    [
        ("portrait", (256, 256), QuiltLayout(4, 2, 0.75), "a.png", "a_qs4x2a0.75.png"),
        ("portrait", (256, 256), QuiltLayout(4, 2, 0.75), "a_qs4x2a0.75.exr", "a_qs4x2a0.75.exr"),
        ("odyssey-3d", (7680, 2160), QuiltLayout(2, 1, 1.77778), "a.tif", "a_2x1.tif"),
        ("odyssey-3d", (3840, 2160), QuiltLayout(2, 1, 1.77778), "a.tif", "a_half_2x1.tif"),
    ],
)
def test_saving_puts_the_layout_into_the_name(display, size, layout, name, written, tmp_path):
    codes = np.zeros((size[1], size[0], 3), np.uint8)
    codes[:, -1] = 200
    quilt = Quilt(codes, layout, "float32", display=load_display(display))
    assert quilt.save(tmp_path / name) == tmp_path / written
    assert [path.name for path in tmp_path.iterdir()] == [written]
    again = read_quilt(tmp_path / written)
    np.testing.assert_allclose(again.pixels[0, -2:], quilt.pixels[0, -2:], atol=1e-3)
    assert (again.layout[:2], again.display) == (layout[:2], quilt.display)


def test_a_name_that_says_another_layout_is_not_saved_to(tmp_path):
    quilt = Quilt(np.zeros((256, 256, 3), np.uint8), QuiltLayout(4, 2, 0.75))
    with pytest.raises(OutputError) as caught:
        quilt.save(tmp_path / "a_qs8x6a0.75.png")
    assert str(caught.value).endswith(
        "the name says another quilt; the quilt's ends in _qs4x2a0.75.png; leave the layout out"
    )


@pytest.mark.parametrize(
    ("name", "layout"),
    [
        ("teapot_qs8x6a0.75.png", (8, 6, 0.75)),
        ("a_qs5x9a1.77778.png", (5, 9, 1.77778)),
        ("old one_qs5x9.png", (5, 9, None)),
        ("x_qs2x2a1_qs11x6a0.5625.exr", (11, 6, 0.5625)),
        ("_qs32x1a2.png", (32, 1, 2.0)),
        ("x_qs8x6a0.75 (1).png", (8, 6, 0.75)),  # downloaded twice
        ("x_qs8x6a0,75.png", (8, 6, 0.75)),
        ("x_QS8x6a.75_final.jpg", (8, 6, 0.75)),
        ("testCircleqs5x9a0.5625.png", (5, 9, 0.5625)),
        ("hologram_qs5x9a1.7777777777777777.png", (5, 9, 16 / 9)),  # the maker's WebXR library
    ],
)
def test_names_are_read(tmp_path, name, layout):
    assert layout_of_name(tmp_path / name) == layout


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("teapot.png", 'does not say how many views.*layout="8x6", or layout="2x1" of a pair'),
        ("teapot_3x4_1920x1080.png", 'layout="3x4"'),
        ("teapot 12BY5.jpg", 'layout="12x5"'),
        ("x_qs8x.png", "does not say how many views"),
        ("x_qs0x6a0.75.png", "0 columns and 6 rows"),
        ("x_qs33x6a0.75.png", "33 columns and 6 rows; there are 1 to 32"),
        ("x_qs8x6a0.png", "the aspect is 0"),
        ("x_qs8x6a100.png", "the aspect is 100"),
    ],
)
def test_impossible_names_are_refused(tmp_path, name, said):
    with pytest.raises(PictureError, match=said) as caught:
        layout_of_name(tmp_path / name)
    assert name in str(caught.value)


@pytest.mark.parametrize("device", DEVICE_QUILTS, ids=lambda d: f"{d.display}-{d.width}")
def test_devices(device, tmp_path):
    assert layout_of_name(tmp_path / f"x{device.layout.ending}.png") == device.layout
    check_size(device.width, device.height, device.layout, "x")
    panel = load_display(device.display).panel
    assert panel.width / panel.height == pytest.approx(device.layout.aspect, rel=1e-5)


@pytest.mark.parametrize(
    ("width", "height", "said"),
    [
        (3361, 3360, "it is 3361 pixels wide.*3361 is no multiple of 8"),
        (3360, 3364, "it is 3364 pixels high.*3364 is no multiple of 6"),
        (248, 3360, "a quilt's sides are 256 to 16384"),
        (3360, 16386, "it is 16386 pixels high"),
    ],
)
def test_sizes_that_disagree_with_the_name_are_refused(width, height, said):
    with pytest.raises(PictureError, match=said):
        check_size(width, height, LAYOUT, "x")


def test_a_quilt_shows_itself_in_notebooks_and_gives_its_codes():
    layout = QuiltLayout(4, 3, 0.75)
    quilt = Quilt(np.full((900, 1600, 3), 0.5, np.float32), layout)
    assert repr(quilt) == "<Quilt 1600 x 900 pixels, 4 x 3 views, aspect 0.75>"
    unknown = Quilt(quilt.values, QuiltLayout(4, 3, None))
    assert repr(unknown) == "<Quilt 1600 x 900 pixels, 4 x 3 views>"
    with Image.open(io.BytesIO(quilt._repr_png_())) as shown:
        assert shown.size == (534, 300)
        assert shown.getpixel((9, 9)) == (188, 188, 188)
    assert (quilt.srgb(16) == 48192).all()
    with pytest.raises(PictureError, match="codes of 12 bits; display codes have 8 or 16 bits"):
        quilt.srgb(12)


@pytest.mark.parametrize(
    ("display", "size", "expected"),
    [
        ("odyssey-3d", None, (3840, 2160, "_half_2x1")),
        ("odyssey-3d", (7680, 2160), (7680, 2160, "_2x1")),
        ("odyssey-3d", (480, 270), (480, 270, "_half_2x1")),
        ("displayxr", None, (3840, 1080, "_2x1")),
        ("lume-pad", None, (5120, 1600, "_2x1")),
        ("lume-pad", (2560, 1600), (2560, 1600, "_half_2x1")),
    ],
)
def test_pairs_of_monitors(display, size, expected):
    found = quilt_of_display(load_display(display), None, size)
    assert (found.width, found.height, found.ending) == expected
    panel = load_display(display).panel
    assert found.layout == (2, 1, pytest.approx(panel.width / panel.height, rel=1e-5))


@pytest.mark.parametrize(
    ("grid", "size", "error", "said"),
    [
        ((8, 6), None, UsageError, "8x6; odyssey-3d shows one view to either eye"),
        (
            None,
            (1000, 1000),
            PictureError,
            "it is 1000 x 1000 pixels; pairs for odyssey-3d have the shape of 7680x2160",
        ),
        (None, (16, 9), PictureError, "a quilt's sides are 256 to 16384 pixels"),
    ],
)
def test_other_pictures_are_not_for_monitors(grid, size, error, said):
    with pytest.raises(error, match=said):
        quilt_of_display(load_display("odyssey-3d"), grid, size)


def test_a_pair_is_known_by_its_name(tmp_path):
    for stem, ending in (("a_2x1", "_2x1"), ("a_half_2x1", "_half_2x1"), ("a_12x1", ""), ("a_2x1_b", "")):
        path = tmp_path / f"{stem}.png"
        assert ending_of_name(path) == ending
        assert names_layout(path) == bool(ending)
    assert layout_of_name(tmp_path / "a_half_2x1.png") == (2, 1, None)


@pytest.mark.parametrize("number", [-1, 6])
def test_a_view_that_there_is_not_is_refused(number):
    quilt = Quilt(np.zeros((8, 12, 3), np.float32), QuiltLayout(3, 2, 1.0))
    with pytest.raises(UsageError, match=f"number: {number}; views are 0 to 5"):
        quilt.view(number)
