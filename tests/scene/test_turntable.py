"""Scenes on a turntable: axes, the space that they sweep, and light that stays."""

from __future__ import annotations

import numpy as np
import pytest

import lippmann
from lippmann.options.placement import PlacementOptions
from lippmann.scene.matrices import inverse, rotation, transform_points
from lippmann.scene.turntable import outline, swept_points, turn_about, turning_axis

AXES = [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)]


@pytest.fixture(scope="module")
def teapot():
    return lippmann.load_scene("teapot")


def test_a_turn_about_y_is_a_yaw_and_the_line_stays():
    assert turn_about((0.0, 1.0, 0.0), (0.0, 0.0, 0.0), 30.0) == pytest.approx(rotation((30.0, 0.0, 0.0)))
    assert turn_about((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 30.0) == pytest.approx(rotation((0.0, 30.0, 0.0)))
    turn = turn_about((0.0, 0.0, 1.0), (1.0, 2.0, 3.0), 77.0)
    assert transform_points(turn, np.array([[1.0, 2.0, 9.0]])) == pytest.approx(np.array([[1.0, 2.0, 9.0]]))


@pytest.mark.parametrize(
    ("turn", "axis"),
    [
        ((0, 0, 0), (0, 1, 0)),
        ((130, 25, -30), (0, 1, 0)),  # seen from above, and tilted
        ((0, -90, 0), (0, 0, 1)),  # stored with z up
        ((0, 80, 0), (0, 0, -1)),
        ((0, 0, 90), (1, 0, 0)),
        ((0, 180, 0), (0, -1, 0)),
    ],
)
def test_the_axis_is_the_one_that_stands_upright(teapot, turn, axis):
    assert turning_axis(teapot, PlacementOptions(turn=tuple(map(float, turn)))) == pytest.approx(axis)


def test_a_camera_says_what_is_upright(teapot):
    assert turning_axis(teapot, PlacementOptions(place="camera")) == (0.0, 1.0, 0.0)
    assert turning_axis(teapot, PlacementOptions(place="camera", turn=(0.0, 0.0, 90.0))) == (1.0, 0.0, 0.0)


@pytest.mark.parametrize("axis", AXES)
def test_the_outline_is_tight_in_every_direction(teapot, axis):
    center = np.array([1.0, 2.0, 3.0])
    points = outline(teapot, axis, center)
    for angle in (0.0, 20.0, 135.0):
        frame = inverse(turn_about(axis, center, angle))
        box = transform_points(frame, points)
        assert np.stack([box.min(axis=0), box.max(axis=0)]) == pytest.approx(teapot.bounds_in(frame), abs=1e-6)
    frame = turn_about(axis, center, 1.7)  # between two sides
    box, exact = transform_points(frame, points), teapot.bounds_in(frame)
    assert (box.min(axis=0) <= exact[0] + 1e-6).all()
    assert (box.max(axis=0) >= exact[1] - 1e-6).all()
    assert np.ptp(box, axis=0) == pytest.approx(exact[1] - exact[0], rel=2e-3)


def test_what_is_swept_is_round(teapot):
    center = teapot.bounds.mean(axis=0)
    swept = swept_points(teapot, (0.0, 1.0, 0.0), center, np.arange(0.0, 360.0, 5.0))
    low, high = swept.min(axis=0), swept.max(axis=0)
    assert high[0] - low[0] == pytest.approx(high[2] - low[2], rel=1e-9)
    assert (high - low)[1] == pytest.approx(np.ptp(teapot.bounds[:, 1]))
    assert high[0] - low[0] >= np.ptp(teapot.bounds[:, 0])
