"""The cameras of a display: judged by the display's own geometry, which knows nothing of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lippmann.display import NUMPY, load_display
from lippmann.errors import PictureError, UsageError
from lippmann.exchange.cameras import Cameras
from lippmann.image.views import view_grid
from lippmann.viewing.replay import eye_of_offset


def pixel_of(display, point, ky, kx):
    """Where in view ``(ky, kx)`` a point is seen, in pixels right and down: by similar triangles from its eye."""
    places = view_grid(display)
    eye = eye_of_offset(display, places.right[kx], places.down[ky])
    x, y, z = point
    lens_x, lens_y = x + (x - eye[0]) * z / (eye[2] - z), y + (y - eye[1]) * z / (eye[2] - z)
    pitch = display.lattice.pitch
    return np.array([lens_x / pitch, -lens_y / pitch])


@settings(deadline=None, max_examples=20)
@given(st.data())
def test_disparity_is_how_far_a_point_moves_from_view_to_view(random_displays, data):
    display = data.draw(random_displays())
    rows, columns = (len(places) for places in (view_grid(display).down, view_grid(display).right))
    assume(columns > 1)
    z = data.draw(st.floats(-50, min(50.0, 0.8 * display.viewing_distance)))
    point = data.draw(st.floats(-9, 9)), data.draw(st.floats(-9, 9)), z
    cameras = Cameras.of_display(display)
    disparity = float(cameras.disparity_of_height(np.array(z)))
    # The camera in row t and column s from the top left shows the pixel in the opposite place under the lens.
    for t in range(rows):
        for s in range(columns):
            moved = pixel_of(display, point, rows - 1 - t, columns - 1 - s)
            first = pixel_of(display, point, rows - 1, columns - 1)
            expected = [s * disparity, t * disparity]
            if display.lens_array.layout == "lenticular":
                expected[1], first[1] = 0.0, moved[1]  # one row of cameras; rows of a sheet are pixels of another size
            np.testing.assert_allclose(first - moved, expected, atol=2e-5)
    assert (disparity > 0) == (z > 0) or disparity == 0


def test_the_middle_camera_s_axis_passes_the_middle_of_its_frame_where_lenses_stand_beside_their_pixels():
    """Readers of the benchmark's files project by that: a point in the lens plane lies in its own lens's pixel."""
    display = load_display("mla-square").resized(31, 31)
    display = replace(display, lens_array=replace(display.lens_array, pitch=6 * display.panel.pixel_pitch))
    for offset in (None, (0.02, -0.013)):
        display = replace(display, lens_array=replace(display.lens_array, offset=offset), viewing_distance=400.0)
        cameras, grid = Cameras.of_display(display), display.lens_grid
        x, y = display.lattice.center(3, 1, 0.0, 0.0, NUMPY)
        column = grid.columns / 2 + (x - cameras.center[0]) / cameras.pixel_pitch
        row = grid.rows / 2 - (y - cameras.center[1]) / cameras.pixel_pitch
        assert (column, row) == pytest.approx((3.5, 1.5))


@settings(deadline=None, max_examples=20)
@given(st.data())
def test_the_panel_shows_the_point_where_the_disparity_says(random_displays, data):
    """The same from the other side: a point is projected onto the panel, lens by lens."""
    display = data.draw(random_displays(layouts=("square",)))
    z = data.draw(st.floats(1, 40) | st.floats(-40, -1))
    assume(z < 0.5 * display.viewing_distance)
    disparity = float(Cameras.of_display(display).disparity_of_height(np.array(z)))
    i = np.array([0.0, 1.0])
    x, _ = display.project(np.zeros(2), np.zeros(2), np.full(2, z), i, np.zeros(2), NUMPY)
    centers, _ = display.lattice.center(i, np.zeros(2), np.zeros(2), np.zeros(2), NUMPY)
    # One lens on is one pixel of a view; so many pixels under the lens are as many views the other way.
    under_lens = (x - centers * display.magnification) / display.panel.pixel_pitch
    assert under_lens[1] - under_lens[0] == pytest.approx(1 / disparity, rel=1e-6)


@settings(deadline=None, max_examples=20)
@given(st.data())
def test_depth_and_disparity_follow_the_published_formula(random_displays, data):
    display = data.draw(random_displays())
    cameras = Cameras.of_display(display)
    low = -0.9 * cameras.focus_distance if cameras.parallel else -5000.0
    z = np.array(data.draw(st.lists(st.floats(low, 0.9 * min(cameras.focus_distance, 3000)), min_size=1)))
    axial = cameras.axial_depth(z)
    # Disparity = (B f F R / Z - B f R) / (F S), with any focal length f and resolution R.
    B, F, f, R = cameras.baseline, cameras.focus_distance, 35.0, 512
    S = cameras.pixel_pitch * f * R / F
    published = (B * f * F * R / axial - B * f * R) / (F * S)
    np.testing.assert_allclose(
        cameras.disparity_of_height(z), published, rtol=1e-9, atol=1e-9 * B / cameras.pixel_pitch
    )
    np.testing.assert_allclose(cameras.disparity(axial), published, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(cameras.depth_of_disparity(published), axial, rtol=1e-6)
    np.testing.assert_allclose(cameras.height(axial), z, rtol=1e-6, atol=1e-6 * F)


def test_parallel_views_are_true_to_one_percent_within_the_depth_that_is_resolved(display):
    made = display("square", pixels=5)
    cameras = Cameras.of_display(made)
    near, far = made.resolvable_depth
    for z in (near, far):
        true = cameras.focus_distance - z
        squeezed = cameras.axial_depth(np.array(z))
        assert squeezed - cameras.focus_distance == pytest.approx(true - cameras.focus_distance, rel=0.0102)
    # d z / (g p), whatever the stand-in distance.
    for distance in (None, 50.0, 1e6):
        cameras = Cameras.of_display(made, distance)
        expected = made.panel.pixel_pitch * 3.0 / (made.gap * made.lens_array.pitch)
        assert cameras.disparity_of_height(np.array(3.0)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("distance", [math.inf, 300.0])
def test_where_nothing_is_seen_depth_is_infinite_disparity_nan_and_both_come_back(display, distance):
    cameras = Cameras.of_display(display(distance=distance))
    nothing = np.array([-np.inf, 1.0])
    assert cameras.axial_depth(nothing)[0] == np.inf
    assert cameras.height(cameras.axial_depth(nothing)).tolist() == [-np.inf, pytest.approx(1.0)]
    disparity = cameras.disparity_of_height(nothing)
    assert np.isnan(disparity[0])
    assert cameras.depth_of_disparity(disparity)[0] == np.inf


@settings(deadline=None, max_examples=20)
@given(st.data())
def test_the_display_made_from_cameras_has_these_cameras(data):
    views, size = data.draw(st.integers(2, 9)), data.draw(st.integers(1, 9))
    focus, pitch = data.draw(st.floats(100, 10000)), data.draw(st.floats(0.1, 10))
    baseline = data.draw(st.floats(1.2, 50)) * pitch / views
    made = Cameras(baseline, focus, pitch).display(views, size, size + 1)
    assert made.pixels_per_lens == pytest.approx((views, views))
    assert (made.lens_grid.columns, made.lens_grid.rows) == (size, size + 1)
    again = Cameras.of_display(made)
    assert (again.baseline, again.focus_distance) == pytest.approx((baseline, focus))
    assert again.pixel_pitch == pytest.approx(pitch)
    assert again.center == pytest.approx((0, 0), abs=1e-6)


def test_what_cannot_be_is_refused(display):
    with pytest.raises(PictureError, match="with the baseline"):
        Cameras(baseline=0.1, focus_distance=100, pixel_pitch=1.0).display(5, 9, 9)
    with pytest.raises(UsageError, match="distance: is for parallel views"):
        Cameras.of_display(display(distance=500), 600)
    for distance in (0.0, -5.0, math.inf, math.nan):
        with pytest.raises(UsageError, match="must be above zero"):
            Cameras.of_display(display(), distance)
    with pytest.raises(PictureError, match="a surface lies 60 mm behind the lens plane"):
        Cameras.of_display(display(), 50).axial_depth(np.array([-60.0, 3.0]))
