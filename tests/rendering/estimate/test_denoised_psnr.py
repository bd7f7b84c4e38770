"""What a denoised picture says of itself, against errors that are known because they were made."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.micro_image_layout import lens_indices
from lippmann.display.panel import Panel
from lippmann.metrics.mse_psnr import micro_image_means, psnr
from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
from lippmann.rendering.estimate.psnr import PixelErrors

SHOWN = Display("test", Panel(64, 64, 0.25), LensArray("square", 2.0), gap=6.8)


def made(seed, noise=0.05, left=0.01, spread=0.5, ratio=3.0):
    """Errors of a denoised picture whose true error is ``left`` and whose judges have ``noise``; and the true ones.

    What its halves have wrong in common is ``ratio`` times what they differ by.
    """
    random = np.random.default_rng(seed)
    strength = np.exp(spread * random.standard_normal(64))[lens_indices(SHOWN)]
    common, first, second, a, b, of_samples = strength * random.standard_normal((6, 64, 64))
    alike = left * math.sqrt(ratio / (1 + ratio)) * common
    first, second = (alike + left * math.sqrt(2 / (1 + ratio)) * chance for chance in (first, second))
    halves_variance = (np.square(first - second) / 4).astype(np.float32)
    judged = ((noise * a - first) * (noise * b - second)).astype(np.float32) + halves_variance
    samples = PixelErrors(np.square(noise * of_samples).astype(np.float32))
    return PixelErrors(judged, None, samples, halves_variance), np.square((first + second) / 2)


def truth_of(true):
    return [psnr(float(true.mean())), psnr(float(np.nanmax(micro_image_means(true, SHOWN)[0])))]


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.3, 3, 10])
@pytest.mark.parametrize("noise", [0.005, 0.05, 0.2])
def test_intervals_hold_the_truth_however_noisy_the_judges_are(noise, ratio):
    estimator = PictureEstimator(SHOWN)
    inside = np.zeros(2)
    for seed in range(40):
        errors, true = made(seed, noise, ratio=ratio)
        found, truth = estimator.estimate(errors, 64), truth_of(true)
        inside += np.less_equal([found.psnr_low, found.worst_low], truth)
        inside -= np.greater(truth, [found.psnr_high, found.worst_high])
    assert (inside >= 37).all()


def kept_samples(seed, spread=0.5):
    """Errors of a picture whose halves are their very samples, some pixels of which are noisier; and the true ones.

    Nothing is left of either half by which the other one could be judged.
    """
    random = np.random.default_rng(seed)
    first, second = 0.01 * np.exp(spread * random.standard_normal((64, 64))) * random.standard_normal((2, 64, 64))
    halves_variance = (np.square(first - second) / 4).astype(np.float32)
    return PixelErrors(halves_variance, None, PixelErrors(halves_variance), halves_variance), np.square(
        (first + second) / 2
    )


def test_where_samples_are_kept_their_difference_is_no_measure_of_what_they_have_in_common():
    estimator = PictureEstimator(SHOWN)
    inside = np.zeros(2)
    for seed in range(30):
        errors, true = kept_samples(seed)
        found, truth = estimator.estimate(errors, 64), truth_of(true)
        inside += np.less_equal([found.psnr_low, found.worst_low], truth)
        inside -= np.greater(truth, [found.psnr_high, found.worst_high])
    assert (inside >= 28).all()


def test_a_negative_measurement_is_no_perfect_picture():
    """Strong noise can push what is measured below zero; what the halves differ by is wrong all the same."""
    errors, _ = made(1, noise=0.2)
    values = errors.values - np.float32(2 * errors.values.std() / 64)
    found = PictureEstimator(SHOWN).estimate(replace(errors, values=values), 64)
    assert values.mean() < 0
    assert found.psnr < psnr(float(errors.halves_variance.mean()))
    assert found.psnr_low < psnr(3 * float(errors.halves_variance.mean()))


def test_halves_that_agree_though_their_samples_do_not_are_not_believed_to_be_right():
    """As if a denoiser made the same of everything."""
    errors, _ = made(1, noise=0.2)
    same = np.zeros_like(errors.halves_variance)
    found = PictureEstimator(SHOWN).estimate(
        replace(errors, values=errors.values - errors.halves_variance, halves_variance=same), 64
    )
    assert found.psnr < psnr(1e-4 * float(errors.samples.values.mean()))


def test_what_is_measured_well_is_believed_whatever_is_usual():
    """Stripes that both halves have lost: they agree, and the samples show them."""
    errors, true = made(4, noise=0.01, ratio=30.0)
    found = PictureEstimator(SHOWN).estimate(errors, 64)
    assert found.psnr == pytest.approx(truth_of(true)[0], abs=0.5)
    assert found.psnr_high < found.psnr + 4.5


def test_where_the_halves_differ_the_picture_is_not_believed_to_be_good():
    errors, _ = made(3, noise=0.06, spread=0.0)
    harder = errors.halves_variance.copy()
    harder[24:32, 40:48] *= 30
    found = PictureEstimator(SHOWN).estimate(replace(errors, halves_variance=harder), 64)
    assert found.worst_lens == (5, 3)
    assert found.worst < found.psnr - 6


@pytest.mark.parametrize(("noise", "least", "most"), [(0.2, 1, 6), (0.005, -0.1, 0.3)])
def test_outliers_are_doubted_where_nothing_else_is_known(noise, least, most):
    """Where few paths find the light, both halves lack it; but what is measured well is known."""
    errors, _ = made(2, noise)
    calm = PictureEstimator(SHOWN).estimate(errors, 64)
    alone = replace(errors.samples, outliers=errors.samples.values)
    found = PictureEstimator(SHOWN).estimate(replace(errors, samples=alone), 64)
    for name in ("psnr", "psnr_low", "worst", "worst_low"):
        assert least < getattr(calm, name) - getattr(found, name) < most


@pytest.mark.parametrize("seed", range(3))
def test_a_few_pixels_that_are_badly_wrong_make_a_worst_micro_image(seed):
    """As beside a lamp whose light the denoiser spreads: the samples there are as good as anywhere."""
    errors, true = made(seed, noise=0.01, spread=0.1)
    errors.values[10, 20:23] += 0.15
    true[10, 20:23] += 0.15
    worst = truth_of(true)[1]
    found = PictureEstimator(SHOWN).estimate(errors, 64)
    assert found.worst_lens == (2, 1)
    assert found.worst_low < worst < found.worst_high
    assert found.worst < worst + 6


@pytest.mark.parametrize("seed", range(3))
def test_single_strong_hits_are_no_worst_micro_image(seed):
    """Both halves have met the rare light in one pixel by chance: its samples' errors show it, too."""
    errors, _ = made(seed, noise=0.01, spread=0.1)
    calm = PictureEstimator(SHOWN).estimate(errors, 64)
    errors.values[10, 20] += 0.15
    errors.samples.values[10, 20] += 0.15
    assert PictureEstimator(SHOWN).estimate(errors, 64).worst > calm.worst - 6


def test_what_may_not_be_there_widens_both_intervals_to_the_better_side_only():
    errors, _ = made(1, noise=0.005)
    calm = PictureEstimator(SHOWN).estimate(errors, 64)
    told = PictureEstimator(SHOWN).estimate(replace(errors, blur=np.float32(0.5) * errors.values), 64)
    assert told.psnr_high > calm.psnr_high + 2
    assert told.worst_high > calm.worst_high + 2
    for name in ("psnr", "psnr_low", "worst", "worst_low", "worst_lens"):
        assert getattr(told, name) == getattr(calm, name)


@pytest.mark.parametrize("seed", range(3))
def test_a_micro_image_that_only_blur_makes_the_worst_may_be_as_good_as_the_others(seed):
    """The blur of caustics is an upper bound, and it lies under one lens."""
    errors, true = made(seed, noise=0.005, spread=0.1)
    blur = np.zeros_like(errors.values)
    blur[16:24, 40:48] = 10 * true.mean()
    found = PictureEstimator(SHOWN).estimate(replace(errors, values=errors.values + blur, blur=blur), 64)
    assert found.worst_lens == (5, 2)
    assert found.worst < truth_of(true)[1] - 3
    assert found.worst_low < truth_of(true)[1] < found.worst_high


def test_micro_images_of_few_pixels_may_be_worse_than_expected():
    """A corner that a slanted lens cuts off: what single pixels do there is most of its error."""
    panel = Panel(64, 64, 0.25)
    cut = Display("cut", panel, LensArray("lenticular", 5.3 * 0.25, slant=9.46), gap=6.8)
    counts = np.bincount(lens_indices(cut).ravel())
    assert counts.min() < 0.1 * np.median(counts)
    low = {}
    for name, display in (("cut", cut), ("whole", SHOWN)):
        random = np.random.default_rng(4)
        even = PixelErrors(np.full((64, 64), 2.5e-3, np.float32))
        judged = np.float32(1e-4) * (1 + 0.1 * random.standard_normal((64, 64)).astype(np.float32))
        halves_variance = np.full((64, 64), 3e-5, np.float32)
        found = PictureEstimator(display).estimate(PixelErrors(judged, None, even, halves_variance), 64)
        low[name] = found.worst_low
    assert low["cut"] < low["whole"] - 3
