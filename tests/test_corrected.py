"""Scenes rendered for the lens that is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.corrected import finer_display, halves_of
from lippmann.display import load_display
from lippmann.errors import DisplayError, UsageError
from lippmann.optics.correction import CorrectionStep, LensCorrection, parts_beside
from lippmann.rendering import session
from lippmann.scene.placement import Placement

PRINT = "print:lpi=60,ppi=720,size=4x2mm,thickness=26mil,radius=0.2877mm"

GAINS = dict.fromkeys(("exact", "radius", "thickness", "index"), 0.0)


@pytest.mark.parametrize("name", [PRINT, "looking-glass-portrait"])
@pytest.mark.parametrize("channel", [0, 1, 2])
def test_parts_lie_beside_the_middles_of_subpixels(name, channel):
    display = load_display(name)
    finer = finer_display(display)
    assert finer.lens_grid == display.lens_grid
    u, v = np.arange(6) + 0.5, np.full(6, 3.5)
    fine = np.arange(12) + 0.5
    x, _ = finer.subpixel_point(fine, np.full(12, 7.0), channel)
    for part, beside in enumerate(parts_beside()):
        own, _ = display.subpixel_point(u, v, channel)
        np.testing.assert_allclose(x[part::2], own + beside * display.panel.pixel_pitch, atol=1e-12)


def test_halves_are_diagonals_of_a_pixel():
    pixels = np.arange(2 * 4 * 3, dtype=np.float32).reshape(2, 4, 3)
    for half, (left, right) in enumerate(halves_of(pixels)):
        np.testing.assert_array_equal(left, pixels[None, half, 0::2])
        np.testing.assert_array_equal(right, pixels[None, 1 - half, 1::2])


def test_detail_finer_than_a_pixel_is_not_taken_for_noise():
    display, rng = load_display(PRINT), np.random.default_rng(1)
    height, width = display.panel.height, display.panel.width
    edges = np.repeat(rng.random((height, 9)), 2 * width // 9 + 1, axis=1)[:, : 2 * width]
    waves = np.sin(2 * np.pi * (np.arange(2 * width) / 48 + rng.random((2 * height, 1))))
    light = 0.2 + 0.6 * np.repeat(edges, 2, axis=0) + 0.1 * waves
    halves = halves_of(np.repeat(light[..., None], 3, axis=2).astype(np.float32))
    correction = LensCorrection(display)
    step, free = correction.step([(0, halves)]), correction.step([(0, [np.mean(halves, axis=0)])])
    assert step.share == pytest.approx(free.share, abs=0.1)
    assert step.gains["exact"] == pytest.approx(free.gains["exact"], abs=0.3)


@pytest.mark.slow
def test_one_ray_through_the_middle_of_a_lens_is_not_enough(engine):
    small = PRINT.replace("4x2mm", "2x1mm")
    assert lippmann.render("gears", small, correct="lens").provenance.spp == 64
    assert lippmann.render("gears", small, correct="lens", pixel_filter="point").provenance.spp == 4


@pytest.mark.slow
def test_four_samples_are_not_called_one(engine, monkeypatch):
    monkeypatch.setattr(LensCorrection, "step", lambda *parts: CorrectionStep(0.5, GAINS, 0.0))
    image = lippmann.render("teapot", PRINT, correct="lens", spp=4, denoise="none")
    assert image.provenance.spp == 4
    remarks = [note for note in image.provenance.notes if "no estimate" in note]
    assert len(remarks) == 1
    assert "one sample" not in remarks[0]


@pytest.mark.slow
def test_a_correction_that_gains_nothing_leaves_the_plain_picture(engine, monkeypatch):
    monkeypatch.setattr(LensCorrection, "step", lambda *parts: CorrectionStep(0.0, GAINS, 0.0))
    options = {"spp": 4, "integrator": "direct", "method": "full", "denoise": "none"}
    plain = lippmann.render("teapot", PRINT, **options)
    image = lippmann.render("teapot", PRINT, correct="lens", **options)
    np.testing.assert_array_equal(image.pixels, plain.pixels)
    assert image.provenance.options["correction_share"] == 0.0
    assert "not corrected for its lens" in image.provenance.notes[-1]
    assert image.provenance.estimate is not None


@pytest.mark.slow
def test_an_eye_sees_the_corrected_picture_nearer_to_what_rays_meet(engine, monkeypatch):
    built, build = [], session._build
    monkeypatch.setattr(session, "_build", lambda *parts: built.append(parts) or build(*parts))
    options = {"integrator": "direct", "method": "full", "denoise": "none", "threads": 1}
    image = lippmann.render("teapot", PRINT, correct="lens", spp=64, **options)
    assert len(built) == 1
    plain = lippmann.render("teapot", PRINT, spp=1, **options)
    assert image.pixels.shape == plain.pixels.shape
    assert image.provenance.options["correct"] == "lens"
    # The display stands where its own depth budget has it, not where that of finer pixels would.
    np.testing.assert_array_equal(image.world_from_display, plain.world_from_display)
    pinhole = replace(image.display, lens=None, distortion=None)
    plain = lippmann.render("teapot", pinhole, spp=16, **options, placement=placed(image))
    judge = lippmann.render("teapot", finer_display(image.display), spp=16, seed=1, **options, placement=placed(image))
    correction = LensCorrection(image.display)
    goal = correction._rows.light_meant(correction._meant(np.mean(halves_of(judge.pixels), axis=0)), 0)
    lights = correction._rows.eyes(image.display)((plain.pixels, image.pixels), 0)
    before, after = (np.nanmean((light - goal) ** 2) for light in lights)
    assert 10.0 * np.log10(before / after) > 2.0


def placed(image):
    return Placement(image.world_from_display, (0.0, 0.0), (0.0, 0.0), "given")


@pytest.mark.parametrize(
    ("display", "options", "error", "what"),
    [
        ("seed-lenticular", {}, DisplayError, "gives no lens"),
        (PRINT, {"integrator": "depth"}, UsageError, "beside integrator depth"),
        (PRINT, {"layers": True}, UsageError, "beside layers"),
    ],
)
def test_what_cannot_be_corrected_is_refused(display, options, error, what):
    with pytest.raises(error, match=what):
        lippmann.render("teapot", display, correct="lens", **options)


def test_an_unknown_correction_is_named():
    with pytest.raises(UsageError, match="lens"):
        lippmann.render("teapot", PRINT, correct="lense")
