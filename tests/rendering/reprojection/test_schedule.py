"""The order in which micro-images are made."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")


@given(st.integers(1, 300), st.sampled_from([1, 3, 40]), st.sampled_from([1, 2]))
def test_each_lens_is_made_once_from_lenses_that_are_done(count, rows, step):
    from lippmann.rendering.reprojection.schedule import refine

    columns = np.arange(count) * step
    width = step * count
    keys, steps = refine(columns, rows, width)
    done = set(keys.tolist())
    assert len(done) == len(keys)
    assert {0, int(columns[-1]), (rows - 1) * width} <= done
    for step in steps:
        assert done.isdisjoint(step.targets.tolist())
        assert set(step.sources.ravel().tolist()) <= done
        assert np.all(step.sources[:, 0] < step.targets)
        assert np.all(step.targets < step.sources[:, 1])
        done |= set(step.targets.tolist())
    assert done == set((np.arange(rows)[:, None] * width + columns).ravel().tolist())


def test_sources_are_the_nearest_that_are_done():
    from lippmann.rendering.reprojection.schedule import refine

    keys, steps = refine(np.arange(18), 1, 18)
    assert keys.tolist() == [0, 16, 17]
    assert [step.targets.tolist() for step in steps] == [[4, 8, 12], [1, 2, 3, 5, 6, 7, 9, 10, 11, 13, 14, 15]]
    assert steps[0].sources.tolist() == [[0, 16]] * 3
    assert steps[1].sources.tolist() == [[k // 4 * 4, k // 4 * 4 + 4] for k in steps[1].targets.tolist()]


@pytest.mark.parametrize("rows", [1, 3])
@pytest.mark.parametrize(("columns", "last_right"), [(1, None), (2, -1), (5, 4), (6, -1)])
def test_even_micro_images_lie_between_odd_ones(columns, rows, last_right):
    from lippmann.rendering.reprojection.schedule import odd_and_even

    odd, even = odd_and_even(columns, rows)
    assert np.all(odd % 2 == 0)  # counted from 1 these are the odd ones
    assert len(even.targets) == rows * (columns // 2)
    for row in range(rows):
        part = slice(row * (columns // 2), (row + 1) * (columns // 2))
        targets, sources = even.targets[part] - row * columns, even.sources[part]
        assert sorted([*odd.tolist(), *targets.tolist()]) == list(range(columns))
        if last_right is None:
            continue
        assert np.array_equal(sources[:, 0], even.targets[part] - 1)
        assert np.array_equal(sources[:-1, 1], even.targets[part][:-1] + 1)
        assert sources[-1, 1] == (last_right if last_right < 0 else row * columns + last_right)
