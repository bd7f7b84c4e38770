"""Weights of paths, the chances by which they go on, and how many emitter samples they take."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")


@given(*[st.floats(0, 1e6)] * 2)
def test_weights_of_two_ways_add_up_to_one(a, b):
    import mitsuba as mi

    from lippmann.rendering.transport.path_weights import mis_weight

    first, second = mi.Float(a), mi.Float(b)
    if max(a, b) > 1e-10:  # whose squares are numbers
        assert mis_weight(first, second)[0] + mis_weight(second, first)[0] == pytest.approx(1, rel=1e-5)
    assert mis_weight(first, second)[0] == mis_weight(first, second, mi.Float(0))[0]


@given(*[st.floats(0, 1e6)] * 3)
def test_weights_of_the_three_ways_add_up_to_one(a, b, c):
    import mitsuba as mi

    from lippmann.rendering.transport.path_weights import mis_weight

    numbers = [mi.Float(value) for value in (a, b, c)]
    total = sum(mis_weight(numbers[k], numbers[k - 1], numbers[k - 2])[0] for k in range(3))
    if max(a, b, c) > 1e-10:  # whose squares are numbers
        assert total == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize(
    ("throughput", "eta", "expected"),
    [((0.04, 0.01, 0.0), 1.0, 0.2), ((0.16, 0.16, 0.16), 1.5, 0.6), ((1.0, 0.5, 0.5), 1.0, 0.95), ((0, 0, 0), 1, 0)],
)
def test_roulette_lets_faint_paths_go_on_by_the_root(throughput, eta, expected):
    import mitsuba as mi

    from lippmann.rendering.transport.path_weights import roulette_survival

    survival = np.array(roulette_survival(mi.Spectrum(*throughput), mi.Float(eta)))
    np.testing.assert_allclose(survival, expected, rtol=1e-5)


def test_emitter_samples_of_all_paths_are_one_stratified_sequence():
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream
    from lippmann.rendering.transport.path_weights import first_emitter_samples

    count, first = (np.array(part) for part in first_emitter_samples(dr.arange(mi.UInt32, 12)))
    assert count.tolist() == [4] * 4 + [2] * 8
    assert np.array_equal(first, np.cumsum(count) - count)
    stream = SampleStream.of_pixels(mi.UInt32(3), mi.UInt32(5), mi.UInt32(1))
    points = np.array(stream.at(dr.arange(mi.UInt32, 32)).next_2d(1)[0])
    assert sorted(np.floor(points * 32)) == list(range(32))
