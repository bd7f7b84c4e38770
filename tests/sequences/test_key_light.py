"""Light of key frames in the frames after them: the same as traced, and only while scene and light are at rest."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.display import load_display
from lippmann.rendering.methods import SAMPLES_LAYER
from lippmann.scene.matrices import rotation, translation
from lippmann.scene.values.whitted_scene import CameraPose
from lippmann.sequences import key_light
from lippmann.sequences.frames import FrameRange, render_sequence
from lippmann.sequences.motion import Flight
from lippmann.sequences.turntable import open_turntable

PATHS = {"integrator": "path", "placement": {"depth_scale": 0.5}}


def flight(*sideways):
    """The camera of the bundled room, moved to the right by so many of its scene's units, frame by frame."""
    scene = lippmann.load_scene("room")
    camera = scene.classic.camera
    moved = [(camera.center[0] + x, *camera.center[1:]) for x in sideways]
    return Flight(scene, [CameraPose(view=camera.view, up=camera.up, center=center) for center in moved])


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular").resized(192, 112)


@pytest.fixture(scope="module")
def frames(display):
    return dict(render_sequence(flight(0.0, 2.0, 4.0), display, **PATHS))


def error(one, other):
    """Mean squared difference of codes."""
    return np.mean(np.square(encode_srgb(one.pixels).astype(np.float64) - encode_srgb(other.pixels)))


def test_diffuse_pixels_take_the_light_of_the_key_frame(frames):
    assert frames[0].provenance.pixel_shares == {}
    for number in (1, 2):
        made = frames[number].provenance
        assert made.pixel_shares["reprojected"] > 0.4
        assert made.rays["primary"] == pytest.approx(made.pixel_shares["traced"] * 192 * 112 * made.spp, rel=1e-6)
        share = np.mean(frames[number].maps[SAMPLES_LAYER] == 0)
        assert share == pytest.approx(made.pixel_shares["reprojected"])


def test_that_light_is_what_would_be_traced(frames, display):
    # The panel is so coarse that shadows have edges between the points that neighbouring lenses show.
    motion, samples = flight(0.0, 2.0, 4.0), frames[0].provenance.spp
    one, other = (
        dict(render_sequence(motion, display, FrameRange(2, 3), seed=seed, **PATHS, spp=samples))[2] for seed in (1, 2)
    )
    assert error(frames[2], one) < 1.6 * error(other, one)


def test_a_frame_is_the_same_alone_and_after_others(frames, display):
    alone = dict(render_sequence(flight(0.0, 2.0, 4.0), display, FrameRange(2, 3), **PATHS))[2]
    np.testing.assert_array_equal(alone.pixels, frames[2].pixels)


def test_no_light_is_kept_across_a_cut(display):
    after = dict(render_sequence(flight(0.0, 400.0, 402.0), display, **PATHS))
    assert after[1].provenance.pixel_shares == after[2].provenance.pixel_shares == {}


def test_light_that_moves_past_the_scene_is_traced(display):
    turn = open_turntable(lippmann.load_scene("teapot"), 48)
    for _, image in render_sequence(turn, display, FrameRange(0, 2), **PATHS):
        assert image.provenance.pixel_shares == {}


@pytest.mark.parametrize(
    ("follows", "moved", "scene", "is_at_rest"),
    [
        (False, rotation((0.0, 10.0, 0.0)), None, True),
        (True, translation((5.0, 0.0, 0.0)), None, True),
        (True, rotation((0.0, 10.0, 0.0)), None, False),
        (False, np.eye(4), "another", False),
    ],
)
def test_light_that_turns_with_the_display_is_not_at_rest(monkeypatch, follows, moved, scene, is_at_rest):
    monkeypatch.setattr(key_light, "_light_of", lambda job: "the same")
    own = SimpleNamespace(environment=SimpleNamespace(follows_viewer=follows))
    jobs = [
        SimpleNamespace(session=SimpleNamespace(scene=shown), display_from_world=place)
        for shown, place in ((own, np.eye(4)), (scene or own, moved))
    ]
    assert key_light._is_light_at_rest(*jobs) == is_at_rest
