"""Local means know how far they may be off, at the picture's edges, too."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.rendering.denoise.local_statistics import leave_one_out_mean, mean_around
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


def test_means_are_cut_at_the_edges(bands):
    values = np.random.default_rng(5).random((12, 14)).astype(np.float32)
    assert mean_around(values, REACH, bands)[0, 0] == pytest.approx(values[:3, :3].mean(), rel=1e-5)
