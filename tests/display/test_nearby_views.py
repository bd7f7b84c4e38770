"""Views beside a ray, and the pixels in which they show a point."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.display.array_ops import NUMPY
from lippmann.display.nearby_views import CameraViews, LensViews
from lippmann.display.panel import PixelWindow
from lippmann.display.view_cone import cone_tangent

DISPLAYS = {
    "seed-lenticular": load_display("seed-lenticular"),
    "slanted": load_display("looking-glass-portrait").resized(300, 200),
    "square": load_display("mla-square").resized(160, 160),
    "hexagonal": load_display("mla-hexagonal").resized(160, 160),
}


def shown_at(display, u, v, z):
    """Where the rays of panel pixels meet the lens plane, their slope, and their points at height ``z``."""
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(*display.panel_point(u, v))
    slope_x, slope_y = dx / -dz, dy / -dz
    return ox + oz * slope_x, oy + oz * slope_y, slope_x, (ox + (oz - z) * slope_x, oy + (oz - z) * slope_y, z)


@pytest.mark.parametrize("z", [-40.0, -3.0, 2.5])
@pytest.mark.parametrize("name", DISPLAYS)
def test_a_pixels_own_lens_shows_its_point_in_that_pixel(name, z):
    display = DISPLAYS[name]
    rng = np.random.default_rng(3)
    u = rng.integers(20, display.panel.width - 20, 400) + 0.5
    v = rng.integers(20, display.panel.height - 20, 400) + 0.5
    window = PixelWindow(7, 5, display.panel.width - 9, display.panel.height - 6)
    views = LensViews(display, window)
    x, y, slope, point = shown_at(display, u, v, np.full_like(u, z))
    places = list(views.places(x, y, slope, point, NUMPY))
    assert len(places) == (2 if display.lens_array.layout == "lenticular" else 4)
    own = places[0]
    # Half a pixel at the edge of a micro-image is cut off.
    np.testing.assert_allclose(own.u + 7, u, atol=0.51)
    np.testing.assert_allclose(own.v + 5, v, atol=0.51)
    assert np.mean(np.hypot(own.u + 7 - u, own.v + 5 - v) < 1e-6) > 0.6
    assert (own.left, own.top, own.right, own.bottom) == (0, 0, window.width, window.height)
    for other in places[1:] if name != "hexagonal" else ():  # the box about a hexagon holds pixels of its neighbours
        i, j = (np.stack(display.lens_of(*display.panel_point(p.u + 7, p.v + 5))) for p in (own, other))
        assert np.mean(np.abs(i - j).max(axis=0) == 1) > 0.6


def test_weights_make_a_point_of_those_that_two_lenses_show_beside_it():
    display = DISPLAYS["seed-lenticular"]
    rng = np.random.default_rng(5)
    x, slope = rng.uniform(-50, 50, 400), rng.uniform(-0.15, 0.15, 400)
    z = np.full_like(x, -3.0)
    point = x - slope * z, np.zeros_like(x), z
    places = list(LensViews(display, PixelWindow(0, 0, 512, 512)).places(x, 0 * x, slope, point, NUMPY))
    shown = [shown_at(display, place.u, place.v, z)[3][0] for place in places]
    between = (shown[0] - point[0]) * (shown[1] - point[0]) < 0
    assert between.mean() > 0.3
    mean = sum(place.weight * at for place, at in zip(places, shown, strict=True)) / sum(p.weight for p in places)
    np.testing.assert_allclose(mean[between], point[0][between], atol=2e-3)
    np.testing.assert_allclose(mean_aside(places)[between], 0, atol=2e-3)


def mean_aside(places):
    """Pixels to the right from the points that two lenses show, in the mean, to the point."""
    return sum(place.weight * place.across for place in places) / sum(place.weight for place in places)


def test_points_aside_of_all_that_two_lenses_show_are_told():
    display = DISPLAYS["seed-lenticular"]
    x, slope, z = np.linspace(-50, 50, 400), np.where(np.arange(400) % 2, 1.5, 0.1), np.full(400, -30.0)
    point = x - slope * z, np.zeros_like(x), z
    aside = mean_aside(list(LensViews(display, PixelWindow(0, 0, 512, 512)).places(x, 0 * x, slope, point, NUMPY)))
    assert np.abs(aside[slope < 1]).max() < 0.01
    assert np.abs(aside[slope > 1]).min() > 1


def test_cameras_beside_a_ray_show_its_points_where_their_pictures_have_them():
    display = DISPLAYS["slanted"]
    window = PixelWindow(4, 3, 90, 70)
    views = CameraViews(display, 4, 2, (100, 80), window)
    rng = np.random.default_rng(4)
    slope, x, y = rng.uniform(-0.2, 0.2, 200), rng.uniform(-5, 5, 200), rng.uniform(-4, 4, 200)
    z = rng.uniform(-30, 10, 200)
    point = x - slope * z, y - (y / display.viewing_distance) * z, z
    # Where the camera stands that has this ray, of 8 in a row.
    own = (((x / display.viewing_distance - slope) / cone_tangent(display) + 1) * 8 - 1) / 2
    places = list(views.places(x, y, slope, point, NUMPY))
    width, height = display.size_mm
    numbers = [(1 - place.top // 70) * 4 + place.left // 90 for place in places]
    inner = (own > 0) & (own < 7)
    assert inner.mean() > 0.5
    np.testing.assert_array_equal(numbers[0][inner], np.floor(own[inner]))
    np.testing.assert_array_equal(numbers[1][inner], np.floor(own[inner]) + 1)
    # Between both cameras' places lies that of the ray itself.
    u = [place.u - place.left + 4 for place in places]
    share = own - np.floor(own)
    mean = u[0] * (1 - share) + u[1] * share
    np.testing.assert_allclose(mean[inner], ((x / width + 0.5) * 100)[inner], atol=1e-6)
    np.testing.assert_allclose((places[0].v - places[0].top + 3)[inner], ((0.5 - y / height) * 80)[inner], atol=1e-6)
