"""An eye's picture through real lenses: the pixels under each lens, weighted by the light that they send to it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.display.display import Display
from lippmann.errors import DisplayError
from lippmann.optics.eye_light import eye_light
from lippmann.optics.lens import Lens, Real

#: Share of a lens's light below which a pixel counts as dark.
_LEAST = 1e-5

#: Slope by which the directions whose light is known reach beyond those asked for, so that one alone will do.
_BEYOND = 1e-3


@dataclass(frozen=True, eq=False)
class PixelShares:
    """Shares of pixels in the light of n lenses, each in one direction; they sum up to 1.

    Attributes
    ----------
    first:
        ``(n,)`` column of the first pixel.
    shares:
        ``(n, m)`` of that pixel and those to its right; 0 beside the panel.
    """

    first: NDArray[np.int64]
    shares: Real

    def gather(self, rows: Real) -> Real:
        """Light ``(rows, n)`` of the lenses, of pixels ``(rows, width)``."""
        columns = np.clip(self.first[:, None] + np.arange(self.shares.shape[1]), 0, rows.shape[1] - 1)
        light = np.zeros((len(rows), len(self.first)))
        for k in range(self.shares.shape[1]):
            light += rows[:, columns[:, k]] * self.shares[:, k]
        return light


def pixel_shares(display: Display, lens: Real, slopes: Real, offset: float = 0.0) -> PixelShares:
    """Shares of the pixels of a row in the light that upright cylinders send in these directions.

    Parameters
    ----------
    display:
        A display with the profile of its lenses.
    lens:
        ``(n,)`` numbers of lenses.
    slopes:
        ``(n,)`` slopes across the lenses, toward the eye.
    offset:
        Place of the sub-pixel, in pixels to the right of its pixel's middle.

    Raises
    ------
    DisplayError
        If the display gives no lens, or its lenses are not upright cylinders.
    """
    Lens.of(display)
    if not display.lattice.rows_are_alike:
        rule = "light through upright cylinders is followed row by row"
        raise DisplayError("has other lenses", where=display.name, rule=rule)
    pixel, width = display.panel.pixel_pitch, display.panel.width
    light = eye_light(display, (slopes.min() - _BEYOND, slopes.max() + _BEYOND), (-_BEYOND, _BEYOND))
    number, middle = light.nearest(slopes, np.zeros_like(slopes))
    profile, step = light.weights.reshape(-1, light.weights.shape[3]), light.step
    half = 0.5 * (profile.shape[1] - 1)
    # Pixels from the middle of the panel; the middle of the light.
    axis = display.lattice.origin_x + lens * display.lattice.pitch + middle[:, 0]
    axis = axis / pixel + 0.5 * width - 0.5 - offset
    reach = math.ceil(half * step / pixel)
    first = np.round(axis).astype(np.int64) - reach
    columns = first[:, None] + np.arange(2 * reach + 1)
    place = (columns - axis[:, None]) * (pixel / step) + half
    left = np.clip(place.astype(np.int64), 0, profile.shape[1] - 2)
    lower, upper = (profile[number[:, None], left + right] for right in (0, 1))
    shares = lower + (upper - lower) * (place - left)
    is_dark = (place < 0.0) | (place > 2.0 * half) | (shares < _LEAST)
    shares[(columns < 0) | (columns >= width) | is_dark] = 0.0
    total = shares.sum(axis=1, keepdims=True)
    shares = np.divide(shares, total, out=np.zeros_like(shares), where=total > 0.0)
    lit_places = np.flatnonzero(shares.any(axis=0))
    if len(lit_places):
        shares, first = shares[:, lit_places[0] : lit_places[-1] + 1], first + lit_places[0]
    return PixelShares(first, np.ascontiguousarray(shares))
