"""Binocular disparity by hand, and as the places where the two eyes' sight lines meet the panel."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.display.stereo import (
    StereoPair,
    comfortable_share,
    depth_of_disparity,
    disparity,
    parallax,
    perceived_height,
)
from lippmann.errors import DisplayError

MONITORS = ["displayxr", "elf-sr", "lume-pad", "odyssey-3d", "spatiallabs"]


def test_disparity_is_the_change_of_the_vergence_angle():
    # Eyes 60 mm apart see the panel at 500 mm under 2 atan(30 / 500), a point at 400 mm under 2 atan(30 / 400).
    expected = 2 * math.degrees(math.atan(0.075) - math.atan(0.06))
    assert disparity(100, 500, 60) == pytest.approx(expected)
    assert disparity(0, 500, 60) == 0
    assert disparity(-1e12, 500, 60) == pytest.approx(-2 * math.degrees(math.atan(0.06)))


@pytest.mark.parametrize("limits", [(1, 1), (1.84, 2.04), (0.2, 3)])
def test_depths_have_the_disparity_that_was_asked_for(limits):
    near, far = depth_of_disparity(*limits, 600, 63)
    assert disparity(near, 600, 63) == pytest.approx(limits[0])
    assert -disparity(far, 600, 63) == pytest.approx(limits[1])
    assert far < 0 < near < 600


def test_nothing_is_too_far_where_parallel_eyes_see_less():
    assert depth_of_disparity(1, 1, 5000, 63)[1] == -math.inf


def test_parallax_by_hand():
    # Sight lines of eyes 60 mm apart at 600 mm to a point 300 mm behind the panel cut it 20 mm apart, uncrossed.
    assert parallax(-300, 600) == pytest.approx(20 / 60)
    assert parallax(0, 600) == 0
    assert parallax(300, 600) == pytest.approx(-1)
    assert parallax(-math.inf, 600) == 1


@pytest.mark.parametrize(
    ("back", "front", "expected"),
    [
        (-100, 50, 1.0),  # comfortable as it is
        (-300, 50, parallax(-119.949, 600) / parallax(-300, 600)),
        (-100, 250, parallax(85.756, 600) / parallax(250, 600)),
        (-math.inf, 0, parallax(-119.949, 600)),
        (-20, -10, 1.0),
    ],
)
def test_eyes_come_closer_until_depth_is_comfortable(back, front, expected):
    share = comfortable_share(back, front, 600, 63)
    assert share == pytest.approx(expected, rel=1e-5)
    # Eyes of full distance perceive the smaller parallax at these heights.
    seen = [disparity(perceived_height(z, 600, share), 600, 63) for z in (back, front)]
    assert max(map(abs, seen)) == pytest.approx(1) if share < 1 else max(map(abs, seen)) <= 1


@pytest.mark.parametrize("name", MONITORS)
@pytest.mark.parametrize("share", [1.0, 0.4])
def test_neighbouring_pixels_shine_one_eye_distance_apart(name, share):
    display = load_display(name).with_closer_eyes(share)
    distance, eyes = display.viewing_distance, share * display.stereo.eyes
    column = np.arange(0, display.panel.width, 97)
    x, y = display.panel_point(column + 0.5, np.full(len(column), 0.5))
    (ox, _, oz), (dx, _, dz) = display.light_ray(x, y)
    arrived = ox + dx / dz * (distance - oz)
    # Of the two pixels under a lens the right one shines to the left eye.
    np.testing.assert_allclose(arrived, np.where(column % 2 == 1, -eyes / 2, eyes / 2), atol=1e-6 * eyes)


@pytest.mark.parametrize("name", MONITORS)
def test_what_a_monitor_is_to_show_is_comfortable(name):
    display = load_display(name)
    near, far = display.depth_budget
    for z, expected in ((near, 1), (far, -1)):
        assert disparity(z, display.viewing_distance, display.stereo.eyes) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"eyes": 39.9}, "it must be 40 to 80 mm"),
        ({"eyes": 81}, "it must be 40 to 80 mm"),
        ({"eyes": "63"}, "it must be 40 to 80 mm"),
        ({"eyes": math.nan}, "it must be 40 to 80 mm"),
        ({"width": "halv"}, "did you mean 'half'"),
    ],
)
def test_impossible_pairs(values, said):
    with pytest.raises(DisplayError, match=said):
        StereoPair(**values)
