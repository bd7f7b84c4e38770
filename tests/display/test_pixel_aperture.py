"""The lit part of a sub-pixel."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from lippmann.display import Display, load_display
from lippmann.display.panel import Panel
from lippmann.display.pixel_aperture import PixelAperture, subpixel_cell
from lippmann.errors import DisplayError

STRIPES = Panel(30, 20, 0.3)
PRINT = Panel(30, 20, 0.3, ((0, 0), (0, 0), (0, 0)))


def test_sub_pixels_share_a_pixel():
    assert subpixel_cell(STRIPES) == pytest.approx((0.1, 0.3))
    assert subpixel_cell(PRINT) == (0.3, 0.3)
    assert subpixel_cell(Panel(9, 9, 0.3, ((0, -1 / 3), (0, 0), (0, 1 / 3)))) == pytest.approx((0.3, 0.1))


def test_the_black_matrix_takes_its_part():
    assert PixelAperture(black_matrix=0.02).lit_size(STRIPES) == pytest.approx((0.08, 0.28))
    assert PixelAperture(width=0.09, height=0.2).lit_size(STRIPES) == (0.09, 0.2)
    assert PixelAperture().lit_size(PRINT) == (0.3, 0.3)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"width": 0.0}, "pixel.width: width is 0 mm; it must be a length above zero"),
        ({"height": -1}, "height is -1 mm"),
        ({"black_matrix": -0.1}, "black_matrix is -0.1 mm; it must be a length of zero or more"),
        ({"black_matrix": 0.1}, "black_matrix is 0.1 mm; it must leave some of a sub-pixel's width of 0.1 mm"),
        ({"width": 0.4}, "width is 0.4 mm; a pixel is 0.3 mm wide"),
        ({"blur": math.nan}, "blur is nan"),
        ({"blur": 0.5}, "blur is 0.5 mm; it must not exceed a pixel of 0.3 mm"),
    ],
)
def test_what_cannot_be_is_refused(values, said):
    with pytest.raises(DisplayError) as caught:
        PixelAperture(**values).lit_size(STRIPES)
    assert said in str(caught.value)


def test_a_display_keeps_it():
    display = replace(load_display("panel-4k"), pixel=PixelAperture(black_matrix=0.005))
    assert Display.from_dict(display.to_dict()) == display
    with pytest.raises(DisplayError, match="black_matrix"):
        replace(display, pixel=PixelAperture(black_matrix=0.05))
