"""Every pixel has one place under one lens."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import (
    Display,
    LensArray,
    Panel,
    covers_whole_pixels,
    load_display,
    micro_image_shape,
    pixel_indices_under_lens,
    pixel_lenses,
)
from lippmann.display.micro_image_layout import lens_indices, row_blocks

many = settings(deadline=None, max_examples=30)


@given(data=st.data())
@many
def test_lens_and_index_name_a_pixel_uniquely(displays, data):
    display = data.draw(displays())
    i, j = pixel_lenses(display)
    k_x, k_y = pixel_indices_under_lens(display)
    grid, (n_y, n_x) = display.lens_grid, micro_image_shape(display)
    for index, count in ((i, grid.columns), (j, grid.rows), (k_x, n_x), (k_y, n_y)):
        assert index.shape == (display.panel.height, display.panel.width)
        assert index.min() >= 0
        assert index.max() < count
    address = ((j.astype(np.int64) * grid.columns + i) * n_y + k_y) * n_x + k_x
    assert len(np.unique(address)) == display.panel.width * display.panel.height


@given(data=st.data())
@many
def test_neighbours_under_one_lens_have_neighbouring_indices(displays, data):
    display = data.draw(displays())
    i, j = pixel_lenses(display)
    k_x, k_y = pixel_indices_under_lens(display)
    same = (np.diff(i, axis=1) == 0) & (np.diff(j, axis=1) == 0)
    assert (np.diff(k_x, axis=1)[same] == 1).all()
    assert (np.diff(k_y, axis=1)[same] == 0).all()
    same = (np.diff(i, axis=0) == 0) & (np.diff(j, axis=0) == 0)
    assert (np.diff(k_y, axis=0)[same] == 1).all()
    if display.lens_array.slant == 0:
        assert (np.diff(k_x, axis=0)[same] == 0).all()


@given(data=st.data())
@many
def test_the_index_tells_the_direction(displays, data):
    """Pixels with one index see within one pixel's step of one direction, whatever their lens."""
    display = data.draw(displays(layouts=("lenticular", "square")))
    column, row = np.meshgrid(np.arange(display.panel.width) + 0.5, np.arange(display.panel.height) + 0.5)
    x, y = display.panel_point(column, row)
    i, j = display.lens_of(x, y)
    cx, cy = display.lens_center(i, j, x, y)
    slant = np.radians(display.lens_array.slant)
    if display.lens_array.layout == "lenticular":
        # Level with the pixel, not nearest to it: the axis at the pixel's own height.
        cx, cy = cx + (y / display.magnification - cy) * np.tan(slant), y / display.magnification
    k_x, k_y = pixel_indices_under_lens(display)
    place = (x - cx * display.magnification) / display.panel.pixel_pitch + display.pixels_per_lens[0] / 2
    assert (k_x <= place + 1e-6).all()
    assert (place < k_x + 1 + 1e-6).all()
    if display.lens_array.layout == "square":
        place = (cy * display.magnification - y) / display.panel.pixel_pitch + display.pixels_per_lens[1] / 2
        assert (k_y <= place + 1e-6).all()
        assert (place < k_y + 1 + 1e-6).all()


@given(data=st.data())
@many
def test_row_ranges_are_cut_from_the_whole(displays, data):
    display = data.draw(displays())
    first = data.draw(st.integers(0, display.panel.height - 1))
    last = data.draw(st.integers(first + 1, display.panel.height))
    for function in (pixel_lenses, pixel_indices_under_lens):
        for whole, part in zip(function(display), function(display, (first, last)), strict=True):
            np.testing.assert_array_equal(part, whole[first:last])


@given(data=st.data())
@many
def test_whole_micro_images_are_blocks(displays, data):
    """Rectangular micro-images that tile the panel are what reshaping gives."""
    display = data.draw(displays(layouts=("lenticular", "square"), aligned=True))
    assert covers_whole_pixels(display)
    n_y, n_x = micro_image_shape(display)
    row, column = np.indices((display.panel.height, display.panel.width))
    i, j = pixel_lenses(display)
    k_x, k_y = pixel_indices_under_lens(display)
    np.testing.assert_array_equal(i, column // n_x)
    np.testing.assert_array_equal(j, row // n_y)
    np.testing.assert_array_equal(k_x, column % n_x)
    np.testing.assert_array_equal(k_y, row % n_y)


@given(data=st.data())
@many
def test_whole_hexagonal_lenses_have_the_same_pixels(displays, data):
    """All full lenses of even rows are alike, and all of odd rows."""
    display = data.draw(displays(layouts=("hexagonal",), aligned=True))
    assert covers_whole_pixels(display)
    display = display.resized(display.panel.width * 3, display.panel.height * 3)
    i, j = pixel_lenses(display)
    k_x, k_y = pixel_indices_under_lens(display)
    grid, (n_y, n_x) = display.lens_grid, micro_image_shape(display)
    taken = np.zeros((grid.rows, grid.columns, n_y, n_x), dtype=bool)
    taken[j, i, k_y, k_x] = True
    for parity in (0, 1):
        inner = taken[2 + parity : -2 : 2, 1:-2].reshape(-1, n_y, n_x)
        assert (inner == inner[:1]).all()


def test_hexagonal_micro_image_by_hand():
    """Lenses 4 pixels apart in rows 3 apart, centred on rows of pixels: cells 3 + 16/12 = 4.33 high, of 12 pixels."""
    display = Display("x", Panel(40, 30, 0.1), LensArray("hexagonal", 0.4, row_pitch=0.3), gap=1)
    assert micro_image_shape(display) == (5, 4)
    i, j = pixel_lenses(display)
    inside = (j == 5) & (i == 5)
    assert inside.sum() == 12
    k_x, k_y = pixel_indices_under_lens(display)
    places = sorted(zip(k_y[inside].tolist(), k_x[inside].tolist(), strict=True))
    # Its own row of pixels and one above and below; two away the neighbours' centres, 2 across and 3 down, are nearer.
    assert places == [(y, x) for y in (1, 2, 3) for x in range(4)]


@pytest.mark.parametrize(
    ("change", "whole"),
    [
        ({}, True),
        ({"lens_array": LensArray("lenticular", 0.8, slant=1.0)}, False),
        ({"lens_array": LensArray("lenticular", 0.81)}, False),
        ({"lens_array": LensArray("lenticular", 0.8, offset=(0.0, 0.0))}, False),
        ({"lens_array": LensArray("lenticular", 0.8, offset=(0.4, 0.0))}, True),
        ({"viewing_distance": 500.0}, False),
        ({"panel": Panel(63, 16, 0.1)}, False),
        ({"panel": Panel(64, 15, 0.1)}, True),
        ({"lens_array": LensArray("square", 0.8)}, True),
        ({"lens_array": LensArray("square", 0.8), "panel": Panel(64, 20, 0.1)}, False),
        ({"lens_array": LensArray("hexagonal", 0.8, row_pitch=0.7)}, True),
        ({"lens_array": LensArray("hexagonal", 0.8)}, False),
    ],
)
def test_covers_whole_pixels(change, whole):
    display = replace(Display("x", Panel(64, 16, 0.1), LensArray("lenticular", 0.8), gap=3), **change)
    assert covers_whole_pixels(display) is whole


def test_the_papers_display():
    display = load_display("seed-lenticular")
    assert micro_image_shape(display) == (512, 8)
    i, j = pixel_lenses(display, (100, 102))
    np.testing.assert_array_equal(i, [np.arange(512) // 8] * 2)
    assert not j.any()
    k_x, k_y = pixel_indices_under_lens(display, (100, 102))
    np.testing.assert_array_equal(k_x, [np.arange(512) % 8] * 2)
    np.testing.assert_array_equal(k_y, [[100] * 512, [101] * 512])


def test_lens_indices_count_row_by_row():
    display = Display("x", Panel(6, 4, 0.1), LensArray("square", 0.2), gap=1)
    indices = lens_indices(display)
    assert indices[:, ::2].tolist() == [[0, 1, 2], [0, 1, 2], [3, 4, 5], [3, 4, 5]]
    np.testing.assert_array_equal(lens_indices(display, (1, 3)), indices[1:3])


@pytest.mark.parametrize("first", [0, 5])
def test_row_blocks_cover_all_rows_once(first):
    for height, width in ((1, 1), (4320, 7680), (3, 1 << 21)):
        blocks = list(row_blocks(height, width, first))
        assert [start for start, _ in blocks] == [first, *(stop for _, stop in blocks[:-1])]
        assert blocks[-1][1] == first + height
