"""Means over neighbourhoods by running sums, against means that are taken one by one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.rendering.denoise.local_statistics_kernels import (
    column_mean_rows,
    compared_rows,
    judged_rows,
    row_mean_rows,
)


def means(values, radius, cuts=()):
    """Of the square around each pixel, the rows in bands that end at ``cuts``."""
    along, mean = np.empty_like(values), np.empty_like(values)
    edges = [0, *sorted(cuts), len(values)]
    for kernel, source, target in ((row_mean_rows, values, along), (column_mean_rows, along, mean)):
        for first, last in pairwise(edges):
            kernel(first, last, source, radius, target)
    return mean


@settings(deadline=None)  # the first example may compile
@given(
    st.integers(1, 20), st.integers(1, 20), st.integers(0, 9), st.lists(st.integers(0, 20), max_size=3), st.integers(0)
)
def test_means_are_those_of_the_pixels_that_there_are(height, width, radius, cuts, seed):
    values = np.random.default_rng(seed).standard_normal((height, width)).astype(np.float32)
    found = means(values, radius, [min(cut, height) for cut in cuts])
    for row in range(height):
        for column in range(width):
            part = values[max(0, row - radius) : row + radius + 1, max(0, column - radius) : column + radius + 1]
            assert found[row, column] == pytest.approx(float(part.mean(dtype=np.float64)), abs=1e-5)


def test_where_bands_begin_changes_no_bit():
    values = np.random.default_rng(2).lognormal(0, 4, (150, 30)).astype(np.float32)
    assert np.array_equal(means(values, 8), means(values, 8, [7, 63, 64, 100]))


def test_a_strong_value_leaves_nothing_behind_in_running_sums():
    values = np.ones((40, 40), dtype=np.float32)
    values[3, 3] = 1e6
    assert means(values, 2)[10:, 10:] == pytest.approx(1, abs=1e-5)


def test_halves_measure_their_noise_and_the_clean_ones_error():
    random = np.random.default_rng(3)
    truth = np.full((64, 64, 3), 0.5, dtype=np.float32)
    a, b = (truth + random.normal(0, 0.1, truth.shape).astype(np.float32) for _ in range(2))
    slope = np.full_like(truth, 2)
    noise, error = np.empty((64, 64), np.float32), np.empty((64, 64), np.float32)
    judged_rows(0, 64, a, b, truth + np.float32(0.2), truth + np.float32(0.1), slope, noise, error)
    assert float(noise.mean()) == pytest.approx(4 * 0.1**2, rel=0.05)
    assert float(error.mean()) == pytest.approx(4 * (0.2**2 + 0.1**2) / 2, rel=0.05)


def test_measures_are_those_of_their_formulas():
    random = np.random.default_rng(4)
    a, b, clean_a, clean_b, shared_a, shared_b, slope = random.uniform(0, 2, (7, 9, 11, 3)).astype(np.float32)
    found = np.full((4, 9, 11), np.nan, np.float32)
    for first, last in ((0, 4), (4, 9)):
        judged_rows(first, last, a, b, clean_a, clean_b, slope, *found[:2])
        compared_rows(first, last, a, b, clean_a, clean_b, shared_a, shared_b, slope, *found[2:])
    weight = np.square(slope, dtype=np.float64)
    scatter = np.square(a - b)
    noise = (weight * scatter / 2).mean(axis=2)
    error = (weight * (np.square(clean_a - b) + np.square(clean_b - a) - scatter) / 2).mean(axis=2)
    steps = shared_a - clean_a, shared_b - clean_b
    gain = (weight * ((shared_a - b) * steps[0] + (shared_b - a) * steps[1])).sum(axis=2)
    apart = (weight * (np.square(steps[0]) + np.square(steps[1]))).sum(axis=2)
    np.testing.assert_allclose(found, [noise, error, gain, apart], rtol=1e-4, atol=1e-4)
