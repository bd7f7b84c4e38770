"""Sheets of prints: trim, bleed and margin, in millimetres and in plain values."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import Display, load_display
from lippmann.display.formats.print_sheet import Print
from lippmann.display.sheet import Sheet
from lippmann.display.sheet_layout import trim_of, trimmed, with_bleed, with_margin
from lippmann.errors import DisplayError, UsageError

PRINT = Print(ppi=400, size=(40, 25), lpi=30, viewing_distance=400)


def lens_centers_from_trim(display):
    """Lens centres in mm to the right of the trim's left edge, as an eye at the viewing distance sees them there."""
    pixel, trim = display.panel.pixel_pitch, trim_of(display)
    left = (trim.left - display.panel.width / 2) * pixel
    lattice, columns = display.lattice, display.lens_grid.columns
    centers = (lattice.origin_x + np.arange(columns) * lattice.pitch) * display.magnification - left
    return centers[(centers > 0) & (centers < trim.width * pixel)]


@given(
    lpi=st.floats(15, 80),
    size=st.tuples(st.floats(10, 60), st.floats(5, 30)),
    bleed=st.floats(0.1, 20),
    margin=st.integers(0, 300),
    distance=st.sampled_from([math.inf, 300.0, 700.0]),
)
@settings(deadline=None, max_examples=20)
def test_lenses_keep_their_distance_from_the_trim(lpi, size, bleed, margin, distance):
    plain = Print(ppi=720, size=size, lpi=lpi, viewing_distance=distance).display()
    bled = with_bleed(plain, bleed)
    sheet = with_margin(bled, margin)
    for display in (bled, sheet, trimmed(sheet)):
        assert trim_of(display).shape == (plain.panel.height, plain.panel.width)
        # Where a number of lenses is whole to a millionth, it is made whole.
        np.testing.assert_allclose(lens_centers_from_trim(display), lens_centers_from_trim(plain), atol=1e-4)
        assert display.resolvable_depth == pytest.approx(plain.resolvable_depth)
    # At least what was asked for, and less than a pixel more.
    pixel = plain.panel.pixel_pitch
    assert bleed - 1e-5 <= bled.sheet.bleed * pixel < bleed + pixel
    assert sheet.panel.width == plain.panel.width + 2 * (bled.sheet.bleed + margin)


def test_a_bleed_by_hand():
    # 40 mm at 400 pixels per inch are 629.92, so 630 pixels of 0.0635 mm; a bleed of 3.175 mm is 50 of them.
    bled = with_bleed(PRINT.display(), 3.175)
    assert bled.sheet == Sheet(bleed=50)
    # 127 pixels of 0.0635 mm, which rounding makes 127.00000000000001.
    assert with_bleed(PRINT.display(), 8.0645).sheet == Sheet(bleed=127)
    assert bled.size_mm[0] == pytest.approx(630 * 0.0635 + 2 * 3.175)
    trim = trim_of(bled)
    assert (trim.left, trim.top, trim.width, trim.height) == (50, 50, 630, 394)
    # 47.2 lenses of 0.8467 mm: an axis lies in the middle of the trim, 315 pixels from its edge.
    centers = lens_centers_from_trim(bled)
    assert np.abs(centers - 315 * 0.0635).min() < 1e-9
    np.testing.assert_allclose(np.diff(centers), bled.micro_image_pitch)


def test_plain_values_and_back():
    bled = with_margin(with_bleed(PRINT.display(), 2), 90)
    bled = replace(bled, sheet=replace(bled.sheet, mirrored=True, profile="Printer, glossy"))
    assert Display.from_dict(bled.to_dict()) == bled
    assert Display.from_dict(PRINT.display().to_dict()).sheet == Sheet()
    panel = load_display("lkg-portrait")
    assert panel.sheet is None
    assert "sheet" not in panel.to_dict()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"bleed": -1}, "bleed is -1"),
        ({"bleed": 2.5}, "bleed is 2.5"),
        ({"margin": True}, "margin is True"),
        ({"mirrored": 1}, "mirrored is 1"),
        ({"profile": 7}, "profile is 7"),
        ({"trim": 7}, "unknown key 'trim'"),
        ({"bleed": 200}, "bleed and margin take 400 of 394 pixels"),
    ],
)
def test_values_that_make_no_sense_are_refused(change, said):
    values = PRINT.display().to_dict()
    values["sheet"] = values["sheet"] | change
    with pytest.raises(DisplayError, match=said):
        Display.from_dict(values)


def test_what_has_no_bleed():
    with pytest.raises(DisplayError, match="prints have upright cylindrical lenses"):
        replace(load_display("panel-4k"), sheet=Sheet())
    with pytest.raises(UsageError, match="bleed: does not apply to the display seed-lenticular"):
        with_bleed(load_display("seed-lenticular"), 3)
    with pytest.raises(UsageError, match="a bleed or a margin already"):
        with_bleed(with_bleed(PRINT.display(), 3), 3)
    for length in (-1, 101, math.nan, math.inf):
        with pytest.raises(UsageError, match="it must be 0 to 100 mm"):
            with_bleed(PRINT.display(), length)
