"""Charts: marks, lines with gaps, words that stay text."""

from __future__ import annotations

import base64
import math
import re

import pytest

from lippmann.reproduce.charts import Series, chart


def drawn(*series, **options):
    """The SVG of a chart."""
    markup = chart(series, ("x & more", "y"), title="t", **options)
    return base64.b64decode(re.search(r"base64,([^\"]+)", markup)[1]).decode()


def test_titles_and_names_of_series_stay_text():
    words = re.findall(r"<text[^>]*>([^<]*)</text>", drawn(Series([(0, 1), (1, 2)], "o", "red", "one <two>")))
    assert {"x &amp; more", "y", "one &lt;two&gt;"} <= set(words)


@pytest.mark.parametrize("gap", [math.inf, math.nan])
def test_lines_break_at_values_that_are_not_finite(gap):
    points = [(0, 30.0), (1, 31.0), (2, gap), (3, 31.0), (4, 32.0)]
    (path,) = re.findall(r'<path d="([^"]+)"[^>]*stroke: #123456', drawn(Series(points, "-", "#123456", "psnr")))[:1]
    assert re.findall("[ML]", path) == ["M", "L", "M", "L"]


def test_a_dashed_line_is_drawn_where_it_is_asked_for():
    line = Series([(0, 1), (1, 2)], "-", "red", "one")
    assert "stroke-dasharray: 5.55" in drawn(line, dashed=[(0, 1.5), (1, 1.5)])
    assert "stroke-dasharray: 5.55" not in drawn(line)
