"""SSIM against scikit-image's, and what its mask and its small windows mean."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skimage.metrics import structural_similarity

from lippmann.metrics import ssim


def random_pair(shape, seed, noise=0.1):
    generator = np.random.default_rng(seed)
    a = generator.uniform(0, 1, shape)
    return a, np.clip(a + generator.normal(0, noise, shape), 0, 1)


@settings(deadline=None, max_examples=25)
@given(
    height=st.integers(11, 40),
    width=st.integers(11, 40),
    seed=st.integers(0, 1000),
    noise=st.sampled_from([0.01, 0.1, 1.0]),
)
def test_agrees_with_scikit_image(height, width, seed, noise):
    a, b = random_pair((height, width, 3), seed, noise)
    expected = structural_similarity(
        a, b, data_range=1.0, channel_axis=-1, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )
    assert ssim(a, b) == pytest.approx(expected, abs=1e-12)


def test_agrees_with_scikit_image_on_pictures_that_are_taken_in_parts():
    a, b = random_pair((301, 410), 9)
    expected = structural_similarity(
        a, b, data_range=1.0, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )
    assert ssim(a, b) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("masked", [False, True])
def test_a_picture_is_the_mean_of_its_windows(masked):
    a, b = random_pair((13, 90, 3), 8)
    mask = np.ones(a.shape[:2], dtype=bool)
    if masked:
        mask[3:9, ::5] = False
    # Windows of one column of places, one place after the other.
    parts = [(a[:, k : k + 11], b[:, k : k + 11], mask[:, k : k + 11]) for k in range(a.shape[1] - 10)]
    rows = 3
    weights = [int(part[2][5:-5, 5].sum()) for part in parts]
    sums = [ssim(*part) * weight for part, weight in zip(parts, weights, strict=True) if weight]
    assert sum(weights) == rows * len(parts) - (masked and np.count_nonzero(~mask[5:-5, 5:-5]))
    assert ssim(a, b, mask) == pytest.approx(sum(sums) / sum(weights), abs=1e-12)


def test_equal_pictures_have_one_and_negatives_less():
    a, _ = random_pair((20, 20), 1)
    assert ssim(a, a) == pytest.approx(1.0, abs=1e-12)
    assert ssim(a, 1 - a) < 0


def test_flat_pictures_by_hand():
    # No variance: (2 a b + C1) / (a^2 + b^2 + C1) is left.
    assert ssim(np.full((12, 12), 0.2), np.full((12, 12), 0.4)) == pytest.approx((0.16 + 1e-4) / (0.2 + 1e-4))


@pytest.mark.parametrize("shape", [(1, 1), (1, 30), (8, 30), (30, 10)])
def test_a_short_side_cuts_the_window(shape):
    a, b = random_pair(shape, 3)
    assert ssim(a, a) == pytest.approx(1.0)
    assert -1 <= ssim(a, b) < 1


def test_one_row_is_judged_by_windows_of_one_row():
    # Nothing but the row itself can count: repeated rows add nothing to a window that is one row high.
    a, b = random_pair((1, 30), 4)
    tall = np.repeat(a, 11, axis=0), np.repeat(b, 11, axis=0)
    assert ssim(a, b) == pytest.approx(ssim(*tall))


def test_what_does_not_exist_does_not_count():
    a, b = random_pair((30, 30, 3), 5)
    mask = np.ones((30, 30), dtype=bool)
    mask[::3, 1::2] = False
    masked = ssim(a, b, mask)
    a[~mask], b[~mask] = 0.9, 0.1
    assert ssim(a, b, mask) == pytest.approx(masked, abs=1e-12)
    assert masked != pytest.approx(ssim(a, b), abs=1e-3)


def test_a_mask_of_all_is_no_mask_and_one_of_none_gives_nothing():
    a, b = random_pair((15, 15), 6)
    assert ssim(a, b, np.ones((15, 15), dtype=bool)) == ssim(a, b)
    assert np.isnan(ssim(a, b, np.zeros((15, 15), dtype=bool)))


def test_windows_are_centred_on_pixels_that_exist():
    mask = np.zeros((25, 25), dtype=bool)
    mask[12, 12] = True
    flat = (2 * 0.2 * 0.4 + 1e-4) / (0.2**2 + 0.4**2 + 1e-4)
    assert ssim(np.full((25, 25), 0.2), np.full((25, 25), 0.4), mask) == pytest.approx(flat)
