"""Cuts: which frames of a film another one may stand for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.options.placement import PlacementOptions
from lippmann.scene.matrices import scaling, translation
from lippmann.scene.placement import Placement
from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription
from lippmann.sequences.cuts import Moment, is_cut
from lippmann.sequences.frames import find_stand
from lippmann.sequences.motion import open_motion
from lippmann.sequences.turntable import open_turntable

DISPLAY = load_display("seed-lenticular")
SQUARE = Mesh("square", np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]]), 0)
SCENE = SceneDescription(
    "square", [SQUARE], [Material()], [Instance(0, np.eye(4))], [Light("point", (1, 1, 1), np.eye(4))]
)
IN_PLACE = np.eye(4)
#: A display as wide as the square is.
PLACEMENT = Placement(scaling(1 / DISPLAY.size_mm[0]), (-10, 10), (-10, 10), "fit")


def moment(placed=IN_PLACE, **changed):
    description = replace(SCENE, **changed)
    return Moment(
        0,
        lippmann.load_scene(description),
        replace(PLACEMENT, world_from_display=placed @ scaling(1 / DISPLAY.size_mm[0])),
    )


def moments(motion, *frames):
    where = find_stand(motion, DISPLAY, PlacementOptions())
    return [Moment(frame, motion.scene(frame), where(frame)) for frame in frames]


def places(*matrices):
    return [Instance(0, matrix) for matrix in matrices]


def test_a_scene_read_anew_is_the_same():
    assert not is_cut(moment(), moment(), DISPLAY)


@pytest.mark.parametrize(
    "changed",
    [
        {"lights": []},
        {"lights": [Light("point", (0, 0, 0), np.eye(4))]},
        {"materials": [Material(emission=(1, 1, 1))]},
        {"instances": places(np.eye(4), np.eye(4))},
        {"background": (1, 1, 1)},
        {"instances": places(translation([0, 0.4, 0]))},
        {"instances": places(scaling(2))},
    ],
)
def test_what_appears_is_switched_or_jumps(changed):
    assert is_cut(moment(), moment(**changed), DISPLAY)


def test_smooth_motion():
    assert not is_cut(moment(), moment(instances=places(translation([0.3, 0, 0]))), DISPLAY)
    assert not is_cut(moment(), moment(translation([0, 0, 0.3])), DISPLAY)
    assert is_cut(moment(), moment(translation([0, 0, 0.4])), DISPLAY)


@pytest.mark.parametrize("name", ["teapot", "gears", "room"])  # the last two are Whitted tracers'
def test_turntables_of_few_frames_jump(name):
    scene = lippmann.load_scene(name)
    assert not is_cut(*moments(open_turntable(scene, 48), 0, 3), DISPLAY)
    assert is_cut(*moments(open_turntable(scene, 8), 0, 1), DISPLAY)


def test_an_animation_moves_smoothly(moving_ball):
    assert not is_cut(*moments(open_motion(moving_ball), 0, 3), DISPLAY)


def test_scenes_of_whitted_tracers():
    teapot, room = (lippmann.load_scene(name) for name in ("teapot", "room"))
    one, other = (Moment(0, scene, PLACEMENT) for scene in (teapot, room))
    assert not is_cut(one, one, DISPLAY)
    assert is_cut(one, other, DISPLAY)
