"""Displays of sheets: the finished print, and the larger ones with its bleed and its margin.

The picture of a print covers the whole sheet. The finished print is its middle, the *trim*: cutting takes bleed and
margin away. The lenses continue over the whole sheet, at the same positions over the trim. Lengths are whole pixels, so
that the pixels of the trim lie where they lie without bleed.
"""

from __future__ import annotations

import math
from dataclasses import replace

from lippmann.display.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.display.sheet import Sheet
from lippmann.errors import UsageError

#: Largest bleed in mm: print shops ask for 2 to 5, stretched canvas for some 50.
MOST_BLEED = 100.0

#: A bleed that exceeds whole pixels by less than this, in pixels, is taken as whole: far above rounding noise.
_WHOLE = 1e-6


def trim_of(display: Display) -> PixelWindow:
    """The pixels of the finished print; all where a display has no sheet."""
    border = 0 if display.sheet is None else display.sheet.border
    panel = display.panel
    return PixelWindow(border, border, panel.width - 2 * border, panel.height - 2 * border)


def trimmed(display: Display) -> Display:
    """The display of the finished print alone, behind the same lenses; the display itself where nothing is cut off."""
    sheet = display.sheet
    return display if sheet is None or not sheet.border else _resize(display, replace(sheet, bleed=0, margin=0))


def with_bleed(display: Display, bleed: float) -> Display:
    """The display of a print that is larger by ``bleed`` mm on every side, or up to a pixel more.

    Raises
    ------
    UsageError
        If the display is no print, has a bleed already, or the length is out of range.
    """
    if bleed == 0:
        return display
    if not 0 < bleed <= MOST_BLEED:
        rule = f"it must be 0 to {MOST_BLEED:g} mm"
        raise UsageError(f"{bleed:g} mm is out of range", parameter="bleed", rule=rule)
    if display.sheet is None:
        rule = "it applies to prints only"
        raise UsageError(f"does not apply to the display {display.name}", parameter="bleed", rule=rule)
    if display.sheet.border:
        raise UsageError("the print has a bleed or a margin already", parameter="bleed", fix="leave it out")
    pixels = math.ceil(bleed / display.panel.pixel_pitch - _WHOLE)
    return _resize(display, replace(display.sheet, bleed=pixels))


def with_margin(display: Display, margin: int) -> Display:
    """The display of a sheet with a margin of so many pixels on every side; a display without a sheet is given one."""
    return _resize(display, replace(display.sheet or Sheet(), margin=margin))


def _resize(display: Display, sheet: Sheet) -> Display:
    """The display with another sheet around the same trim, and the same lenses at the same positions."""
    trim, lattice = trim_of(display), display.lattice
    border = 2 * sheet.border
    panel = replace(display.panel, width=trim.width + border, height=trim.height + border)
    lenses = replace(display.lens_array, pitch=lattice.pitch, offset=(lattice.origin_x, 0.0))
    return replace(display, panel=panel, lens_array=lenses, sheet=sheet)
