"""Denoised halves that judge each other, against truths that are known."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.color.transfer import encode, encode_srgb
from lippmann.rendering.denoise.dual_buffer import DenoisedPicture
from lippmann.rendering.denoise.tuning import TUNING
from lippmann.rendering.estimate.psnr import PixelErrors

SHAPE = (256, 256, 3)


class Noise:
    """Two halves of a smooth picture, each with noise of its own."""

    def __init__(self, spread=0.05, seed=1):
        random = np.random.default_rng(seed)
        y, x = np.mgrid[0:1:256j, 0:1:256j]
        self.truth = np.stack([0.2 + 0.3 * x, 0.2 + 0.3 * y, 0.3 + 0.1 * np.sin(9 * x)], axis=-1).astype(np.float32)
        self._halves = [self.truth + random.normal(0, spread, SHAPE).astype(np.float32) for _ in range(2)]
        self.added = 0

    def add(self, samples, progress=lambda _: None):
        self.added += samples
        self.samples += samples

    samples = 2
    blurred = None
    #: Of each half.
    of_seen = None
    of_excess = None
    covered = None

    def to_display(self, values):
        return values

    def specular(self):
        return None if self.of_seen is None else self.of_seen[0]

    def specular_halves(self):
        return self.of_seen

    def excess(self):
        return self.of_excess

    def picture(self):
        return self._halves[0]

    def average_samples(self):
        return self._halves[0]

    def average_halves(self):
        return tuple(self._halves)

    def coverage_halves(self):
        return self.covered

    def squared_error(self):
        difference = np.square(self._halves[0] - self._halves[1]).mean(axis=2) / 4
        return PixelErrors(difference, blur=self.blurred)


def blur(picture, samples=2, rotated=False):
    padded = np.pad(picture, ((2, 2), (2, 2), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (5, 5), axis=(0, 1))
    return windows.mean(axis=(-1, -2)).astype(np.float32)


def true_error(picture, truth):
    return float(np.square(encode_srgb(picture.astype(float)) - encode_srgb(truth.astype(float))).mean())


def told_and_true(renderer, denoise):
    denoised = DenoisedPicture(renderer, denoise, "srgb")
    told = denoised.squared_error()
    return float(told.values.mean()), true_error(denoised.picture(), renderer.truth)


DENOISERS = {"blur": blur, "flat": lambda p, *_: np.full_like(p, 0.3), "brighter": lambda p, *_: p + np.float32(0.05)}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("denoise", DENOISERS.values(), ids=DENOISERS)
def test_the_error_is_neither_missed_nor_much_overstated(denoise, seed, as_denoised):
    """Bias and left-over noise both count, however strong the noise of the judges is."""
    told, true = told_and_true(Noise(seed=seed), denoise)
    assert told == pytest.approx(true, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("denoise", DENOISERS.values(), ids=DENOISERS)
def test_samples_that_take_the_place_of_worse_pixels_do_not_flatter(denoise):
    told, true = np.mean([told_and_true(Noise(seed=seed), denoise) for seed in range(8)], axis=0)
    assert told == pytest.approx(true, rel=0.15)


def test_noise_that_both_halves_share_would_not_be_seen_but_theirs_is_their_own():
    """The judge of a half is the other one: a denoiser that does nothing is told its whole noise."""
    renderer = Noise()
    told = DenoisedPicture(renderer, lambda picture, *_: picture, "srgb").squared_error()
    noise = true_error(np.mean(renderer.average_halves(), axis=0), renderer.truth)
    assert float(told.values.mean()) == pytest.approx(noise, rel=0.2)


@pytest.mark.parametrize("coding", ["srgb", "pbr-neutral"])
def test_what_the_curve_takes_off_rare_light_is_told(coding, monkeypatch):
    """Skewed noise is mostly darker than the truth, so the code of its mean is too low."""
    random = np.random.default_rng(3)
    renderer = Noise()
    halves = tuple(renderer.truth * random.gamma(1, 1, (*SHAPE[:2], 1)).astype(np.float32) for _ in range(2))
    monkeypatch.setattr(renderer, "average_halves", lambda: halves)
    denoised = DenoisedPicture(renderer, lambda picture, *_: picture, coding)
    codes = (encode(picture.astype(float), coding) for picture in (denoised.picture(), renderer.truth))
    true = np.square(np.subtract(*codes)).mean()
    assert denoised.squared_error().values.mean() == pytest.approx(true, rel=0.15)


def test_what_the_halves_differ_by_is_known():
    renderer = Noise()
    told = DenoisedPicture(renderer, lambda picture, *_: picture, "srgb").squared_error()
    # Halves that are their samples have nothing wrong in common.
    assert float(told.halves_variance.mean()) == pytest.approx(float(told.values.mean()), rel=0.2)
    assert told.halves_variance.min() >= 0
    # With a blur they agree better than its samples do, but not wholly.
    blurred = DenoisedPicture(renderer, blur, "srgb").squared_error()
    assert 0.01 < float(blurred.halves_variance.mean()) / float(told.halves_variance.mean()) < 0.3


def test_seen_light_goes_past_the_denoiser(as_denoised):
    """A highlight of one pixel, which a blur would wipe out."""
    renderer = Noise()
    highlights = [np.zeros_like(half) for half in renderer.average_halves()]
    for light, half, strength in zip(highlights, renderer.average_halves(), (5.0, 5.4), strict=True):
        light[100, 100] = strength
        half += light
    given = []

    def denoise(picture, samples, rotated):
        given.append(picture.max())
        return blur(picture)

    renderer.of_seen = tuple(highlights)
    picture = DenoisedPicture(renderer, denoise, "srgb").picture()
    assert max(given) < 2
    assert picture[100, 100] == pytest.approx(renderer.truth[100, 100] + 5.2, rel=0.05)
    renderer.samples = 1
    alone = DenoisedPicture(renderer, denoise, "srgb").picture()
    assert alone[100, 100] == pytest.approx(renderer.truth[100, 100] + 5.0, rel=0.05)


def test_what_rests_on_single_chains_is_left_out_and_still_counts_as_an_error():
    renderer = Noise()
    hits = [np.zeros_like(half) for half in renderer.average_halves()]
    for hit, half in zip(hits, renderer.average_halves(), strict=True):
        hit[50, 50] = 0.25
        half += hit
    hits[0][100, 100] = 3.0
    renderer.average_halves()[0][100, 100] += 3.0
    renderer.of_seen = tuple(hits)
    before = DenoisedPicture(renderer, blur, "srgb")
    whole = before.picture()
    renderer.of_excess = np.zeros_like(hits[0])
    renderer.of_excess[100, 100] = 1.25
    after = DenoisedPicture(renderer, blur, "srgb")
    np.testing.assert_allclose(after.squared_error().values, before.squared_error().values, rtol=1e-6)
    less = whole - after.picture()
    assert less[100, 100] == pytest.approx(1.25, rel=1e-5)
    assert after.picture()[100, 100] == pytest.approx(renderer.truth[100, 100] + 0.25, rel=0.1)
    less[100, 100] = 0
    assert np.abs(less).max() < 1e-6
    renderer.samples = 1
    alone = DenoisedPicture(renderer, blur, "srgb").picture()
    assert alone[100, 100] == pytest.approx(renderer.truth[100, 100] + 1.75, rel=0.1)
    renderer.of_excess[100, 100] = 9.0
    assert DenoisedPicture(renderer, blur, "srgb").picture().min() == 0


def test_an_emitter_in_a_narrow_lobe_does_not_light_the_pixels_beside_it():
    """A mirrored emitter of which a tenth is not sharp; beside it something bright that is not seen light at all."""
    renderer = Noise()
    rest = [half.copy() for half in renderer.average_halves()]
    emitters = [np.zeros_like(half) for half in rest]
    for light, half in zip(emitters, renderer.average_halves(), strict=True):
        light[100, 100] = 300.0
        half[100, 100] += 330.0
        half[50, 50] += 30.0
    given = []

    def denoise(picture, samples, rotated):
        given.append(picture)
        return picture

    renderer.of_seen = tuple(emitters)
    picture = DenoisedPicture(renderer, denoise, "srgb").picture()
    for displayed, half in zip(given, rest, strict=True):
        assert displayed[100, 100] == pytest.approx(8.0)
        assert displayed[50, 50] == pytest.approx(8.0)
        displayed[100, 100] = displayed[50, 50] = half[100, 100] = half[50, 50] = 0
        assert displayed == pytest.approx(half)
    expected = np.mean(renderer.average_halves(), axis=0)
    np.testing.assert_allclose(picture, expected, rtol=1e-6)


@pytest.mark.parametrize("samples", [1, 4])
def test_one_path_that_happens_upon_an_emitter_does_not_light_the_pixels_beside_it(samples):
    renderer = Noise()
    renderer.samples = samples
    without = DenoisedPicture(renderer, blur, "srgb").picture()
    renderer.average_halves()[0][50, 50] += 3000.0
    beside = DenoisedPicture(renderer, blur, "srgb").picture() - without
    assert 0 < beside[50, 51].max() < 1


@pytest.mark.parametrize("samples", [1, 4])
def test_what_is_still_far_beyond_white_without_its_noise_is_as_bright_as_the_samples(samples):
    """An emitter that fills pixels, and not the same for both halves."""
    renderer = Noise()
    renderer.samples = samples
    for value, half in zip((290.0, 310.0), renderer.average_halves(), strict=True):
        half[40:60, 40:60] = value
    displayed = renderer.average_samples() if samples == 1 else np.mean(renderer.average_halves(), axis=0)
    picture = DenoisedPicture(renderer, blur, "srgb").picture()
    np.testing.assert_allclose(picture[45:55, 45:55], displayed[45:55, 45:55], rtol=1e-6)


@pytest.mark.parametrize(("samples", "hidden"), [(4, True), (64, False)])
def test_a_pixel_that_both_halves_hit_hard_does_not_hide_what_is_wrong_elsewhere(samples, hidden, as_denoised):
    """A caustic's rare light: the product of two hits is larger than any error of a code. Of few samples it counts."""
    renderer = Noise()
    renderer.samples = samples
    clear = float(DenoisedPicture(renderer, lambda p, *_: blur(np.minimum(p, 1)), "srgb").squared_error().values.mean())
    for half in renderer.average_halves():
        half[100, 100] += 15
    told = float(DenoisedPicture(renderer, lambda p, *_: blur(np.minimum(p, 1)), "srgb").squared_error().values.mean())
    assert (told > 2 * clear) == hidden


@pytest.mark.parametrize(("samples", "all_may_be"), [(2, True), (3, True), (4, False), (64, False)])
def test_of_few_samples_any_hit_may_be_an_outlier(samples, all_may_be):
    renderer = Noise()
    renderer.samples = samples
    told = DenoisedPicture(renderer, blur, "srgb").squared_error().samples
    assert (told.outliers is not None) == all_may_be
    if all_may_be:
        assert np.array_equal(told.outliers, np.float32(TUNING.assumed_outliers) * told.values)


def test_more_samples_are_cleaned_anew():
    renderer = Noise()
    calls = []

    def denoise(picture, samples, rotated):
        calls.append((samples, rotated))
        return picture

    denoised = DenoisedPicture(renderer, denoise, "srgb")
    denoised.picture(), denoised.squared_error()
    # Halves that the network sees another way: of itself it gets other things wrong.
    assert calls == [(2, False), (2, True)]
    renderer.add(4)
    denoised.picture()
    assert (calls[2:], renderer.added) == ([(6, False), (6, True)], 4)
    renderer.add(2)
    denoised.picture()
    assert len(calls) == 6


def test_a_single_sample_has_no_halves():
    renderer = Noise()
    renderer.samples = 1
    assert np.array_equal(DenoisedPicture(renderer, lambda p, *_: p * 2, "srgb").picture(), 2 * renderer.picture())


@pytest.mark.long
@pytest.mark.parametrize("samples", [4, 16])
def test_the_stated_interval_holds_for_open_image_denoise(engine, samples):
    import lippmann
    from lippmann.metrics.mse_psnr import low_percentile, micro_image_means, psnr, squared_errors

    display = lippmann.load_display("seed-lenticular").resized(192, 128)
    long = lippmann.render("teapot", display, spp=256, seed=99, tone_map="none")
    image = lippmann.render("teapot", display, spp=samples, denoise="oidn", tone_map="none")
    stated = image.provenance.estimate
    errors = squared_errors(long, image)
    assert stated["psnr_low"] < psnr(float(errors.mean())) < stated["psnr_high"]
    worst = low_percentile(*micro_image_means(errors, display), 0.0).psnr
    assert stated["worst_low"] < worst < stated["worst_high"]


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_light_spread_beyond_white_is_not_lost_where_codes_are_cut_off(transfer, as_denoised):
    """Beside a lamp a denoiser may make pixels brighter than white: the whole step from the truth to white counts."""
    truth = np.full(SHAPE, 0.35, dtype=np.float32)
    random = np.random.default_rng(4)
    renderer = Noise()
    renderer._halves = [truth + random.normal(0, 0.02, SHAPE).astype(np.float32) for _ in range(2)]
    told = DenoisedPicture(renderer, lambda p, *_: np.full_like(p, 1.2), transfer).squared_error()
    code = encode_srgb(np.float64(0.35)) if transfer == "srgb" else 0.35
    assert float(told.values.mean()) == pytest.approx((1 - code) ** 2, rel=0.05)
    # White beyond white is as white.
    renderer._halves = [half + np.float32(2) for half in renderer._halves]
    assert float(np.abs(DenoisedPicture(renderer, lambda p, *_: p + 1, transfer).squared_error().values).max()) < 1e-12


def test_light_spread_beyond_white_counts_by_what_the_tone_map_makes_of_it(as_denoised):
    random = np.random.default_rng(4)
    renderer = Noise()
    renderer._halves = [np.float32(0.35) + random.normal(0, 0.02, SHAPE).astype(np.float32) for _ in range(2)]
    told = DenoisedPicture(renderer, lambda p, *_: np.full_like(p, 1.2), "pbr-neutral").squared_error()
    codes = encode(np.array([[1.2] * 3, [0.35] * 3]), "pbr-neutral")
    assert float(told.values.mean()) == pytest.approx(np.square(codes[0] - codes[1]).mean(), rel=0.2)


def test_where_codes_are_steep_the_whole_step_counts(as_denoised):
    """A black corner that a denoiser makes dark grey: the slope there is that of the grey, the step far more."""
    truth = np.full(SHAPE, 0.001, dtype=np.float32)
    random = np.random.default_rng(5)
    renderer = Noise()
    renderer._halves = [truth + random.normal(0, 0.0005, SHAPE).astype(np.float32) for _ in range(2)]
    told = DenoisedPicture(renderer, lambda p, *_: np.full_like(p, 0.02), "srgb").squared_error()
    step = float(encode_srgb(np.float64(0.02)) - encode_srgb(np.float64(0.001)))
    assert step**2 < 1.5 * float(told.values.mean())
    assert float(told.values.mean()) < step**2


def test_blur_of_caustics_counts_in_full():
    """It is the same in both halves, so that they do not tell of it."""
    renderer = Noise(seed=1)
    plain = DenoisedPicture(renderer, blur, "srgb").squared_error()
    renderer.blurred = np.full(plain.values.shape, 0.01, np.float32)
    counted = DenoisedPicture(renderer, blur, "srgb").squared_error()
    np.testing.assert_allclose(counted.values - plain.values, 0.01, rtol=1e-4)
    assert counted.blur is renderer.blurred
