"""Charts of the page, drawn by Matplotlib as SVG."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from lippmann.reproduce.html import element, figure
from lippmann.runtime.plotting import plain_matplotlib, svg_of

#: Width and height of a chart in inches.
_SIZE = (6.6, 4.2)


@dataclass(frozen=True)
class Series:
    """Points ``(x, y)`` of one kind; ``style`` is Matplotlib's, such as ``o`` for marks and ``-`` for a line."""

    points: Sequence[tuple[float, float]]
    style: str
    color: str
    label: str


def chart(
    series: Sequence[Series], axes_titles: tuple[str, str], *, title: str, dashed: Sequence[tuple[float, float]] = ()
) -> Markup:
    """Series over a grid, broken where y is not finite, with a key and a ``dashed`` line."""
    with plain_matplotlib(salt=title):
        from matplotlib.figure import Figure

        drawing = Figure(figsize=_SIZE, layout="constrained")
        axes = drawing.subplots()
        for each in series:
            axes.plot(*np.transpose(each.points), each.style, color=each.color, label=each.label)
        if dashed:
            axes.plot(*np.transpose(dashed), "--", color="0.5", zorder=1)
        axes.set(xlabel=axes_titles[0], ylabel=axes_titles[1])
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="0.9")
        drawing.legend(loc="outside upper left", ncols=2, frameon=False)
        data = base64.b64encode(svg_of(drawing).encode()).decode()
    width, height = (round(96 * side) for side in _SIZE)
    return element("div", figure(f"data:image/svg+xml;base64,{data}", (width, height), title, title), class_="chart")
