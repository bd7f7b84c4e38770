"""Sums of pixels' errors over the parts of a picture."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from lippmann.rendering.estimate.psnr import (
    MOST_BLUR_SHARE,
    ErrorSums,
    PixelErrors,
    select_parts,
)


@pytest.fixture
def errors():
    values, outliers, halves_variance, blur, of_samples = (
        np.random.default_rng(1).exponential(0.01, (5, 12, 10)).astype(np.float32)
    )
    samples = PixelErrors(of_samples, outliers * np.float32(0.1))
    return PixelErrors(values, None, samples, halves_variance * np.float32(0.1), blur * np.float32(0.1))


OWNER = np.arange(120).reshape(12, 10) // 30


def test_sums_over_rows_are_those_of_the_whole(errors):
    for each in (errors, errors.samples):
        whole, bands = ErrorSums.none(4, 30), ErrorSums.none(4, 30)
        whole.add(OWNER, each)
        for first in range(0, 12, 5):
            bands.add(OWNER[first : first + 5], each.part(slice(first, first + 5)))
        for field in fields(ErrorSums):
            np.testing.assert_allclose(getattr(bands, field.name), getattr(whole, field.name), rtol=1e-12)
        assert (whole.pixels == 30).all()


def test_only_what_is_uncertain_is_squared(errors):
    known = ErrorSums.none(4, 30)
    known.add(OWNER, errors)
    uncertain = (errors.values - errors.halves_variance).astype(np.float64)
    np.testing.assert_allclose(known.squares, np.square(uncertain).reshape(4, 30).sum(axis=1), rtol=1e-5)
    np.testing.assert_allclose(known.halves_variance, errors.halves_variance.reshape(4, 30).sum(axis=1), rtol=1e-5)
    of_samples = ErrorSums.none(4, 30)
    of_samples.add(OWNER, errors.samples)
    squares = np.square(errors.samples.values.astype(np.float64))
    np.testing.assert_allclose(of_samples.squares, squares.reshape(4, 30).sum(axis=1), rtol=1e-5)
    np.testing.assert_allclose(of_samples.outliers, errors.samples.outliers.reshape(4, 30).sum(axis=1), rtol=1e-5)


def test_the_mean_may_be_less_by_a_share_that_is_bounded(errors):
    sums = ErrorSums.none(4, 30)
    sums.add(OWNER, errors)
    less = float(errors.blur.mean())
    assert sums.bound_blur_share(10 * less) == pytest.approx(0.1, rel=1e-5)
    assert sums.bound_blur_share(less) == MOST_BLUR_SHARE
    means = np.array([1e3, 2, 0.5, 1]) * sums.blur / sums.pixels
    np.testing.assert_allclose(sums.bound_blur_shares(means), [1e-3, 0.5, MOST_BLUR_SHARE, MOST_BLUR_SHARE])
    sums.blur[:] *= -1
    assert sums.bound_blur_share(less) == 0


def test_a_part_has_all_that_the_whole_has(errors):
    part = errors.part((slice(2, 5), slice(3, 9)))
    for mine, whole in (
        (part.values, errors.values),
        (part.halves_variance, errors.halves_variance),
        (part.blur, errors.blur),
        (part.samples.outliers, errors.samples.outliers),
    ):
        assert np.array_equal(mine, whole[2:5, 3:9])
    assert part.outliers is None


def test_parts_without_pixels_are_left_out():
    sums = ErrorSums.none(3, np.array([4, 0, 2]))
    index, known = select_parts(sums)
    assert index.tolist() == [0, 2]
    assert known.pixels.tolist() == [4, 2]
