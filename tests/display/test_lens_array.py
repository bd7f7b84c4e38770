"""What a panel and a lens array refuse."""

from __future__ import annotations

import math

import pytest

from lippmann.display import LensArray, Panel
from lippmann.errors import DisplayError


@pytest.mark.parametrize("value", [0, -8, 2.5, "512", True, None, math.nan, 10**9])
@pytest.mark.parametrize("key", ["width", "height"])
def test_pixel_counts_are_whole_and_positive(key, value):
    with pytest.raises(DisplayError, match=f"{key} is .*whole number from 1 to") as caught:
        Panel(**{"width": 8, "height": 8, "pixel_pitch": 1.0, key: value})
    assert caught.value.where == f"panel.{key}"


@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, "1", None])
def test_lengths_are_positive_and_finite(value):
    with pytest.raises(DisplayError, match=r"pixel_pitch is .*finite length above zero"):
        Panel(8, 8, value)
    with pytest.raises(DisplayError, match=r"pitch is .*finite length above zero"):
        LensArray("square", value)


@pytest.mark.parametrize(
    "offsets",
    [None, 3, ((0, 0), (0, 0)), ((0, 0), (0, 0), (0,)), ((0, 0), (0, 0), (0, 1.5)), ((0, 0), (0, 0), (0, math.nan))],
)
def test_subpixel_offsets_are_three_pairs(offsets):
    with pytest.raises(DisplayError, match="three pairs") as caught:
        Panel(8, 8, 1.0, offsets)
    assert caught.value.where == "panel.subpixel_offsets"


@pytest.mark.parametrize(
    ("values", "key", "said"),
    [
        ({"layout": "round"}, "layout", "lenticular, square, hexagonal"),
        ({"slant": 80}, "slant", "between -80 and 80"),
        ({"slant": -90.0}, "slant", "between -80 and 80"),
        ({"slant": math.nan}, "slant", "nan"),
        ({"slant": 5.0, "layout": "square"}, "slant", "only a lenticular sheet has a slant, this layout is square"),
        ({"slant": 5.0, "layout": "hexagonal"}, "slant", "only a lenticular sheet"),
        ({"row_pitch": 1.0}, "row_pitch", "only a hexagonal array"),
        ({"row_pitch": 1.0, "layout": "square"}, "row_pitch", "only a hexagonal array"),
        ({"row_pitch": 0.0, "layout": "hexagonal"}, "row_pitch", "above zero"),
        ({"row_pitch": 0.49, "layout": "hexagonal"}, "row_pitch", "at least half the pitch of 1 mm"),
        ({"offset": 3.0}, "offset", "two finite lengths"),
        ({"offset": (1.0, 2.0, 3.0)}, "offset", "two finite lengths"),
        ({"offset": (1.0, math.inf)}, "offset", "two finite lengths"),
    ],
)
def test_impossible_lens_arrays_are_refused(values, key, said):
    with pytest.raises(DisplayError) as caught:
        LensArray(**{"layout": "lenticular", "pitch": 1.0, **values})
    assert caught.value.where == f"lens_array.{key}"
    assert said in str(caught.value)


def test_rows_of_a_regular_hexagonal_array():
    assert LensArray("hexagonal", 2.0).row_spacing == pytest.approx(math.sqrt(3))
    assert LensArray("hexagonal", 2.0, row_pitch=1.5).row_spacing == 1.5
    assert LensArray("square", 2.0).row_spacing == 2.0
    assert math.isinf(LensArray("lenticular", 2.0).row_spacing)
