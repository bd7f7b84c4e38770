"""Key frames: which frames have halves of their own, and that no frame states the error of another scene."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.image import Provenance
from lippmann.image.preview import Preview
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.denoise.guided_denoiser import GuidedDenoiser
from lippmann.rendering.film.wavefront import Frame
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.values.whitted_scene import CameraPose
from lippmann.sequences.cuts import Moment
from lippmann.sequences.frames import place_frames, render_frames, render_sequence
from lippmann.sequences.key_frames import KeyFrames, estimate_next, list_frames_before
from lippmann.sequences.key_light import LightOfSurfaces
from lippmann.sequences.motion import Flight, Motion
from lippmann.sequences.still_pixels import StillPixels
from lippmann.sequences.turntable import open_turntable

ESTIMATE = {"psnr": 40.0, "psnr_low": 38.0, "psnr_high": 43.0, "by_chance": 46.0}


@pytest.fixture(scope="module")
def motion():
    return open_turntable(lippmann.load_scene("teapot"), 48)


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular").resized(32, 32)


class AtRest(Motion):
    """A scene in which nothing moves, before a display at rest."""

    count = 6
    content = None
    still = lippmann.load_scene("teapot")

    def scene(self, frame):
        return self.still

    def camera(self, frame, name):
        return None

    def bounds(self):
        return self.still.bounds


def asked_of(motion, display, frames, estimate=ESTIMATE, **options):
    """``(seed, samples, whether it has halves)`` of all that is rendered, whose pictures took 8 samples."""
    asked = []

    class Form:
        def render(self, scene, display, request, progress, build):
            asked.append((request.seed, request.spp, not request.judged_by))
            return Preview(np.zeros((2, 2, 3), np.float32), Provenance(method="pooled", spp=8, estimate=estimate))

    where, request = place_frames(motion, display, PlacementOptions()), RenderRequest(**options)
    made = list(render_frames(motion, display, frames, where, request, Form(), lambda _: None))
    assert [frame for frame, _ in made] == list(frames)
    return asked


def test_frames_between_follow_a_key_frame_or_those_that_pass_on_its_light():
    every, own = RenderRequest(), RenderRequest(spp=4)
    assert [list_frames_before(frame, every, None) for frame in range(6)] == [[], [0], [0], [0], [], [4]]
    assert list_frames_before(39, every, LightOfSurfaces()) == [38, 36, 34, 32]
    assert list_frames_before(39, every, StillPixels()) == [36, 32]
    assert [list_frames_before(39, own, kind) for kind in (None, StillPixels())] == [[], []]


def test_frames_after_a_key_frame_take_three_quarters_of_its_samples_in_one_stream(motion, display):
    asked = asked_of(motion, display, range(6))
    assert [each[1:] for each in asked] == [(None, True), *[(6, False)] * 3, (None, True), (6, False)]
    assert len({seed for seed, *_ in asked}) == 6


@pytest.mark.parametrize(("frames", "rendered"), [([6, 7], [4, 6, 7]), (range(3, 12, 3), [0, 3, 4, 6, 8, 9])])
def test_a_frame_is_the_same_alone_and_among_others(motion, display, frames, rendered):
    every = asked_of(motion, display, range(12))
    assert asked_of(motion, display, frames) == [every[number] for number in rendered]


def test_no_key_frame_is_rendered_for_a_frame_after_a_cut(motion, display, monkeypatch):
    monkeypatch.setattr("lippmann.sequences.key_frames.is_cut", lambda before, after, display: before.number == 4)
    asked = asked_of(motion, display, [3, 6, 7])
    assert [has_halves for *_, has_halves in asked] == [True, False, True, True]  # 0 and 3, 6, 7


@pytest.mark.parametrize(
    ("places", "halves", "before"),
    [
        ((0, 1, 2, 3, 4, 5), [0], [0, 2, 4]),
        ((0, 1, 2, 3, 404, 405), [0, 4], [4]),
        ((0, 20, 40, 60, 80, 100), [0, 4], [0, 2, 4]),
    ],
    ids=["slow", "cut", "fast"],
)
def test_frames_along_a_camera_path_follow_the_first_up_to_a_cut_or_the_next_that_shows_another_view(
    display, places, halves, before, monkeypatch
):
    monkeypatch.setattr(LightOfSurfaces, "has_light", True)
    scene = lippmann.load_scene("room")
    camera = scene.classic.camera
    center = camera.center
    poses = [CameraPose(view=camera.view, up=camera.up, center=(center[0] + x, *center[1:])) for x in places]
    motion = Flight(scene, poses)
    every = asked_of(motion, display, range(6))
    assert [frame for frame, (*_, has_halves) in enumerate(every) if has_halves] == halves
    assert asked_of(motion, display, [5]) == [every[number] for number in [*before, 5]]


def test_frames_after_a_step_of_the_light_take_none_from_before_it(display):
    job, traced = SimpleNamespace(denoiser=SimpleNamespace(variance=1.0)), SimpleNamespace(frame=Frame(None))
    shared = LightOfSurfaces()
    shared.holds = lambda key, moment: (key.number, moment.number) != (0, 2)
    for name in ("trace_next", "trace_key", "pass_on"):
        setattr(shared, name, lambda job, trace, name=name: asked.append(name) or traced)
    keys, asked = KeyFrames(display, None, None, shared), []
    key = keys.add(Moment(0, None, None), Provenance(method="pooled", spp=8), None)
    for number in range(1, 5):
        moment = Moment(number, None, None)
        keys.make_request(RenderRequest(), moment, key).trace_through(job, None)
        keys.add(moment, key.made, key)
    assert asked == ["trace_next", "trace_key", "trace_next", "pass_on"]


@pytest.mark.parametrize(("has_light", "halves"), [(True, [0]), (False, [0, 4])])
def test_every_fourth_frame_has_halves_where_no_light_is_kept(display, has_light, halves, monkeypatch):
    # Pictures with photons are traced whole: a film stated up to 23 dB too much after its first frame.
    monkeypatch.setattr(StillPixels, "has_light", has_light)
    asked = asked_of(AtRest(), display, range(6))
    assert [frame for frame, (*_, has_halves) in enumerate(asked) if has_halves] == halves


@pytest.mark.parametrize(
    "options", [{"spp": 4}, {"quality": 40.0}, {"max_time": 1.0}, {"effort": "draft"}, {"fixed_noise": True}]
)
def test_frames_tell_their_own_error_where_that_may_matter(motion, display, options):
    asked = asked_of(motion, display, [1, 2], **options)
    assert len(asked) == 2
    assert all(has_halves for *_, has_halves in asked)


@pytest.mark.parametrize("estimate", [None, {"psnr": 40.0}])
def test_without_the_estimate_of_a_denoised_key_frame_all_have_halves(motion, display, estimate):
    asked = asked_of(motion, display, range(3), estimate)
    assert [has_halves for *_, has_halves in asked] == [True] * 3


def test_more_noise_lowers_the_estimate_by_its_root_and_the_lower_end_by_itself():
    more, less = (estimate_next({**ESTIMATE, "worst_lens": [3, 4]}, noise) for noise in (4 / 3, 3 / 4))
    by_share = 10 * math.log10(4 / 3)
    for after, sign in ((more, -1), (less, 1)):
        assert after["psnr"] == pytest.approx(40 + sign * by_share / 2, abs=0.01)
        assert after["by_chance"] == pytest.approx(46 + sign * by_share / 2, abs=0.01)
        assert after["worst_lens"] == [3, 4]
    assert (more["psnr_low"], more["psnr_high"]) == (pytest.approx(38 - by_share, abs=0.01), 43.0)
    assert (less["psnr_low"], less["psnr_high"]) == (38.0, pytest.approx(43 + by_share, abs=0.01))


@pytest.mark.parametrize("shared", [None, StillPixels()])
@pytest.mark.parametrize(
    ("variances", "noise"), [((2.0, 6.0), 4.0), ((6.0, 2.0), 4 / 9), ((0.0, 2.0), 4 / 3), ((2.0, 0.0), 4 / 3)]
)
def test_a_frame_that_is_traced_whole_notices_that_it_is_noisier(display, shared, variances, noise, monkeypatch):
    monkeypatch.setattr(StillPixels, "holds", lambda *moments: True)
    monkeypatch.setattr(StillPixels, "_keep", lambda *picture: None)  # as of pictures with photons
    monkeypatch.setattr("lippmann.sequences.still_pixels._find_window", lambda job: None)
    traced = SimpleNamespace(frame=Frame(None))
    columns = {name: SimpleNamespace(width=1) for name in ("source", "sample_source")}
    keys, key = KeyFrames(display, None, None, shared), None
    for number, variance in enumerate(variances):
        through = keys.make_request(RenderRequest(), Moment(number, None, None), key).trace_through
        job = SimpleNamespace(denoiser=SimpleNamespace(variance=variance), **columns)
        assert through(job, lambda job: traced) is traced
        key = keys.add(Moment(number, None, None), Provenance(method="pooled", spp=8, estimate=ESTIMATE), key)
    assert keys.estimate(Provenance(), key) == estimate_next(ESTIMATE, noise)


def test_frames_after_a_key_frame_are_denoised_once(engine, motion, display, monkeypatch):
    runs, denoise = [], GuidedDenoiser.__call__
    monkeypatch.setattr(GuidedDenoiser, "__call__", lambda self, *args: runs.append(1) or denoise(self, *args))
    images = [image for _, image in render_sequence(motion, display, [4, 5], integrator="path", device="cpu")]
    assert len(runs) == 3
    key, after = (image.provenance for image in images)
    for name in ("psnr", "psnr_low", "worst", "worst_low", "flicker_low"):
        assert after.estimate[name] < key.estimate[name]
    assert after.estimate["psnr_high"] == key.estimate["psnr_high"]
    assert after.spp == math.ceil(0.75 * key.spp)
    assert "the error follows from frame 4's" in " ".join(after.notes)
    assert not any("frame 4's" in note for note in key.notes)
