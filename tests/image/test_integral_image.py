import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from lippmann.codecs.png import read_png_header
from lippmann.errors import OutputError, PictureError
from lippmann.image import IntegralImage, Provenance

ANGLE = math.radians(30)
SIMILARITY = 3e-4 * np.array([[math.cos(ANGLE), -math.sin(ANGLE), 0], [math.sin(ANGLE), math.cos(ANGLE), 0], [0, 0, 1]])


def test_pixels_are_kept_without_a_copy_and_read_only(display):
    values = np.zeros((9, 12, 3), np.float32)
    image = IntegralImage(values, display("square"))
    assert np.shares_memory(image.pixels, values)
    with pytest.raises(ValueError, match="read-only"):
        image.pixels[0, 0, 0] = 1
    values[0, 0, 0] = 1  # the caller's own array stays as it was
    assert IntegralImage(np.zeros((9, 12, 3), np.float64), display("square")).pixels.dtype == np.float32


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        (np.zeros((9, 12)), r"shape \(9, 12\); it must be"),
        (np.zeros((9, 12, 4)), r"shape \(9, 12, 4\)"),
        (np.zeros((12, 9, 3)), "9 x 12 pixels; the display test-square has 12 x 9"),
        ("a picture", "no array of numbers"),
        (
            np.where(np.arange(324).reshape(9, 12, 3) == 40, np.nan, 0),
            "1 pixels are not finite, the first in column 1, row 1",
        ),
        (np.full((9, 12, 3), np.inf), "108 pixels are not finite"),
    ],
)
def test_pixels_that_do_not_fit(display, pixels, message):
    with pytest.raises(PictureError, match=message):
        IntegralImage(pixels, display("square"))


def test_placements(display):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = SIMILARITY, (5, 6, 7)
    image = IntegralImage(np.zeros((9, 12, 3)), display("square"), matrix)
    np.testing.assert_array_equal(image.world_from_display, matrix)
    matrix[0, 0] = 9
    assert image.world_from_display[0, 0] != 9
    np.testing.assert_array_equal(IntegralImage(np.zeros((9, 12, 3)), display("square")).world_from_display, np.eye(4))
    for wrong in (
        np.eye(3),
        np.diag([1, 2, 1, 1]),
        np.diag([1, 1, -1, 1]),
        np.eye(4) * 2,
        np.full((4, 4), np.nan),
        "x",
    ):
        with pytest.raises(PictureError, match="rotation times a scale"):
            IntegralImage(np.zeros((9, 12, 3)), display("square"), wrong)


@pytest.mark.parametrize(
    ("maps", "message"),
    [
        ({"depth": np.zeros((9, 12))}, "the map depth holds float64"),
        ({"depth": np.zeros((9, 11), np.float32)}, "the map depth has the shape"),
        ({"depth": np.zeros((9, 12, 1), np.float32)}, "the map depth has the shape"),
        ({"depth": np.zeros((9, 12, 5), np.float32)}, "the map depth has the shape"),
        ({"a.b": np.zeros((9, 12), np.float32)}, "a map has the name 'a.b'"),
        ({"": np.zeros((9, 12), np.float32)}, "a map has the name ''"),
    ],
)
def test_maps_that_do_not_fit(display, maps, message):
    with pytest.raises(PictureError, match=message):
        IntegralImage(np.zeros((9, 12, 3)), display("square"), maps=maps)


def test_unknown_storage(display):
    with pytest.raises(PictureError, match="stored is 'int8'"):
        IntegralImage(np.zeros((9, 12, 3)), display("square"), stored="int8")


def test_shapes_of_all_layouts(display, picture):
    square = picture(display("square", lenses=(4, 3), pixels=2))
    assert square.micro_images().shape == (3, 4, 2, 2, 3)
    assert square.views().shape == (2, 2, 3, 4, 3)
    sheet = picture(display("lenticular", lenses=(4, 3), pixels=2))
    assert sheet.micro_images().shape == (1, 4, 6, 2, 3)
    assert sheet.views().shape == (1, 2, 6, 4, 3)
    assert sheet.micro_image_mask().all()
    assert sheet.view_mask().shape == (1, 2, 6, 4)


def test_from_parts_keeps_the_other_parameters(display, picture, provenance):
    image = picture(display("hexagonal", pixels=5))
    back = IntegralImage.from_micro_images(image.micro_images(), image.display, provenance=provenance, stored="uint8")
    np.testing.assert_array_equal(back.pixels, image.pixels)
    assert (back.provenance, back.stored) == (provenance, "uint8")
    with pytest.raises(PictureError, match="the views have the shape"):
        IntegralImage.from_views(image.views()[1:], image.display)


def test_with_pixels(display, picture):
    image = picture(display())
    darker = image.with_pixels(image.pixels / 2, stored="float16")
    np.testing.assert_array_equal(darker.pixels, image.pixels / 2)
    assert (darker.display, darker.provenance, darker.stored) == (image.display, image.provenance, "float16")


def test_stats(display, picture, provenance):
    made = replace(provenance, seconds={"trace": 0.1})
    stats = picture(display("square", lenses=(4, 3)), provenance=made).stats
    assert stats["size"] == [12, 9]
    assert stats["lenses"] == [4, 3]
    assert stats["rays"] == provenance.rays
    assert stats["seconds"]["trace"] == 0.1


def test_worker_processes_get_the_same_picture(display, picture):
    image = picture(display())
    back = pickle.loads(pickle.dumps(image))
    np.testing.assert_array_equal(back.pixels, image.pixels)
    assert back.display == image.display


def test_numpy_takes_the_pixels(display):
    image = IntegralImage(np.full((4, 4, 3), 0.25, np.float32), display("square", lenses=(2, 2), pixels=2))
    assert np.shares_memory(np.asarray(image), image.pixels)
    assert np.asarray(image, np.float64).dtype == np.float64
    assert np.mean(image) == 0.25


def test_notebooks_show_what_an_eye_sees(tmp_path, display):
    array = display("square", lenses=(300, 100), pixels=3)
    colors = np.broadcast_to(np.float32([1, 0.5, 0]), (300, 900, 3))
    image = IntegralImage(colors, array, provenance=Provenance(scene="<b>&", method="full"))
    (tmp_path / "a.png").write_bytes(image._repr_png_())
    header = read_png_header(tmp_path / "a.png")
    assert (header.width, header.height) == (512, 171)
    page = image._repr_html_()
    assert "data:image/png;base64," in page
    assert "&lt;b&gt;&amp;" in page
    assert "<b>" not in page
    assert "900 x 300 pixels, 300 x 100 lenses" in repr(image)


def test_saving_to_a_place_that_cannot_be(tmp_path, display, picture):
    with pytest.raises(OutputError, match=r"known are .png"):
        picture(display()).save(str(tmp_path / "a.gif"))
