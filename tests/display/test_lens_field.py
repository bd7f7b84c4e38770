"""Which lens every pixel has, and which pixels of other lenses correspond to it."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.display.lens_field import LensField
from lippmann.display.micro_image_layout import lens_numbers
from lippmann.display.panel import PixelWindow

DISPLAYS = {
    "square": Display("q", Panel(96, 96, 1.0), LensArray("square", 8.0), 4.0),
    "hexagonal": Display("h", Panel(96, 96, 1.0), LensArray("hexagonal", 9.0), 4.0),
    "slanted": Display("t", Panel(120, 80, 1.0), LensArray("lenticular", 8.2, slant=11.0), 4.0, "", 700.0),
    "straight": Display("s", Panel(90, 20, 1.0), LensArray("lenticular", 8.2), 4.0, "", 700.0),
}


@pytest.mark.parametrize("name", DISPLAYS)
def test_reach_is_the_longest_stretch_of_one_lens_in_a_row(name):
    field = LensField.of(DISPLAYS[name])
    assert field.reach == max(len(list(pixels)) for row in field.lens for _, pixels in groupby(row))


def test_numba_has_one_type_for_all_displays():
    """Kernels that read the field are compiled for one of them alone, whichever is rendered."""
    from numba import typeof

    assert len({typeof(LensField.of(display)) for display in DISPLAYS.values()}) == 1


def test_corresponding_pixels_lie_at_the_same_place():
    field = LensField.of(DISPLAYS["square"])
    numbers = np.arange(96 * 96)
    lens = field.lens.ravel().astype(np.int64)
    right = np.where(lens % 12 < 11, lens + 1, -1)
    there = field.corresponding(numbers, right)
    assert np.array_equal(there, np.where(right >= 0, numbers + 8, -1))


@pytest.mark.parametrize("name", DISPLAYS)
def test_windows_have_the_lenses_of_the_whole_panel(name):
    display = DISPLAYS[name]
    whole = LensField.of(display).lens
    window = PixelWindow(7, 5, 31, 11)
    assert np.array_equal(lens_numbers(display, window)[0], whole[window.slices])
    own = lens_numbers(display, window, subpixels=True)[1]  # green lies in the pixel's middle
    assert np.array_equal(own, whole[window.slices])
