"""How much of a denoised pixel its samples make up, where it is known what is right."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.rendering.denoise.noisy_blend import leave_one_out_mean, mean_around, weigh_samples
from lippmann.runtime.row_threads import Bands

SHAPE = (96, 96, 3)


def halves(noise, seed=1, value=0.3):
    random = np.random.default_rng(seed)
    return tuple(np.float32(value) + random.normal(0, noise, SHAPE).astype(np.float32) for _ in range(2))


def clean(value=0.3):
    return (np.full(SHAPE, value, dtype=np.float32),) * 2


def share(noisy, of, transfer="linear", threads=1):
    return weigh_samples(noisy, of, transfer, threads=threads)[..., 0]


def test_samples_change_nothing_where_the_clean_picture_is_right():
    assert float(share(halves(0.1), clean()).mean()) < 0.03


@pytest.mark.parametrize("off", [0.05, 0.1, 0.3])
@pytest.mark.parametrize("transfer", ["linear", "srgb"])
def test_where_it_is_wrong_the_weight_is_that_of_the_least_error(off, transfer):
    noise = 0.1
    found = share(halves(noise), clean(0.3 + off), transfer)
    assert float(found.mean()) == pytest.approx(off**2 / (off**2 + noise**2), abs=0.12)
    assert found.std() < 0.12


def test_more_samples_take_over():
    weights = [float(share(halves(noise), clean(0.33)).mean()) for noise in (0.3, 0.03, 0.003)]
    assert weights[0] < 0.1
    assert weights[2] > 0.97
    assert weights == sorted(weights)


def test_only_where_it_is_wrong():
    wrong = clean()[0].copy()
    wrong[:, 48:] += np.float32(0.2)
    found = share(halves(0.02), (wrong, wrong))
    assert found[:, :30].max() < 0.2
    assert found[:, 66:].min() > 0.8


def test_a_pixel_has_no_say_in_its_own_weight():
    """Else its judge would be party: the other half's noise would decide where it is asked."""
    noisy, of = halves(0.1), clean(0.4)
    changed = noisy[1].copy()
    changed[40, 40] = noisy[0][40, 40]
    before, after = share(noisy, of), share((noisy[0], changed), of)
    # Its noise stays known: a bright hit must not look like the truth.
    assert after[40, 40] == pytest.approx(before[40, 40], abs=0.02)
    assert abs(after[40, 41] - before[40, 41]) > 1e-4


def test_a_bright_hit_is_not_taken_for_light_that_is_missing():
    noisy = tuple(half.copy() for half in halves(0.001))
    noisy[0][50, 50] = 200
    assert share(noisy, clean())[50, 50] < 0.01


def test_threads_change_nothing_and_nothing_is_made_of_nothing():
    noisy, of = halves(0.1), clean(0.35)
    assert np.array_equal(share(noisy, of), share(noisy, of, threads=3))
    black = (np.zeros(SHAPE, np.float32),) * 2
    assert not share(black, black).any()
    single = tuple(part[:1, :1] for part in noisy)
    assert np.isfinite(share(single, tuple(part[:1, :1] for part in of))).all()


# ---- Local means ----

REACH = 2
ROUNDS = 1500
PLACES = {
    "middle": (6, 7),
    "edge": (0, 7),
    "side": (6, 0),
    "next to an edge": (1, 6),
    "corner": (0, 0),
    "far": (11, 13),
}


@pytest.fixture(scope="module")
def bands():
    return Bands(1)


def others(values, row, column):
    window = np.zeros(values.shape, bool)
    window[max(0, row - REACH) : row + REACH + 1, max(0, column - REACH) : column + REACH + 1] = True
    window[row, column] = False
    return values[window]


@pytest.mark.parametrize("place", PLACES)
def test_means_leave_the_pixel_itself_out(bands, place):
    values = np.random.default_rng(1).random((12, 14)).astype(np.float32)
    found = leave_one_out_mean(values, REACH, bands, 0.0)[PLACES[place]]
    assert found == pytest.approx(others(values, *PLACES[place]).mean(), rel=1e-5)


@pytest.mark.parametrize("place", PLACES)
def test_the_standard_error_is_the_textbooks(bands, place):
    values = (5 + np.random.default_rng(2).random((12, 14))).astype(np.float32)
    stated = leave_one_out_mean(values, REACH, bands, 0.0) - leave_one_out_mean(values, REACH, bands, 1.0)
    sample = others(values, *PLACES[place])
    assert stated[PLACES[place]] == pytest.approx(sample.std(ddof=1) / np.sqrt(sample.size), rel=2e-3)


@pytest.mark.parametrize("mean", [0.0, 3.0])
def test_the_standard_error_is_the_true_one_at_edges_too(bands, mean):
    """Over many pictures of noise: of the square of what means are off by, and of the variance that is stated."""
    random = np.random.default_rng(3)
    off, stated = np.zeros((12, 14)), np.zeros((12, 14))
    # Far above 0, so that nothing is cut there.
    lift = 100 + mean
    for _ in range(ROUNDS):
        values = (lift + random.normal(0, 1, (12, 14))).astype(np.float32)
        plain = leave_one_out_mean(values, REACH, bands, 0.0).astype(np.float64)
        off += np.square(plain - lift) / ROUNDS
        stated += np.square(plain - leave_one_out_mean(values, REACH, bands, 1.0)) / ROUNDS
    for name, place in PLACES.items():
        assert np.sqrt(off[place] / stated[place]) == pytest.approx(1, abs=0.1), name


def test_too_few_neighbours_know_nothing(bands):
    assert leave_one_out_mean(np.ones((1, 2), np.float32), 3, bands, 0.0).tolist() == [[0.0, 0.0]]
    assert leave_one_out_mean(np.ones((1, 3), np.float32), 3, bands, 0.0).tolist() == [[1.0, 1.0, 1.0]]


def test_what_noise_explains_counts_for_nothing(bands):
    noise = np.random.default_rng(4).normal(0, 1, (40, 40)).astype(np.float32)
    assert (leave_one_out_mean(noise, REACH, bands, 3.0) > 0).mean() < 0.01
    assert leave_one_out_mean(noise, REACH, bands, 3.0).min() == 0
    assert (leave_one_out_mean(noise + 10, REACH, bands, 3.0) > 8).mean() > 0.99


@settings(deadline=None)
@given(st.integers(1, 20), st.integers(1, 20), st.integers(0, 9), st.integers(0))
def test_means_are_those_of_the_pixels_that_there_are(height, width, reach, seed):
    values = np.random.default_rng(seed).standard_normal((height, width)).astype(np.float32)
    found = mean_around(values, reach, Bands(1))
    for row, column in np.ndindex(values.shape):
        part = values[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1]
        assert found[row, column] == pytest.approx(float(part.mean(dtype=np.float64)), abs=1e-5)


def test_where_bands_begin_changes_no_bit():
    values = np.random.default_rng(2).lognormal(0, 4, (150, 30)).astype(np.float32)
    assert np.array_equal(mean_around(values, 8, Bands(1)), mean_around(values, 8, Bands(3)))


def test_a_strong_value_leaves_nothing_behind():
    values = np.ones((40, 40), dtype=np.float32)
    values[3, 3] = 1e12
    assert (mean_around(values, 2, Bands(1))[6:, 6:] == 1).all()
