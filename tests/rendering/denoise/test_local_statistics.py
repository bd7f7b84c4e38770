"""Local means know how far they may be off, at the picture's edges, too."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.rendering.denoise.local_statistics import leave_one_out_mean, mean_around
from lippmann.rendering.denoise.noisy_blend import _noise_and_error
from lippmann.rendering.denoise.unshared_blend import _gain_and_distance
from lippmann.runtime.row_threads import Bands

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
    found = leave_one_out_mean(values, REACH, 0.0, bands)[PLACES[place]]
    assert found == pytest.approx(others(values, *PLACES[place]).mean(), rel=1e-5)


@pytest.mark.parametrize("place", PLACES)
def test_the_standard_error_is_the_textbooks(bands, place):
    values = (5 + np.random.default_rng(2).random((12, 14))).astype(np.float32)
    stated = leave_one_out_mean(values, REACH, 0.0, bands) - leave_one_out_mean(values, REACH, 1.0, bands)
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
        plain = leave_one_out_mean(values, REACH, 0.0, bands).astype(np.float64)
        off += np.square(plain - lift) / ROUNDS
        stated += np.square(plain - leave_one_out_mean(values, REACH, 1.0, bands)) / ROUNDS
    for name, place in PLACES.items():
        assert np.sqrt(off[place] / stated[place]) == pytest.approx(1, abs=0.1), name


def test_too_few_neighbours_know_nothing(bands):
    assert leave_one_out_mean(np.ones((1, 2), np.float32), 3, 0.0, bands).tolist() == [[0.0, 0.0]]
    assert leave_one_out_mean(np.ones((1, 3), np.float32), 3, 0.0, bands).tolist() == [[1.0, 1.0, 1.0]]


def test_what_noise_explains_counts_for_nothing(bands):
    noise = np.random.default_rng(4).normal(0, 1, (40, 40)).astype(np.float32)
    assert (leave_one_out_mean(noise, REACH, 3.0, bands) > 0).mean() < 0.01
    assert leave_one_out_mean(noise, REACH, 3.0, bands).min() == 0
    assert (leave_one_out_mean(noise + 10, REACH, 3.0, bands) > 8).mean() > 0.99


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


def test_measures_are_those_of_their_formulas():
    random = np.random.default_rng(4)
    a, b, clean_a, clean_b, shared_a, shared_b, slope = random.uniform(0, 2, (7, 9, 11, 3)).astype(np.float32)
    noise_and_error = _noise_and_error(a, b, clean_a, clean_b, slope)
    gain_and_distance = _gain_and_distance(a, b, clean_a, clean_b, shared_a, shared_b, slope)
    weight = np.square(slope, dtype=np.float64)
    scatter = np.square(a - b)
    noise = (weight * scatter / 2).mean(axis=2)
    error = (weight * (np.square(clean_a - b) + np.square(clean_b - a) - scatter) / 2).mean(axis=2)
    steps = shared_a - clean_a, shared_b - clean_b
    gain = (weight * ((shared_a - b) * steps[0] + (shared_b - a) * steps[1])).sum(axis=2)
    apart = (weight * (np.square(steps[0]) + np.square(steps[1]))).sum(axis=2)
    np.testing.assert_allclose(
        [*noise_and_error, *gain_and_distance], [noise, error, gain, apart], rtol=1e-4, atol=1e-4
    )
