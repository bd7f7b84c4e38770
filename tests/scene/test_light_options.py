"""The light of a scene turns and changes its strength; nothing else does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.errors import UsageError
from lippmann.options.light import LightOptions
from lippmann.scene.scene import Scene, change_environment, change_source, light_rotation
from lippmann.scene.values.description import Environment, Light


def test_light_from_the_front_swings_to_the_right_and_rises():
    front = np.array([0.0, 0.0, 1.0, 0.0])
    assert light_rotation(LightOptions((90.0, 0.0))) @ front == pytest.approx([1.0, 0.0, 0.0, 0.0])
    assert light_rotation(LightOptions((0.0, 90.0))) @ front == pytest.approx([0.0, 1.0, 0.0, 0.0])
    up, right = np.radians([30.0, 40.0])
    expected = [np.cos(up) * np.sin(right), np.sin(up), np.cos(up) * np.cos(right), 0.0]
    assert light_rotation(LightOptions((40.0, 30.0))) @ front == pytest.approx(expected)


def test_directional_lights_turn_others_stay_and_all_change_their_strength():
    light = LightOptions((90.0, 0.0), 2.0)
    sun, lamp = (change_source(Light(kind, (1.0, 2.0, 3.0), np.eye(4)), light) for kind in ("directional", "point"))
    assert sun.color == lamp.color == (2.0, 4.0, 6.0)
    assert sun.world_from_light[:3, 2] == pytest.approx([1.0, 0.0, 0.0])
    assert (lamp.world_from_light == np.eye(4)).all()


def test_the_environment_turns_and_changes_its_strength():
    pixels = np.arange(24, dtype=np.float32).reshape(2, 4, 3)
    changed = change_environment(Environment(pixels, follows_viewer=True), LightOptions((0.0, 20.0), 3.0, 0.5))
    assert (changed.pixels == pixels / 2).all()
    assert changed.follows_viewer
    assert changed.world_from_environment == pytest.approx(light_rotation(LightOptions((0.0, 20.0))))


def test_a_scene_tells_its_light_after_the_change():
    scene = lippmann.load_scene("gears", light=LightOptions(light_strength=2.0, environment_strength=3.0))
    plain = lippmann.load_scene("gears")
    assert np.allclose([each.color for each in scene.lights], 2.0 * np.array([each.color for each in plain.lights]))
    assert np.allclose(scene.environment.pixels, 3.0 * plain.environment.pixels)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"light_turn": (float("nan"), 0.0)}, "light_turn"),
        ({"light_turn": (1.0,)}, "light_turn"),
        ({"light_strength": -1.0}, "light_strength"),
        ({"environment_strength": float("inf")}, "environment_strength"),
    ],
)
def test_values_out_of_range_are_refused(options, word):
    with pytest.raises(UsageError, match=word):
        LightOptions(**options)


def test_light_that_cannot_change_is_said(engine):
    import mitsuba as mi

    from lippmann.device.pbr import build

    with pytest.raises(UsageError, match='use integrator="path"'):
        lippmann.render(lippmann.load_scene("gears", light=LightOptions(light_strength=2.0)), "seed-lenticular")
    ball = {"type": "scene", "ball": {"type": "sphere"}, "lamp": {"type": "point", "position": [0, 0, 5]}}
    own = lippmann.load_scene(mi.load_dict(ball))
    assert isinstance(own, Scene)
    for light, word in (
        (LightOptions(light_strength=2.0), "light_strength"),
        (LightOptions((10.0, 0.0)), "light_turn"),
        (LightOptions(environment_strength=2.0), "environment_strength"),
    ):
        with pytest.raises(UsageError, match=word):
            build(replace(own, light=light))
