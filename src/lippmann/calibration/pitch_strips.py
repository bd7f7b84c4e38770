"""Pitch test: strips of lines at slightly different pitches, to find the print pitch of a lens sheet.

Strip k (0 on top) of n has the print pitch ``lpi_k = middle + (k - (n - 1)/2) step`` in lenses per inch. A pixel whose
centre is x inches right of the middle of the print has the phase ``f = x lpi_k + 1/2 (mod 1)`` under its lens, and is
black where |f - 1/2| < 1/4. Seen from the viewing distance of the test, the strip with the right pitch is uniformly
dark (or bright, depending on the position of the sheet) and changes as a whole when the sheet or the head moves
sideways. The other strips show bars: as many as they have lenses too many or too few. The label of the strip next to
the expected print pitch says so.

White paper is left around the strips, as printers do not print to the edge. All pixels are black or white, so that no
printer dithers them. All functions draw windows of the print.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.calibration.labels import label_window, paint_label
from lippmann.calibration.patterns import check_step, round_step
from lippmann.display.formats.print_sheet import Print
from lippmann.display.panel import PixelWindow
from lippmann.errors import UsageError
from lippmann.runtime.engine_lock import cached_property

#: Largest height of a label in mm; smaller in low strips.
_LABEL = 6.0

#: Width of the white margin in mm: more than desktop printers leave out; at most so much of the print's shorter side.
_MARGIN, _MARGIN_SHARE = 5.0, 0.1

#: Word after the pitch in the label of the expected strip.
_EXPECTED = "expected"

#: Height of the white line between strips over that of a strip.
_GUTTER = 0.04

#: Number of strips, least and most.
STRIPS = (1, 199)


@dataclass(frozen=True)
class Strip:
    """One strip: its part of the print, its print pitch in lenses per inch, and that pitch as its label."""

    window: PixelWindow
    lpi: float
    text: str


@dataclass(frozen=True)
class PitchTest:
    """A pitch test for a sheet, a printer and a viewing distance.

    Parameters
    ----------
    sheet:
        Size, resolution, lenses and viewing distance of the print.
    strips:
        Number of strips, 1 to 199.
    step:
        Step between strips in lenses per inch. None: about half a lens over the width of the print.

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
            rule = f"it must be {least} to {most}"
            raise UsageError(f"{self.strips} is out of range", parameter="strips", rule=rule)
        check_step(self.step)
        if self.strips + 1 > self.inside.height:
            rule = f"the print is {self.inside.height} pixels high within its margin"
            raise UsageError(f"{self.strips} is out of range", parameter="strips", rule=rule)
        if self.lpi_of(0) <= 0:
            rule = f"the print pitch is about {self.sheet.pitch_on_print:.6g} lenses per inch"
            what = f"{self.effective_step:g} is out of range"
            raise UsageError(what, parameter="step", rule=rule, fix="use a smaller step")

    @property
    def effective_step(self) -> float:
        """Step between strips in lenses per inch: the given one, else the default."""
        return round_step(0.5 * self.sheet.ppi / self.sheet.pixels[0]) if self.step is None else self.step

    @property
    def middle(self) -> float:
        """Lenses per inch of the middle strip: the expected print pitch, rounded to whole steps if these are small."""
        expected, step = self.sheet.pitch_on_print, self.effective_step
        return round(expected / step) * step if step < expected / 2 else expected

    @property
    def expected(self) -> int:
        """The strip whose print pitch is next to the expected one, counted from 0 at the top."""
        return min(range(self.strips), key=lambda strip: abs(self.lpi_of(strip) - self.sheet.pitch_on_print))

    @property
    def inside(self) -> PixelWindow:
        """The print within its margin."""
        width, height = self.sheet.pixels
        margin = min(round(_MARGIN * self.sheet.ppi / 25.4), int(_MARGIN_SHARE * min(width, height)))
        return PixelWindow(margin, margin, width - 2 * margin, height - 2 * margin)

    def lpi_of(self, strip: int) -> float:
        """Print pitch in lenses per inch of a strip, counted from 0 at the top."""
        return self.middle + (strip - (self.strips - 1) / 2) * self.effective_step

    @cached_property
    def all_strips(self) -> tuple[Strip, ...]:
        """All strips from the top; the title has the height of a strip above them."""
        inside = self.inside
        rows = [inside.top + inside.height * (k + 1) // (self.strips + 1) for k in range(self.strips + 1)]
        decimals = next((d for d in range(2, 6) if math.isclose(round(self.effective_step, d), self.effective_step)), 6)
        strips = []
        for k in range(self.strips):
            lpi, window = self.lpi_of(k), PixelWindow(inside.left, rows[k], inside.width, rows[k + 1] - rows[k])
            strips.append(Strip(window, lpi, f"{lpi:.{decimals}f}"))
        return tuple(strips)

    def title(self) -> str:
        """The line of text above the strips."""
        sheet = self.sheet
        distance = "infinitely far" if math.isinf(sheet.viewing_distance) else f"{sheet.viewing_distance:g} mm"
        return f"print pitch in lpi: {sheet.pitch_of_sheet:.6g}-lpi sheet, {sheet.ppi:g} ppi, from {distance}"

    def draw(self, window: PixelWindow) -> NDArray[np.uint8]:
        """``(height, width)`` uint8 pixels of a window of the print, 0 black or 255 white."""
        pixels = np.full(window.shape, 255, dtype=np.uint8)
        width, inside, expected = self.sheet.pixels[0], self.inside, self.expected
        tallest = round(_LABEL * self.sheet.ppi / 25.4)
        head = PixelWindow(inside.left, inside.top, inside.width, self.all_strips[0].window.top - inside.top)
        paint_label(pixels, window, self.title(), label_window(self.title(), head, tallest), ink=0, paper=255)
        for number, strip in enumerate(self.all_strips):
            part = strip.window.intersection(window)
            if part is None:
                continue
            gutter = round(_GUTTER * strip.window.height)
            rows = np.arange(part.top, part.bottom) - strip.window.top
            inches = (np.arange(part.left, part.right) + 0.5 - width / 2) / self.sheet.ppi
            is_dark = np.abs((inches * strip.lpi + 0.5) % 1.0 - 0.5) < 0.25
            is_strip = rows < strip.window.height - gutter
            pixels[part.relative_to(window).slices][is_strip] = np.where(is_dark, 0, 255)
            text = f"{strip.text} {_EXPECTED}" if number == expected else strip.text
            box = label_window(text, strip.window, min(tallest, round(0.7 * strip.window.height)))
            paint_label(pixels, window, text, box, ink=0, paper=255)
        return pixels
