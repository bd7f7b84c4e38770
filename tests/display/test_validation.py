"""Lengths and sizes as people write them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.display import validation
from lippmann.errors import DisplayError


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("200x300mm", (200, 300)),
        ("8x10in", (203.2, 254)),
        (" 8 in x 25 cm ", (203.2, 250)),
        ("0.2mx300mm", (200, 300)),
        ("8inx10in", (203.2, 254)),
        ("1.5x2.5cm", (15, 25)),
        ("20X30cm", (200, 300)),
        ("200 x 300 mm", (200, 300)),
        ("8in x 10", (203.2, 254)),
        ("A4", (210, 297)),
    ],
)
def test_sizes(text, expected):
    assert validation.size(text, "size") == pytest.approx(expected)


def test_a_size_without_a_unit_is_refused_with_both_readings():
    with pytest.raises(DisplayError, match="size: '8x10' has no unit; say 8x10mm, 8x10cm or 8x10in"):
        validation.size("8x10", "size")


@pytest.mark.parametrize("text", ["", "200", "200x", "x300mm", "200x300x10mm", "200 by 300", "200x300 furlongs", "axb"])
def test_what_is_no_size_is_refused(text):
    with pytest.raises(DisplayError) as caught:
        validation.size(text, "size")
    assert caught.value.where == "size"


@pytest.mark.parametrize(
    ("text", "expected"),
    [("6.8 mm", 6.8), ("26mil", 0.6604), ("50cm", 500), ("20 in", 508), ("1e3um", 1), (".5m", 500)],
)
def test_lengths(text, expected):
    assert validation.length(text, "gap") == pytest.approx(expected)


@pytest.mark.parametrize("text", ["", "mm", "1,5 mm", "3 lpi", "1.2.3", "nan", "inf", "--3mm"])
def test_what_is_no_length_is_refused(text):
    with pytest.raises(DisplayError):
        validation.length(text, "gap")


@pytest.mark.parametrize("text", ["", "x", "60lpi", "nan", "inf", "1e", "0x3", "9" * 400])
def test_what_is_no_plain_number_is_refused(text):
    with pytest.raises(DisplayError, match="is not a number"):
        validation.plain_number(text, "lpi")


@given(st.text(max_size=12))
def test_whatever_is_typed_is_a_size_or_refused(text):
    try:
        width, height = validation.size(text, "size")
    except DisplayError:
        return
    assert isinstance(width, float)
    assert isinstance(height, float)
