"""Flicker that frames state of themselves: its formula, and that it holds against long renderings."""

from __future__ import annotations

import math

import numpy as np
import pytest

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.display import load_display
from lippmann.sequences.flicker import add_flicker, film_in_words, mean_psnr
from lippmann.sequences.frames import render_sequence
from lippmann.sequences.turntable import open_turntable

ESTIMATE = {"psnr": 40.0, "psnr_low": 38.0, "psnr_high": 43.0, "by_chance": 46.0}


def test_errors_by_chance_count_whole_and_the_denoisers_own_half():
    stated = add_flicker(ESTIMATE)
    by_chance, total = 10**-4.6, 10**-4.0
    assert stated["flicker"] == pytest.approx(-10 * math.log10(by_chance + (total - by_chance) / 2), abs=0.01)
    assert (stated["flicker_low"], stated["flicker_high"]) == (38.0, 46.0)


def test_noise_alone_flickers_by_all_of_its_error():
    stated = add_flicker(ESTIMATE | {"by_chance": 40.0})
    assert (stated["flicker"], stated["flicker_low"], stated["flicker_high"]) == (40.0, 38.0, 43.0)


def test_pixels_that_were_not_traced_may_not_flicker_at_all():
    stated = add_flicker(ESTIMATE, 0.1)
    assert (stated["flicker_low"], stated["flicker_high"]) == (38.0, 56.0)
    assert stated["flicker"] == add_flicker(ESTIMATE)["flicker"]


def test_pixels_that_keep_their_code_do_not_flicker():
    # A tenth of the pixels, an outline with half of the error.
    stated, whole = add_flicker(ESTIMATE, 0.1, traced_error=0.5), add_flicker(ESTIMATE)
    assert stated["flicker"] == pytest.approx(whole["flicker"] + 3.01)
    assert (stated["flicker_low"], stated["flicker_high"]) == (38.0, 56.0)


@pytest.mark.parametrize("estimate", [None, {"psnr": 40.0}])
def test_nothing_is_stated_where_nothing_is_known(estimate):
    assert add_flicker(estimate) == estimate


def test_the_mean_is_that_of_errors():
    assert mean_psnr([30.0, 30.0]) == pytest.approx(30.0)
    assert mean_psnr([20.0, 200.0]) == pytest.approx(20.0 + 10 * math.log10(2))


def test_a_film_says_what_its_frames_say():
    frames = [add_flicker(ESTIMATE), add_flicker(ESTIMATE | {"psnr": 39.0})]
    assert film_in_words(frames).startswith(
        "estimated PSNR of the frames 39.5 dB, of the worst 39.0 dB, of their flicker"
    )
    assert film_in_words([ESTIMATE]) == "estimated PSNR of the frames 40.0 dB, of the worst 40.0 dB"
    assert film_in_words([None]) is None


def frames(display, **options):
    motion = open_turntable(lippmann.load_scene("teapot"), 48)
    return [image for _, image in render_sequence(motion, display, range(2), integrator="path", **options)]


def codes(images):
    return np.stack([encode_srgb(image.pixels).astype(np.float64) for image in images])


@pytest.mark.slow
@pytest.mark.parametrize("method", [pytest.param("pooled", marks=pytest.mark.long), "full"])
def test_the_stated_flicker_holds_against_long_renderings(method):
    display = load_display("seed-lenticular").resized(128, 128)
    stated = frames(display, method=method, spp=4 if method == "full" else None)  # a key frame, and one after it
    long = [codes(frames(display, method="full", spp=48, seed=seed)) for seed in (991, 992)]
    change, first, second = (np.diff(each, axis=0) for each in (codes(stated), *long))
    flicker = -10 * math.log10(np.mean((change - first) * (change - second)) / 2)
    figures = stated[0].provenance.estimate
    assert figures["flicker_low"] < flicker < figures["flicker_high"]
    if method == "full":  # of a small denoised picture the error is known to some dB only
        assert flicker == pytest.approx(figures["flicker"], abs=1.0)


def test_noise_that_stands_still_states_no_flicker():
    display = load_display("seed-lenticular").resized(32, 32)
    assert "flicker" not in frames(display, spp=2, fixed_noise=True)[0].provenance.estimate
