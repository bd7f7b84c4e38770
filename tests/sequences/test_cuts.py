"""Cuts: which frames of a film another one may stand for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.options.placement import PlacementOptions
from lippmann.scene.matrices import rotation, scaling, translation
from lippmann.scene.placement import Placement
from lippmann.scene.turntable import turn_about
from lippmann.scene.values.description import (
    Environment,
    Image,
    Instance,
    Light,
    Material,
    Mesh,
    SceneDescription,
    Texture,
)
from lippmann.sequences.cuts import Moment, are_emitters_at_rest, is_cut, is_light_at_rest
from lippmann.sequences.frames import place_frames
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
    where = place_frames(motion, DISPLAY, PlacementOptions())
    return [Moment(frame, motion.scene(frame), where(frame)) for frame in frames]


def places(*matrices):
    return [Instance(0, matrix) for matrix in matrices]


def light(matrix, kind="point"):
    return {"lights": [Light(kind, (1, 1, 1), matrix)]}


def turned(degrees):
    return turn_about((0.0, 1.0, 0.0), np.zeros(3), degrees)


def painted(code):
    """The square's material with a texture of one colour."""
    image = Image("paint", np.full((2, 2, 3), code, np.uint8))
    return {"materials": [Material(base_color_texture=Texture(image, srgb=True))]}


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
        light(translation([0, 0, 0.4])),
    ],
)
def test_what_appears_is_switched_or_jumps(changed):
    assert is_cut(moment(), moment(**changed), DISPLAY)


@pytest.mark.parametrize("size", [0.0, 1e-4])
def test_what_appears_by_its_size_is_a_cut(size):
    seen, hidden = (moment(instances=places(scaling(0.2 * scale))) for scale in (1, size))
    assert is_cut(hidden, seen, DISPLAY)
    assert is_cut(seen, hidden, DISPLAY)
    assert not is_cut(hidden, hidden, DISPLAY)
    assert not is_cut(seen, moment(instances=places(scaling(0.1))), DISPLAY)


def test_smooth_motion():
    assert not is_cut(moment(), moment(instances=places(translation([0.3, 0, 0]))), DISPLAY)
    assert not is_cut(moment(), moment(translation([0, 0, 0.3])), DISPLAY)
    assert is_cut(moment(), moment(translation([0, 0, 0.4])), DISPLAY)


def test_light_sources_move_smoothly_or_go_along_with_the_display():
    assert not is_cut(moment(), moment(**light(translation([0.3, 0, 0]))), DISPLAY)
    assert not is_cut(moment(**light(np.eye(4), "directional")), moment(**light(turned(30.0), "directional")), DISPLAY)
    assert is_cut(moment(**light(np.eye(4), "directional")), moment(**light(turned(50.0), "directional")), DISPLAY)
    far = translation([0, 0, 100])
    assert not is_cut(moment(**light(far)), moment(turned(10.0), **light(turned(10.0) @ far)), DISPLAY)
    assert is_cut(moment(**light(far)), moment(turned(10.0), **light(turned(-10.0) @ far)), DISPLAY)
    assert not is_cut(moment(**light(far)), moment(turned(10.0), **light(far)), DISPLAY)


@pytest.mark.parametrize("glows", [False, True])
def test_light_that_moves_is_not_at_rest_whether_it_is_a_source_or_a_surface(glows):
    materials = {"materials": [Material(emission=(float(glows),) * 3)]}
    aside = translation([0.1, 0, 0])
    assert are_emitters_at_rest(moment(**materials), moment(**materials))
    assert not are_emitters_at_rest(moment(**materials), moment(**materials, **light(aside)))
    assert are_emitters_at_rest(moment(**materials), moment(**materials, instances=places(aside))) != glows


@pytest.mark.parametrize("form", ["inner_angle", "outer_angle", "radius"])
def test_light_whose_cone_or_radius_changes_is_not_at_rest(form):
    lamps = [[replace(SCENE.lights[0], kind="spot", **{form: size})] for size in (0.2, 0.21)]
    assert not are_emitters_at_rest(*(moment(lights=lights) for lights in lamps))


def test_a_texture_is_changed():
    assert not is_cut(moment(**painted(100)), moment(**painted(100)), DISPLAY)
    assert is_cut(moment(**painted(100)), moment(**painted(101)), DISPLAY)
    assert is_cut(moment(**painted(100)), moment(), DISPLAY)


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


@pytest.mark.parametrize(
    ("follows", "moved", "is_at_rest"),
    [
        (False, rotation((0.0, 10.0, 0.0)), True),
        (True, translation((5.0, 0.0, 0.0)), True),
        (True, rotation((0.0, 10.0, 0.0)), False),
    ],
)
def test_light_that_turns_with_the_display_is_not_at_rest(follows, moved, is_at_rest):
    before = moment(environment=Environment(np.ones((4, 8, 3), np.float32), follows_viewer=follows))
    after = before._replace(placement=replace(before.placement, world_from_display=moved))
    assert is_light_at_rest(before, after) == is_at_rest
    assert not is_light_at_rest(before, after._replace(scene=replace(before.scene)))
