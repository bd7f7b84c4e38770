"""What a picture lacks of a goal, by its estimate."""

from __future__ import annotations

import pytest

from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.rendering.adaptive.goal import Goal
from lippmann.rendering.estimate.denoised_psnr import DenoisedEstimator
from lippmann.rendering.estimate.psnr import (
    AMONG_MIRRORS,
    FEW_AMONG_MIRRORS,
    NO_MARGIN,
    Estimate,
    Margin,
    PictureEstimator,
)

SHOWN = Display("test", Panel(64, 64, 0.25), LensArray("square", 2.0), gap=6.8)


def test_missing_is_by_the_likely_value_and_by_the_low_end():
    wide = Estimate(45, 44, 46, 41.0, 38.0, 43.0, (0, 0))
    assert Goal(quality_worst=40).missing(wide) == pytest.approx(1.0)
    narrow = Estimate(45, 44.9, 45.1, 41.0, 40.8, 41.2, (0, 0))
    assert Goal(quality_worst=42).missing(narrow) == pytest.approx(1.0)
    assert Goal(quality=44).missing(wide) <= 0


def test_among_mirrors_few_samples_need_a_margin_of_their_own_for_the_worst():
    plain, denoised = PictureEstimator(SHOWN), DenoisedEstimator(SHOWN)
    assert plain.margin(8) == Margin(4.0, 4.0)
    assert denoised.margin(2) == NO_MARGIN
    for each in (plain, denoised):
        each.expect_mirrors()
        assert each.fewest == 16
        assert each.margin(16) == NO_MARGIN
    assert (plain.first, denoised.first) == (8, 2)
    assert plain.margin(8) == Margin(4.0, 8.0)
    assert denoised.margin(8) == AMONG_MIRRORS
    assert denoised.margin(2) == denoised.margin(4) == FEW_AMONG_MIRRORS
    assert FEW_AMONG_MIRRORS.whole > AMONG_MIRRORS.whole
    estimate = Estimate(38.0, 37.0, 39.0, 26.0, 25.0, 27.0, (0, 0))
    assert Goal(quality=35).missing(estimate) == pytest.approx(-3)
    # The worst micro-image may have 12 dB less than the whole.
    assert Goal(quality=35).missing(estimate, AMONG_MIRRORS) == pytest.approx(23 + 5 - 26)
    assert Goal(quality=35).missing(estimate, Margin(2.0, 0.0)) == pytest.approx(-1)
