"""Each pixel is traced at one place, and what was traced comes back to its pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.rendering.film.wavefront import STRIP_ROWS, in_strips, locate_pixel, reorder_to_rows

pytestmark = pytest.mark.usefixtures("engine")


def places(width: int, height: int) -> np.ndarray:
    """Row and column of every place, ``(places, 2)``."""
    import drjit as dr
    import mitsuba as mi

    count = width * height
    number = mi.UInt32(np.arange(count, dtype=np.uint32))
    # As pictures do it: pictures of all sizes share a kernel.
    found = locate_pixel(number, width, dr.opaque(mi.UInt32, in_strips(count, width)))
    dr.eval(found)
    return np.stack([np.array(part) for part in found], axis=1)


@settings(deadline=None)
@given(width=st.integers(1, 23), height=st.integers(1, 23))
def test_every_pixel_has_one_place(width, height):
    found = places(width, height)
    assert sorted(map(tuple, found)) == [(row, column) for row in range(height) for column in range(width)]


@settings(deadline=None)
@given(width=st.integers(1, 23), height=st.integers(1, 23))
def test_what_was_placed_comes_back_in_rows(width, height):
    found = places(width, height)
    found = reorder_to_rows(found, width)
    rows, columns = np.divmod(np.arange(width * height), width)
    assert found.tolist() == np.stack([rows, columns], axis=1).tolist()


def test_sixteen_lanes_are_a_square():
    square = places(8, 8)[:16]
    assert square.max(axis=0).tolist() == [STRIP_ROWS - 1, 16 // STRIP_ROWS - 1]


def test_a_picture_all_in_rows():
    import mitsuba as mi

    row, column = locate_pixel(mi.UInt32([0, 7, 8, 63]), 8, mi.UInt32(0))
    assert np.array(row).tolist() == [0, 0, 1, 7]
    assert np.array(column).tolist() == [0, 7, 0, 7]


@pytest.mark.parametrize("inner", [(), (3,), (2, 3)])
def test_values_of_any_shape(inner):
    values = np.arange(np.prod((26, *inner))).reshape(26, *inner)
    ordered = reorder_to_rows(values, 2)
    # The first strip of two columns, four rows each, and what is left below whole strips.
    assert ordered[:8].tolist() == values[[0, 4, 1, 5, 2, 6, 3, 7]].tolist()
    assert ordered[24:].tolist() == values[24:].tolist()
