"""Marks for laying a lens sheet on a print: a margin about the picture, with marks at exact places under the lenses.

The lenses are continued into the margin, so that the marked sheet is a display of its own, whose lenses lie over the
picture exactly where they lay before. With ``f`` the place of a pixel's centre under its lens, 0 to 1, and m the width
of the margin:

- above and below the picture, from 0.1 m to 0.5 m away from it, over its whole width: strips of lines, ink where
  |f - 1/2| < 1/4. Under a sheet that lies right they are dark from end to end for an eye in the middle of the viewing
  place; bars tell of a turned sheet, a change of both at once of a shifted one.
- in each corner, and left and right at half height: a cross in a ring. Its upright arm is the middle of a lens, ink
  within half a line of it.
- at the picture's corners, from 0.6 m outwards: cutting lines, which begin where the picture ends.
- outside the lower strip: a line of words. On top: where the top is.

All ink is black on white. Everything is a function of the pixel, so that windows of a large print can be drawn alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.calibration.labels import label_window, paint_label
from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import UsageError
from lippmann.image import IntegralImage, Provenance

FloatArray = NDArray[np.float32]
Real = NDArray[np.float64]
Ink = NDArray[np.bool_]

_INCH = 25.4

#: Width of the margin, mm; below that no mark can be seen, above it would be paper only.
MARGINS = (3.0, 100.0)

#: Width of lines, mm: a few pixels of a printer.
_LINE = 0.1

#: Parts of the margin: where the strips begin and end, where cutting lines begin, and the ring's radius.
_STRIP = (0.1, 0.5)
_CUT = 0.6
_RING = 0.2


@dataclass(frozen=True)
class Marks:
    """The margin of a display with upright cylindrical lenses, and what is drawn there.

    Parameters
    ----------
    display:
        The display of the picture alone.
    margin:
        Width of the margin in millimetres, 3 to 100; it gets the whole number of pixels next to it.

    Raises
    ------
    UsageError
        If the margin is out of range, or the lenses are not cylindrical and upright.
    """

    display: Display
    margin: float

    def __post_init__(self) -> None:
        least, most = MARGINS
        if not least <= self.margin <= most:
            rule = f"a margin with marks is {least:g} to {most:g} mm wide"
            raise UsageError(f"a margin of {self.margin:g} mm will not do", rule=rule)
        lenses = self.display.lens_array
        if lenses.layout != "lenticular" or lenses.slant:
            kind = "slanted" if lenses.slant else lenses.layout
            rule = "marks are drawn for upright cylindrical lenses"
            raise UsageError(f"the display {self.display.name} has {kind} lenses", rule=rule)

    @property
    def pixels(self) -> int:
        """Width of the margin in pixels."""
        return round(self.margin / self.display.panel.pixel_pitch)

    @property
    def picture(self) -> PixelWindow:
        """Where the picture lies on the marked sheet."""
        panel = self.display.panel
        return PixelWindow(self.pixels, self.pixels, panel.width, panel.height)

    @property
    def sheet(self) -> Display:
        """The display of the marked sheet: the same lenses, over the margin too."""
        panel, lattice = self.display.panel, self.display.lattice
        width, height = panel.width + 2 * self.pixels, panel.height + 2 * self.pixels
        lenses = replace(self.display.lens_array, pitch=lattice.pitch, offset=(lattice.origin_x, 0.0))
        return replace(self.display, panel=replace(panel, width=width, height=height), lens_array=lenses)

    def words(self) -> str:
        """The line of words below the picture."""
        display = self.display
        lpi, seen = _INCH / display.lattice.pitch, _INCH / (display.lattice.pitch * display.magnification)
        ppi = _INCH / display.panel.pixel_pitch
        distance = f"{display.viewing_distance:g} mm" if display.viewing_distance < 1e9 else "afar"
        return f"{lpi:.6g} lpi, printed at {seen:.6g} lpi, {ppi:.6g} ppi, seen from {distance}"

    def draw(self, window: PixelWindow) -> NDArray[np.float32]:
        """``(height, width)`` of a window of the marked sheet, 0 ink or 1 paper; paper where the picture goes."""
        rows = np.arange(window.top, window.bottom, dtype=np.float64)[:, None]
        columns = np.arange(window.left, window.right, dtype=np.float64)[None, :]
        ink = self._strips(columns, rows) | self._cuts(columns, rows)
        for center in self._cross_centers():
            ink |= self._cross(columns, rows, *center)
        pixels = np.where(ink, np.float32(0), np.float32(1))
        m, inside = self.pixels, self.picture
        room = round((1 - _CUT) * 0.8 * m)
        for text, top in (("TOP", 0.1 * m), (self.words(), inside.bottom + _CUT * m)):
            line = PixelWindow(inside.left, round(top), inside.width, room)
            box = label_window(text, line, room, at="bottom")
            paint_label(pixels, window, text, box, ink=0, paper=1)
        return pixels

    def place_under_lens(self, column: Real) -> Real:
        """f of pixels of the marked sheet, 0 at the left edge of their lens, 1 at the right."""
        lattice, panel = self.display.lattice, self.display.panel
        x = (column - self.pixels + 0.5 - panel.width / 2) * panel.pixel_pitch
        place: Real = (x / self.display.magnification - lattice.origin_x) / lattice.pitch + 0.5
        return place - np.floor(place)

    def _strips(self, column: Real, row: Real) -> Ink:
        inside, m = self.picture, self.pixels
        above = inside.top - 0.5 - row
        away = np.where(above > 0, above, row + 0.5 - inside.bottom)
        is_across = (column >= inside.left) & (column < inside.right)
        in_strip = is_across & (away >= _STRIP[0] * m) & (away < _STRIP[1] * m)
        return in_strip & (np.abs(self.place_under_lens(column) - 0.5) < 0.25)

    def _cuts(self, column: Real, row: Real) -> Ink:
        """Lines of one line's width just outside the picture's edges, near the corners, in the outer margin."""
        inside, m, line = self.picture, self.pixels, self._line
        right = np.maximum(inside.left - column, column - (inside.right - 1))
        down = np.maximum(inside.top - row, row - (inside.bottom - 1))
        is_upright = (right > 0) & (right <= line) & (down > _CUT * m)
        is_lying = (down > 0) & (down <= line) & (right > _CUT * m)
        return is_upright | is_lying

    def _cross_centers(self) -> list[tuple[float, float]]:
        """Places in pixels from the sheet's left and top edges; a lens's middle is put there by :meth:`_cross`."""
        inside, half = self.picture, self.pixels / 2
        far_right, far_down = inside.right + half, inside.bottom + half
        middle = inside.top + inside.height / 2
        return [(x, y) for x in (half, far_right) for y in (half, middle, far_down)]

    def _cross(self, column: Real, row: Real, x: float, y: float) -> Ink:
        lattice, panel = self.display.lattice, self.display.panel
        seen_pitch = lattice.pitch * self.display.magnification / panel.pixel_pitch
        # The lens's middle next to x, in pixels from the left edge.
        first = lattice.origin_x * self.display.magnification / panel.pixel_pitch + panel.width / 2 + self.pixels
        x = first + round((x - first) / seen_pitch) * seen_pitch
        right, down = column + 0.5 - x, row + 0.5 - y
        half, radius, reach = self._line / 2, _RING * self.pixels, 1.5 * _RING * self.pixels
        is_upright = (np.abs(right) <= half) & (np.abs(down) <= reach)
        is_lying = (np.abs(down) <= half) & (np.abs(right) <= reach)
        return is_upright | is_lying | (np.abs(np.hypot(right, down) - radius) <= half)

    @property
    def _line(self) -> int:
        return max(1, round(_LINE / self.display.panel.pixel_pitch))


def with_marks(image: IntegralImage, margin: float) -> IntegralImage:
    """The picture with a margin of ``margin`` mm and its marks, for the display that is larger by as much.

    Its maps are zero over the margin.

    Raises
    ------
    UsageError
        As :class:`Marks`.
    """
    marks = Marks(image.display, margin)
    sheet, m = marks.sheet, marks.pixels
    pixels = marked_rows(marks, lambda first, last: image.pixels[first:last], 0, sheet.panel.height)
    maps = {name: np.pad(values, ((m, m), (m, m), (0, 0))[: values.ndim]) for name, values in image.maps.items()}
    return replace(
        image, pixels=pixels, display=sheet, provenance=marked_provenance(marks, image.provenance), maps=maps
    )


def marked_rows(marks: Marks, rows: Callable[[int, int], FloatArray], first: int, last: int) -> FloatArray:
    """Rows of the marked sheet from ``first`` up to ``last``, ``(last - first, width, 3)`` linear RGB.

    ``rows(first, last)`` gives those of the picture alone; it is asked for no others than are needed.
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


def marked_provenance(marks: Marks, made: Provenance) -> Provenance:
    """What a marked picture says of how it was made."""
    return replace(made, options={**made.options, "margin_pixels": marks.pixels})
