"""Panels whose pixels are of several kinds."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import NUMPY, Display, LensArray, Panel, load_display
from lippmann.errors import DisplayError

A = ((-0.3, 0.1), (0.0, -0.2), (0.3, 0.1))
B = ((0.3, -0.1), (0.0, 0.2), (-0.3, -0.3))
C = ((0.1, 0.0), (0.2, 0.0), (0.4, 0.0))
#: Two rows of three.
CELLS = ((A, B, C), (B, C, A))


def test_the_pattern_begins_at_the_top_left_and_repeats():
    panel = Panel(7, 5, 1.0, subpixel_cells=CELLS)
    for row in range(5):
        for column in range(7):
            for c in range(3):
                x, y = panel.subpixel_point(np.array([column + 0.5]), np.array([row + 0.5]), c, NUMPY)
                right, down = CELLS[row % 2][column % 3][c]
                assert x[0] == pytest.approx(column + 0.5 - 3.5 + right)
                assert y[0] == pytest.approx(2.5 - (row + 0.5) - down)


def test_numbers_and_arrays_of_colours_give_the_same():
    panel = Panel(7, 5, 0.1, subpixel_cells=CELLS)
    u, v = np.meshgrid(np.arange(7) + 0.25, np.arange(5) + 0.75)
    for c in range(3):
        here = panel.subpixel_point(u, v, c, NUMPY)
        there = panel.subpixel_point(u, v, np.full(u.shape, float(c)), NUMPY)
        np.testing.assert_array_equal(here, there)


def test_all_that_asks_for_one_place_gets_the_mean():
    panel = Panel(7, 5, 1.0, subpixel_cells=((A,), (B,)))
    assert panel.subpixel_offsets == pytest.approx(np.array([[0, 0], [0, 0], [0, -0.1]]))
    assert Panel(7, 5, 1.0).subpixel_cells is None


def test_one_kind_is_as_plain_offsets():
    plain, cells = Panel(7, 5, 1.0, A), Panel(7, 5, 1.0, subpixel_cells=((A,),))
    u, v = np.meshgrid(np.arange(7) + 0.5, np.arange(5) + 0.5)
    for c in range(3):
        np.testing.assert_array_equal(plain.subpixel_point(u, v, c, NUMPY), cells.subpixel_point(u, v, c, NUMPY))


def test_the_same_on_the_device(engine):
    import mitsuba as mi

    from lippmann.device.kernel_ops import DEVICE

    panel = Panel(30, 20, 0.1, subpixel_cells=CELLS)
    rng = np.random.default_rng(3)
    u, v, c = rng.uniform(0, 30, 300), rng.uniform(0, 20, 300), rng.integers(0, 3, 300).astype(float)
    here = panel.subpixel_point(u, v, c, NUMPY)
    there = panel.subpixel_point(mi.Float64(u), mi.Float64(v), mi.Float64(c), DEVICE)
    np.testing.assert_allclose([array.numpy() for array in there], here, rtol=0, atol=1e-12)


def test_files_and_plain_values_carry_them(tmp_path):
    path = tmp_path / "own.toml"
    rows = str([[[list(pair) for pair in cell] for cell in row] for row in CELLS])
    path.write_text(
        f"gap = 1\n[panel]\nwidth = 30\nheight = 20\npixel_pitch = 0.1\nsubpixel_cells = {rows}\n"
        '[lens_array]\nlayout = "lenticular"\npitch = "5 px"\n'
    )
    display = load_display(path)
    assert display.panel.subpixel_cells == CELLS
    assert Display.from_dict(display.to_dict()) == display
    sheet = LensArray("lenticular", 0.5)
    assert display != Display("own", Panel(30, 20, 0.1, display.panel.subpixel_offsets), sheet, gap=1.0)


@pytest.mark.parametrize(
    "cells",
    [3, [], [[]], [A, B], [[A, B], [A]], [[((2, 0), (0, 0), (0, 0))]], [[A] * 9], [[A]] * 9, [[(A[0], A[1])]]],
)
def test_what_is_no_pattern_is_refused(cells):
    with pytest.raises(DisplayError, match="subpixel_cells") as caught:
        Panel(7, 5, 1.0, subpixel_cells=cells)
    assert caught.value.where == "panel.subpixel_cells"
