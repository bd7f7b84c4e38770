import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import NUMPY, Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage
from lippmann.image.views import micro_image_centers, view_grid

PIXEL = 0.25


def ramp(display):
    """A picture of the pixels' own places: column + 0.5, row + 0.5, 1."""
    v, u = np.indices((display.panel.height, display.panel.width)) + 0.5
    return IntegralImage(np.stack([u, v, np.ones_like(u)], axis=-1), display)


def lenticular(pixels, *, width=60, height=5, slant=0.0):
    pitch = pixels * PIXEL * math.cos(math.radians(slant))
    return Display("sheet", Panel(width, height, PIXEL), LensArray("lenticular", pitch, slant=slant), gap=6.8)


@settings(deadline=None, max_examples=30)
@given(data=st.data())
def test_exact_views_come_back(data, random_displays, picture):
    display = data.draw(random_displays(whole=True))
    image = picture(display)
    assert image.views_are_exact
    views, mask = image.views_and_mask()
    assert mask.sum() == display.panel.width * display.panel.height
    np.testing.assert_array_equal(IntegralImage.from_views(views, display).pixels, image.pixels)


@settings(deadline=None, max_examples=30)
@given(data=st.data())
def test_a_view_holds_the_pixels_at_its_place_behind_every_lens(data, random_displays):
    display = data.draw(random_displays())
    image, grid = ramp(display), view_grid(display)
    views, mask = image.views_and_mask()
    u_center, v_center, lens = micro_image_centers(display)
    lenticular = display.lens_array.layout == "lenticular"
    assert views.shape[:4] == (len(grid.down), len(grid.right), *u_center.shape)
    for ky, down in enumerate(grid.down):
        for kx, right in enumerate(grid.right):
            shown = mask[ky, kx]
            if not grid.exact:
                # Places in the corners of a hexagon's box are other lenses'.
                place = display.panel_point(u_center + right, v_center + (0 if lenticular else down))
                i, j = display.lens_of(*place, NUMPY)
                assert (j * display.lens_grid.columns + i == lens)[shown].all()
            beside_u = (views[ky, kx, ..., 0] - u_center - right)[shown]
            beside_v = (views[ky, kx, ..., 1] - v_center - (0 if lenticular else down))[shown]
            # Exact views: by no more than is said. Resampled ones: the pixel at the place, or the next one if that is
            # a neighbouring lens's.
            limit = grid.spread + 1e-4 if grid.exact else 1.5 + 1e-9
            assert np.abs(beside_u).max(initial=0) <= limit
            assert np.abs(beside_v).max(initial=0) <= limit


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(data=st.data())
def test_resampled_views_take_own_pixels_only(data, random_displays):
    display = data.draw(random_displays(whole=False))
    views, mask = ramp(display).views_and_mask()
    u, v = views[mask][:, 0].astype(float), views[mask][:, 1].astype(float)
    i, j = display.lens_of(*display.panel_point(u, v), NUMPY)
    row, column = np.nonzero(mask)[2:]
    np.testing.assert_array_equal(i, column)
    if display.lens_array.layout != "lenticular":
        np.testing.assert_array_equal(j, row)


def test_places_of_whole_lenses_by_hand(display):
    grid = view_grid(display("square", pixels=4))
    assert grid.exact
    assert grid.note == ""
    assert grid.right == pytest.approx((-1.5, -0.5, 0.5, 1.5))
    assert grid.down == pytest.approx((-1.5, -0.5, 0.5, 1.5))
    assert view_grid(display("lenticular", pixels=3)).right == pytest.approx((-1, 0, 1))
    assert view_grid(display("lenticular", pixels=3)).down == (0.0,)


def test_a_shifted_array_shifts_the_places():
    array = Display("x", Panel(12, 12, PIXEL), LensArray("square", 1.0, offset=(0.1 * PIXEL, 0.0)), gap=6.8)
    grid = view_grid(array)
    # A centre a tenth of a pixel right of the middle: pixels stand at -1.6, -0.6, 0.4, 1.4 from it.
    assert grid.right == pytest.approx((-1.6, -0.6, 0.4, 1.4))
    assert grid.down == pytest.approx((-1.5, -0.5, 0.5, 1.5))
    assert grid.spread == pytest.approx(0, abs=1e-9)


def test_odd_hexagonal_lenses_stand_half_a_pixel_aside(display):
    even, odd = (view_grid(display("hexagonal", lenses=(4, 4), pixels=pixels)) for pixels in (4, 5))
    assert even.spread == pytest.approx(0, abs=1e-9)
    assert even.note == ""
    assert odd.exact
    assert odd.spread == pytest.approx(0.25)
    assert "±0.25 pixels" in odd.note


def test_broken_numbers_of_pixels_are_resampled_and_said_so():
    image = ramp(lenticular(7.5))
    assert not image.views_are_exact
    assert "resampled" in image.views_note
    grid = view_grid(image.display)
    # Seven views share 7.5 pixels.
    assert grid.right == pytest.approx(tuple((k - 3) * 7.5 / 7 for k in range(7)))
    with pytest.raises(PictureError, match="do not cover whole pixels"):
        IntegralImage.from_views(image.views(), image.display)


def test_the_corners_of_a_hexagon_s_box_show_nothing():
    array = Display("hexagons", Panel(60, 60, PIXEL), LensArray("hexagonal", 7.5 * PIXEL), gap=6.8)
    views, mask = ramp(array).views_and_mask()
    assert views.shape[:2] == (8, 7)
    filled = mask.any(axis=(2, 3)).astype(int)
    # Half-widths of a hexagon 7.5 across: 3.75 in the middle rows, less from 2.165 above the centre on.
    assert filled.tolist() == [
        [0, 0, 0, 1, 0, 0, 0],
        [0, 1, 1, 1, 1, 1, 0],
        *[[1] * 7] * 4,
        [0, 1, 1, 1, 1, 1, 0],
        [0, 0, 0, 1, 0, 0, 0],
    ]
    assert not views[~mask].any()


def test_nearest_and_linear_by_hand():
    # Lenses of 2.5 pixels on 10: boundaries at 0, 2.5, 5, 7.5, 10; their own pixels are 0 1, 2 3 4, 5 6, 7 8 9 (a pixel
    # whose middle lies on a boundary belongs to the right), the two views stand 0.625 pixels beside the centres.
    sheet = lenticular(2.5, width=10, height=1)
    assert view_grid(sheet).right == pytest.approx((-0.625, 0.625))
    image = ramp(sheet)
    places = np.array([[1.25 - 0.625, 3.75 - 0.625, 6.25 - 0.625, 8.75 - 0.625], [1.875, 4.375, 6.875, 9.375]])
    np.testing.assert_allclose(image.views("nearest")[0, :, 0, :, 0], [[0.5, 3.5, 5.5, 8.5], [1.5, 4.5, 6.5, 9.5]])
    # Linear gives the place itself, except where it lies beyond the lens's outermost own pixel.
    np.testing.assert_allclose(
        image.views("linear")[0, :, 0, :, 0], np.minimum(places, [[9, 9, 9, 9], [1.5, 4.5, 6.5, 9.5]]), rtol=1e-6
    )


@pytest.mark.parametrize("pixel_pitch", [0.1, 0.25, 25.4 / 96, 0.07])
def test_a_place_between_two_pixels_takes_the_right_one_behind_every_lens(pixel_pitch):
    # Lenses of 3.5 pixels: the middle of every second one lies between two pixels.
    sheet = Display("sheet", Panel(701, 1, pixel_pitch), LensArray("lenticular", 3.5 * pixel_pitch), gap=6.8)
    middle = ramp(sheet).views()[0, 1, 0, :, 0]
    places = micro_image_centers(sheet)[0][0]
    between = np.abs(places - np.round(places)) < 1e-3
    assert between.sum() == 100
    np.testing.assert_array_equal(middle[between], np.round(places[between]) + 0.5)


@settings(deadline=None, max_examples=20)
@given(data=st.data())
def test_linear_views_of_one_colour_have_that_colour(data, random_displays):
    display = data.draw(random_displays(whole=False))
    image = ramp(display)
    views, mask = image.views_and_mask("linear")
    np.testing.assert_array_equal(mask, image.view_mask())
    np.testing.assert_allclose(views[mask][:, 2], 1, rtol=1e-6)


def test_slanted_views_follow_the_axes():
    # 9 pixels across, slant 45 degrees (one pixel to the left per row down): every row is the one above moved.
    sheet = lenticular(9.5, width=95, height=8, slant=45.0)
    u, _, _ = micro_image_centers(sheet)
    np.testing.assert_allclose(np.diff(u, axis=0), -1, atol=1e-9)
    np.testing.assert_allclose(np.diff(u, axis=1), 9.5, atol=1e-9)


def test_unknown_resampling_is_refused(display, picture):
    with pytest.raises(PictureError, match="resampling is 'cubic'; it must be one of nearest, linear"):
        picture(display()).views("cubic")


def test_finite_viewing_distance_moves_the_centres_outward(display):
    near = display("square", lenses=(3, 3), pixels=5, distance=300.0)
    u, v, lens = micro_image_centers(near)
    np.testing.assert_allclose(u[0], [2.5, 7.5, 12.5])
    np.testing.assert_allclose(v[:, 0], [2.5, 7.5, 12.5])
    assert lens.tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    # The lenses themselves are smaller: micro-images are (D + g) / D as wide.
    assert near.lens_array.pitch == pytest.approx(5 * 0.25 * 300 / 306.8)
    far = replace(near, lens_array=replace(near.lens_array, pitch=1.25), viewing_distance=math.inf)
    np.testing.assert_allclose(micro_image_centers(far)[0], u)
