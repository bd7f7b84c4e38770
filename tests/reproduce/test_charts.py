"""Charts: round axes that hold their values, marks in their places, gaps in lines."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

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
    slack = 1e-6 * (axis.high - axis.low)
    assert axis.low - slack <= min(finite)
    assert max(finite) <= axis.high + slack
    assert 2 <= len(axis.ticks) <= 9
    digit = axis.step / 10 ** math.floor(math.log10(axis.step) + 1e-9)
    assert min(abs(digit - round_digit) for round_digit in (1, 2, 5, 10)) < 1e-6


def test_an_axis_may_begin_where_it_must():
    axis = Axis.around([30.0, 103.0], "x", low=0)
    assert (axis.low, axis.high, axis.step) == (0, 150, 50)
    assert axis.ticks == [0, 50, 100, 150]
    assert axis.part(75) == 0.5


def drawn(markup):
    return ElementTree.fromstring(markup)


def test_marks_lie_where_their_numbers_say():
    x = y = Axis(0, 100, 25, "share")
    picture = drawn(
        charts.scatter([Mark(0, 0, "circle", "a", "low"), Mark(100, 100, "circle", "b", "high")], x, y, title="t")
    )
    low, high = picture.findall("circle")
    assert low.find("title").text == "low"
    assert (float(low.get("cx")), float(low.get("cy"))) == (charts.LEFT, charts.HEIGHT - charts.BOTTOM)
    assert (float(high.get("cx")), float(high.get("cy"))) == (charts.WIDTH - charts.RIGHT, charts.TOP)
    assert picture.find("title").text == "t"


@pytest.mark.parametrize(("shape", "tag"), [("circle", "circle"), ("square", "polygon"), ("triangle", "polygon")])
def test_every_shape_has_its_entry_in_the_key(shape, tag):
    entry = drawn(charts.key([(shape, "a", "one & two")])).find("li")
    assert entry.find("svg").find(tag) is not None
    assert "".join(entry.itertext()) == "one & two"


def test_lines_break_at_values_that_are_not_finite():
    points = [(0, 30.0), (1, math.inf), (2, 31.0), (3, 32.0), (4, math.nan)]
    picture = drawn(
        charts.lines([Line(points, "a", "psnr")], Axis(0, 4, 1, "x"), Axis(30, 34, 1, "y"), title="t", level=33)
    )
    path = picture.find("path").get("d")
    assert re.findall("[MLh]", path) == ["M", "h", "M", "h", "L"]
    dashed = [line for line in picture.findall("line") if line.get("class") == "diagonal"]
    assert len(dashed) == 1
    assert dashed[0].get("y1") == dashed[0].get("y2")


def test_a_level_outside_the_chart_is_not_drawn():
    picture = drawn(charts.lines([], Axis(0, 4, 1, "x"), Axis(30, 34, 1, "y"), title="t", level=29.0))
    assert not [line for line in picture.findall("line") if line.get("class") == "diagonal"]
