"""Light of key frames in the frames after them: the same as traced, and only while scene and light are at rest."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.display import load_display
from lippmann.rendering.methods import SAMPLES_LAYER
from lippmann.scene.matrices import rotation, scaling, translation
from lippmann.scene.values.description import Camera, Environment, Instance, Light, Material, Mesh, SceneDescription
from lippmann.sequences import key_frames
from lippmann.sequences.frames import FrameRange, render_quilt_sequence, render_sequence
from lippmann.sequences.motion import Motion
from lippmann.sequences.turntable import open_turntable

PATHS = {"integrator": "path", "placement": {"depth_scale": 0.5}}


class Passing(Motion):
    """A camera that passes a box before a wall, in mm; each frame is read anew, as those of an animated file are."""

    content = None

    def __init__(self, *places, material=None):
        self.places, self.material = places, material or Material(base_color=(0.7, 0.5, 0.3), specular=0.0)

    count = property(lambda self: len(self.places))

    def scene(self, frame):
        corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float32)
        faces = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]]
        faces += [[2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
        box, wall = (Mesh("box", corners - 0.5, np.array(faces), material) for material in (0, 1))
        return lippmann.load_scene(
            SceneDescription(
                "passage",
                [box, wall],
                [self.material, Material(base_color=(0.7, 0.5, 0.3), specular=0.0)],
                [Instance(0, scaling(2)), Instance(1, translation((0, 0, -25)) @ scaling(40))],
                lights=[Light("point", (800.0, 800.0, 800.0), translation((8, 9, 20)))],
                cameras=[self.camera(frame, None)],
            )
        )

    def camera(self, frame, name):
        return Camera("passing", translation((self.places[frame], 0, 654)), fov_y=0.01, focus_distance=654)

    def bounds(self):
        return self.scene(0).bounds


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular").resized(96, 64)


def error(one, other):
    """Mean squared difference of codes between two pictures."""
    return np.mean(np.square(encode_srgb(one.pixels).astype(np.float64) - encode_srgb(other.pixels)))


@pytest.mark.slow
@pytest.mark.parametrize("form", ["pixels", "slanted sub-pixels", pytest.param("quilt", marks=pytest.mark.long)])
def test_diffuse_pixels_take_the_light_of_the_key_frame_which_is_what_would_be_traced(display, form):
    motion = Passing(0.0, 0.2)

    def render(frames, **options):
        if form == "quilt":
            panel = load_display("looking-glass-portrait").resized(96, 64)
            size = {"views": (8, 6), "size": (288, 264)}
            return dict(render_quilt_sequence(motion, panel, frames, **size, **PATHS, **options))
        panel = display if form == "pixels" else load_display("looking-glass-portrait").resized(96, 64)
        return dict(render_sequence(motion, panel, frames, **PATHS, **options))

    key, after = render([0, 1]).values()
    assert key.provenance.pixel_shares == {}
    made = after.provenance
    assert made.pixel_shares["reprojected"] > 0.55
    assert made.spp == key.provenance.spp
    if form == "pixels":
        assert made.rays["primary"] == pytest.approx(made.pixel_shares["traced"] * 96 * 64 * made.spp, rel=1e-6)
        assert np.mean(after.maps[SAMPLES_LAYER] == 0) == pytest.approx(made.pixel_shares["reprojected"])
    # Frames of their own err alike, so that their difference is no judge.
    own, reference = (render([1], seed=seed, spp=n)[1] for seed, n in ((1, key.provenance.spp), (2, 64)))
    assert error(after, reference) < 1.2 * error(own, reference)


def test_surfaces_that_shine_are_traced(display):
    shiny = Passing(0.0, 0.2, material=Material(base_color=(0.9, 0.01, 0.01), roughness=0.5))
    after = dict(render_sequence(shiny, display, [1], **PATHS))[1]
    is_shiny = after.pixels[..., 0] > np.maximum(8 * after.pixels[..., 1], 0.1)
    assert is_shiny.mean() > 0.02
    assert not (is_shiny & (after.maps[SAMPLES_LAYER] == 0)).any()
    assert after.provenance.pixel_shares["reprojected"] > 0.4


def test_frames_pass_on_the_light_that_they_took(display):
    """Alone it does, too."""
    motion = Passing(*np.arange(0.0, 1.2, 0.2))
    frames = dict(render_sequence(motion, display, FrameRange(4, 6), **PATHS))
    assert all(image.provenance.pixel_shares["reprojected"] > 0.2 for image in frames.values())
    alone = dict(render_sequence(motion, display, FrameRange(5, 6), **PATHS))[5]
    np.testing.assert_array_equal(alone.pixels, frames[5].pixels)


def test_no_light_is_kept_across_a_cut(display):
    """Though half of what it shows is in sight before and after it."""
    after = dict(render_sequence(Passing(0.0, 5.0, 5.2), display, **PATHS))
    assert after[1].provenance.pixel_shares == after[2].provenance.pixel_shares == {}


def test_light_that_moves_past_the_scene_is_traced(display):
    turn = open_turntable(lippmann.load_scene("teapot"), 48)
    for _, image in render_sequence(turn, display, FrameRange(0, 2), **PATHS):
        assert image.provenance.pixel_shares == {}


class Turning(Motion):
    """A matt ball, about which the camera turns by 12 degrees with each frame from ``start`` on."""

    content = None
    count = 2

    def __init__(self, start=0):
        trimesh = pytest.importorskip("trimesh")
        ball = trimesh.creation.icosphere(4, 15)
        mesh = Mesh("ball", ball.vertices.astype("f4"), ball.faces, 0, ball.vertex_normals.astype("f4"))
        self.start = start
        self.ball = lippmann.load_scene(
            SceneDescription(
                "ball",
                [mesh],
                [Material(base_color=(0.9, 0.6, 0.3), specular=0.0, roughness=1.0)],
                [Instance(0, np.eye(4))],
                lights=[Light("point", (4000.0, 4000.0, 4000.0), translation((20, 30, 40)))],
                environment=Environment(np.full((16, 32, 3), 0.25, np.float32)),
                cameras=[self.camera(0, None)],
            )
        )

    def scene(self, frame):
        return self.ball

    def camera(self, frame, name):
        turn = rotation((12 * (frame + self.start), 0, 0))
        return Camera("turning", turn @ translation((0, 0, 654)), fov_y=0.06, focus_distance=654)

    def bounds(self):
        return self.ball.bounds


@pytest.mark.slow
def test_surfaces_that_come_into_sight_take_no_light_of_those_beside_them():
    display = load_display("seed-lenticular").resized(256, 160)
    options = {"integrator": "path", "placement": {"depth_scale": 0.3}, "exposure": 0.0, "tone_map": "none"}
    after = dict(render_sequence(Turning(), display, [1], **options))[1]
    traced = dict(render_sequence(Turning(start=1), display, [0], **options))[0]
    assert after.provenance.pixel_shares
    assert error(after, traced) < 1e-5


def test_what_is_kept_of_a_film_ends_with_it(display, monkeypatch):
    """At once: scenes that a cycle of references keeps change the numbers of later ones, whose kernels are new then."""
    kept = []

    class Remembered(key_frames.KeyFrames):
        def __init__(self, *values):
            super().__init__(*values)
            kept.append(weakref.ref(self))

    monkeypatch.setattr("lippmann.sequences.frames.KeyFrames", Remembered)
    gc.disable()
    try:
        list(render_sequence(Passing(0.0), display, **PATHS))
        assert [each() for each in kept] == [None]
    finally:
        gc.enable()
