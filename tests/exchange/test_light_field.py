"""Light fields of integral images and back: nothing is lost, and every view is where its camera stands."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import PictureError
from lippmann.exchange.cameras import Cameras
from lippmann.exchange.light_field import (
    LightField,
    check_rectangular,
    decode_weights,
    encode_weights,
    light_field_of,
)
from lippmann.image import IntegralImage
from lippmann.image.views import view_grid, view_shape
from lippmann.viewing.replay import eye_of_offset

TYPES = st.sampled_from(["uint8", "uint16", "float16", "float32"])


@settings(deadline=None, max_examples=20)
@given(st.data(), TYPES)
def test_a_picture_comes_back_bit_by_bit(random_displays, picture, same, data, stored):
    display = data.draw(random_displays(("square", "lenticular", "hexagonal")))
    image = picture(display, data.draw(st.integers(0, 99)), stored=stored, depth=True)
    field = light_field_of(image, stored)
    assert field.values.dtype == stored
    assert field.shape == view_shape(display)
    same(field.image(), image)


def test_the_first_view_is_the_top_left_camera_s(display):
    made = display("square", lenses=(2, 2), pixels=3, distance=400)
    places = view_grid(made)
    # Every pixel tells where the eye is that sees it.
    pixels = np.zeros((2, 3, 2, 3, 3), dtype=np.float32)
    for ky in range(3):
        for kx in range(3):
            pixels[:, ky, :, kx] = eye_of_offset(made, places.right[kx], places.down[ky])
    field = light_field_of(IntegralImage(pixels.reshape(6, 6, 3), made), "float32")
    eyes = field.values[:, :, 0, 0]
    assert (np.diff(eyes[..., 0], axis=1) > 0).all()  # s counts to the right
    assert (np.diff(eyes[..., 1], axis=0) < 0).all()  # t counts downwards
    assert (eyes[..., 2] == 400).all()
    baseline = Cameras.of_display(made).baseline
    np.testing.assert_allclose(np.diff(eyes[..., 0], axis=1), baseline, rtol=1e-6)


def test_lenses_cut_by_the_edge_leave_empty_places(display, picture, same):
    made = display("square", lenses=(3, 2), pixels=4, offset=(0.3, 0.1))
    image = picture(made, depth=True)
    field = light_field_of(image, "float32")
    assert field.mask is not None
    assert field.mask.sum() == made.panel.width * made.panel.height
    same(field.image(), image)


def test_without_a_display_one_is_made_from_the_cameras_or_asked_for(display, picture):
    values = np.zeros((3, 3, 4, 5, 3), dtype=np.uint8)
    made = LightField(values, cameras=Cameras(10.0, 1000.0, 2.0)).image()
    assert (made.display.panel.width, made.display.panel.height) == (15, 12)
    assert made.display.viewing_distance == 1000
    assert made.stored == "uint8"
    with pytest.raises(PictureError, match=r"x: has no display in it; its display has 3 x 3 pixels under each lens"):
        LightField(values).image(where="x")
    with pytest.raises(PictureError, match=r"has 3 x 2 views, of unlike number; .*display=FILE"):
        LightField(values[:2], cameras=Cameras(10.0, 1000.0, 2.0)).image()
    with pytest.raises(
        PictureError, match="has 3 x 3 views of 5 x 4 pixels; the display test-square has 3 x 3 views of 4 x 3"
    ):
        LightField(values).image(display("square"))


@pytest.mark.parametrize(
    ("values", "what"),
    [
        (np.zeros((2, 2, 2, 3), np.uint8), "has the shape"),
        (np.zeros((2, 2, 2, 2, 4), np.uint8), "with 3 colours"),
        (np.zeros((0, 2, 2, 2, 3), np.uint8), "has the shape"),
        (np.zeros((2, 2, 2, 2, 3), np.int32), "holds int32"),
        (
            np.lib.stride_tricks.as_strided(np.zeros(1, np.uint8), (1 << 8, 1 << 8, 1 << 8, 1 << 6, 3), (0,) * 5),
            "at most",
        ),
    ],
)
def test_impossible_arrays_are_refused(values, what):
    with pytest.raises(PictureError, match=what):
        LightField(values)


def test_values_that_are_not_finite_are_refused_by_name():
    values = np.full((3, 3, 4, 5, 3), np.nan, dtype=np.float32)
    with pytest.raises(PictureError, match=r"x\.mat: 180 pixels are not finite"):
        LightField(values, cameras=Cameras(10.0, 1000.0, 2.0)).image(where="x.mat")


def test_only_rows_and_columns_of_whole_lenses_are_rectangular(display):
    from lippmann.display import load_display

    check_rectangular(display("square"), "it")
    check_rectangular(display("lenticular"), "it")
    for made, what in (
        (display("hexagonal"), "has hexagonal lenses; it takes lenses in rows and columns"),
        (load_display("panel-4k"), "has slanted lenses"),
        (load_display("print-60lpi"), "print-60lpi cover parts of pixels; it takes lenses that cover whole pixels"),
    ):
        with pytest.raises(PictureError, match=what):
            check_rectangular(made, "it")


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_every_code_of_a_weight_comes_back(dtype):
    codes = np.arange(np.iinfo(dtype).max + 1, dtype=dtype)
    shares = decode_weights(codes)
    assert shares.dtype == np.float32
    assert (shares.min(), shares.max()) == (0, 1)
    np.testing.assert_array_equal(encode_weights(shares, np.dtype(dtype)), codes)


def test_float_weights_stay():
    values = np.array([0, 0.1, 1, 7], dtype=np.float32)
    np.testing.assert_array_equal(encode_weights(decode_weights(values), np.dtype(np.float32)), values)


def test_weights_are_clipped():
    assert encode_weights(np.array([-1.0, 2.0], np.float32), np.dtype(np.uint8)).tolist() == [0, 255]
