"""What an eye sees, against places worked out by hand and against the rays that the pixels record."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lens_samples import eye_of_view, replay_at_lens_centers

from lippmann.display import NUMPY, Display, LensArray, Panel, list_displays, load_display
from lippmann.errors import UsageError
from lippmann.image import IntegralImage, Provenance
from lippmann.viewing.replay import FAR, default_eye, default_size, replay, replay_points, sweep

#: Three lenses of four 1 mm pixels each, 10 mm in front of the panel; centres at x = -4, 0, 4. Column c is centred at
#: x = c - 5.5.
SHEET = Display("sheet", Panel(12, 4, 1.0), LensArray("lenticular", 4.0), gap=10.0)

DISPLAYS = [
    SHEET,
    Display("square", Panel(15, 10, 0.5), LensArray("square", 2.5), gap=4.0),
    Display("even square", Panel(16, 8, 0.5), LensArray("square", 2.0), gap=4.0),
    Display("near square", Panel(15, 10, 0.5), LensArray("square", 2.5 * 200 / 204), gap=4.0, viewing_distance=200.0),
    Display("near sheet", Panel(30, 6, 0.5), LensArray("lenticular", 3 * 150 / 155), gap=5.0, viewing_distance=150.0),
    Display("hexagonal", Panel(24, 24, 0.5), LensArray("hexagonal", 3.0, row_pitch=2.5), gap=4.0),
    Display(
        "near hexagonal",
        Panel(24, 24, 0.5),
        LensArray("hexagonal", 3.0 * 90 / 94, row_pitch=2.5 * 90 / 94),
        gap=4.0,
        viewing_distance=90.0,
    ),
    # One pixel to the right per row up, so that all lenses stand alike between pixels.
    Display("steep", Panel(30, 12, 0.5), LensArray("lenticular", 2.5 * math.sqrt(0.5), slant=45.0), gap=4.0),
]
NAMES = [display.name for display in DISPLAYS]


def numbered(display):
    """Red is the column, green the row, blue 1."""
    v, u = np.indices((display.panel.height, display.panel.width)).astype(np.float32)
    return IntegralImage(np.stack([u, v, np.ones_like(u)], axis=-1), display)


def columns_seen(image, eye, **options):
    """Red of one sample in the middle of each third of the panel: what each lens of SHEET shows."""
    return replay(image, eye, size=(3, 4), **options)[1, :, 0].tolist()


def test_an_eye_on_the_left_sees_the_right_end_of_every_micro_image():
    # Pixel 3 of lens 1 is at x = 1.5, 10 behind the lens's centre at 0: its light leaves with slope -0.15.
    far = 1e6
    assert columns_seen(numbered(SHEET), (-0.15 * far, 0, far)) == [3, 7, 11]
    assert columns_seen(numbered(SHEET), (-0.05 * far, 0, far)) == [2, 6, 10]
    assert columns_seen(numbered(SHEET), (0.05 * far, 0, far)) == [1, 5, 9]
    assert columns_seen(numbered(SHEET), (0.15 * far, 0, far)) == [0, 4, 8]


def test_a_near_eye_sees_another_view_through_every_lens():
    # From (0, 0, 40) the lens at -4 shows x = -4 - 4 * 10 / 40 = -5, between columns 0 and 1: the right one is shown.
    # The lens at 4 shows x = 5, between columns 10 and 11, the lens at 0 the middle.
    assert columns_seen(numbered(SHEET), (0, 0, 40)) == [1, 6, 11]
    # A little to the left: x = -4.975, 0.025, 5.025; a little to the right: -5.025, -0.025, 4.975.
    assert columns_seen(numbered(SHEET), (-0.1, 0, 40)) == [1, 6, 11]
    assert columns_seen(numbered(SHEET), (0.1, 0, 40)) == [0, 5, 10]


@pytest.mark.parametrize("pixel", [0.1, 0.25, 25.4 / 96])
def test_a_line_between_two_pixels_goes_to_the_right_and_down_everywhere(pixel):
    array = Display("fine", Panel(80, 80, pixel), LensArray("square", 4 * pixel), gap=1.7)
    for eye in ((0, 0, FAR), (-pixel / 1.7 * FAR, pixel / 1.7 * FAR, FAR)):
        samples = replay_at_lens_centers(numbered(array), eye)
        expected = 2 if eye[0] == 0 else 3
        np.testing.assert_array_equal(samples.pixels[..., 0] % 4, expected)
        np.testing.assert_array_equal(samples.pixels[..., 1] % 4, expected)


def test_beyond_the_field_the_neighbour_s_pixels_are_seen():
    # Slope -0.25 is 2.5 mm at the panel: beyond the lens's own 2 mm, in the next micro-image or off the panel.
    far = 1e6
    assert columns_seen(numbered(SHEET), (-0.25 * far, 0, far)) == [4, 8, 0]
    assert replay(numbered(SHEET), (-0.25 * far, 0, far), size=(3, 4))[1, 2].tolist() == [0, 0, 0]


def test_a_cylinder_is_filled_with_one_colour_across_and_straight_along():
    picture = replay(numbered(SHEET), (-150.0, 0, 1000.0))
    assert picture.shape == (4, 12, 3)
    for k in range(3):
        assert (picture[:, 4 * k : 4 * k + 4, 0] == picture[0, 4 * k, 0]).all()
    # Along the axis nothing is bent: from 20 mm away and 10 mm behind, rows at y = +-1.5 appear at +-1.5 * 20 / 30, so
    # the four pixels of the picture (y = 1.5, 0.5, ...) look at y = 2.25, 0.75, ...: past the panel at the ends.
    near = replay(numbered(SHEET), (0, 0, 20))
    assert near[:, 5, 2].tolist() == [0, 1, 1, 0]
    assert near[1:3, 5, 1].tolist() == [1, 2]


def test_rows_of_a_square_array_turn_over_too():
    array = DISPLAYS[2]  # 4 x 4 pixels of 0.5 mm a lens, 4 mm behind: slopes of +-0.1875 and +-0.0625
    far = 1e6
    seen = replay(numbered(array), (0.0625 * far, 0.1875 * far, far), size=(4, 2))
    # The eye is above: it sees the lowest pixel of each micro-image, one to the left of the middle.
    np.testing.assert_array_equal(seen[..., 1], [[3] * 4, [7] * 4])
    np.testing.assert_array_equal(seen[..., 0], [[1, 5, 9, 13]] * 2)


@pytest.mark.parametrize("display", DISPLAYS, ids=NAMES)
def test_a_view_of_one_colour_is_seen_by_its_eye_and_by_no_other(display):
    image = numbered(display)
    views, mask = image.views_and_mask()
    for ky, kx in np.argwhere(mask.any(axis=(2, 3))).tolist():
        marked = np.zeros_like(views)
        marked[ky, kx] = (0.25, 0.5, 0.75)
        picture = IntegralImage.from_views(marked, display)
        samples = replay_at_lens_centers(picture, eye_of_view(display, ky, kx))
        assert samples.own.sum() == mask[ky, kx].sum()
        np.testing.assert_allclose(samples.offsets[samples.own], 0, atol=1e-6)
        np.testing.assert_array_equal(samples.colors[samples.own], [[0.25, 0.5, 0.75]] * int(samples.own.sum()))
        other = next(iter(set(map(tuple, np.argwhere(mask.any(axis=(2, 3))).tolist())) - {(ky, kx)}))
        assert not replay_at_lens_centers(picture, eye_of_view(display, *other)).colors.any()


@pytest.mark.parametrize("display", DISPLAYS[3:5], ids=NAMES[3:5])
def test_at_the_viewing_distance_one_view_fills_the_picture(display):
    image = numbered(display)
    views = np.zeros_like(image.views())
    views[0, -1] = (1, 0.5, 0)
    picture = replay(IntegralImage.from_views(views, display), eye_of_view(display, 0, views.shape[1] - 1))
    lit = (picture == (1, 0.5, 0)).all(axis=-1)
    assert lit.mean() > 0.9  # all but the rim, where the panel's rectangle is wider than its lenses
    assert not picture[~lit].any()
    assert lit[picture.shape[0] // 2, 2:-2].all()


@pytest.mark.long
@settings(deadline=None, max_examples=60)
@given(
    display=st.sampled_from(DISPLAYS + list_displays()[:2]),
    eye=st.tuples(st.floats(-200, 200), st.floats(-200, 200), st.floats(20, 5000)),
)
def test_the_pixel_seen_sends_its_ray_past_the_eye(display, eye):
    samples = replay_at_lens_centers(numbered(display), eye)
    column, row = (samples.pixels[samples.own][:, k] + 0.5 for k in (0, 1))
    origin, direction = display.light_ray(*display.panel_point(column, row), NUMPY)
    steps = (eye[2] - origin[2]) / direction[2]
    beside = origin[0] + steps * direction[0] - eye[0], origin[1] + steps * direction[1] - eye[1]
    # Within the half pixel that nearest sampling leaves, magnified from the panel to the eye.
    limit = 0.5 * display.panel.pixel_pitch * eye[2] / display.gap * (1 + 1e-6) + 1e-6
    if display.lens_array.layout == "lenticular":
        # Across the lenses the ray passes the eye; along them it knows nothing of the eye's place.
        assert np.abs(display.lattice.across(*beside)).max(initial=0) <= limit
    else:
        assert np.abs(beside).max(initial=0) <= limit


def test_slanted_sheets_replay_what_the_rays_recorded():
    sheet = Display("slanted", Panel(64, 48, 0.1), LensArray("lenticular", 0.55, slant=12.0), gap=0.8)
    eye = (60.0, -20.0, 500.0)
    samples = replay_at_lens_centers(numbered(sheet), eye)
    assert samples.own.sum() > 300
    column, row = (samples.pixels[samples.own][:, k] for k in (0, 1))
    np.testing.assert_array_equal(row, np.argwhere(samples.own)[:, 0])
    x, y = sheet.panel_point(column + 0.5, row + 0.5)
    origin, direction = sheet.light_ray(x, y, NUMPY)
    steps = (eye[2] - origin[2]) / direction[2]
    across = sheet.lattice.across(origin[0] + steps * direction[0] - eye[0], origin[1] + steps * direction[1] - eye[1])
    assert np.abs(across).max() <= 0.5 * 0.1 * math.cos(math.radians(12)) * 500 / 0.8 * (1 + 1e-6)


def test_colours_lie_at_their_own_places():
    image = numbered(SHEET).with_pixels(np.repeat(numbered(SHEET).pixels[..., :1], 3, axis=2))
    # The eye sees x = 1.2, that is u = 7.2. Red pixels begin a third further left: 7.2 + 1/3 is in column 7; green 7.2
    # in column 7; blue 7.2 - 1/3 in column 6.
    eye = (-0.12 * FAR, 0, FAR)
    assert replay(image, eye, size=(3, 4), subpixels=True)[1, 1].tolist() == [7, 7, 6]
    assert replay(image, eye, size=(3, 4))[1, 1].tolist() == [7, 7, 7]
    rendered_so = IntegralImage(image.pixels, SHEET, provenance=Provenance(subpixels=True))
    assert replay(rendered_so, eye, size=(3, 4))[1, 1].tolist() == [7, 7, 6]
    assert replay(rendered_so, eye, size=(3, 4), subpixels=False)[1, 1].tolist() == [7, 7, 7]
    # Linear: red sub-pixels 6 and 7 are centred at u = 6.1667 and 7.1667, and 8.1667 is the neighbour's; 7 is all.
    np.testing.assert_allclose(
        replay(image, eye, size=(3, 4), subpixels=True, filter="linear")[1, 1],
        [7, 6.7, 6 + 7.2 - 5.5 - 1.3333333],
        1e-5,
    )


def test_linear_interpolates_within_the_micro_image_only():
    image = numbered(SHEET)
    far = 1e6
    # x = 1 lies midway between columns 6 and 7; x = 1.9 is beyond the middle of column 7, whose right neighbour belongs
    # to the next lens.
    assert columns_seen(image, (-0.1 * far, 0, far), filter="linear")[1] == pytest.approx(6.5, abs=1e-4)
    assert columns_seen(image, (-0.125 * far, 0, far), filter="linear")[1] == pytest.approx(6.75, abs=1e-4)
    assert columns_seen(image, (-0.19 * far, 0, far), filter="linear")[1] == pytest.approx(7, abs=1e-4)


@settings(deadline=None, max_examples=40)
@given(
    display=st.sampled_from(DISPLAYS),
    eye=st.tuples(st.floats(-100, 100), st.floats(-100, 100), st.floats(10, 5000)),
    filter=st.sampled_from(["nearest", "linear"]),
    subpixels=st.booleans(),
)
def test_one_colour_stays_that_colour(display, eye, filter, subpixels):
    panel = display.panel
    image = IntegralImage(np.broadcast_to(np.float32([0.2, 0.4, 0.6]), (panel.height, panel.width, 3)), display)
    picture = replay_points(image, eye, (23, 17), filter=filter, subpixels=subpixels)
    for channel, value in enumerate((0.2, 0.4, 0.6)):
        seen = picture[..., channel]
        np.testing.assert_allclose(seen[seen != 0], value, rtol=1e-6)


def test_a_picture_smaller_than_the_panel_is_the_mean_of_four_points_in_each_pixel():
    """Single points show colour fringes of slanted sheets that no eye resolves."""
    image, eye = numbered(DISPLAYS[-1]), (3.0, 2.0, 400.0)
    points = replay_points(image, eye, (22, 10))
    np.testing.assert_allclose(
        replay(image, eye, size=(11, 5)), points.reshape(5, 2, 11, 2, 3).mean(axis=(1, 3)), rtol=1e-6
    )
    np.testing.assert_array_equal(replay(image, eye, size=(30, 12)), replay_points(image, eye, (30, 12)))


def test_samples_at_lens_centers_agree_with_the_picture():
    array = DISPLAYS[1]
    eye = (7.0, -3.0, 90.0)
    samples = replay_at_lens_centers(numbered(array), eye)
    # 3 x 2 lenses: a picture of 3 x 2 pixels looks at the same points.
    np.testing.assert_allclose(samples.points[0, :, 0], [-2.5, 0, 2.5], atol=1e-12)
    np.testing.assert_allclose(samples.points[:, 0, 1], [1.25, -1.25], atol=1e-12)
    np.testing.assert_array_equal(replay(numbered(array), eye, size=(3, 2)), samples.colors)


def test_an_eye_far_aside_is_outside_the_field():
    samples = replay_at_lens_centers(numbered(SHEET), (-0.25 * FAR, 0, FAR))
    assert not samples.own.any()
    assert samples.colors[:, 0, 2].all()  # it still sees the neighbour's pixels
    assert not samples.colors[:, 2].any()  # or past the panel


def test_a_sweep_moves_in_even_steps():
    image = numbered(SHEET)
    frames = list(sweep(image, (-100, 0, 500), (100, 10, 700), 5, size=(6, 4)))
    assert len(frames) == 5
    np.testing.assert_array_equal(frames[0], replay(image, (-100, 0, 500), size=(6, 4)))
    np.testing.assert_array_equal(frames[1], replay(image, (-50, 2.5, 550), size=(6, 4)))
    np.testing.assert_array_equal(frames[4], replay(image, (100, 10, 700), size=(6, 4)))
    assert len(list(sweep(image, (0, 0, 500), (0, 0, 500), 1, size=(3, 4)))) == 1


def test_default_eye_and_size():
    assert default_eye(load_display("odyssey-3d")) == (-31.5, 0, 600)
    assert default_eye(load_display("panel-4k"))[2] == load_display("panel-4k").viewing_distance
    x, y, z = default_eye(SHEET)
    assert (x, y) == (0, 0)
    # 12 mm wide, field of atan(2 / 10) to each side: as wide as the panel at 30 mm.
    assert z == pytest.approx(45)
    samples = replay_at_lens_centers(numbered(SHEET), (x, y, z))
    assert samples.own[1:3].all()
    assert default_size(SHEET) == (12, 4)
    assert default_size(load_display("panel-8k")) == (2048, 1152)
    assert default_size(Display("slim", Panel(9000, 1, 0.1), LensArray("lenticular", 1.0), gap=5.0)) == (2048, 1)
    assert numbered(SHEET).replay().shape == (4, 12, 3)


def test_large_pictures_are_made_in_blocks_alike():
    array = DISPLAYS[1]
    picture = replay(numbered(array), (5, 5, 80), size=(450, 300))
    # Every lens covers 150 x 150 pixels of the picture.
    samples = replay_at_lens_centers(numbered(array), (5, 5, 80)).colors
    np.testing.assert_array_equal(picture[75::150, 75::150], samples)
    np.testing.assert_array_equal(picture[1::150, 148::150], samples)


@pytest.mark.parametrize(
    "eye", [(0, 0, 0), (0, 0, -5), (0, math.nan, 5), (math.inf, 0, 5), (0, 5), "left", (0, 0, math.inf)]
)
def test_eyes_that_cannot_be(eye):
    for look in (replay, replay_at_lens_centers, lambda image, eye: list(sweep(image, eye, (0, 0, 5), 2))):
        with pytest.raises(UsageError, match="eye: "):
            look(numbered(SHEET), eye)


def test_other_wrong_questions():
    image = numbered(SHEET)
    assert replay(image, size=(np.int64(4), np.int64(3))).shape == (3, 4, 3)
    for size in ((0, 5), (5, -1), (70000, 2)):
        with pytest.raises(UsageError, match="size: "):
            replay(image, size=size)
    with pytest.raises(UsageError, match="unknown filter 'cubic'; known are nearest, linear"):
        replay(image, filter="cubic")
    with pytest.raises(UsageError, match="frames: 0 is out of range"):
        sweep(image, (0, 0, 5), (1, 0, 5), 0)
    with pytest.raises(UsageError, match="frames: 1000000 is out of range; it must be from 1 to 100000"):
        sweep(image, (0, 0, 5), (1, 0, 5), 1_000_000)
