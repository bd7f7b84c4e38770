"""Rectangles of pixels as sets of pixels; tiles cover a picture, each pixel once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display.panel import PixelWindow, TileGrid

WINDOWS = st.builds(PixelWindow, st.integers(0, 15), st.integers(0, 15), st.integers(1, 12), st.integers(1, 12))


def _covered(window):
    mask = np.zeros((27, 27), dtype=bool)
    mask[window.slices] = True
    return mask


@given(window=WINDOWS)
def test_a_window_has_its_pixels(window):
    row, column = np.nonzero(_covered(window))
    assert len(row) == window.pixels == np.prod(window.shape)
    assert (column.min(), row.min(), column.max() + 1, row.max() + 1) == (
        window.left,
        window.top,
        window.right,
        window.bottom,
    )
    assert (window.rows, window.columns) == window.slices


@given(a=WINDOWS, b=WINDOWS)
def test_an_intersection_has_the_pixels_of_both(a, b):
    shared = a.intersection(b)
    mask = np.zeros((27, 27), dtype=bool) if shared is None else _covered(shared)
    np.testing.assert_array_equal(mask, _covered(a) & _covered(b))


@given(a=WINDOWS, b=WINDOWS)
def test_a_relative_window_is_the_same_part_of_its_whole(a, b):
    part = a.intersection(b)
    if part is not None:
        picture = np.arange(27 * 27).reshape(27, 27)
        np.testing.assert_array_equal(picture[a.slices][part.relative_to(a).slices], picture[part.slices])


@settings(deadline=None)
@given(width=st.integers(1, 60), height=st.integers(1, 60), side=st.integers(1, 70))
def test_every_pixel_lies_in_one_tile(width, height, side):
    grid = TileGrid(width, height, side)
    covered = np.zeros((height, width), dtype=int)
    for window in grid:
        assert window.shape == covered[window.slices].shape
        covered[window.slices] += 1
    assert (covered == 1).all()
    assert len({grid.name(index) for index in range(len(grid))}) == len(grid) == grid.rows * grid.columns


def test_tiles_are_counted_row_by_row():
    grid = TileGrid(100, 50, 40)
    assert [grid[index] for index in (0, 2, 3)] == [
        PixelWindow(0, 0, 40, 40),
        PixelWindow(80, 0, 20, 40),
        PixelWindow(0, 40, 40, 10),
    ]
    assert grid.name(4) == "r0001_c0001"


@pytest.mark.parametrize("index", [-1, 6])
def test_there_are_no_other_tiles(index):
    with pytest.raises(IndexError):
        TileGrid(100, 50, 40)[index]
