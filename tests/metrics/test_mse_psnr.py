"""Pooled and per-lens errors, against numbers worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.color.transfer import decode_srgb
from lippmann.metrics import low_percentile, micro_image_means, psnr, squared_errors


def test_psnr_by_hand():
    assert psnr(0.01) == pytest.approx(20.0)
    assert psnr(1.0) == 0.0
    assert psnr(255**2 / 100, 255) == pytest.approx(20.0)
    assert psnr(0.0) == math.inf


def test_errors_are_means_over_channels_of_coded_differences(display, picture):
    plain = display()
    a, b = picture(plain, [0.5, 0.5, 0.5]), picture(plain, [0.8, 0.5, 0.1])
    np.testing.assert_allclose(squared_errors(a, b), (0.09 + 0.16) / 3, rtol=1e-6)


def test_linear_values_are_coded_before_they_are_compared(display, picture):
    plain = display()
    a, b = (picture(plain, decode_srgb(np.array(code)), "srgb") for code in (0.2, 0.3))
    np.testing.assert_allclose(squared_errors(a, b), 0.01, rtol=1e-5)
    c = picture(plain, 0.2)
    np.testing.assert_allclose(squared_errors(c, b), 0.01, rtol=1e-5)  # each is coded by its own transfer


def test_what_a_display_cannot_show_is_no_error(display, picture):
    plain = display()
    assert squared_errors(picture(plain, 1.0), picture(plain, 7.5)).max() == 0
    assert squared_errors(picture(plain, 0.0), picture(plain, -1.0)).max() == 0


def test_micro_image_means_are_those_of_the_micro_images(any_display, picture):
    values = np.random.default_rng(1).uniform(0, 1, (32, 64))
    image = picture(any_display, values[..., None])
    parts, mask = image.micro_images()[..., 0], image.micro_image_mask()
    means, counts = micro_image_means(values, any_display)
    np.testing.assert_array_equal(counts, mask.sum(axis=(2, 3)))
    assert counts.sum() == 32 * 64
    with np.errstate(invalid="ignore"):
        expected = parts.sum(axis=(2, 3), where=mask, dtype=np.float64) / counts
    np.testing.assert_allclose(means, expected, rtol=1e-6)
    assert np.isnan(means[counts == 0]).all()


@settings(deadline=None, max_examples=40)
@given(errors=st.lists(st.floats(0, 1), min_size=1, max_size=250), share=st.sampled_from([0.0, 0.01, 0.1, 0.5, 1.0]))
def test_low_percentile_is_the_nearest_rank(errors, share):
    means, counts = np.array([errors]), np.ones((1, len(errors)), dtype=np.intp)
    found = low_percentile(means, counts, share)
    rank = max(1, math.ceil(share * len(errors)))
    assert found.psnr == psnr(sorted(errors, reverse=True)[rank - 1])
    assert psnr(errors[found.column]) == found.psnr


def test_lenses_without_pixels_are_never_the_worst():
    means, counts = np.array([[np.nan, 0.25], [0.01, np.nan]]), np.array([[0, 3], [4, 0]])
    worst = low_percentile(means, counts, 0.0)
    assert (worst.column, worst.row, worst.pixels, worst.psnr) == (1, 0, 3, psnr(0.25))
    best = low_percentile(means, counts, 1.0)
    assert (best.column, best.row, best.pixels) == (0, 1, 4)
