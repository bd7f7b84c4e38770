"""Plans cover every sample once and stay within the memory."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import MemoryLimitError
from lippmann.rendering.film.memory_model import (
    BYTES_PER_LANE,
    PICTURE,
    cut_batches,
    cut_wavefronts,
    divide_evenly,
    preferred_lanes,
)


@settings(deadline=None, max_examples=60)
@given(
    st.integers(1, 9000), st.integers(1, 5000), st.integers(1, 3000), st.sampled_from([1, 3]), st.integers(2**22, 2**33)
)
def test_every_sample_once_and_within_memory(width, height, samples, channels, memory):
    try:
        plan = cut_wavefronts(width, height, samples, channels=channels, memory=memory)
    except MemoryLimitError:
        assert memory - width * height * PICTURE < width * channels * BYTES_PER_LANE
        return
    rows = [row for tile in plan.tiles for row in (tile.first_row, tile.first_row + tile.rows)]
    assert rows[0] == 0
    assert rows[-1] == height
    assert rows[1:-1:2] == rows[2::2]
    runs = plan.passes
    assert [r.first for r in runs] == [sum(q.count for q in runs[:i]) for i in range(len(runs))]
    assert sum(r.count for r in runs) == samples
    assert sum(t.rows * width * channels * r.count for t, r in plan) == plan.work
    assert plan.lanes * BYTES_PER_LANE + width * height * PICTURE <= memory


def test_a_small_picture_is_one_wavefront():
    plan = cut_wavefronts(512, 512, 1, memory=2**31)
    assert len(plan.tiles) == len(plan.passes) == 1


def test_an_8k_picture_of_four_samples_fits_two_gigabytes():
    plan = cut_wavefronts(7680, 4320, 4, memory=2 * 2**30)
    assert plan.samples_per_pass == 4
    assert preferred_lanes() // 2 <= plan.lanes <= preferred_lanes()


def test_too_little_memory_says_how_much_is_needed():
    with pytest.raises(MemoryLimitError, match=r"memory: .* too small .* it needs [\d.]+ MiB; raise the limit"):
        cut_wavefronts(4096, 4096, 1, memory=2**20)
    with pytest.raises(MemoryLimitError, match=r"memory: 1 KiB are too small"):
        cut_wavefronts(4096, 4096, 1, memory=1000)


@given(total=st.integers(1, 10**6), most=st.integers(-3, 10**6))
def test_equal_parts_are_few_and_no_longer_than_allowed(total, most):
    length = divide_evenly(total, most)
    assert 1 <= length <= max(1, min(total, most))
    parts = -(-total // length)
    assert parts == -(-total // max(1, min(total, most)))
    assert length * parts - total < parts  # no part is shorter than the others by more than the rest of the division


@settings(max_examples=200)
@given(
    pixels=st.integers(1, 40),
    starts=st.lists(st.integers(0, 9), min_size=1, max_size=5),
    count=st.integers(1, 12),
    lanes=st.integers(1, 300),
    strip=st.integers(1, 50),
)
def test_every_sample_of_every_batch_once(pixels, starts, count, lanes, strip):
    batches = tuple(range(len(starts)))
    seen = [
        (pixel, batch, start + sample)
        for run in cut_batches(pixels, batches, tuple(starts), count, lanes, strip)
        for pixel in range(run.first, run.last)
        for batch, start in zip(run.batches, run.starts, strict=True)
        for sample in range(run.count)
    ]
    expected = [(p, b, starts[b] + s) for p in range(pixels) for b in batches for s in range(count)]
    assert sorted(seen) == sorted(expected)
    for run in cut_batches(pixels, batches, tuple(starts), count, lanes, strip):
        assert (run.last - run.first) * len(run.batches) * run.count <= lanes
        assert not run.in_strips or run.first % strip == 0
        assert not run.in_strips or run.last % strip == 0 or run.last == pixels
