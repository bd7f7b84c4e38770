"""Samples go where they take out most noise, and none is lost or given twice."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lippmann.rendering.live.sample_plan import LEAST_SHARE, even_samples, samples_by_noise

COUNTS = st.lists(st.integers(0, 50), min_size=1, max_size=40)
LANES = st.integers(1, 500)


@given(COUNTS, LANES)
def test_even_samples_bring_all_to_the_same_number(start, lanes):
    taken = np.array(start)
    for _ in range(sum(max(start) - count for count in start) + 3):
        more = even_samples(taken, lanes)
        assert 0 < more.sum() <= max(lanes, 1)
        assert (more[taken > taken.min()] == 0).all() or taken.min() == taken.max()
        taken = taken + more
        if taken.min() == taken.max() >= max(start):
            break
    assert taken.min() == taken.max()


@given(COUNTS, LANES, st.data())
def test_every_sample_is_given_to_some_pixel(start, lanes, data):
    taken = np.array(start)
    noise = np.array(data.draw(st.lists(st.floats(0, 100, width=32), min_size=len(start), max_size=len(start))))
    more = samples_by_noise(taken, noise.astype(np.float32), lanes)
    assert (more >= 0).all()
    if noise.mean() > 1e-30:
        assert more.sum() == lanes


def test_numbers_come_to_be_in_proportion_to_the_noise():
    noise = np.array([0, 1, 2, 4, 8, 1, 0, 16], np.float32)
    taken = np.ones(8, np.int64)
    for _ in range(60):
        taken = taken + samples_by_noise(taken, noise, 30)
    wanted = np.maximum(noise, LEAST_SHARE * noise.mean())
    np.testing.assert_allclose(taken / taken.sum(), wanted / wanted.sum(), atol=1.5 / taken.sum())


def test_the_error_falls_faster_than_with_even_samples():
    noise = np.random.default_rng(1).lognormal(sigma=1.5, size=2000).astype(np.float32)
    taken = np.ones(2000, np.int64)
    for _ in range(20):
        taken = taken + samples_by_noise(taken, noise, 1000)
    assert taken.sum() == 22_000
    assert (noise**2 / taken).sum() < 0.35 * (noise**2 / 11).sum()


def test_pixels_that_have_more_than_is_best_get_none():
    more = samples_by_noise(np.array([100, 1, 1]), np.ones(3, np.float32), 10)
    assert more.tolist() == [0, 5, 5]


def test_without_noise_all_get_as_many():
    assert samples_by_noise(np.array([1, 1, 0]), np.zeros(3, np.float32), 10).tolist() == [0, 0, 1]
