"""The pitch test: what its strips look like under the sheet, and what is drawn where."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.calibration.pitch_strips import PitchTest
from lippmann.display.formats.print_sheet import Print
from lippmann.display.panel import PixelWindow
from lippmann.errors import UsageError
from lippmann.image import IntegralImage
from lippmann.viewing.replay import replay

SHEET = Print(ppi=360, size=(60, 40), lpi=20, viewing_distance=400)


def whole(test):
    return test.draw(PixelWindow(0, 0, *test.sheet.pixels))


def under_the_sheet(test, lpi=None, distance=400.0, shift=0.0):
    """The test as an eye sees it through a sheet of ``lpi`` lenses per inch, ``shift`` lenses to the right."""
    sheet = test.sheet if lpi is None else replace(test.sheet, lpi=lpi)
    display = sheet.display()
    pitch = display.lens_array.pitch
    display = replace(display, lens_array=replace(display.lens_array, offset=(shift * pitch, 0.0)))
    pixels = np.repeat(whole(test)[..., None] / np.float32(255), 3, axis=2)
    return replay(IntegralImage(pixels, display), (0.0, 0.0, distance), size=test.sheet.pixels)[..., 0]


def darkness(test, seen):
    """How much of each strip is dark, beyond its label and away from its rim."""
    shares = []
    for strip in test.all_strips:
        part = strip.window
        shares.append(
            1 - seen[part.top + 2 : part.bottom - 4, part.left + round(0.4 * part.width) : part.right - 20].mean()
        )
    return np.array(shares)


def test_the_strip_with_the_sheets_print_pitch_is_dark_and_the_others_show_bars():
    test = PitchTest(SHEET, strips=9, step=0.25)
    right = test.all_strips[4]
    assert abs(right.lpi - SHEET.pitch_on_print) < 0.25 / 2
    test = replace(test, sheet=replace(SHEET, lpi=20 * right.lpi / SHEET.pitch_on_print))  # exactly on a strip
    assert test.sheet.pitch_on_print == pytest.approx(right.lpi, rel=1e-4)
    dark = darkness(test, under_the_sheet(test))
    assert dark[4] > 0.99
    assert max(*dark[:3], *dark[6:]) < 0.8
    # Half a lens further the same strip is bright from end to end: all changes at once.
    bright = darkness(test, under_the_sheet(test, shift=0.5))
    assert bright[4] < 0.01
    assert min(*bright[:3], *bright[6:]) > 0.2


def test_another_sheet_has_another_strip():
    test = PitchTest(SHEET, strips=9, step=0.25)
    wanted = test.all_strips[7].lpi
    lpi = wanted * (1 + SHEET.gap / 400)
    dark = darkness(test, under_the_sheet(test, lpi=lpi))
    assert dark[7] > 0.99
    assert max(dark[:6]) < 0.8


def test_from_farther_away_another_strip_is_right():
    """The print pitch belongs to a distance: lpi D / (D + g)."""
    test = PitchTest(replace(SHEET, viewing_distance=60), strips=33, step=0.05)
    middles = []
    for distance in (60.0, 100_000.0):
        # Strips less than a quarter of a lens off, on either side, are dark too for an eye in the middle.
        is_dark = darkness(test, under_the_sheet(test, distance=distance)) > 0.99
        middles.append(np.mean([strip.lpi for strip, dark in zip(test.all_strips, is_dark, strict=True) if dark]))
    assert middles[0] == pytest.approx(SHEET.lpi / (1 + test.sheet.gap / 60), abs=0.06)
    assert middles[1] == pytest.approx(20, abs=0.06)


def test_every_pixel_is_black_or_white():
    assert set(np.unique(whole(PitchTest(SHEET)))) == {0, 255}


def test_strips_have_the_pitch_that_is_written_beside_them():
    test = PitchTest(replace(SHEET, ppi=1440), strips=5, step=0.5)
    pixels = whole(test)
    width = test.sheet.pixels[0]
    for strip in test.all_strips:
        row = pixels[strip.window.top + 4, width // 3 : strip.window.right] == 0
        edges = np.flatnonzero(np.diff(row.astype(int)) == 1)
        lines = (len(edges) - 1) / (edges[-1] - edges[0]) * 1440
        assert lines == pytest.approx(strip.lpi, rel=1e-3)
        assert strip.text == f"{strip.lpi:.2f}"
        assert row.mean() == pytest.approx(0.5, abs=0.02)


@given(
    window=st.builds(PixelWindow, st.integers(0, 700), st.integers(0, 500), st.integers(1, 150), st.integers(1, 67)),
    strips=st.integers(1, 40),
)
@settings(deadline=None, max_examples=30)
def test_windows_are_cut_from_the_whole(window, strips):
    test = PitchTest(SHEET, strips=strips)
    assert test.sheet.pixels == (850, 567)
    part = whole(test)[window.top : window.top + window.height, window.left : window.left + window.width]
    np.testing.assert_array_equal(test.draw(window), part)


def test_a_poster_is_drawn_in_windows():
    test = PitchTest(Print(ppi=720, size=(1000, 1400), lpi=60))
    assert test.sheet.pixels == (28346, 39685)
    assert test.draw(PixelWindow(28000, 39000, 300, 200)).shape == (200, 300)


def test_the_middle_is_what_is_expected_in_round_numbers():
    test = PitchTest(SHEET)
    values = [strip.lpi for strip in test.all_strips]
    assert abs(values[10] - SHEET.pitch_on_print) <= test.effective_step / 2
    assert np.diff(values) == pytest.approx(test.effective_step)
    assert values[10] / test.effective_step == pytest.approx(round(values[10] / test.effective_step))
    # Neighbours differ by half a lens from end to end, or a little less.
    assert 0.2 <= test.effective_step * 60 / 25.4 <= 0.5


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"strips": 0}, "strips: 0 is out of range; it must be 1 to 199"),
        ({"strips": 200}, "strips: 200 is out of range"),
        ({"step": 0.0}, "step: 0 is out of range"),
        ({"step": math.nan}, "step: nan is out of range"),
        ({"step": 5.0}, "step: 5 is out of range; the print pitch is about 19.9"),
    ],
)
def test_nonsense_is_refused(asked, said):
    with pytest.raises(UsageError) as caught:
        PitchTest(SHEET, **asked)
    assert said in str(caught.value)


def test_strips_need_pixels():
    with pytest.raises(UsageError, match="the print is 12 pixels high within its margin"):
        PitchTest(replace(SHEET, size=(60, 1)))


def test_paper_is_left_around_the_strips():
    ink = whole(PitchTest(SHEET)) == 0
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    margin = round(0.1 * ink.shape[0])  # a tenth of 40 mm; larger prints have 5 mm
    assert rows[0] >= margin - 1
    assert rows[-1] < ink.shape[0] - margin + 1
    # The outermost lines of strips may be white.
    assert margin - 1 <= columns[0] <= margin + 12
    assert margin - 1 <= ink.shape[1] - 1 - columns[-1] <= margin + 12
    large = PitchTest(replace(SHEET, size=(200, 100)))
    assert large.inside.left == large.inside.top == round(5 * 360 / 25.4)


@pytest.mark.parametrize(("strips", "step"), [(9, 0.25), (8, 0.25), (21, 0.01), (21, None)])
def test_the_strip_next_to_the_expected_pitch_is_said(strips, step):
    test = PitchTest(SHEET, strips=strips, step=step)
    away = [abs(strip.lpi - SHEET.pitch_on_print) for strip in test.all_strips]
    assert away[test.expected] == min(away)
    widths = [label_width(test, strip) for strip in test.all_strips]
    assert int(np.argmax(widths)) == test.expected


def label_width(test, strip):
    """Columns from the left of a strip in which it differs from bare lines: those of its label."""
    pixels = whole(test)[strip.window.top : strip.window.bottom, : strip.window.right]
    bare = pixels[1]  # above the label
    differs = np.flatnonzero((pixels[: round(0.9 * len(pixels))] != bare).any(axis=0))
    return differs[-1]
