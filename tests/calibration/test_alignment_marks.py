"""Alignment marks: the lenses go on into the margin, and marks lie at exact places under them."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.calibration.alignment_marks import Marks
from lippmann.calibration.finish import Finish
from lippmann.display import load_display
from lippmann.display.formats.print_sheet import Print
from lippmann.display.panel import PixelWindow
from lippmann.errors import UsageError
from lippmann.image import IntegralImage
from lippmann.viewing.replay import replay

PRINT = Print(ppi=360, size=(40, 25), lpi=30, viewing_distance=400)
DISPLAY = PRINT.display()
MARKS = Marks(DISPLAY, 8.0)
M = MARKS.pixels  # 113


def picture(display=DISPLAY, seed=1):
    size = display.panel.height, display.panel.width, 3
    return IntegralImage(np.random.default_rng(seed).random(size, dtype=np.float32), display)


@cache
def whole(marks):
    panel = marks.sheet.panel
    return marks.draw(PixelWindow(0, 0, panel.width, panel.height))


@given(
    lpi=st.floats(15, 80),
    size=st.tuples(st.floats(10, 60), st.floats(5, 30)),
    margin=st.floats(3, 20),
    distance=st.sampled_from([math.inf, 300.0, 700.0]),
)
@settings(deadline=None, max_examples=40)
def test_the_lenses_lie_where_they_lay(lpi, size, margin, distance):
    display = Print(ppi=720, size=size, lpi=lpi, viewing_distance=distance).display()
    marks = Marks(display, margin)
    sheet, m = marks.sheet, marks.pixels
    rng = np.random.default_rng(2)
    u, v = rng.uniform(0, display.panel.width, 300), rng.uniform(0, display.panel.height, 300)
    before, after = display.panel_point(u, v), sheet.panel_point(u + m, v + m)
    np.testing.assert_allclose(after, before, atol=1e-9)
    (_, _, oz), direction = display.light_ray(*before)
    (_, _, oz2), direction2 = sheet.light_ray(*after)
    # Where a number of lenses is whole to a millionth, it is made whole.
    np.testing.assert_allclose(direction2, direction, atol=1e-5)
    np.testing.assert_array_equal(oz2, oz)
    columns = np.arange(sheet.panel.width)
    x, y = sheet.panel_point(columns + 0.5, np.full(columns.shape, 1.5))
    cx, _ = sheet.lens_center(*sheet.lens_of(x, y), x, y)
    away = (x - cx * sheet.magnification) / sheet.micro_image_pitch + 0.5 - marks.lens_phase(columns)
    assert np.abs(away - np.round(away)).max() < 1e-4


def test_the_picture_is_kept_and_replays_as_before():
    depth = np.full(picture().pixels.shape[:2], 3.0, dtype=np.float32)
    image = replace(picture(), maps={"depth": depth, "normal": np.stack([depth] * 3, axis=-1)})
    marked = Finish(margin=8.0).image(image)
    assert marked.display == MARKS.sheet
    for name in ("depth", "normal"):
        np.testing.assert_array_equal(marked.maps[name][M:-M, M:-M], image.maps[name])
        assert marked.maps[name].sum() == image.maps[name].sum()
    np.testing.assert_array_equal(marked.pixels[M:-M, M:-M], image.pixels)
    assert marked.display.sheet.margin == M
    panel = DISPLAY.panel
    for eye in ((0.0, 0.0, 400.0), (55.0, -20.0, 500.0)):
        seen = replay(marked, eye, size=(panel.width + 2 * M, panel.height + 2 * M))[M:-M, M:-M]
        alone = replay(image, eye, size=(panel.width, panel.height))
        # At the edges of the picture lenses show what lies next to it, now the margin.
        rim = 30
        np.testing.assert_array_equal(seen[rim:-rim, rim:-rim], alone[rim:-rim, rim:-rim])


def test_the_strips_are_dark_in_the_middle_and_bright_from_the_edge_of_the_field():
    marked = Finish(margin=8.0).image(picture())
    size = marked.display.panel.width, marked.display.panel.height
    edge = 400 * math.tan(math.radians(marked.display.field_of_view / 2))
    strips = [np.s_[round(0.55 * M) : round(0.85 * M), M + 20 : -M - 20]]
    strips.append(np.s_[-round(0.85 * M) : -round(0.55 * M), M + 20 : -M - 20])
    for x, dark in ((0.0, 1.0), (0.9 * edge, 0.0), (-0.9 * edge, 0.0)):
        seen = replay(marked, (x, 0.0, 400.0), size=size)
        for strip in strips:
            assert 1 - seen[strip].mean() == pytest.approx(dark, abs=0.01)


def test_a_turned_sheet_shows_bars_and_a_shifted_one_changes_all():
    marked = Finish(margin=8.0).image(picture())
    size = marked.display.panel.width, marked.display.panel.height
    strip = np.s_[round(0.55 * M) : round(0.85 * M), M + 20 : -M - 20]
    sheet = marked.display
    x, y = sheet.lens_array.offset
    for lens_array, expected in (
        (replace(sheet.lens_array, offset=(x + sheet.lens_array.pitch / 2, y)), (0.0, 0.01)),
        (replace(sheet.lens_array, pitch=sheet.lens_array.pitch * 1.03), (0.2, 0.8)),
    ):
        moved = replace(marked, display=replace(sheet, lens_array=lens_array))
        dark = 1 - replay(moved, (0.0, 0.0, 400.0), size=size)[strip].mean()
        assert expected[0] <= dark <= expected[1]


def test_upright_arms_lie_on_the_middle_of_a_lens():
    ink = whole(MARKS) == 0
    line = round(0.1 / (25.4 / 360))
    for x in (M / 2, ink.shape[1] - M / 2):
        # The outer end of the upper arm, beyond the ring.
        row = round(M / 2 - 0.27 * M)
        columns = np.flatnonzero(ink[row, round(x - 0.3 * M) : round(x + 0.3 * M)]) + round(x - 0.3 * M)
        assert len(columns) in (line, line + 1)
        places = MARKS.lens_phase(columns.astype(float))
        pixels_per_lens = 360 / PRINT.pitch_on_print
        assert np.abs(places - 0.5).max() * pixels_per_lens <= line / 2
        assert abs(columns.mean() + 0.5 - x) <= pixels_per_lens / 2 + 1


def test_cutting_lines_begin_where_the_picture_ends():
    ink = whole(MARKS) == 0
    height, width = ink.shape
    line = np.flatnonzero(ink[2, : M + 5])
    assert line.tolist() == [M - 1]
    assert np.flatnonzero(ink[2, -M - 5 :]).tolist() == [5]
    assert np.flatnonzero(ink[: M + 5, 2]).tolist() == [M - 1]
    assert np.flatnonzero(ink[-M - 5 :, width - 3]).tolist() == [5]
    assert not ink[M : height - M, M : width - M].any()


@pytest.mark.slow
@given(window=st.builds(PixelWindow, st.integers(0, 700), st.integers(0, 500), st.integers(1, 90), st.integers(1, 80)))
@settings(deadline=None, max_examples=40)
def test_windows_are_cut_from_the_whole(window):
    every = whole(MARKS)
    part = every[window.top : window.top + window.height, window.left : window.left + window.width]
    np.testing.assert_array_equal(MARKS.draw(window), part)


def test_a_poster_s_margin_is_drawn_in_windows():
    marks = Marks(Print(ppi=720, size=(1000, 700), lpi=60).display(), 12.0)
    panel = marks.sheet.panel
    assert marks.draw(PixelWindow(panel.width - 200, panel.height - 100, 200, 100)).shape == (100, 200)


def test_the_words_say_what_to_check():
    assert MARKS.caption() == "30 lpi, printed at 29.9377 lpi, 360 ppi, seen from 400 mm"
    far = Marks(replace(DISPLAY, viewing_distance=math.inf), 8.0)
    assert far.caption() == "30 lpi, printed at 30 lpi, 360 ppi, seen from afar"
    below = np.s_[round(MARKS.sheet.panel.height - 0.4 * M) :, M + 5 : -M - 5]
    assert (whole(MARKS)[below] == 0).sum() > 200


@pytest.mark.parametrize("margin", [0.0, -5.0, 2.9, 101.0, math.nan])
def test_impossible_margins_are_refused(margin):
    with pytest.raises(UsageError, match="it must be 3 to 100 mm"):
        Marks(DISPLAY, margin)


@pytest.mark.parametrize(("name", "said"), [("mla-square", "square lenses"), ("panel-4k", "slanted lenses")])
def test_other_lenses_are_refused(name, said):
    with pytest.raises(UsageError, match=said):
        Marks(load_display(name), 8.0)
