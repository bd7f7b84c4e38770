"""Sample streams: stratified within a pixel, independent between pixels, dimensions and seeds."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def points(pixel, count, seed=3, dimension=5, half=0):
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream

    index = dr.arange(mi.UInt32, count)
    return np.array(SampleStream.of_pixels(mi.UInt32(pixel), index, mi.UInt32(seed), half).next_2d(dimension)).T


@pytest.mark.parametrize("pixel", [0, 1, 77, 2**31])
def test_powers_of_two_are_stratified_in_every_elementary_interval(pixel):
    p = points(pixel, 256)
    for m in range(9):
        run = p[: 2**m]
        for a in range(m + 1):
            cell = np.floor(run[:, 0] * 2**a) * 2 ** (m - a) + np.floor(run[:, 1] * 2 ** (m - a))
            assert len(np.unique(cell)) == 2**m


def test_one_sample_per_pixel_is_uniform_over_pixels():
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream

    stream = SampleStream.of_pixels(dr.arange(mi.UInt32, 2**18), mi.UInt32(0), mi.UInt32(9))
    p = np.array(stream.next_2d(1)).T
    counts = np.histogram2d(p[:, 0], p[:, 1], bins=16, range=[[0, 1], [0, 1]])[0]
    chi2 = ((counts - 1024) ** 2 / 1024).sum()
    assert 255 - 5 * np.sqrt(2 * 255) < chi2 < 255 + 5 * np.sqrt(2 * 255)


def test_pixels_dimensions_seeds_and_halves_are_uncorrelated():
    base = points(4, 4096)
    for other in (points(5, 4096), points(4, 4096, seed=4), points(4, 4096, dimension=6), points(4, 4096, half=1)):
        assert not np.array_equal(base, other)
        assert np.abs(np.corrcoef(base.T, other.T)[:2, 2:]).max() < 0.06


def test_the_same_arguments_give_the_same_points():
    assert np.array_equal(points(4, 64), points(4, 64))


def test_one_dimensional_samples_are_stratified():
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream

    stream = SampleStream.of_pixels(mi.UInt32(8), dr.arange(mi.UInt32, 64), mi.UInt32(1))
    values = np.sort(np.array(stream.next_1d(2)))
    assert np.array_equal(np.floor(values * 64), np.arange(64))


def lattice(count):
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import lattice_point

    return np.array(lattice_point(dr.arange(mi.UInt32, count), mi.UInt32(count))).T


@pytest.mark.parametrize("count", [1, 2, 5, 8, 12, 13])
def test_a_lattice_is_even_and_symmetric_about_the_middle(count):
    p = lattice(count)
    assert ((p >= 0) & (p < 1)).all()
    assert p[:, 0] == pytest.approx((np.arange(count) + 0.5) / count, abs=1e-6)
    assert p + p[::-1] == pytest.approx(np.ones_like(p), abs=1e-5)
    gaps = np.diff(np.sort(p[:, 1]), append=p[:, 1].min() + 1)
    assert gaps.max() < 2 / count + 1e-5
