"""The pitch test: strips of lines at slightly different pitches, by which the print pitch of a sheet is found.

Strip k (0 on top) of n has the print pitch ``lpi_k = middle + (k - (n - 1)/2) step`` in lenses per inch. A pixel whose
centre lies x inches right of the middle of the print has the place ``f = x lpi_k + 1/2 (mod 1)`` under its lens, and is
black where |f - 1/2| < 1/4. Seen from the distance for which the test is made, the strip with the right pitch is dark
(or bright, as the sheet happens to lie) from end to end, and changes all at once when the sheet or the head is moved
sideways; the others show bars. The bars of a strip are as many as its lenses are too many or too few.

All pixels are black or white, so that no printer dithers them. Every function works on windows of the print.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.calibration.labels import label_window, paint_label
from lippmann.calibration.patterns import rounded
from lippmann.display.formats.print_sheet import Print
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import UsageError
from lippmann.runtime.cached_property import cached_property

#: The largest label, mm; smaller where strips are.
_LABEL = 6.0

#: Height of the line of words on top, as a part of a strip's; and of the white line between strips.
_GUTTER = 0.04

STRIPS = (1, 199)


@dataclass(frozen=True)
class Strip:
    """One strip: where it is, its print pitch in lenses per inch, and that as written beside it."""

    window: PixelWindow
    lpi: float
    text: str


@dataclass(frozen=True)
class PitchTest:
    """A pitch test for a sheet, a printer and a viewing distance.

    Parameters
    ----------
    sheet:
        The print: its size, resolution, lenses and distance.
    strips:
        How many, 1 to 199.
    step:
        Lenses per inch from strip to strip; None takes the one by which neighbours differ by about half a lens over
        the width of the print.

    Raises
    ------
    UsageError
        If a number is out of range, or the print is too small for the strips.
    """

    sheet: Print
    strips: int = 21
    step: float | None = None

    def __post_init__(self) -> None:
        least, most = STRIPS
        if not least <= self.strips <= most:
            raise UsageError(f"{self.strips} strips will not do", rule=f"it must be {least} to {most}")
        if self.step is not None and not (math.isfinite(self.step) and self.step > 0):
            raise UsageError(f"the step {self.step:g} will not do", rule="it must be a number above zero")
        if self.strips + 1 > self.sheet.pixels[1]:
            rule = f"the print is only {self.sheet.pixels[1]} pixels high"
            raise UsageError(f"{self.strips} strips will not do", rule=rule)
        if self.lpi_of(0) <= 0:
            rule = f"the print pitch is about {self.sheet.pitch_on_print:.6g} lenses per inch"
            raise UsageError(f"the step {self.step_taken:g} will not do", rule=rule, fix="take a smaller one")

    @property
    def step_taken(self) -> float:
        """Lenses per inch from strip to strip."""
        return rounded(0.5 * self.sheet.ppi / self.sheet.pixels[0]) if self.step is None else self.step

    @property
    def middle(self) -> float:
        """Lenses per inch of the middle strip: the expected print pitch, rounded to whole steps if those are small."""
        expected, step = self.sheet.pitch_on_print, self.step_taken
        return round(expected / step) * step if step < expected / 2 else expected

    def lpi_of(self, strip: int) -> float:
        """The print pitch of a strip, counted from the top."""
        return self.middle + (strip - (self.strips - 1) / 2) * self.step_taken

    @cached_property
    def made_of(self) -> tuple[Strip, ...]:
        """All strips, from the top; above them one row as high as they are is left for the title."""
        width, height = self.sheet.pixels
        rows = [height * (k + 1) // (self.strips + 1) for k in range(self.strips + 1)]
        decimals = next((d for d in range(2, 6) if math.isclose(round(self.step_taken, d), self.step_taken)), 6)
        strips = []
        for k in range(self.strips):
            lpi = self.lpi_of(k)
            strips.append(Strip(PixelWindow(0, rows[k], width, rows[k + 1] - rows[k]), lpi, f"{lpi:.{decimals}f}"))
        return tuple(strips)

    def title(self) -> str:
        """What stands above the strips."""
        sheet = self.sheet
        distance = "infinitely far" if math.isinf(sheet.viewing_distance) else f"{sheet.viewing_distance:g} mm"
        return f"print pitch in lpi: {sheet.pitch_of_sheet:.6g}-lpi sheet, {sheet.ppi:g} ppi, from {distance}"

    def draw(self, window: PixelWindow) -> NDArray[np.uint8]:
        """``(height, width)`` of a window of the print, 0 black or 255 white."""
        pixels = np.full(window.shape, 255, dtype=np.uint8)
        width = self.sheet.pixels[0]
        tallest = round(_LABEL * self.sheet.ppi / 25.4)
        head = PixelWindow(0, 0, width, self.made_of[0].window.top)
        paint_label(pixels, window, self.title(), label_window(self.title(), head, tallest), ink=0, paper=255)
        columns = np.arange(window.left, window.right)
        inches = (columns + 0.5 - width / 2) / self.sheet.ppi
        for strip in self.made_of:
            part = strip.window.intersection(window)
            if part is None:
                continue
            gutter = round(_GUTTER * strip.window.height)
            rows = np.arange(part.top, part.bottom) - strip.window.top
            is_dark = np.abs((inches * strip.lpi + 0.5) % 1.0 - 0.5) < 0.25
            inside = rows < strip.window.height - gutter
            pixels[part.relative_to(window).rows][inside] = np.where(is_dark, 0, 255)
            box = label_window(strip.text, strip.window, min(tallest, round(0.7 * strip.window.height)))
            paint_label(pixels, window, strip.text, box, ink=0, paper=255)
        return pixels
