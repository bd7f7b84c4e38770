"""Two charts as inline SVG, drawn by Matplotlib: rays against time, and PSNR from lens to lens.

Colours and fonts come from the page's style sheet by class names, so that the charts follow light and dark. Every mark
carries its numbers as a ``<title>``, which browsers show on hovering and screen readers read.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from markupsafe import Markup

from lippmann.reproduce.html import element
from lippmann.runtime.plotting import import_matplotlib, plain_matplotlib

if TYPE_CHECKING:
    from matplotlib.artist import Artist

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 68, 28, 40, 60

#: Matplotlib's names of the shapes of marks, and their sizes in pixels.
_MARKERS = {"circle": ("o", 10), "square": ("s", 10), "triangle": ("^", 12)}

#: Width and height in pixels of a sign in a key.
_SIGN = 16

#: Size in pixels that text is placed by; the style sheet sets it.
_FONT = 13

_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"


@dataclass(frozen=True)
class Axis:
    """A linear axis from the first of its ``ticks`` to the last; ``unit`` follows every number."""

    ticks: Sequence[float]
    title: str
    unit: str = ""

    @staticmethod
    def around(values: Sequence[float], title: str, unit: str = "", *, low: float | None = None) -> Axis:
        """An axis between round numbers that holds all finite ``values``; with ``low`` it holds that, too."""
        import_matplotlib()
        from matplotlib.ticker import MaxNLocator

        finite = [value for value in values if math.isfinite(value)] or [0.0, 1.0]
        least, most = min(finite) if low is None else low, max(finite)
        ticks = MaxNLocator(nbins=5, steps=[1, 2, 5, 10]).tick_values(least, max(most, least + 0.1))
        return Axis([float(tick) for tick in ticks], title, unit)

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the largest value."""
        return self.ticks[0], self.ticks[-1]

    @property
    def labels(self) -> list[str]:
        """The ticks in words."""
        return [f"{round(tick, 9) + 0.0:.10g}{self.unit}" for tick in self.ticks]


@dataclass(frozen=True)
class Mark:
    """A point of a chart; ``class_`` gives the colour, ``shape`` is circle, square or triangle."""

    x: float
    y: float
    shape: str
    class_: str
    title: str


@dataclass(frozen=True)
class Line:
    """A line through ``points``; it is broken where y is not finite, and ``title`` names it."""

    points: Sequence[tuple[float, float]]
    class_: str
    title: str


def scatter(marks: Sequence[Mark], x: Axis, y: Axis, *, title: str) -> Markup:
    """Marks over a grid, with the diagonal on which y equals x."""
    with plain_matplotlib(salt=title):
        drawing = _chart(x, y)
        end = min(x.ends[1], y.ends[1])
        drawing.add_line([0, end], [0, end], "diagonal")
        for mark in marks:
            drawing.add_mark(mark)
        return drawing.svg(element("title", title), class_="chart", role="img")


def lines(series: Sequence[Line], x: Axis, y: Axis, *, title: str, level: float | None = None) -> Markup:
    """Lines over a grid, with a dashed one at the height ``level``."""
    with plain_matplotlib(salt=title):
        drawing = _chart(x, y)
        if level is not None and y.ends[0] <= level <= y.ends[1]:
            drawing.add_line(x.ends, [level, level], "diagonal")
        for line in series:
            drawing.add_line(*_broken(line.points), f"series {line.class_}", line.title)
        return drawing.svg(element("title", title), class_="chart", role="img")


def key(entries: Sequence[tuple[str, str, str]]) -> Markup:
    """The legend of a chart: (shape, class, text) of each entry; the shape may also be ``line``."""
    return element("ul", *(element("li", _sign(shape, class_), text) for shape, class_, text in entries), class_="key")


def _sign(shape: str, class_: str) -> Markup:
    with plain_matplotlib(salt=f"{shape} {class_}"):
        drawing = _Drawing((_SIGN, _SIGN), (0, 0, 1, 1))
        if shape == "line":
            drawing.add_line([0, 1], [0.5, 0.5], f"series {class_}")
        else:
            drawing.add_mark(Mark(0.5, 0.5, shape, class_, ""))
        return drawing.svg(width=_SIGN, height=_SIGN, aria_hidden="true")


def _chart(x: Axis, y: Axis) -> _Drawing:
    """A drawing with the axes' grid, numbers and titles."""
    place = LEFT / WIDTH, BOTTOM / HEIGHT, (WIDTH - LEFT - RIGHT) / WIDTH, (HEIGHT - TOP - BOTTOM) / HEIGHT
    drawing = _Drawing((WIDTH, HEIGHT), place)
    axes, figure = drawing.axes, drawing.figure
    axes.set(xlim=x.ends, ylim=y.ends)
    drawing.name(axes.hlines(y.ticks, *x.ends, clip_on=False), "grid")
    axes.set_xticks(x.ticks, x.labels, fontsize=_FONT)
    axes.set_yticks(y.ticks, y.labels, fontsize=_FONT)
    axes.tick_params("x", length=4, pad=8)
    axes.tick_params("y", length=0, pad=8)
    for tick in axes.xaxis.get_major_ticks():
        drawing.name(tick.tick1line, "grid")
    # Lettering grows on narrow screens, so a turned title beside the numbers would run into them.
    figure.text(1 - RIGHT / WIDTH, 8 / HEIGHT, x.title, ha="right", fontsize=_FONT)
    figure.text(0, 1 - 18 / HEIGHT, y.title, fontsize=_FONT)
    return drawing


def _broken(points: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    """Coordinates of a line, NaN at gaps. The first point of each piece comes twice: alone it would not show."""
    xs: list[float] = []
    ys: list[float] = []
    joined = False
    for x, y in points:
        finite = math.isfinite(y)
        for _ in range(2 if finite and not joined else 1):
            xs.append(x)
            ys.append(y if finite else math.nan)
        joined = finite
    return xs, ys


class _Drawing:
    """A figure with one pair of axes, from 0 to 1 at first; classes and titles of its parts are those of the page.

    Parameters
    ----------
    size:
        Width and height in pixels.
    place:
        Left, bottom, width and height of the axes, as fractions of the figure.
    """

    def __init__(self, size: tuple[int, int], place: tuple[float, float, float, float]) -> None:
        from matplotlib.figure import Figure

        self._size = size
        self._names: dict[str, tuple[str, str]] = {}
        # At 72 dots per inch Matplotlib's points are pixels.
        self.figure = Figure(figsize=(size[0] / 72, size[1] / 72), dpi=72, frameon=False)
        self.axes = self.figure.add_axes(place, frameon=False, xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])

    def name(self, artist: Artist, class_: str, title: str = "") -> None:
        """Give a part its class and the words that are shown on hovering."""
        identifier = f"part-{len(self._names)}"
        artist.set_gid(identifier)
        self._names[identifier] = class_, title

    def add_line(self, xs: Sequence[float], ys: Sequence[float], class_: str, title: str = "") -> None:
        """Draw a line."""
        (line,) = self.axes.plot(xs, ys, clip_on=False)
        self.name(line, class_, title)

    def add_mark(self, mark: Mark) -> None:
        """Draw a mark."""
        marker, size = _MARKERS[mark.shape]
        (line,) = self.axes.plot(mark.x, mark.y, marker=marker, markersize=size, linestyle="none", clip_on=False)
        self.name(line, f"mark {mark.class_}", mark.title)

    def svg(self, *inside: Markup, **attributes: object) -> Markup:
        """The drawing as an element of the page, which holds ``inside`` first."""
        written = io.BytesIO()
        self.figure.savefig(written, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
        root = ElementTree.fromstring(written.getvalue())
        for part in root.iter():
            self._adopt(part)
        groups = (Markup(ElementTree.tostring(part, "unicode", short_empty_elements=False)) for part in root.iter("g"))
        width, height = self._size
        return element("svg", *inside, next(groups), viewBox=f"0 0 {width} {height}", **attributes)

    def _adopt(self, part: ElementTree.Element) -> None:
        """Make an element of Matplotlib's one of the page: its looks come from the style sheet, links stay in it."""
        part.tag = part.tag.removeprefix(_SVG)
        style = part.attrib.pop("style", "")
        if anchor := re.search("text-anchor: (start|middle|end)", style):
            part.set("text-anchor", anchor[1])
        if target := part.attrib.pop(f"{_XLINK}href", ""):
            part.set("href", target)
        if part.tag == "g":
            class_, title = self._names.get(part.attrib.pop("id", ""), ("", ""))
            if class_:
                part.set("class", class_)
            if title:
                words = ElementTree.Element(f"{_SVG}title")
                words.text = title
                part.insert(0, words)
