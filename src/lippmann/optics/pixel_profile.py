"""The light of a sub-pixel across the lens: a slanted rectangle, spread by ink and by the lens."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lippmann.display.display import Display
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.optics.lens import Real

#: Standard deviations of a Gaussian after which 1e-6 of it is left.
_TAIL = 5.0


@dataclass(frozen=True)
class Trapezoid:
    """Light of a rectangle of width a and height h under a lens slanted by s, of area 1: a trapezoid across the lens.

    Attributes
    ----------
    base, top:
        Widths in mm where it begins and where it is flat: ``(a + h tan s) cos s`` and ``|a - h tan s| cos s``.
    """

    base: float
    top: float

    @property
    def half_height(self) -> float:
        """Width at half of its height: ``max(a, h tan s) cos s``."""
        return 0.5 * (self.base + self.top)

    def shares(self, edges: Real) -> Real:
        """Share of its light between neighbouring edges, in mm from its middle."""
        return np.diff(self._left_of(edges))

    def _left_of(self, x: Real) -> Real:
        """Share of its light left of ``x``: half of all, and what lies between the middle and ``x``."""
        away = np.minimum(np.abs(x), 0.5 * self.base)
        beyond = np.maximum(away - 0.5 * self.top, 0.0)
        ramp = 0.5 * (self.base - self.top)
        lost = beyond**2 / (2.0 * ramp) if ramp > 0.0 else 0.0
        return 0.5 + np.sign(x) * (away - lost) / self.half_height


def pixel_trapezoid(display: Display) -> Trapezoid:
    """The light of one sub-pixel of a display across its lenses, before ink and lens spread it."""
    width, height = (display.pixel or PixelAperture()).lit_size(display.panel)
    slant = abs(math.radians(display.lens_array.slant))
    along = height * math.tan(slant)
    return Trapezoid((width + along) * math.cos(slant), abs(width - along) * math.cos(slant))


def kernel(shape: Trapezoid, blur: float, step: float) -> Real:
    """Shares of a sub-pixel's light on places ``step`` wide around its middle, an odd number of them; they sum up to 1.

    ``blur`` is the standard deviation of the ink's.
    """
    half = math.ceil((0.5 * shape.base) / step + 0.5)
    lit = shape.shares((np.arange(2.0 * half + 2.0) - half - 0.5) * step)
    return np.convolve(lit, ink_kernel(blur, step))


def ink_kernel(blur: float, step: float) -> Real:
    """Shares of a point's light on places ``step`` wide around it, as ink blurs it; an odd number of them."""
    if blur <= 0.0:
        return np.ones(1)
    half = math.ceil(_TAIL * blur / step + 0.5)
    edges = (np.arange(2 * half + 2) - half - 0.5) * step
    ink = np.diff([0.5 * math.erf(edge / (blur * math.sqrt(2.0))) for edge in edges])
    shares: Real = ink / ink.sum()
    return shares


def width_at_half_height(values: Real, step: float) -> float:
    """Width between the outermost places at which a profile crosses half of its greatest value."""
    half = 0.5 * values.max()
    above = np.flatnonzero(values >= half)
    padded = np.concatenate([[0.0], values, [0.0]])
    first, last = above[0] + 1, above[-1] + 1
    left = first - (padded[first] - half) / (padded[first] - padded[first - 1])
    right = last + (padded[last] - half) / (padded[last] - padded[last + 1])
    return float((right - left) * step)
