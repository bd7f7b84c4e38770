"""True directions: the median direction of the light that leaves a place of the panel through its own lens.

The mean would follow the faint light of a lens's flanks: pictures along it are 0.3 to 0.7 dB worse to an eye.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lippmann.display.distortion import Distortion
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.optics.lens import Lens, Real, check_lens
from lippmann.optics.trace import Vectors, crest, trace, trace_back

#: Places of half a lens at which directions are known; between them they are interpolated.
_PLACES = 49

#: Points of the crest through which the light of a place is followed, across the lens and, if it is round, along it.
_POINTS, _ROUND_POINTS = 512, 48

#: Largest angle in degrees of light that counts.
_LARGEST_ANGLE = 80.0

#: Distance in pitches of the two places by which it is known how much light a place sends through a point.
_APART = 1e-5

#: Slope by which the directions of a lens fall off where its light would have them stand still.
_TINY = 1e-9


@dataclass(frozen=True, eq=False)
class TrueDirections:
    """Direction of a place.

    Attributes
    ----------
    places:
        ``(n,)`` places across the own lens in mm relative to its axis, ascending.
    slopes:
        ``(n,)`` slopes across the lens of their median directions, descending: a place on the right is seen from
        the left.
    spread:
        ``(n,)`` standard deviation of the slope of their light.
    """

    places: Real
    slopes: Real
    spread: Real

    def direction_of(self, place: Real) -> Real:
        """Slope of the median direction of places; beyond the lens as its last places go on."""
        return _interpolate(place, self.places, self.slopes)


@lru_cache(maxsize=16)
def true_directions(lens: Lens) -> TrueDirections:
    """The true directions of a lens: light of all angles that leaves a place through it, weighted by its share.

    Of a micro-lens, those of places level with its centre.

    Examples
    --------
    >>> from lippmann.optics.directions import true_directions
    >>> from lippmann.optics.lens import Lens
    >>> outermost = true_directions(Lens.of(lippmann.load_display("print-60lpi"))).slopes[0]
    >>> print(f"{outermost:.2f}")
    0.54
    """
    check_lens(lens)
    half = np.linspace(0.0, 0.5, _PLACES) * lens.pitch
    x, y = lens.samples(_POINTS if lens.is_cylinder else _ROUND_POINTS)
    apart = _APART * lens.pitch
    before, after = (_leaving(lens, half[:, None] + step, x, y) for step in (-apart, apart))
    slope_x, slope_y = (0.5 * (a + b) for a, b in zip(before, after, strict=True))
    # Light that a point of the crest sends evenly into all angles, by the place of the panel that it comes from.
    angles = np.abs(np.arctan(after[0]) - np.arctan(before[0])) / (2.0 * apart)
    is_passing = np.isfinite(slope_x) & (np.abs(slope_x) < math.tan(math.radians(_LARGEST_ANGLE)))
    slope_x, slope_y = (np.where(is_passing, slope, 0.0) for slope in (slope_x, slope_y))
    weights = np.where(is_passing, trace(lens, x, y, slope_x, slope_y).light * angles, 0.0)
    light = weights.sum(axis=1)
    mean = (weights * slope_x).sum(axis=1) / light
    spread = np.sqrt(np.maximum((weights * slope_x**2).sum(axis=1) / light - mean**2, 0.0))
    median = np.array([_weighted_median(*of_place) for of_place in zip(slope_x, weights, strict=True)])
    # A lens has two like sides; and directions have one place each.
    median[0] = 0.0
    median = np.minimum.accumulate(median) - _TINY * half / lens.pitch
    sides = np.concatenate([-half[:0:-1], half]), np.concatenate([-median[:0:-1], median])
    return TrueDirections(*sides, np.concatenate([spread[:0:-1], spread]))


@lru_cache(maxsize=64)
def distortion_of(profile: LensProfile, lenses: LensArray, gap: float) -> Distortion:
    """The change that such lenses make to the directions of a pinhole at the gap."""
    directions = true_directions(Lens(profile, lenses))
    places = directions.places[_PLACES:]
    factors = -gap * directions.slopes[_PLACES:] / places
    return Distortion(float(places[-1]), (float(factors[0]), *(float(factor) for factor in factors)))


def _leaving(lens: Lens, place: Real, x: Real, y: Real) -> tuple[Real, Real]:
    """Slopes of the light that leaves places ``(places, 1)`` through points ``(n,)`` of the crest; NaN if none does."""
    depth, _ = crest(lens, x, y)
    height = lens.profile.thickness - depth
    length = np.sqrt((x - place) ** 2 + y**2 + height**2)
    inside = Vectors((x - place) / length, y / length + 0.0 * place, height / length)
    slope_x, slope_y, _ = trace_back(lens, np.broadcast_to(place, length.shape), np.zeros(length.shape), inside)
    return slope_x, slope_y


def _weighted_median(values: Real, weights: Real) -> float:
    """Value with half of the weights to either side, interpolated between the values' own middles."""
    order = np.argsort(values)
    values, weights = values[order], weights[order]
    below = np.cumsum(weights) - 0.5 * weights
    return float(np.interp(0.5 * weights.sum(), below, values))


def _interpolate(at: Real, x: Real, y: Real) -> Real:
    """Piecewise linear interpolation, going on in a straight line beyond the ends; ``x`` ascends."""
    at = np.asarray(at, dtype=np.float64)
    k = np.clip(np.searchsorted(x, at) - 1, 0, len(x) - 2)
    return y[k] + (at - x[k]) * (y[k + 1] - y[k]) / (x[k + 1] - x[k])
