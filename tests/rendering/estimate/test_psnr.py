"""What a picture says of its own error, against errors that are known because they were made."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.micro_image_layout import lens_indices
from lippmann.display.panel import Panel
from lippmann.metrics.mse_psnr import micro_image_means, psnr
from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
from lippmann.rendering.estimate.psnr import FLOOR, Estimate, Parts, PixelErrors
from lippmann.rendering.request.preconditions import explain_missing_estimate
from lippmann.rendering.request.render_request import RenderRequest

ARRAYS = {
    "straight": LensArray("lenticular", 1.0),
    "slanted": LensArray("lenticular", 1.3, slant=9.46),
    "square": LensArray("square", 2.0),
    "hexagonal": LensArray("hexagonal", 1.75),
}


def display(kind="square", size=64):
    return Display(kind, Panel(size, size, 0.25), ARRAYS[kind], gap=6.8, aperture_distance=10.0)


def noisy_picture(shown, seed, spread=0.5):
    """Errors of normal noise whose strength differs from lens to lens: estimates by two halves, and the true ones."""
    random = np.random.default_rng(seed)
    owner = lens_indices(shown)
    strength = 0.02 * np.exp(spread * random.standard_normal(owner.max() + 1))[owner]
    a, b = strength * math.sqrt(2) * random.standard_normal((2, *owner.shape))
    return PixelErrors(((a - b) ** 2 / 4).astype(np.float32)), ((a + b) / 2) ** 2


def truth(errors, shown):
    return psnr(float(errors.mean())), psnr(float(np.nanmax(micro_image_means(errors, shown)[0])))


@pytest.mark.parametrize("kind", list(ARRAYS))
def test_intervals_hold_the_truth_for_every_layout(kind):
    shown = display(kind)
    estimator = PictureEstimator(shown)
    whole = worst = 0
    off = []
    for seed in range(40):
        errors, true = noisy_picture(shown, seed)
        found = estimator.estimate(errors, 64)
        true_psnr, true_worst = truth(true, shown)
        whole += found.psnr_low <= true_psnr <= found.psnr_high
        worst += found.worst_low <= true_worst <= found.worst_high
        off.append(found.worst - true_worst)
    assert whole >= 36
    assert worst >= 36
    assert abs(np.mean(off)) < 0.5


def test_intervals_say_something():
    shown = display()
    found = PictureEstimator(shown).estimate(noisy_picture(shown, 3, spread=0.2)[0], 64)
    assert found.psnr_high - found.psnr_low < 1.5
    assert found.worst_high - found.worst_low < 4.5


def test_one_bad_lens_among_good_ones_is_found():
    shown = display()
    errors, _ = noisy_picture(shown, 1, spread=0.2)
    values = errors.values.copy()
    values[16:24, 40:48] *= 100
    found = PictureEstimator(shown).estimate(PixelErrors(values), 64)
    assert found.worst_lens == (5, 2)
    assert found.worst == pytest.approx(psnr(float(values[16:24, 40:48].mean())), abs=1.0)


def test_outliers_widen_the_interval_to_the_worse_side_only():
    shown = display()
    errors, _ = noisy_picture(shown, 1)
    calm = PictureEstimator(shown).estimate(errors, 64)
    pessimistic = PictureEstimator(shown).estimate(PixelErrors(errors.values, errors.values), 64)
    assert pessimistic.psnr == calm.psnr
    assert pessimistic.psnr_low < calm.psnr_low - 1
    assert pessimistic.psnr_high <= calm.psnr_high + 0.01
    assert pessimistic.worst_low < calm.worst_low


def test_what_may_not_be_there_widens_the_interval_of_the_whole_to_the_better_side_only():
    shown = display()
    errors, _ = noisy_picture(shown, 1)
    calm, told = (
        PictureEstimator(shown).estimate(PixelErrors(errors.values, blur=blur), 64)
        for blur in (None, np.float32(0.5) * errors.values)
    )
    assert told.psnr_high == pytest.approx(calm.psnr_high + 10 * math.log10(2), abs=0.05)
    assert (told.psnr, told.psnr_low, told.worst) == (calm.psnr, calm.psnr_low, calm.worst)


def test_no_error_at_all_is_the_ceiling():
    shown = display()
    found = PictureEstimator(shown).estimate(PixelErrors(np.zeros((64, 64), np.float32)), 64)
    assert found.psnr == pytest.approx(-10 * math.log10(FLOOR))
    assert found.worst > -10 * math.log10(FLOOR) - 6


def test_an_estimate_survives_its_plain_form():
    shown = display()
    found = PictureEstimator(shown).estimate(noisy_picture(shown, 1)[0], 64)
    again = Estimate.from_dict(found.to_dict())
    assert again.worst_lens == found.worst_lens
    assert again.worst == pytest.approx(found.worst, abs=0.005)
    assert f"{found.psnr:.1f} dB" in str(found)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"integrator": "classic", "pixel_filter": "point"}, "chance"),
        ({"integrator": "path", "pixel_filter": "point"}, None),
        ({"integrator": "classic", "pixel_filter": "box"}, None),
        ({"integrator": "path", "spp": 1}, "two samples per pixel or more"),
    ],
)
def test_pictures_without_an_estimate_say_why(settings, reason):
    found = explain_missing_estimate(RenderRequest(**settings))
    assert found is None if reason is None else reason in found


def test_noise_that_hides_the_error_widens_the_interval_and_promises_nothing():
    # Products with noisy judges of a picture that is far better than they can tell: their mean may well be negative.
    shown, true = display(size=128), 1e-6
    estimator = PictureEstimator(shown)
    inside = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        values = true + 1e-3 * random.standard_normal((128, 128))
        found = estimator.estimate(PixelErrors(values.astype(np.float32)), 64)
        # A thousandth of noise in 16384 pixels tells errors down to 8e-6, which is 51 dB.
        assert 45 < found.psnr < 66
        assert found.worst < found.psnr + 3
        inside += found.psnr_low <= psnr(true) <= found.psnr_high or psnr(true) > found.psnr_high
        assert found.psnr_low < psnr(true)
    assert inside == 40


def test_the_better_end_of_the_worst_micro_image_leaves_out_blur_too():
    """Blur is told too high; in the lens that has it nothing else may be wrong."""
    errors = np.full((12, 24), 1e-6, np.float32)
    errors[4:8, 8:16] = 1e-3
    blur = np.where(errors > 1e-5, errors, 0).astype(np.float32)
    shown = Display("small", Panel(24, 12, 1.0), LensArray("square", 4.0), 30.0, "", 500.0, 80.0)
    without, told = (PictureEstimator(shown).estimate(PixelErrors(errors, blur=each), 64) for each in (None, blur))
    assert (told.worst, told.worst_low, told.psnr) == (without.worst, without.worst_low, without.psnr)
    assert 6 < told.worst_high - without.worst_high < 11


@pytest.mark.parametrize(("samples", "low", "worst_low"), [(4, 33.0, 23.0), (8, 33.0, 23.0), (16, 38.0, 30.0)])
def test_intervals_of_few_samples_among_mirrors_reach_down_farther(samples, low, worst_low):
    found = Estimate(40.0, 38.0, 43.0, 34.0, 30.0, 37.0, (3, 0)).widen_for_mirrors(samples)
    assert found == Estimate(40.0, low, 43.0, 34.0, worst_low, 37.0, (3, 0))


def test_no_psnr_is_below_nothing():
    poor = Estimate(5.0, 3.0, 6.0, 4.0, 2.0, 5.0, (0, 0)).widen_for_mirrors(2)
    assert (poor.psnr_low, poor.worst_low) == (0.0, 0.0)


def test_an_estimator_among_mirrors_states_that_interval():
    shown = display()
    errors, _ = noisy_picture(shown, 1)
    plain, mirrored = (PictureEstimator(shown, among).estimate(errors, 4) for among in (False, True))
    assert mirrored == plain.widen_for_mirrors(4)


def test_the_first_view_of_a_quilt_is_at_the_bottom_left():
    parts = Parts.views(3, 2, (4, 5), known=7)
    assert parts.owner.shape == (10, 12)
    assert (parts.rows, parts.columns, parts.known) == (1, 6, 7)
    assert [parts.owner[row, column] for row in (9, 0) for column in (0, 4, 11)] == [0, 1, 2, 3, 4, 5]
    assert (np.bincount(parts.owner.ravel()) == 20).all()
