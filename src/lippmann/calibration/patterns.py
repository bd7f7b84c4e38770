"""Native test patterns of a slanted monitor, as functions of the lens phase of each sub-pixel.

Patterns are functions of the phase of a sub-pixel (:mod:`lippmann.display.formats.monitor`). Let a panel have W x H
pixels. The sub-pixel c (0 R, 1 G, 2 B) of the pixel in column i and row j (row 0 on top) is offset from the pixel's
centre by (right_c, down_c) pixels: (-1/3, 0), (0, 0), (1/3, 0) for an RGB stripe. Then ::

    A = (pitch / DPI) cos(atan(1 / slope))    lenses per pixel to the right; slope infinite: A = pitch / DPI
    B = A / slope                             lenses per pixel upwards;      slope infinite: B = 0
    u = i + 1/2 + right_c                     pixels from the left edge
    w = H - j - 1/2 - down_c                  pixels from the lower edge
    phase = u A + w B - center
    f = phase - floor(phase)                  position under the lens: 0 its left edge, 1 its right edge
    v = 1 - f                                 view: 0 seen from the far left, 1 from the far right

A shader needs the phase in two parts or in double precision: it counts up to some thousand lenses and has to resolve a
hundredth of a lens. All values are 0 or 1, so that no tone curve matters.

``stripes``: N views, number k = min(floor(v N), N - 1). View k has the colour COLORS[k mod 6], of which the sub-pixel
shows its own component. With the right values an eye sees the whole panel in one colour, which changes everywhere at
once as the eye moves. Stripes on the panel that move with the eye mean a wrong pitch (vertical stripes) or slope
(horizontal or slanted stripes).

``pitch``, ``slope``, ``center``: n fields, k = 0 ... n - 1, each with values of its own; s = k - (n - 1)/2. Field k
covers the rows (or columns) from floor(k S / n) up to floor((k + 1) S / n), where S is H (or W). A sub-pixel is white
where |f - 1/2| < LIT, else black. LIT is 1/4 for pitch and slope (the half of each lens that an eye at the centre of
the viewing zone sees) and 1/12 for center. In the field with the centre (u0, w0), in the units of u and w, the given
values A, B and center become ::

    pitch:  fields from top to bottom   A_k = A (pitch + s step) / pitch, B_k = A_k / slope
    slope:  fields from left to right   1 / slope_k = 1 / slope + s step; A_k, B_k by slope_k
    center: fields from top to bottom   center_k = center + s step, A and B as given
    phase = u0 A + w0 B - center + (u - u0) A_k + (w - w0) B_k      (center: phase = u A + w B - center_k)

The phase at the centre of a field does not change. The field of pitch or slope with the right value is uniformly bright
or uniformly dark; the others show bars, the more the farther off their value is. With the right pitch and slope, the
field of center with the right value is the one that an eye at the centre of the viewing zone sees bright.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.display.formats.monitor import Monitor
from lippmann.display.panel import PixelWindow
from lippmann.errors import LippmannError, UsageError
from lippmann.options.option import checked

FloatArray = NDArray[np.float32]
Real = NDArray[np.float64]
Name = Literal["stripes", "pitch", "slope", "center"]
NAMES: tuple[Name, ...] = get_args(Name)

#: RGB of the views of ``stripes``, repeated.
COLORS = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1), (1, 1, 0))

#: Views of ``stripes``, least and most: two to see a change, more than any lens resolves.
VIEWS = (2, 100)

#: Fields of the other patterns, least and most.
FIELDS = (1, 99)

#: Half-width of the lit part of a lens, in lenses.
LIT: dict[Name, float] = {"pitch": 1 / 4, "slope": 1 / 4, "center": 1 / 12}


@dataclass(frozen=True)
class Field:
    """A field of a pattern: a part of the panel that is drawn with calibration values of its own.

    Attributes
    ----------
    window:
        The part of the panel.
    monitor:
        The monitor with the field's values.
    value:
        The field's pitch (lenses per inch), slope or centre (lenses).
    text:
        The value as written in the label.
    """

    window: PixelWindow
    monitor: Monitor
    value: float
    text: str


@dataclass(frozen=True)
class Pattern:
    """The parameters of a test pattern.

    Parameters
    ----------
    name:
        ``stripes`` (one colour per view), or ``pitch``, ``slope`` or ``center`` (one value per field).
    views:
        Number of views of ``stripes``, 2 to 100.
    fields:
        Number of fields of the other patterns, 1 to 99.
    step:
        Step between fields: lenses per inch for ``pitch``, 1 / slope for ``slope``, lenses for ``center``. None: half a
        lens or less over the panel for ``pitch`` and ``slope``; one lens divided by the number of fields for
        ``center``.

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
            raise UsageError.unknown("pattern", self.name, NAMES)
        for parameter, count, (least, most) in (("views", self.views, VIEWS), ("fields", self.fields, FIELDS)):
            if not least <= count <= most:
                raise UsageError(f"{count} is out of range", parameter=parameter, rule=f"it must be {least} to {most}")
        check_step(self.step)


def whole(monitor: Monitor) -> PixelWindow:
    """The window of the whole panel."""
    return PixelWindow(0, 0, monitor.panel.width, monitor.panel.height)


def check_step(step: float | None) -> None:
    """Raise :class:`UsageError` unless ``step`` is None or a positive finite number."""
    if step is not None and not (math.isfinite(step) and step > 0):
        raise UsageError(f"{step:g} is out of range", parameter="step", rule="it must be a positive number")


@checked
def draw(pattern: Pattern, monitor: Monitor, window: PixelWindow | None = None) -> FloatArray:
    """Draw a test pattern.

    Parameters
    ----------
    pattern:
        The pattern.
    monitor:
        The monitor with its calibration values.
    window:
        The part of the panel to draw; None for all of it. Pixels do not depend on the window.

    Returns
    -------
    ``(height, width, 3)`` float32, 0 or 1.

    Raises
    ------
    UsageError
        If a field has values that no monitor can have, or there are more fields than pixels.

    Examples
    --------
    >>> from lippmann.calibration.patterns import Pattern, draw
    >>> from lippmann.display.formats.monitor import Monitor
    >>> monitor = Monitor("tablet", lippmann.Panel(64, 48, 0.1), pitch=50.0, slope=6.0, center=0.0)
    >>> draw(Pattern("stripes", views=5), monitor).shape
    (48, 64, 3)
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
    """View of each sub-pixel by its phase under the lens (in lenses): 0 is seen from the far left."""
    return np.minimum(((1.0 - phase % 1.0) * views).astype(np.intp), views - 1)


def fields(pattern: Pattern, monitor: Monitor) -> list[Field]:
    """The fields of a pattern ``pitch`` or ``center`` (from the top) or ``slope`` (from the left).

    Raises
    ------
    UsageError
        If a field has values that no monitor can have, or there are more fields than pixels.
    """
    panel = monitor.panel
    is_horizontal = pattern.name != "slope"
    extent = panel.height if is_horizontal else panel.width
    count = pattern.fields
    if count > extent:
        raise UsageError(
            f"{count} is out of range", parameter="fields", rule=f"the panel has {extent} pixels in that direction"
        )
    step = step_of(pattern, monitor)
    result = []
    for number in range(count):
        first, last = number * extent // count, (number + 1) * extent // count
        size = last - first
        window = (
            PixelWindow(0, first, panel.width, size) if is_horizontal else PixelWindow(first, 0, size, panel.height)
        )
        result.append(_field(pattern.name, monitor, window, (number - (count - 1) / 2) * step))
    return result


def step_of(pattern: Pattern, monitor: Monitor) -> float:
    """Step between fields, in the unit of :class:`Pattern`: the given one, else the default.

    The default of ``pitch`` and ``slope`` is 1, 2 or 5 times a power of ten.
    """
    panel = monitor.panel
    if pattern.step is not None:
        return pattern.step
    if pattern.name == "center":
        return 1 / pattern.fields
    if pattern.name == "pitch":
        return round_step(0.5 * monitor.pitch / (panel.width * monitor.lenses_right))
    return round_step(0.5 / (panel.height * monitor.lenses_right))


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
        fix = "use a smaller step or fewer fields"
        raise UsageError(f"a field is out of range: {error.what}", rule=error.rule, fix=fix) from None
    # The phase in the middle of the field stays the same.
    u, w = window.left + window.width / 2, monitor.panel.height - window.top - window.height / 2
    shift = u * (changed.lenses_right - monitor.lenses_right) + w * (changed.lenses_up - monitor.lenses_up)
    return Field(window, replace(changed, center=monitor.center + shift), value, text)


def _phase(monitor: Monitor, window: PixelWindow, channel: int) -> Real:
    columns = np.arange(window.left, window.right, dtype=np.float64)
    rows = np.arange(window.top, window.bottom, dtype=np.float64)
    return monitor.phase(*np.meshgrid(columns, rows), channel)


def round_step(step: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above ``step``."""
    power = 10.0 ** math.floor(math.log10(step))
    return max(part * power for part in (1, 2, 5) if part * power <= step * (1 + 1e-9))
