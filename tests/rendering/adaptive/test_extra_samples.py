"""Pictures that are not clean with a default number of samples get more, within bounds."""

import pytest

from lippmann.rendering.adaptive.extra_samples import extra_samples
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.psnr import Estimate

CLEAN = TUNING.clean


def of(psnr, worst=None):
    worst = psnr - 5 if worst is None else worst
    return Estimate(psnr, psnr - 1, psnr + 1, worst, worst - 1, worst + 1, (0, 0))


def test_clean_pictures_and_asked_numbers_stay():
    assert extra_samples(of(CLEAN), 8, 64) == 0
    assert extra_samples(of(20.0), 8, None) == 0


@pytest.mark.parametrize(("psnr", "total"), [(CLEAN - 0.1, 16), (CLEAN - 2.5, 24), (CLEAN - 20.0, 32)])
def test_as_many_as_the_estimate_suggests_but_no_more_than_there_may_be(psnr, total):
    assert extra_samples(of(psnr), 8, 32) == total - 8


def test_few_samples_grow_by_small_steps():
    assert extra_samples(of(CLEAN - 0.1), 2, 8) == 2
    assert extra_samples(of(CLEAN - 9.0), 2, 8) == 6


@pytest.mark.parametrize(("worst", "total"), [(25.0, 8), (24.9, 16), (22.0, 32), (5.0, 64)])
def test_a_worst_micro_image_that_is_bad_gets_more_of_the_reserve(worst, total):
    """However good the picture is as a whole."""
    assert extra_samples(of(CLEAN + 2, worst), 8, 64) == total - 8
