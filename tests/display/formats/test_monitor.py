"""Slanted monitors by pitch, slope and centre: the display agrees with the published formula at every sub-pixel."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import NUMPY, Display, Panel, load_display
from lippmann.display.formats.monitor import Monitor
from lippmann.errors import DisplayError

BGR = ((1 / 3, 0.0), (0.0, 0.0), (-1 / 3, 0.0))
CELL = ((-0.31, 0.26), (0.27, -0.21), (0.05, 0.25))
OTHER = ((0.1, -0.2), (-0.3, 0.15), (0.33, 0.05))

FOUR_K = Monitor("4k", Panel(3840, 2160, 25.4 / 282.4), pitch=45.5, slope=-6.0, center=0.37, viewing_distance=600.0)

VARIANTS = {
    "left": FOUR_K,
    "right": replace(FOUR_K, slope=5.3, center=-7.21),
    "upright": replace(FOUR_K, slope=math.inf, center=0.9),
    "blue first": replace(FOUR_K, panel=replace(FOUR_K.panel, subpixel_offsets=BGR)),
    "cells": replace(FOUR_K, panel=replace(FOUR_K.panel, subpixel_cells=((CELL, OTHER), (OTHER, CELL)))),
    "odd size": replace(FOUR_K, panel=Panel(1367, 769, 0.21), pitch=18.3),
    "parallel": replace(FOUR_K, viewing_distance=math.inf),
}


def published_phase(monitor, column, row, c):
    """The formula as it is published, x and y in [0, 1] from the lower left corner."""
    width, height, pixel = monitor.panel.width, monitor.panel.height, monitor.panel.pixel_pitch
    dpi = 25.4 / pixel
    cells = monitor.panel.subpixel_cells
    offsets = monitor.panel.subpixel_offsets if cells is None else cells[row % 2][column % 2]
    x, y = (column + 0.5) / width, (height - row - 0.5) / height
    dx, dy = offsets[c][0], -offsets[c][1]
    pitch = monitor.pitch * (width / dpi) * math.cos(math.atan(1 / monitor.slope))
    tilt = height / (width * monitor.slope)
    return ((x + dx / width) + (y + dy / height) * tilt) * pitch - monitor.center


def places(monitor, count=300):
    rng = np.random.default_rng(3)
    width, height = monitor.panel.width, monitor.panel.height
    corners = [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)]
    drawn = zip(rng.integers(0, width, count).tolist(), rng.integers(0, height, count).tolist(), strict=True)
    return [(column, row, c) for column, row in [*corners, *drawn] for c in range(3)]


@pytest.mark.parametrize("monitor", VARIANTS.values(), ids=VARIANTS)
def test_the_phase_is_the_published_one(monitor):
    for column, row, c in places(monitor):
        assert monitor.phase(column, row, c) == pytest.approx(published_phase(monitor, column, row, c), abs=1e-9)


@pytest.mark.parametrize("monitor", VARIANTS.values(), ids=VARIANTS)
def test_every_subpixel_lies_under_its_lens_where_the_formula_says(monitor):
    display = monitor.display()
    for column, row, c in places(monitor):
        x, y = display.subpixel_point(np.array([column + 0.5]), np.array([row + 0.5]), c, NUMPY)
        i, j = display.lens_of(x, y)
        cx, cy = display.lens_center(i, j, x, y)
        # From the lens's axis, across, in micro-images; to the right is more.
        away = (display.lattice.across(x, y) - display.lattice.across(cx, cy) * display.magnification)[0]
        # Seen from the middle of the viewing place, the axis of a lens lies over (D + g) / D of its own place.
        away /= display.micro_image_pitch
        difference = away + 0.5 - published_phase(monitor, column, row, c)
        assert abs(difference - round(difference)) < 2e-6, (column, row, c)


@pytest.mark.parametrize("monitor", VARIANTS.values(), ids=VARIANTS)
def test_every_subpixel_s_ray_runs_to_its_view(monitor):
    """View 0 is seen from the leftmost place of the cone, view 1 from the rightmost, evenly in between."""
    display = monitor.display()
    distance = 1e9 if math.isinf(monitor.viewing_distance) else monitor.viewing_distance
    half = distance * math.tan(math.radians(monitor.view_cone / 2)) * math.cos(math.radians(display.lens_array.slant))
    for column, row, c in places(monitor, 100):
        x, y = display.subpixel_point(np.array([column + 0.5]), np.array([row + 0.5]), c, NUMPY)
        (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y, NUMPY)
        t = (distance - oz) / dz
        seen = 0.5 + 0.5 * float(display.lattice.across(ox + t * dx, oy + t * dy)[0]) / half
        difference = seen - (1 - published_phase(monitor, column, row, c) % 1)
        assert abs(difference - round(difference)) < 1e-5, (column, row, c)


@st.composite
def monitors(draw):
    width, height = draw(st.integers(60, 4000)), draw(st.integers(10, 3000))
    pixel = draw(st.floats(0.03, 0.6))
    slope = draw(st.just(math.inf) | st.floats(0.2, 40) | st.floats(-40, -0.2))
    pixels_per_lens = draw(st.floats(2, 50))
    pitch = 25.4 / (pixel * pixels_per_lens * math.cos(math.atan(1 / slope)))
    return Monitor(
        "random",
        Panel(width, height, pixel),
        pitch=min(max(pitch, 1.0), 1000.0),
        slope=slope,
        center=draw(st.floats(-3, 3)),
        view_cone=draw(st.floats(5, 100)),
        viewing_distance=draw(st.just(math.inf) | st.floats(100, 3000)),
    )


def test_numbers_at_a_limit_are_given_back_though_they_are_rounded():
    panel = Panel(60, 10, 0.0625)
    at_limit = Monitor("fine", panel, pitch=1000.0, slope=0.2, center=0.0, view_cone=5.0, viewing_distance=120.0)
    assert Monitor.of_display(at_limit.display()).pitch == 1000.0


@given(monitor=monitors())
@settings(deadline=None, max_examples=40)
def test_a_display_gives_its_numbers_back(monitor):
    again = Monitor.of_display(monitor.display())
    # A number of upright lenses that is nearly whole is taken as whole: to a millionth of a lens over the panel.
    assert again.pitch == pytest.approx(monitor.pitch, rel=1e-6)
    assert again.slope == pytest.approx(monitor.slope, rel=1e-9)
    difference = again.center - monitor.center
    assert abs(difference - round(difference)) < 1e-5
    assert again.view_cone == pytest.approx(monitor.view_cone, rel=1e-6)
    assert (again.panel, again.viewing_distance) == (monitor.panel, monitor.viewing_distance)


def test_every_lenticular_preset_has_numbers():
    for name in (
        "panel-4k",
        "seed-lenticular",
        "print-60lpi",
        "looking-glass-portrait",
        "looking-glass-32-gen3-portrait",
    ):
        display = replace(load_display(name), distortion=None)  # the numbers are those of a pinhole
        again = Monitor.of_display(display).display()
        rng = np.random.default_rng(1)
        u, v = rng.uniform(0, display.panel.width, 500), rng.uniform(0, display.panel.height, 500)
        lines = []
        for one in (display, again):
            (ox, oy, oz), direction = one.light_ray(*one.subpixel_point(u, v, 0))
            t = -oz / direction[2]
            lines.append(np.stack([ox + t * direction[0], oy + t * direction[1], *direction]))
        np.testing.assert_allclose(lines[1], lines[0], atol=1e-6)


def test_lenses_that_are_not_cylindrical_have_none():
    with pytest.raises(DisplayError, match="square lenses"):
        Monitor.of_display(load_display("mla-square"))


def test_half_the_cone_shows_on_each_side():
    display: Display = FOUR_K.display()
    sideways = display.micro_image_pitch / math.cos(math.radians(display.lens_array.slant)) / display.gap
    assert math.degrees(2 * math.atan(sideways / 2)) == pytest.approx(FOUR_K.view_cone)
    assert 25.4 / display.micro_image_pitch == pytest.approx(45.5)
    assert display.aperture_distance == pytest.approx(60.0)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"pitch": 0}, "pitch is 0; it must lie between 1 and 1000 lenses per inch"),
        ({"pitch": -45.5}, "pitch is -45.5"),
        ({"pitch": math.nan}, "pitch is nan"),
        ({"pitch": "45"}, "pitch is '45'"),
        ({"slope": 0}, "slope is 0; it must be at least 0.18 in size"),
        ({"slope": 0.1}, "slope is 0.1"),
        ({"slope": math.nan}, "slope is nan"),
        ({"center": math.inf}, "center is inf"),
        ({"view_cone": 0}, "view_cone is 0"),
        ({"view_cone": 180}, "view_cone is 180"),
        ({"viewing_distance": -600}, "viewing_distance is -600"),
        ({"name": ""}, "name is ''"),
    ],
)
def test_bad_values_are_refused(changed, said):
    with pytest.raises(DisplayError, match=said.replace(".", r"\.")):
        replace(FOUR_K, **changed)


def test_a_lens_covers_a_pixel_at_least_and_the_panel_at_most():
    with pytest.raises(DisplayError, match="it must cover at least one"):
        replace(FOUR_K, pitch=400.0).display()
    with pytest.raises(DisplayError, match="the panel has only 5"):
        replace(FOUR_K, panel=replace(FOUR_K.panel, width=5)).display()
