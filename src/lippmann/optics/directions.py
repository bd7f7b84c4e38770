"""True directions: the mean direction of the light that leaves a place of the panel through its own lens."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lippmann.optics.lens import Lens, Real
from lippmann.optics.light_table import light_table

#: Directions to both sides whose light is averaged, evenly spaced in angle, and their largest angle in degrees.
_DIRECTIONS, _LARGEST_ANGLE = 320, 80.0

#: Places across one lens at which directions are known; between them they are interpolated.
_PLACES = 48

#: Slope by which the directions of a lens fall off where its light would have them stand still.
_TINY = 1e-9


@dataclass(frozen=True, eq=False)
class TrueDirections:
    """Direction of a place and place of a direction, each the other's inverse.

    Attributes
    ----------
    places:
        ``(n,)`` places across the own lens in mm relative to its axis, ascending.
    slopes:
        ``(n,)`` slopes across the lens of their mean directions, descending: a place on the right is seen from the
        left.
    spread:
        ``(n,)`` standard deviation of the slope of their light.
    """

    places: Real
    slopes: Real
    spread: Real

    def direction_of(self, place: Real) -> Real:
        """Slope of the mean direction of places; beyond the lens as its last places go on."""
        return _interpolate(place, self.places, self.slopes)


@lru_cache(maxsize=16)
def true_directions(lens: Lens) -> TrueDirections:
    """The true directions of a lens: light of all angles that leaves a place through it, weighted by its share."""
    angles = np.radians(np.linspace(-_LARGEST_ANGLE, _LARGEST_ANGLE, 2 * _DIRECTIONS + 1))
    slopes = np.tan(angles)
    table = light_table(lens, slopes, places_per_lens=_PLACES, neighbours=0)
    light = table.shares.sum(axis=0)
    places, shares, light = table.places[light > 0.0], table.shares[:, light > 0.0], light[light > 0.0]
    mean = slopes @ shares / light
    spread = np.sqrt(np.maximum(slopes**2 @ shares / light - mean**2, 0.0))
    # A lens has two like sides; and directions have one place each.
    mean, spread = 0.5 * (mean - mean[::-1]), 0.5 * (spread + spread[::-1])
    return TrueDirections(places, np.minimum.accumulate(mean) - _TINY * places / lens.pitch, spread)


def _interpolate(at: Real, x: Real, y: Real) -> Real:
    """Piecewise linear interpolation, going on in a straight line beyond the ends; ``x`` ascends."""
    at = np.asarray(at, dtype=np.float64)
    k = np.clip(np.searchsorted(x, at) - 1, 0, len(x) - 2)
    return y[k] + (at - x[k]) * (y[k + 1] - y[k]) / (x[k + 1] - x[k])
