"""What is likely wrong with both halves of a denoised picture, for what they differ by."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.rendering.estimate.denoised_psnr import estimate_posterior
from lippmann.rendering.estimate.tuning import TUNING

ENDS = np.array([0.025, 0.5, 0.975])
chances = st.floats(1e-8, 1e-2)


@given(chances, st.floats(-10, 100), st.floats(1e-3, 100), st.floats(0, 1))
def test_no_picture_is_better_than_what_its_halves_differ_by(by_chance, ratio, deviation, outliers):
    low, middle, high = estimate_posterior(by_chance, ratio * by_chance, deviation * by_chance, outliers).quantiles(
        ENDS
    )
    assert by_chance <= low < middle < high


@given(chances, st.floats(0.1, 300), st.floats(0, 1))
def test_what_is_measured_well_is_the_error(by_chance, ratio, outliers):
    found = estimate_posterior(by_chance, ratio * by_chance, 1e-3 * ratio * by_chance, outliers)
    assert found.quantiles(0.5) == pytest.approx((1 + ratio) * by_chance, rel=0.02)


@given(chances, st.floats(0, 1))
def test_where_nothing_is_measured_the_usual_ratio_stands(by_chance, outliers):
    found = estimate_posterior(by_chance, 0.0, 1e6 * by_chance, outliers)
    assert found.quantiles(0.5) == pytest.approx(
        (1 + TUNING.usual_ratio ** (1 - outliers) * TUNING.outlier_ratio**outliers) * by_chance, rel=0.02
    )


@given(chances, st.floats(-3, 30), st.floats(0.1, 10), st.floats(0, 1), st.floats(1e-2, 1e2))
def test_only_ratios_count(by_chance, ratio, deviation, outliers, scale):
    one = estimate_posterior(by_chance, ratio * by_chance, deviation * by_chance, outliers).quantiles(ENDS)
    other = estimate_posterior(*(scale * by_chance * factor for factor in (1, ratio, deviation)), outliers).quantiles(
        ENDS
    )
    np.testing.assert_allclose(other, scale * one, rtol=1e-6)


@pytest.mark.parametrize("ratio", [1e5, 1e8])
def test_beyond_all_ratios_the_measurement_alone_counts(ratio):
    found = estimate_posterior(1e-9, ratio * 1e-9, 1e-2 * ratio * 1e-9, 0.0).quantiles(ENDS)
    assert found[0] < ratio * 1e-9 < found[2]
    assert found[1] == pytest.approx(ratio * 1e-9, rel=0.1)


def test_the_measurement_is_believed_the_more_the_surer_it_is():
    middles = [float(estimate_posterior(1e-4, 2e-3, deviation, 0.0).quantiles(0.5)) for deviation in (1e-2, 1e-3, 1e-4)]
    assert middles[0] < middles[1] < middles[2] <= 2.1e-3


def test_a_picture_without_any_error_is_not_worse_than_what_codes_tell():
    assert float(estimate_posterior(0.0, 0.0, 0.0, 0.0).quantiles(0.975)) < 1e-10
