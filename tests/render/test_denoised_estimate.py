"""What a denoised picture says of itself, against errors that are known because they were made."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.image.permutation import lens_indices
from lippmann.quality.metrics import micro_image_means, psnr
from lippmann.render.denoised_estimate import DenoisedEstimator
from lippmann.render.estimate import CROSS_NOISE, OWN_NOISE, PixelErrors, cut_at_zero

SHOWN = Display("test", Panel(64, 64, 0.25), LensArray("square", 2.0), gap=6.8)


def made(seed, noise=0.05, left=0.01, spread=0.5):
    """Errors of a denoised picture whose true error is ``left`` and whose judges have ``noise``; and the true ones."""
    random = np.random.default_rng(seed)
    strength = np.exp(spread * random.standard_normal(64))[lens_indices(SHOWN)]
    own, a, b = random.standard_normal((3, 64, 64)) * np.stack([left * strength, *[noise * strength] * 2])
    samples = PixelErrors(
        np.square(noise * strength * random.standard_normal((64, 64))).astype(np.float32), None, OWN_NOISE
    )
    return PixelErrors(((own - a) * (own - b)).astype(np.float32), None, CROSS_NOISE, samples), own**2


@pytest.mark.parametrize(("noise", "too_bad"), [(0.005, 4), (0.05, 4), (0.2, 20)])
def test_intervals_hold_the_truth_however_noisy_the_judges_are(noise, too_bad):
    """Where the judges hide nearly all, pictures are said to be worse than they are, but not better."""
    estimator = DenoisedEstimator(SHOWN)
    flattered, blamed = np.zeros(2), np.zeros(2)
    for seed in range(40):
        errors, true = made(seed, noise)
        found = estimator.estimate(errors)
        truth = [psnr(float(true.mean())), psnr(float(np.nanmax(micro_image_means(true, SHOWN)[0])))]
        flattered += np.less(truth, [found.psnr_low, found.worst_low])
        blamed += np.greater(truth, [found.psnr_high, found.worst_high])
    assert (flattered <= 2).all()
    assert (flattered + blamed <= too_bad).all()


def test_a_negative_measurement_is_no_perfect_picture():
    """Strong noise can push the measured mean below zero; the picture is then not known to be good."""
    errors, _ = made(1, noise=0.2)
    low = PixelErrors(errors.values - np.float32(2 * errors.values.std() / 64), None, CROSS_NOISE, errors.samples)
    assert low.values.mean() < 0
    deviation = float(np.sqrt(np.square(low.values).sum())) / low.values.size
    found = DenoisedEstimator(SHOWN).estimate(low)
    assert found.psnr < psnr(0.2 * deviation)
    assert found.psnr_low < psnr(2 * deviation)


def test_where_the_samples_are_bad_the_denoised_picture_is_not_believed_to_be_good():
    errors, _ = made(3, noise=0.06, spread=0.0)
    harder = errors.samples.values.copy()
    harder[24:32, 40:48] *= 100
    found = DenoisedEstimator(SHOWN).estimate(
        PixelErrors(errors.values, None, CROSS_NOISE, PixelErrors(harder, None, OWN_NOISE))
    )
    assert found.worst_lens == (5, 3)
    assert found.worst < found.psnr - 6


def test_what_lone_hits_show_is_left_in_part_and_doubted():
    errors, _ = made(2)
    samples = errors.samples
    calm = DenoisedEstimator(SHOWN).estimate(errors)
    alone = PixelErrors(samples.values, samples.values, OWN_NOISE)
    found = DenoisedEstimator(SHOWN).estimate(PixelErrors(errors.values, None, CROSS_NOISE, alone))
    assert found.psnr <= psnr(0.1 * float(samples.values.mean())) + 0.1
    assert found.psnr_low < calm.psnr_low - 3
    assert found.worst_low < calm.worst_low


@given(st.floats(-50, 50), st.floats(1e-6, 10))
def test_what_cannot_be_negative_is_not(mean, deviation):
    found = cut_at_zero(mean, deviation)
    assert found > 0
    assert found >= mean
    if mean > 6 * deviation:
        assert found == pytest.approx(mean)
    if mean == 0:
        assert found == pytest.approx(deviation * math.sqrt(2 / math.pi))


@pytest.mark.parametrize("seed", range(3))
def test_a_few_pixels_that_are_badly_wrong_make_a_worst_micro_image(seed):
    """As beside a lamp whose light the denoiser spreads: the samples there are as good as anywhere."""
    errors, true = made(seed, noise=0.01, spread=0.1)
    errors.values[10, 20:23] += 0.15
    true[10, 20:23] += 0.15
    worst = psnr(float(np.nanmax(micro_image_means(true, SHOWN)[0])))
    found = DenoisedEstimator(SHOWN).estimate(errors)
    assert found.worst_lens == (2, 1)
    assert found.worst_low < worst < found.worst_high
    assert found.worst < worst + 6


def test_micro_images_of_few_pixels_may_be_worse_than_expected():
    """A corner that a slanted lens cuts off: what single pixels do there is most of its error."""
    panel = Panel(64, 64, 0.25)
    cut = Display("cut", panel, LensArray("lenticular", 5.3 * 0.25, slant=9.46), gap=6.8)
    counts = np.bincount(lens_indices(cut).ravel())
    assert counts.min() < 0.1 * np.median(counts)
    low = {}
    for name, display in (("cut", cut), ("whole", SHOWN)):
        random = np.random.default_rng(4)
        even = PixelErrors(np.full((64, 64), 2.5e-3, np.float32), None, OWN_NOISE)
        judged = np.float32(1e-4) * (1 + 0.1 * random.standard_normal((64, 64)).astype(np.float32))
        found = DenoisedEstimator(display).estimate(PixelErrors(judged, None, CROSS_NOISE, even))
        low[name] = found.worst_low
    assert low["cut"] < low["whole"] - 3


def test_doubt_of_lone_hits_leaves_the_better_end_where_it_was_measured():
    errors, _ = made(2)
    lone = PixelErrors(errors.samples.values, errors.samples.values, OWN_NOISE)
    found = DenoisedEstimator(SHOWN).estimate(PixelErrors(errors.values, None, CROSS_NOISE, lone))
    calm = DenoisedEstimator(SHOWN).estimate(errors)
    assert found.psnr < calm.psnr - 1
    assert found.psnr_high == pytest.approx(calm.psnr_high, abs=0.1)
    assert found.worst_high == pytest.approx(calm.worst_high, abs=0.5)
