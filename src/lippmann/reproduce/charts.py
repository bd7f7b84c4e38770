"""Two charts as inline SVG: rays against time, and PSNR from lens to lens.

Colours and fonts come from the page's style sheet by class names, so that the charts follow light and dark. Every mark
carries its numbers as a ``<title>``, which browsers show on hovering and screen readers read.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from lippmann.reproduce.html import element, joined

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 68, 28, 40, 60

#: Radius of a mark.
_R = 5.0


@dataclass(frozen=True)
class Axis:
    """A linear axis from ``low`` to ``high`` with ticks every ``step``."""

    low: float
    high: float
    step: float
    title: str
    unit: str = ""

    @staticmethod
    def around(values: Sequence[float], title: str, unit: str = "", *, low: float | None = None) -> Axis:
        """An axis of round numbers that holds all finite ``values``; with ``low`` it begins there."""
        finite = [value for value in values if math.isfinite(value)] or [0.0, 1.0]
        least = min(finite) if low is None else low
        most = max(max(finite), least + 1e-6)
        step = _round_step((most - least) / 5)
        first = math.floor(least / step + 1e-9) * step if low is None else low
        return Axis(first, first + math.ceil((most - first) / step - 1e-9) * step, step, title, unit)

    @property
    def ticks(self) -> list[float]:
        count = round((self.high - self.low) / self.step)
        return [self.low + k * self.step for k in range(count + 1)]

    def part(self, value: float) -> float:
        """Where on the axis ``value`` lies, from 0 to 1."""
        return (value - self.low) / (self.high - self.low)


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
    end = min(x.high, y.high)
    diagonal = _line(_px(x, 0), _py(y, 0), _px(x, end), _py(y, end), "diagonal")
    drawn = [_shape(_px(x, mark.x), _py(y, mark.y), mark) for mark in marks]
    return _svg(title, *_grid(x, y), diagonal, *drawn)


def lines(drawn: Sequence[Line], x: Axis, y: Axis, *, title: str, level: float | None = None) -> Markup:
    """Lines over a grid, with a dashed one at the height ``level``."""
    parts = [*_grid(x, y)]
    if level is not None and y.low <= level <= y.high:
        parts.append(_line(_px(x, x.low), _py(y, level), _px(x, x.high), _py(y, level), "diagonal"))
    parts += [_path(line, x, y) for line in drawn]
    return _svg(title, *parts)


def key(entries: Sequence[tuple[str, str, str]]) -> Markup:
    """The legend of a chart: (shape, class, text) of each entry; the shape may also be ``line``."""
    return element("ul", *(_key_entry(*entry) for entry in entries), class_="key")


def _key_entry(shape: str, class_: str, text: str) -> Markup:
    inside = _line(0, 8, 16, 8, f"series {class_}") if shape == "line" else _shape(8, 8, Mark(0, 0, shape, class_, ""))
    sign = element("svg", inside, viewBox="0 0 16 16", width=16, height=16, aria_hidden="true")
    return element("li", sign, text)


def _svg(title: str, *inside: str) -> Markup:
    return element(
        "svg",
        element("title", title),
        *inside,
        viewBox=f"0 0 {WIDTH} {HEIGHT}",
        class_="chart",
        role="img",
    )


def _grid(x: Axis, y: Axis) -> list[Markup]:
    left, right, bottom = LEFT, WIDTH - RIGHT, HEIGHT - BOTTOM
    parts = []
    for tick in y.ticks:
        at = _py(y, tick)
        parts += [_line(left, at, right, at, "grid"), _text(left - 8, at + 4, _number(tick) + y.unit, "end")]
    for tick in x.ticks:
        at = _px(x, tick)
        parts += [_line(at, bottom, at, bottom + 4, "grid"), _text(at, bottom + 22, _number(tick) + x.unit, "middle")]
    # Lettering grows on narrow screens, so a turned title beside the numbers would run into them.
    return [*parts, _text(right, HEIGHT - 8, x.title, "end"), _text(0, 18, y.title, "start")]


def _path(line: Line, x: Axis, y: Axis) -> Markup:
    steps, joined = [], False
    for at, value in line.points:
        if not math.isfinite(value):
            joined = False
            continue
        steps.append(f"{'L' if joined else 'M'}{_px(x, at):.1f} {_py(y, value):.1f}")
        # A point between two gaps would not show without a length of its own.
        steps += [] if joined else ["h0.01"]
        joined = True
    return element("path", element("title", line.title), d="".join(steps), class_=f"series {line.class_}")


def _shape(x: float, y: float, mark: Mark) -> Markup:
    title = element("title", mark.title) if mark.title else joined()
    class_ = f"mark {mark.class_}"
    if mark.shape == "circle":
        return element("circle", title, cx=f"{x:.1f}", cy=f"{y:.1f}", r=_R, class_=class_)
    corners = {
        "square": ((-1, -1), (1, -1), (1, 1), (-1, 1)),
        "triangle": ((0, -1.2), (1.2, 0.9), (-1.2, 0.9)),
    }[mark.shape]
    points = " ".join(f"{x + dx * _R:.1f},{y + dy * _R:.1f}" for dx, dy in corners)
    return element("polygon", title, points=points, class_=class_)


def _line(x1: float, y1: float, x2: float, y2: float, class_: str) -> Markup:
    return element("line", x1=f"{x1:.1f}", y1=f"{y1:.1f}", x2=f"{x2:.1f}", y2=f"{y2:.1f}", class_=class_)


def _text(x: float, y: float, text: str, anchor: str) -> Markup:
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def _px(axis: Axis, value: float) -> float:
    return LEFT + axis.part(value) * (WIDTH - LEFT - RIGHT)


def _py(axis: Axis, value: float) -> float:
    return HEIGHT - BOTTOM - axis.part(value) * (HEIGHT - TOP - BOTTOM)


def _round_step(least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is not below ``least``."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(digit * power for digit in (1, 2, 5, 10) if digit * power >= least * (1 - 1e-9))


def _number(value: float) -> str:
    return f"{value:.10g}" if abs(value) > 1e-9 else "0"
