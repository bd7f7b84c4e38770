"""Native test patterns of a slanted monitor, as functions of the lens phase of each sub-pixel.

Everything follows from one number per sub-pixel, its phase (:mod:`lippmann.display.formats.monitor`). The sub-pixel c
(0 R, 1 G, 2 B) of the pixel in column i and row j (row 0 on top) of a panel of W x H pixels, whose place in its pixel
is (right_c, down_c) in pixels, (-1/3, 0), (0, 0), (1/3, 0) for a plain RGB stripe, has ::

    A = (pitch / DPI) cos(atan(1 / slope))    lenses per pixel to the right; slope infinite: A = pitch / DPI
    B = A / slope                             lenses per pixel upwards;      slope infinite: B = 0
    u = i + 1/2 + right_c                     pixels from the left edge
    w = H - j - 1/2 - down_c                  pixels from the lower edge
    phase = u A + w B - center
    f = phase - floor(phase)                  place under the lens: 0 its left edge, 1 its right edge
    v = 1 - f                                 view: 0 seen from the leftmost place, 1 from the rightmost

In a shader take the phase in two parts, or in double precision: it counts up to some thousand lenses, and a hundredth
of a lens must be left. All values are 0 or 1, so that no tone curve matters.

``stripes``: N views, number k = min(floor(v N), N - 1). View k has the colour COLORS[k mod 6], of which the sub-pixel
shows its own component. At the right values an eye sees the whole panel in one colour, which changes everywhere at
once as it moves; stripes that stand on the panel, and wander as the eye moves, tell of a wrong pitch (upright ones) or
slope (lying or slanted ones).

``pitch``, ``slope``, ``center``: n fields, k = 0 ... n - 1, each with values of its own. Rows or columns of pixels are
shared out as floor(k S / n) <= row (column) < floor((k + 1) S / n), S being H or W; s = k - (n - 1)/2. The sub-pixel is
lit, white, where |f - 1/2| < LIT, which is 1/4 for pitch and slope (the half of each lens that the middle of the
viewing place sees) and 1/12 for center. The field whose middle is the place (u0, w0), in pixels as u and w are, has
with the values A, B and center given ::

    pitch:  fields from top to bottom   A_k = A (pitch + s step) / pitch, B_k = A_k / slope
    slope:  fields from left to right   1 / slope_k = 1 / slope + s step; A_k, B_k by slope_k
    center: fields from top to bottom   center_k = center + s step, A and B as given
    phase = u0 A + w0 B - center + (u - u0) A_k + (w - w0) B_k      (center: phase = u A + w B - center_k)

So changed values turn the phase about the field's own middle. Of pitch and slope the field that is evenly lit, or
evenly dark, from end to end has the right value; the others show bars, the more the farther off they are. Of center,
once pitch and slope are right, it is the field that an eye in the middle of the viewing place sees lit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.display.formats.monitor import Monitor
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import LippmannError, UsageError

FloatArray = NDArray[np.float32]
Real = NDArray[np.float64]
Name = Literal["stripes", "pitch", "slope", "center"]
NAMES: tuple[Name, ...] = get_args(Name)

#: Colours of the views of ``stripes``, over and over.
COLORS = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1), (1, 1, 0))

#: Views of ``stripes``: more than are kept apart by any lens, and at least two to see a change.
VIEWS = (2, 100)

FIELDS = (1, 99)

#: How far from the lens's middle light is lit, in lenses.
LIT: dict[Name, float] = {"pitch": 1 / 4, "slope": 1 / 4, "center": 1 / 12}


@dataclass(frozen=True)
class Field:
    """A part of the panel with values of its own, and the value in question, as ``text`` for a label."""

    window: PixelWindow
    monitor: Monitor
    value: float
    text: str


@dataclass(frozen=True)
class Pattern:
    """Which pattern to draw.

    Parameters
    ----------
    name:
        ``stripes``, ``pitch``, ``slope`` or ``center``.
    views:
        Views of ``stripes``, 2 to 100.
    fields:
        Fields of the others, 1 to 99.
    step:
        From field to field: of ``pitch`` in lenses per inch, of ``slope`` in 1 / slope, of ``center`` in lenses. None
        chooses: neighbouring fields of ``pitch`` and ``slope`` differ by up to half a lens from end to end, those of
        ``center`` share a lens evenly.

    Raises
    ------
    UsageError
        If a value is out of range.
    """

    name: Name
    views: int = 3
    fields: int = 11
    step: float | None = None

    def __post_init__(self) -> None:
        if self.name not in NAMES:
            raise UsageError(f"the pattern {self.name!r} is not known", rule=f"known are {', '.join(NAMES)}")
        for what, count, (least, most) in (("views", self.views, VIEWS), ("fields", self.fields, FIELDS)):
            if not least <= count <= most:
                raise UsageError(f"{count} {what} will not do", rule=f"it must be {least} to {most}")
        if self.step is not None and not (math.isfinite(self.step) and self.step > 0):
            raise UsageError(f"the step {self.step:g} will not do", rule="it must be a number above zero")


def whole(monitor: Monitor) -> PixelWindow:
    """The window that is the whole panel."""
    return PixelWindow(0, 0, monitor.panel.width, monitor.panel.height)


def draw(pattern: Pattern, monitor: Monitor, window: PixelWindow | None = None) -> FloatArray:
    """The pattern in a window of the panel, by default all of it.

    Returns
    -------
    ``(height, width, 3)`` float32, 0 or 1; the same pixels whatever the window they are drawn in.

    Raises
    ------
    UsageError
        If ``pattern`` has fields whose values no monitor can have, or more of them than the panel has pixels.
    """
    window = whole(monitor) if window is None else window
    pixels = np.zeros((*window.shape, 3), dtype=np.float32)
    if pattern.name == "stripes":
        for channel in range(3):
            view = view_of_phase(_phase(monitor, window, channel), pattern.views)
            pixels[..., channel] = np.array([color[channel] for color in COLORS])[view % len(COLORS)]
        return pixels
    for field in fields(pattern, monitor):
        part = field.window.intersection(window)
        if part is None:
            continue
        rows, columns = part.relative_to(window).slices
        for channel in range(3):
            place = _phase(field.monitor, part, channel) % 1.0
            pixels[rows, columns, channel] = np.abs(place - 0.5) < LIT[pattern.name]
    return pixels


def view_of_phase(phase: Real, views: int) -> NDArray[np.intp]:
    """Which of ``views`` views sub-pixels show: 0 is seen from the leftmost place."""
    return np.minimum(((1.0 - phase % 1.0) * views).astype(np.intp), views - 1)


def fields(pattern: Pattern, monitor: Monitor) -> list[Field]:
    """The fields of ``pitch``, ``slope`` or ``center`` with their monitors, from the top or from the left.

    Raises
    ------
    UsageError
        As :func:`draw`.
    """
    panel = monitor.panel
    is_lying = pattern.name != "slope"
    extent = panel.height if is_lying else panel.width
    count = pattern.fields
    if count > extent:
        raise UsageError(f"{count} fields will not do", rule=f"the panel has only {extent} pixels that way")
    step = step_of(pattern, monitor)
    made = []
    for number in range(count):
        first, last = number * extent // count, (number + 1) * extent // count
        size = last - first
        window = PixelWindow(0, first, panel.width, size) if is_lying else PixelWindow(first, 0, size, panel.height)
        made.append(_field(pattern.name, monitor, window, (number - (count - 1) / 2) * step))
    return made


def step_of(pattern: Pattern, monitor: Monitor) -> float:
    """The step between fields; where none is given one of 1, 2 or 5 times a power of ten, but for ``center``."""
    panel = monitor.panel
    if pattern.step is not None:
        return pattern.step
    if pattern.name == "center":
        return 1 / pattern.fields
    if pattern.name == "pitch":
        return rounded(0.5 * monitor.pitch / (panel.width * monitor.lenses_right))
    return rounded(0.5 / (panel.height * monitor.lenses_right))


def _field(name: Name, monitor: Monitor, window: PixelWindow, change: float) -> Field:
    try:
        if name == "center":
            center = (monitor.center + change) % 1.0
            return Field(window, replace(monitor, center=center), center, f"{center:.3f}")
        if name == "pitch":
            changed = replace(monitor, pitch=monitor.pitch + change)
            value, text = changed.pitch, f"{changed.pitch:.4f}"
        else:
            lean = 1 / monitor.slope + change
            changed = replace(monitor, slope=1 / lean if abs(lean) > 1e-12 else math.inf)
            value, text = changed.slope, f"{changed.slope:.4f}"
    except LippmannError as error:
        fix = "take a smaller step or fewer fields"
        raise UsageError(f"a field would have another value: {error.what}", rule=error.rule, fix=fix) from None
    # The phase stays as it was in the middle of the field.
    u, w = window.left + window.width / 2, monitor.panel.height - window.top - window.height / 2
    turned = u * (changed.lenses_right - monitor.lenses_right) + w * (changed.lenses_up - monitor.lenses_up)
    return Field(window, replace(changed, center=monitor.center + turned), value, text)


def _phase(monitor: Monitor, window: PixelWindow, channel: int) -> Real:
    columns = np.arange(window.left, window.right, dtype=np.float64)
    rows = np.arange(window.top, window.bottom, dtype=np.float64)
    return monitor.phase(*np.meshgrid(columns, rows), channel)


def rounded(step: float) -> float:
    """The nearest below of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(step))
    return max(part * power for part in (1, 2, 5) if part * power <= step * (1 + 1e-9))
