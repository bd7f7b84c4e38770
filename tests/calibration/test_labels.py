"""Words on test pictures: where they lie, and that windows of them fit together."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.calibration import Pattern, draw, fields
from lippmann.calibration.labels import label_window, paint_label
from lippmann.calibration.pattern_files import draw_labelled, pattern_picture
from lippmann.display import Panel
from lippmann.display.formats.monitor import Monitor
from lippmann.display.panel import PixelWindow

MONITOR = Monitor("small", Panel(1200, 800, 0.3), pitch=14.0, slope=-4.7, center=0.31, viewing_distance=700.0)


def painted(window, box, text="59.95"):
    pixels = np.full((window.height, window.width), 0.5)
    paint_label(pixels, window, text, box)
    return pixels


def test_a_label_lies_at_the_edge_of_its_window():
    inside = PixelWindow(100, 50, 400, 80)
    left = label_window("59.95", inside, 40)
    assert (left.left, left.height) == (100, 40)
    assert left.top == 50 + 20
    low = label_window("59.95", inside, 40, at="bottom")
    assert low.top + low.height == 50 + 80
    assert abs(low.left + low.width / 2 - 300) <= 1
    narrow = label_window("59.95", PixelWindow(0, 0, 30, 80), 40)
    assert narrow is None or narrow.width <= 30


def test_letters_fill_their_box_and_do_not_touch_its_edge():
    whole = PixelWindow(0, 0, 300, 100)
    box = label_window("59.95", whole, 80)
    pixels = painted(whole, box)
    inside = pixels[box.top : box.top + box.height, box.left : box.left + box.width]
    assert set(np.unique(inside)) == {0, 1}
    assert (np.delete(pixels, slice(box.left, box.left + box.width), axis=1) == 0.5).all()
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    assert 0.5 * box.height < rows[-1] - rows[0] < 0.8 * box.height
    assert columns[-1] - columns[0] > 0.7 * box.width
    assert min(rows[0], columns[0]) > 2
    assert max(rows[-1] - box.height, columns[-1] - box.width) < -2


def test_different_words_look_different():
    whole = PixelWindow(0, 0, 300, 100)
    box = label_window("59.95", whole, 80)
    assert (painted(whole, box, "59.95") != painted(whole, box, "59.96")).any()


def test_windows_of_a_label_fit_together():
    whole = PixelWindow(0, 0, 300, 100)
    box = label_window("59.95", whole, 80)
    every = painted(whole, box)
    for window in (
        PixelWindow(30, 20, 100, 50),
        PixelWindow(0, 0, 10, 10),
        PixelWindow(250, 70, 50, 30),
        PixelWindow(70, 0, 1, 100),
    ):
        np.testing.assert_array_equal(painted(window, box), every[window.slices])


def test_what_could_not_be_read_is_left_out():
    assert label_window("59.95", PixelWindow(0, 0, 300, 6), 6) is None
    assert (painted(PixelWindow(0, 0, 20, 20), None) == 0.5).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pitch", "slope", "center"])
def test_every_field_has_its_label_and_keeps_most_of_its_pattern(name):
    pattern = Pattern(name, fields=5)
    plain, labelled = draw(pattern, MONITOR), pattern_picture(pattern, MONITOR).pixels
    for field in fields(pattern, MONITOR):
        window = field.window
        part = np.s_[window.top : window.top + window.height, window.left : window.left + window.width]
        share = (plain[part] != labelled[part]).any(axis=2).mean()
        assert 0.01 < share < 0.3
    window = PixelWindow(13, 17, 301, 203)
    part = labelled[17:220, 13:314]
    np.testing.assert_array_equal(draw_labelled(pattern, MONITOR, window), part)


def test_the_picture_knows_its_display():
    image = pattern_picture(Pattern("stripes"), MONITOR)
    assert image.display == MONITOR.display()
    assert image.provenance.subpixels
    np.testing.assert_array_equal(image.pixels, draw(Pattern("stripes"), MONITOR))
