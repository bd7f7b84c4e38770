"""Tiles cover a picture, each pixel once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.journal import TileGrid, Window


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
    assert [grid[index] for index in (0, 2, 3)] == [Window(0, 0, 40, 40), Window(0, 80, 40, 20), Window(40, 0, 10, 40)]
    assert grid.name(4) == "r0001_c0001"


@pytest.mark.parametrize("index", [-1, 6])
def test_there_are_no_other_tiles(index):
    with pytest.raises(IndexError):
        TileGrid(100, 50, 40)[index]
