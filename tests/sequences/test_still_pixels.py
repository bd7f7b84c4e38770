"""Still pixels: those that a moving object leaves as they are, and no others; no ghost of it or of its shadow."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.display import load_display
from lippmann.display.panel import PixelWindow
from lippmann.rendering.methods import SAMPLES_LAYER
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.matrices import scaling, translation
from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription
from lippmann.sequences.frames import render_quilt_sequence, render_sequence
from lippmann.sequences.key_frames import KeyFrames
from lippmann.sequences.motion import Motion
from lippmann.sequences.still_pixels import StillPixels

PATHS = {"integrator": "path"}


class Sliding(Motion):
    """A glossy box that slides to the right before a wall, and its shadow, in mm; it begins after frame 1."""

    count = 6
    content = None

    def __init__(self, places=(-12, -12, -9, -6, -3, 0), wall=30, size=5):
        self.places, self.wall, self.size = places, wall, size

    def scene(self, frame):
        corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float32)
        faces = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]]
        faces += [[2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
        box = Mesh("box", corners - 0.5, np.array(faces), 0)
        wall = translation((0, 0, -self.wall / 2)) @ scaling(self.wall)
        return lippmann.load_scene(
            SceneDescription(
                "sliding",
                [box],
                [Material(base_color=(0.7, 0.5, 0.3), roughness=0.5)],
                [Instance(0, translation((self.places[frame], 0, 4)) @ scaling(self.size)), Instance(0, wall)],
                lights=[Light("point", (6000.0, 6000.0, 6000.0), translation((20, 30, 60)))],
            )
        )

    def camera(self, frame, name):
        return None

    def bounds(self):
        return np.array([[-15.0, -15.0, -30.0], [15.0, 15.0, 6.5]])


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular").resized(96, 56)


@pytest.fixture(scope="module")
def frames(display):
    return dict(render_sequence(Sliding(), display, **PATHS))


def error(one, other):
    """Mean squared difference of codes between two pictures."""
    return np.mean(np.square(encode_srgb(one.pixels).astype(np.float64) - encode_srgb(other.pixels)))


def test_pixels_whose_light_does_not_change_keep_it(frames):
    np.testing.assert_array_equal(frames[1].pixels, frames[0].pixels)
    for number in (2, 3, 4, 5):
        kept = frames[number].maps[SAMPLES_LAYER] == 0
        assert 0.5 < kept.mean() < 0.95
        np.testing.assert_array_equal(frames[number].pixels[kept], frames[0 if number < 5 else 4].pixels[kept])


def test_pixels_are_found_in_another_window(display):
    # The second frame shows more of the panel, beside the wall.
    key, after = dict(render_sequence(Sliding((0, 12), wall=20), display, range(2), **PATHS)).values()
    kept = after.maps[SAMPLES_LAYER] == 0
    assert 0.03 < np.mean(kept & (key.pixels > 0).all(axis=2)) < 0.9
    np.testing.assert_array_equal(after.pixels[kept], key.pixels[kept])
    assert not kept[(after.pixels > 0).all(axis=2) & (key.pixels == 0).all(axis=2)].any()


def test_where_more_than_a_third_changes_all_is_traced(display):
    _, after = dict(render_sequence(Sliding((-6, 0), size=18), display, range(2), **PATHS)).values()
    assert "reprojected" not in after.provenance.pixel_shares
    assert (after.maps[SAMPLES_LAYER] > 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("form", ["slanted sub-pixels", "quilt"])
def test_pixels_of_any_picture_keep_their_light(form):
    display = load_display("looking-glass-portrait").resized(96, 64)
    if form == "quilt":
        size = {"views": (4, 4), "size": (256, 256)}
        key, after = dict(render_quilt_sequence(Sliding(), display, [0, 3], **size, **PATHS)).values()
    else:
        key, after = dict(render_sequence(Sliding(), display, [0, 3], **PATHS)).values()
    assert 0.1 < after.provenance.pixel_shares["reprojected"] < 1
    if form != "quilt":
        kept = after.maps[SAMPLES_LAYER] == 0
        np.testing.assert_array_equal(after.pixels[kept], key.pixels[kept])


def test_neither_the_box_nor_its_shadow_leaves_a_ghost(frames, display):
    for number in (3, 5):
        own, reference = (
            dict(render_sequence(Sliding(), display, [number], seed=seed, spp=n, **PATHS))[number]
            for seed, n in ((1, frames[0].provenance.spp), (2, 64))
        )
        # Light of the key frame at all pixels that show the same surface has four times that error.
        assert error(frames[number], reference) < 2 * error(own, reference)


def test_their_flicker_is_that_of_the_others(frames):
    first, after = (frames[number].provenance for number in (0, 3))
    shift = after.estimate["flicker_high"] - after.estimate["flicker"]
    # The samples of frames after a key frame are fewer, by which both figures of theirs lie lower.
    assert after.estimate["flicker"] > first.estimate["flicker"] - 10 * np.log10(after.pixel_shares["traced"]) - 1.3
    assert shift == pytest.approx(first.estimate["flicker_high"] - first.estimate["flicker"], abs=1.3)


def test_a_frame_is_the_same_alone_and_after_others(frames, display):
    alone = dict(render_sequence(Sliding(), display, [5], **PATHS))[5]
    np.testing.assert_array_equal(alone.pixels, frames[5].pixels)


def covered_job(size):
    """A job whose picture of ``size x size`` pixels surfaces cover."""
    from lippmann.rendering.film.wavefront import Coverage

    coverage = Coverage(np.ones((size, size, 1), np.float32), 6)
    return SimpleNamespace(
        denoiser=SimpleNamespace(coverage=lambda: (coverage, coverage)),
        session=SimpleNamespace(engine=SimpleNamespace(threads=1)),
        source=SimpleNamespace(width=size),
        sample_source=SimpleNamespace(width=size),
    )


def test_a_change_of_light_that_few_paths_bring_is_found():
    from lippmann.sequences.still_pixels import _find_still, _Picture

    # As beside a board that a lamp close by lights: one path in 70 meets it, and brings a fifth of the light.
    size = 160
    row, column = np.indices((size, size))
    is_probed = ((row + 2 * column) % 4 == 0)[..., None]
    light = np.where(np.random.default_rng(1).random((size, size, 1)) < 1 / 70, 15.0, 1.0) * np.ones(3)
    whole, nothing = np.ones((size, size, 3)), np.zeros((size, size))
    probes, after = (np.where(is_probed, part, np.nan) for part in (light, whole))
    key = _Picture(PixelWindow(0, 0, size, size), whole, nothing, probes, whole, None, nothing > 0)
    assert _find_still(key, key, covered_job(size)).all()
    assert not _find_still(key, replace(key, probes=after), covered_job(size)).any()


def test_two_probes_that_change_leave_no_patch_but_an_even_change_and_a_narrow_one_are_found():
    from lippmann.sequences.still_pixels import _find_still, _Picture

    job = covered_job(64)
    row, column = np.indices((64, 64))
    whole = np.ones((64, 64, 3))
    probes = np.where(((row + 2 * column) % 4 == 0)[..., None], whole, np.nan)
    key = _Picture(PixelWindow(0, 0, 64, 64), probes, np.zeros((64, 64)), probes, whole, None, np.zeros((64, 64), bool))
    few = probes.copy()
    few[32, 32] = few[28, 30] = 0
    assert _find_still(key, replace(key, probes=few), job).all()
    is_still = _find_still(key, replace(key, probes=np.where(column[..., None] < 20, 0.9, 1) * probes), job)
    assert not is_still[:, :18].any()
    assert is_still[:, 29:].all()
    # Beside another surface light is taken to change, as far as probes are averaged.
    is_still = _find_still(key, replace(key, features=np.where(column < 20, 1.0, 0.0)), job)
    assert not is_still[:, :28].any()
    assert is_still[:, 28:].all()
    # The shadow of a wire, which takes half of the light from one row, and which no probe of whole paths meets.
    shadow = np.where(row == 33, 0.5, 1)[..., None]
    is_still = _find_still(key, replace(key, probes=shadow * probes, direct=shadow * whole), job)
    assert not is_still[33].any()
    assert is_still[:31].all()
    assert is_still[36:].all()


def test_the_error_that_flickers_is_that_of_the_pixels_that_were_traced():
    from lippmann.sequences.still_pixels import _sum_share

    is_outline = np.array([[True, False, False]])
    assert _sum_share(np.array([[3.0, 1.0, np.nan]], np.float32), is_outline) == pytest.approx(0.75)
    assert _sum_share(np.array([[3.0, -1.0, 0.0]], np.float32), is_outline) == 1.0  # single estimates may be negative
    assert _sum_share(None, is_outline) == 1.0


def test_another_window_finds_each_pixels_own_sub_pixels():
    from lippmann.sequences.still_pixels import _Picture

    whole = np.arange(6.0 * 3 * 8).reshape(6, 24)  # 8 pixels of 3 sub-pixels in a row
    key = _Picture(
        PixelWindow(10, 20, 8, 6),
        np.repeat(whole[..., None], 3, axis=2),
        whole,
        *2 * [whole[..., None]],
        whole,
        whole > 100,
    )
    part = key.crop(PixelWindow(13, 18, 7, 4), 3)
    assert part.features.shape == (4, 21)
    assert np.isnan(part.features[:2]).all()
    assert np.isnan(part.features[:, 15:]).all()
    np.testing.assert_array_equal(part.features[2:, :15], whole[:2, 9:])
    np.testing.assert_array_equal(part.pixels[2:, :15, 0], whole[:2, 9:])
    np.testing.assert_array_equal(part.probes[2:, :15, 0], whole[:2, 9:])
    # Nothing is known of the errors of what the other window does not show.
    assert np.isnan(part.errors[:2]).all()
    assert part.is_swept[:2].all()
    assert not part.is_swept[2:, :15].any()
    assert np.isnan(key.crop(PixelWindow(40, 20, 8, 6), 3).pixels).all()


def test_surfaces_that_no_light_reaches_stay_as_they_are(display):
    # The light stands behind the wall.
    class Behind(Sliding):
        def scene(self, frame):
            scene = super().scene(frame)
            lights = [Light("point", (6000.0, 6000.0, 6000.0), translation((0, 0, -60)))]
            return lippmann.load_scene(replace(scene.description, lights=lights))

    after = dict(render_sequence(Behind(), display, [0, 3], **PATHS))[3]
    assert not after.pixels[:, 60:].any()
    assert (after.maps[SAMPLES_LAYER][:, 60:] == 0).all()


def test_key_frames_have_one_seed(display):
    keys = KeyFrames(display, None, None, StillPixels())
    assert [keys.noise_of(number, RenderRequest()) for number in (0, 4, 31, 32, 33)] == [0, 4, 31, 0, 33]


def test_a_key_frame_in_mid_film_keeps_its_own_features_and_probes(monkeypatch):
    from lippmann.sequences import still_pixels

    none = np.zeros((0, 0))
    still, job = StillPixels(), SimpleNamespace(source=SimpleNamespace(width=1), sample_source=SimpleNamespace(width=1))
    still._own = still_pixels._Picture(PixelWindow(0, 0, 9, 9), *[none] * 6)  # of the frame before
    monkeypatch.setattr(still_pixels, "_find_window", lambda job: None)
    still.trace_key(job, lambda job: SimpleNamespace(frame=SimpleNamespace(pixels=none)))
    assert still._key is None
