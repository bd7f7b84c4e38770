"""The order in which micro-images are made."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")


@given(st.integers(1, 300), st.sampled_from([1, 2, 4, 16]))
def test_each_lens_is_made_once_from_lenses_that_are_done(count, stride):
    from lippmann.rendering.reprojection.common.schedule import refine

    lenses = np.arange(count) * 2 + 5
    keys, steps = refine(lenses, stride)
    done = set(keys.tolist())
    assert {5, 2 * (count - 1) + 5} <= done
    for step in steps:
        assert not done & set(step.targets.tolist())
        assert set(step.sources.ravel().tolist()) <= done
        assert np.all(step.sources[:, 0] < step.targets)
        assert np.all(step.targets < step.sources[:, 1])
        done |= set(step.targets.tolist())
    assert sorted(done) == lenses.tolist()


def test_sources_are_the_nearest_that_are_done():
    from lippmann.rendering.reprojection.common.schedule import refine

    keys, steps = refine(np.arange(9), 4)
    assert keys.tolist() == [0, 4, 8]
    assert [step.targets.tolist() for step in steps] == [[2, 6], [1, 3, 5, 7]]
    assert [step.sources.tolist() for step in steps] == [[[0, 4], [4, 8]], [[0, 2], [2, 4], [4, 6], [6, 8]]]


@pytest.mark.parametrize(("lenses", "last_right"), [(1, None), (2, -1), (5, 4), (6, -1)])
def test_even_micro_images_lie_between_odd_ones(lenses, last_right):
    from lippmann.rendering.reprojection.common.schedule import odd_and_even

    odd, even = odd_and_even(lenses)
    assert sorted([*odd.tolist(), *even.targets.tolist()]) == list(range(lenses))
    assert np.all(odd % 2 == 0)  # counted from 1 these are the odd ones
    if last_right is None:
        assert len(even.targets) == 0
        return
    assert np.array_equal(even.sources[:, 0], even.targets - 1)
    assert np.array_equal(even.sources[:-1, 1], even.targets[:-1] + 1)
    assert even.sources[-1, 1] == last_right


def test_keys_lie_closer_on_displays_of_few_lenses():
    from lippmann.rendering.reprojection.common.schedule import few_lenses, key_stride

    assert few_lenses(64)
    assert not few_lenses(480)
    assert key_stride(64) < key_stride(480)
