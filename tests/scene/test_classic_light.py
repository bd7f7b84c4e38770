"""Light of a classic scene that goes round it."""

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.scene.classic_light import move_light
from lippmann.scene.matrices import transform_points
from lippmann.scene.turntable import turn_about
from lippmann.scene.values.whitted_surfaces import Background, ClassicLight
from lippmann.scene.whitted.to_pbr import to_physical
from lippmann.scene.whitted.world_frame import world_from_scene


def test_classic_light_moves_in_the_world():
    """Tachyon's own coordinates have the z of the world negated."""
    light = ClassicLight("spot", center=(1.0, 2.0, 3.0), direction=(0.0, 0.0, 1.0))
    plane = Background("sky-plane", up=(1.0, 1.0, 0.0), top_value=5.0, bottom_value=-1.0)
    classic = replace(lippmann.load_scene("gears").classic, lights=(light,), background=plane)
    turn = turn_about((0.0, 1.0, 0.0), (4.0, 0.0, -2.0), 40.0)
    moved = move_light(classic, turn)
    mirror = world_from_scene(classic)
    before, after = (transform_points(mirror, np.array([one.lights[0].center])) for one in (classic, moved))
    assert after == pytest.approx(transform_points(turn, before))
    travels = turn[:3, :3] @ mirror[:3, :3] @ np.array(light.direction)
    assert mirror[:3, :3] @ moved.lights[0].direction == pytest.approx(travels)
    # A ray that goes along meets the same place of the gradient.
    origin = np.array([[0.3, -0.7, 2.0]])
    there = transform_points(mirror @ turn @ mirror, origin)
    share = [
        (float(place[0] @ np.array(one.background.up)) - one.background.bottom_value)
        / (one.background.top_value - one.background.bottom_value)
        for one, place in ((classic, origin), (moved, there))
    ]
    assert share[0] == pytest.approx(share[1])


def test_all_frames_of_a_turntable_share_the_physical_form():
    scene = lippmann.load_scene("gears")
    turn = turn_about((0.0, 1.0, 0.0), scene.bounds.mean(axis=0), 40.0)
    one, other = (scene.with_light_moved(matrix) for matrix in (turn, np.eye(4)))
    assert one.physical is other.physical
    assert one.classic.lights != other.classic.lights == scene.classic.lights
    # As if the classic form had been moved before.
    alone = to_physical(move_light(scene.classic, turn))
    for moved, expected in zip(one.lights, alone.lights, strict=True):
        assert moved.world_from_light[:3, 3] == pytest.approx(expected.world_from_light[:3, 3])
        assert moved.color == pytest.approx(expected.color)
        assert moved.radius == pytest.approx(expected.radius)
