"""Charts: round axes that hold their values, marks in their places, gaps in lines."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.reproduce import charts
from lippmann.reproduce.charts import Axis, Line, Mark


@settings(deadline=None, max_examples=60)
@given(values=st.lists(st.floats(-1e4, 1e4) | st.just(math.inf), min_size=1, max_size=20))
def test_axes_hold_their_values_between_few_round_ticks(values):
    axis = Axis.around(values, "x")
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = axis.ends
    slack = 1e-6 * (high - low)
    assert low - slack <= min(finite)
    assert max(finite) <= high + slack
    assert 2 <= len(axis.ticks) <= 9
    steps = np.diff(axis.ticks)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-6)
    digit = steps[0] / 10 ** math.floor(math.log10(steps[0]) + 1e-6)
    assert min(abs(digit - round_digit) for round_digit in (1, 2, 5, 10)) < 1e-4


def test_an_axis_may_begin_where_it_must():
    axis = Axis.around([30.0, 103.0], "x", " %", low=0)
    assert axis.ends == (0, 150)
    assert axis.labels == ["0 %", "50 %", "100 %", "150 %"]


def test_zero_has_no_sign():
    assert Axis([-0.0, 1e-17], "x").labels == ["0", "0"]


def drawn(markup):
    return ElementTree.fromstring(markup)


def of_class(picture, class_):
    return [group for group in picture.iter("g") if group.get("class", "").split()[:1] == [class_]]


def numbers(path):
    """Corners of a path: (letter, x, y)."""
    return [(letter, float(x), float(y)) for letter, x, y in re.findall(r"([ML]) (\S+) (\S+)", path)]


def test_marks_lie_where_their_numbers_say():
    x = y = Axis([0, 25, 50, 75, 100], "share")
    picture = drawn(
        charts.scatter([Mark(0, 0, "circle", "a", "low"), Mark(100, 100, "circle", "b", "high")], x, y, title="t")
    )
    low, high = of_class(picture, "mark")
    assert (low.get("class"), high.get("class")) == ("mark a", "mark b")
    assert (low[0].tag, low[0].text, high[0].text) == ("title", "low", "high")
    places = [tuple(float(mark.find(".//use").get(key)) for key in "xy") for mark in (low, high)]
    assert places == [(charts.LEFT, charts.HEIGHT - charts.BOTTOM), (charts.WIDTH - charts.RIGHT, charts.TOP)]
    assert (picture[0].tag, picture[0].text) == ("title", "t")


def test_numbers_and_titles_stay_text_at_the_ends_of_the_grid():
    x, y = Axis([0, 50, 100], "x & more", " %"), Axis([30, 35, 40], "y")
    picture = drawn(charts.scatter([], x, y, title="t"))
    texts = {text.text: text for text in picture.iter("text")}
    assert set(texts) == {"0 %", "50 %", "100 %", "30", "35", "40", "x & more", "y"}
    assert [texts[name].get("text-anchor") for name in ("50 %", "35", "x & more", "y")] == [
        "middle",
        "end",
        "end",
        "start",
    ]
    assert float(texts["50 %"].get("x")) == (charts.LEFT + charts.WIDTH - charts.RIGHT) / 2
    heights = {
        y for group in of_class(picture, "grid") for path in group.findall("path") for *_, y in numbers(path.get("d"))
    }
    assert heights == {charts.TOP, (charts.TOP + charts.HEIGHT - charts.BOTTOM) / 2, charts.HEIGHT - charts.BOTTOM}


def test_looks_come_from_the_style_sheet_alone():
    chart = charts.scatter([Mark(1, 2, "square", "a", "m")], *2 * [Axis([0, 5], "x")], title="t")
    assert not re.search("style|font|http|#[0-9a-f]{6}\\b", chart)


@pytest.mark.parametrize("shape", ["circle", "square", "triangle", "line"])
def test_every_shape_has_its_entry_in_the_key(shape):
    entry = drawn(charts.key([(shape, "a", "one & two")])).find("li")
    (sign,) = of_class(entry, "series" if shape == "line" else "mark")
    assert sign.find(".//path").get("d")
    assert "".join(entry.itertext()).strip() == "one & two"
    assert entry.find("svg").get("aria-hidden") == "true"


def test_shapes_differ():
    signs = (drawn(charts.key([(shape, "a", "x")])).find(".//path") for shape in ("circle", "square", "triangle"))
    assert len({sign.get("d") for sign in signs}) == 3


def test_lines_break_at_values_that_are_not_finite():
    points = [(0, 30.0), (1, math.inf), (2, 31.0), (3, 32.0), (4, math.nan)]
    x, y = Axis([0, 1, 2, 3, 4], "x"), Axis([30, 31, 32, 33, 34], "y")
    picture = drawn(charts.lines([Line(points, "a", "psnr")], x, y, title="t", level=33))
    (series,), (dashed,) = of_class(picture, "series"), of_class(picture, "diagonal")
    assert series.find("title").text == "psnr"
    corners = numbers(series.find("path").get("d"))
    assert [letter for letter, *_ in corners] == ["M", "L", "M", "L", "L"]
    assert corners[0][1:] == corners[1][1:] == (charts.LEFT, charts.HEIGHT - charts.BOTTOM)  # shows by its round ends
    (_, left, one), (_, right, other) = numbers(dashed.find("path").get("d"))
    assert (left, right) == (charts.LEFT, charts.WIDTH - charts.RIGHT)
    assert one == other == charts.TOP + (charts.HEIGHT - charts.TOP - charts.BOTTOM) / 4


def test_a_level_outside_the_chart_is_not_drawn():
    x, y = Axis([0, 4], "x"), Axis([30, 34], "y")
    assert not of_class(drawn(charts.lines([], x, y, title="t", level=29.0)), "diagonal")
