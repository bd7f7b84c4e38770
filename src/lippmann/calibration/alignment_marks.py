"""Alignment marks for laying a lens sheet on a print: a margin around the picture with marks aligned to the lenses.

The lenses continue into the margin: the marked sheet is a display of its own, with its lenses at the same positions
over the picture. Let ``f`` be the phase of a pixel's centre under its lens, 0 to 1, and m the width of the margin. The
marks are:

- Alignment strips above and below the picture, 0.1 m to 0.5 m from it, over its whole width: ink where
  |f - 1/2| < 1/4. Under an aligned sheet they look uniformly dark to an eye at the centre of the viewing zone. Bars
  mean a rotated sheet; an equal change of both strips means a shifted one.
- A cross in a ring in each corner, and left and right at half height. Its upright arm is centred on a lens.
- Cutting lines at the corners of the finished print, in the margin from 0.6 m outwards, just outside the trim: where
  the picture has a bleed, they point at lines within it.
- Text: the print's parameters outside the lower strip, ``TOP`` outside the upper one.

The picture is what the sheet shows, with its bleed. All ink is black on white. Every mark is a function of the pixel's
position, so that windows of a large print can be drawn alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.calibration.labels import label_window, paint_label
from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.display.sheet_layout import trim_of, with_margin
from lippmann.errors import UsageError
from lippmann.image.stored_values import FloatArray

Real = NDArray[np.float64]
Ink = NDArray[np.bool_]

_INCH = 25.4

#: Width of the margin in mm, least and most: marks in a narrower one would be invisible.
MARGINS = (3.0, 100.0)

#: Width of lines in mm: a few pixels of a printer.
_LINE = 0.1

#: Distances from the picture over the width of the margin: alignment strips, cutting lines; and the ring's radius.
_STRIP = (0.1, 0.5)
_CUT = 0.6
_RING = 0.2


@dataclass(frozen=True)
class Marks:
    """The margin of a display with upright cylindrical lenses, and its marks.

    Parameters
    ----------
    display:
        The display of the picture alone, with its bleed.
    margin:
        Width of the margin in millimetres, 3 to 100; rounded to whole pixels.

    Raises
    ------
    UsageError
        If the margin is out of range, the lenses are not cylindrical and upright, or there are marks already.
    """

    display: Display
    margin: float

    def __post_init__(self) -> None:
        least, most = MARGINS
        if not least <= self.margin <= most:
            rule = f"it must be {least:g} to {most:g} mm"
            raise UsageError(f"{self.margin:g} mm is out of range", parameter="margin", rule=rule)
        lenses = self.display.lens_array
        if lenses.layout != "lenticular" or lenses.slant:
            kind = "slanted" if lenses.slant else lenses.layout
            rule = "marks need upright cylindrical lenses"
            raise UsageError(f"the display {self.display.name} has {kind} lenses", rule=rule)
        if self.display.sheet is not None and self.display.sheet.margin:
            raise UsageError("has a margin with marks already", fix="take the picture without it")

    @property
    def pixels(self) -> int:
        """Width of the margin in pixels."""
        return round(self.margin / self.display.panel.pixel_pitch)

    @property
    def picture(self) -> PixelWindow:
        """The part of the marked sheet that the picture with its bleed covers."""
        panel = self.display.panel
        return PixelWindow(self.pixels, self.pixels, panel.width, panel.height)

    @property
    def sheet(self) -> Display:
        """The display of the marked sheet: the same lenses, continued over the margin."""
        return with_margin(self.display, self.pixels)

    @property
    def trim(self) -> PixelWindow:
        """The part of the marked sheet that is left after cutting."""
        return trim_of(self.sheet)

    def caption(self) -> str:
        """The line of text below the picture: pitches, resolution and viewing distance."""
        display = self.display
        lpi, print_lpi = _INCH / display.lattice.pitch, _INCH / (display.lattice.pitch * display.magnification)
        ppi = _INCH / display.panel.pixel_pitch
        distance = f"{display.viewing_distance:g} mm" if display.viewing_distance < 1e9 else "afar"
        return f"{lpi:.6g} lpi, printed at {print_lpi:.6g} lpi, {ppi:.6g} ppi, seen from {distance}"

    def draw(self, window: PixelWindow) -> NDArray[np.float32]:
        """``(height, width)`` float32 pixels of a window of the marked sheet: 0 ink, 1 paper; no picture."""
        rows = np.arange(window.top, window.bottom, dtype=np.float64)[:, None]
        columns = np.arange(window.left, window.right, dtype=np.float64)[None, :]
        ink = self._strips(columns, rows) | self._cuts(columns, rows)
        for center in self._cross_centers():
            ink |= self._cross(columns, rows, *center)
        pixels = np.where(ink, np.float32(0), np.float32(1))
        m, inside, trim = self.pixels, self.picture, self.trim
        room = round((1 - _CUT) * 0.8 * m)
        for text, top in (("TOP", 0.1 * m), (self.caption(), inside.bottom + _CUT * m)):
            line = PixelWindow(trim.left, round(top), trim.width, room)
            box = label_window(text, line, room, at="bottom")
            paint_label(pixels, window, text, box, ink=0, paper=1)
        return pixels

    def lens_phase(self, column: Real) -> Real:
        """Phase f of the centres of columns of the marked sheet: 0 at the left edge of their lens, 1 at the right."""
        lattice, panel = self.display.lattice, self.display.panel
        x = (column - self.pixels + 0.5 - panel.width / 2) * panel.pixel_pitch
        phase: Real = (x / self.display.magnification - lattice.origin_x) / lattice.pitch + 0.5
        return phase - np.floor(phase)

    def _strips(self, column: Real, row: Real) -> Ink:
        inside, m = self.picture, self.pixels
        above = inside.top - 0.5 - row
        away = np.where(above > 0, above, row + 0.5 - inside.bottom)
        is_across = (column >= inside.left) & (column < inside.right)
        in_strip = is_across & (away >= _STRIP[0] * m) & (away < _STRIP[1] * m)
        return in_strip & (np.abs(self.lens_phase(column) - 0.5) < 0.25)

    def _cuts(self, column: Real, row: Real) -> Ink:
        """Cutting lines: just outside the edges of the trim, in the outer margin."""
        trim, line = self.trim, self._line
        outwards = trim.left - self.picture.left + _CUT * self.pixels
        right = np.maximum(trim.left - column, column - (trim.right - 1))
        down = np.maximum(trim.top - row, row - (trim.bottom - 1))
        is_vertical = (right > 0) & (right <= line) & (down > outwards)
        is_horizontal = (down > 0) & (down <= line) & (right > outwards)
        return is_vertical | is_horizontal

    def _cross_centers(self) -> list[tuple[float, float]]:
        """Positions ``(x, y)`` in pixels from the sheet's left and top edges, before x moves to a lens centre."""
        inside, half = self.picture, self.pixels / 2
        far_right, far_down = inside.right + half, inside.bottom + half
        middle = inside.top + inside.height / 2
        return [(x, y) for x in (half, far_right) for y in (half, middle, far_down)]

    def _cross(self, column: Real, row: Real, x: float, y: float) -> Ink:
        lattice, panel = self.display.lattice, self.display.panel
        visual_pitch = lattice.pitch * self.display.magnification / panel.pixel_pitch
        # The nearest centre of a lens, in pixels from the left edge.
        first = lattice.origin_x * self.display.magnification / panel.pixel_pitch + panel.width / 2 + self.pixels
        x = first + round((x - first) / visual_pitch) * visual_pitch
        right, down = column + 0.5 - x, row + 0.5 - y
        half, radius, reach = self._line / 2, _RING * self.pixels, 1.5 * _RING * self.pixels
        is_vertical = (np.abs(right) <= half) & (np.abs(down) <= reach)
        is_horizontal = (np.abs(down) <= half) & (np.abs(right) <= reach)
        return is_vertical | is_horizontal | (np.abs(np.hypot(right, down) - radius) <= half)

    @property
    def _line(self) -> int:
        return max(1, round(_LINE / self.display.panel.pixel_pitch))


def marked_rows(marks: Marks, rows: Callable[[int, int], FloatArray], first: int, last: int) -> FloatArray:
    """Rows of the marked sheet, ``(last - first, width, 3)`` linear RGB.

    Parameters
    ----------
    marks:
        The margin and its marks.
    rows:
        ``rows(first, last)`` returns rows of the picture alone; called for those that are needed only.
    first, last:
        First row of the marked sheet and the one past the last.
    """
    m, picture, width = marks.pixels, marks.picture, marks.picture.width + 2 * marks.pixels
    pixels = np.empty((last - first, width, 3), dtype=np.float32)
    top, bottom = (min(max(edge, first), last) for edge in (picture.top, picture.bottom))
    if bottom > top:
        pixels[top - first : bottom - first, m : width - m] = rows(top - m, bottom - m)
    edges = (
        PixelWindow(0, first, width, top - first),
        PixelWindow(0, bottom, width, last - bottom),
        PixelWindow(0, top, m, bottom - top),
        PixelWindow(width - m, top, m, bottom - top),
    )
    for edge in edges:
        if edge.height > 0:
            pixels[edge.top - first : edge.bottom - first, edge.columns] = marks.draw(edge)[..., None]
    return pixels
