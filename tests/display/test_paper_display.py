"""The paper's display (its Table I) against numbers worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.display import load_display

D = 25.4 / 96  # a pixel in millimetres


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular")


def test_sizes(display):
    assert display.size_mm == pytest.approx((135.466667, 135.466667), abs=1e-6)
    assert display.lens_array.pitch == pytest.approx(2.116667, abs=1e-6)
    assert display.pixels_per_lens == (pytest.approx(8.0), None)
    assert (display.lens_grid.columns, display.lens_grid.rows) == (64, 1)
    assert display.micro_image_pitch == display.lens_array.pitch
    # 2 atan(1.058333 / 6.8) = 2 x 8.8464 degrees
    assert display.field_of_view == pytest.approx(17.6928, abs=1e-4)


def test_depth(display):
    """A point spreads by d/g = 0.0389 of its distance, over one lens at N g = 8 x 6.8 mm."""
    assert display.resolvable_depth == pytest.approx((54.4, -54.4))


def test_ray_of_the_first_pixel(display):
    """Pixel (0, 0) lies 3.5 pixels left of the centre of lens 0, so its ray runs to the left, 3.5 d for each gap."""
    x, y = display.panel_point(0.5, 0.5)
    assert (x, y) == pytest.approx((-255.5 * D, 255.5 * D))
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y)
    slope = 3.5 * D / 6.8
    assert slope == pytest.approx(0.136183, abs=1e-6)
    assert (ox, oy, oz) == pytest.approx((-252 * D + 10 * slope, 255.5 * D, 10))
    length = math.hypot(slope, 1)
    assert (dx, dy, dz) == pytest.approx((-slope / length, 0, -1 / length))


def test_pixel_before_a_boundary_and_after(display):
    """Columns 7 and 8 are the outer pixels of lenses 0 and 1: their rays run to the right and to the left."""
    x, y = display.panel_point(np.array([7.5, 8.5]), np.array([100.5, 100.5]))
    assert display.lens_of(x, y)[0].tolist() == [0, 1]
    _, (dx, _, _) = display.light_ray(x, y)
    assert dx[0] == pytest.approx(-dx[1])
    assert dx[0] > 0


def panel_points_of(display, point):
    """The lenses of a row that show a point, and the places of the panel where they show it, ``(n,)`` each."""
    lens = np.arange(display.lens_grid.columns, dtype=float)
    x, y = display.project(*(np.full(lens.shape, float(value)) for value in point), lens, 0.0 * lens)
    is_shown = display.lens_of(x, y)[0] == lens
    return lens[is_shown].tolist(), x[is_shown], y[is_shown]


def test_point_before_the_lens_plane(display):
    """(0, 0, 20): lens centres at +-4, +-12 pixels; 4 (1 + 6.8/20) = 5.36 is inside its micro-image, 16.08 is not."""
    lenses, x, y = panel_points_of(display, (0, 0, 20))
    assert lenses == [31, 32]
    u, v = display.pixel_coordinates(x, y)
    assert u == pytest.approx([256 - 5.36, 256 + 5.36])
    assert v == pytest.approx([256, 256])


def test_point_behind_the_lens_plane(display):
    """(0, 0, -60): lens centres at (m + 1/2) 8 pixels appear at 1 - 6.8/60 of that, inside while (m + 1/2) < 4.41."""
    lenses, x, y = panel_points_of(display, (0, 0, -60))
    assert lenses == list(range(28, 36))
    u, _ = display.pixel_coordinates(x, y)
    assert u == pytest.approx([256 + (m + 0.5) * 8 * (1 - 6.8 / 60) for m in range(-4, 4)])


def test_points_keep_their_height(display):
    """A cylindrical lens looks straight ahead along its axis."""
    _, _, y = panel_points_of(display, (1.0, 12.5, -60))
    assert y == pytest.approx(12.5)


def test_an_eye_far_ahead_sees_the_middle_of_every_micro_image(display):
    centers = (np.arange(64) - 31.5) * 8 * D
    x, y = display.visible_panel_point(0.0, 0.0, 1e9, centers, np.zeros(64))
    np.testing.assert_allclose(x, centers, atol=1e-5)
    np.testing.assert_allclose(y, 0, atol=1e-5)


def test_an_eye_to_the_right_sees_pixels_to_the_left(display):
    """From (30, 0, 300): lens 32, centred at 4 d, shows what lies 6.8 (30 - 4 d) / 300 to the left of it."""
    x, _ = display.visible_panel_point(30.0, 0.0, 300.0, 0.5, 0.0)
    assert x == pytest.approx(4 * D - 6.8 * (30 - 4 * D) / 300)
