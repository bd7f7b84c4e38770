"""Moire of lenses and pixels: the waves that an even, lit panel shows behind its lenses.

The light of a panel of equal sub-pixels is a sum of waves of frequencies (i, l) / d with the amplitudes of the
sub-pixel's aperture. Each lens shows one place of it, so that a wave appears at its frequency less the nearest one of
the lens array; along cylinders nothing is sampled. There a wave is slow where its own frequency vanishes: at slants of
rational slope. (Saveljev and Kim, Opt. Express 20, 2163, 2012; Opt. Eng. 57, 030803, 2018.)
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lippmann.display.display import Display
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.optics.lens import Lens
from lippmann.optics.light_table import light_table

#: Highest order of waves: a rectangle's amplitude falls below a tenth beyond.
_ORDERS = 4

#: Contrast that is seen at all in an even surface.
VISIBLE_CONTRAST = 0.01


@dataclass(frozen=True)
class Wave:
    """A wave of an even white picture, in one colour.

    Attributes
    ----------
    order:
        ``(i, l)``: waves a pixel to the right and down.
    period:
        Distance of its bars on the display in mm.
    contrast:
        Greatest deviation from the mean over the mean.
    """

    order: tuple[int, int]
    period: float
    contrast: float


def moire_waves(display: Display) -> list[Wave]:
    """The waves that are seen, the slowest first: slower than lenses, with a contrast of :data:`VISIBLE_CONTRAST`."""
    width, height = (display.pixel or PixelAperture()).lit_size(display.panel)
    blur = display.pixel.blur if display.pixel else 0.0
    pixel, spread = display.panel.pixel_pitch, _spread(display)
    waves = []
    for i, l in itertools.product(range(_ORDERS + 1), range(-_ORDERS, _ORDERS + 1)):  # noqa: E741 - an order's name
        if (i, l) <= (0, 0):
            continue  # of a wave and its mirror image one is enough
        ink = math.exp(-2.0 * (math.pi * blur / pixel) ** 2 * (i * i + l * l))
        aperture = abs(np.sinc(i * width / pixel) * np.sinc(l * height / pixel))
        contrast = 2.0 * float(aperture) * ink * spread(*_frequency(display, (i, l)))
        period = wave_period(display, (i, l))
        if contrast >= VISIBLE_CONTRAST and display.lens_array.pitch < period < math.inf:
            waves.append(Wave((i, l), period, contrast))
    return sorted(waves, key=lambda wave: -wave.period)


def wave_period(display: Display, order: tuple[int, int]) -> float:
    """Period in mm of a wave of the panel as the lenses show it; infinite where all show the same phase."""
    across, along = _frequency(display, order)
    lattice, scale = display.lattice, display.magnification
    pitch, row = lattice.pitch * scale, lattice.row_pitch * scale
    if lattice.layout == "lenticular":
        frequency = math.hypot(across - round(across * pitch) / pitch, along)
    else:
        shift = 0.5 * pitch if lattice.layout == "hexagonal" else 0.0
        # Frequencies of the array: whole numbers of waves from lens to lens in its row, and to the next row.
        first, second = round(across * pitch), round(across * shift + along * row)
        frequency = min(
            math.hypot(across - a / pitch, along - (b - a * shift / pitch) / row)
            for a in (first - 1, first, first + 1)
            for b in (second - 1, second, second + 1)
        )
    return math.inf if frequency < 1e-9 / pitch else 1.0 / (frequency * scale)


def _frequency(display: Display, order: tuple[int, int]) -> tuple[float, float]:
    """Frequency of a wave of the panel across and along its lenses, in waves a mm."""
    slant, pixel = math.radians(display.lens_array.slant), display.panel.pixel_pitch
    right, up = order[0] / pixel, -order[1] / pixel
    return right * math.cos(slant) - up * math.sin(slant), right * math.sin(slant) + up * math.cos(slant)


def _spread(display: Display) -> Callable[[float, float], float]:
    """Share of a wave's contrast that the lens leaves, by its frequency across and along; all of it by a pinhole."""
    if display.lens is None:
        return lambda across, along: 1.0
    table = light_table(Lens.of(display), 0.0)
    shares = table.shares if table.squares is None else table.squares[0]

    def share(across: float, along: float) -> float:
        rows = np.exp(2j * np.pi * along * table.places) if len(shares) > 1 else np.ones(1)
        return abs(complex(rows @ shares @ np.exp(2j * np.pi * across * table.places))) / float(shares.sum())

    return share
