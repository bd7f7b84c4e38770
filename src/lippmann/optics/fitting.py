"""Lenses from what makers state: the crest that focuses best, or that has a stated viewing angle, and its gap."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import (
    DEFAULT_INDEX,
    LensProfile,
    check_conic,
    check_index,
    check_length,
    length_rule,
)
from lippmann.display.validation import finite
from lippmann.errors import DisplayError
from lippmann.optics.first_order import extreme_ray_field
from lippmann.optics.lens import Lens
from lippmann.optics.trace import trace

#: Rays that an estimate of a focus or a gap follows through a lens: their error is below 1e-5 of the pitch.
_RAYS = 500

#: Slope of the light by which the gap is found: small, yet far above rounding noise.
_SMALL_SLOPE = 0.01

#: Steepest crest that is made: half its width over its radius; typical sheets reach .94.
_STEEPEST = 0.95

#: Flattest crest that is tried, in radii per thickness; a paraxial focus at the back has 0.23 to 0.5.
_FLATTEST = 3.0

#: Steps of the golden section and of bisection: 0.618^40 and 0.5^50 leave less than 1e-8 and 1e-14 of the range.
_GOLDEN_STEPS, _BISECTIONS = 40, 50

#: Rounds in which pitch, crest and gap of an apparent pitch agree; each gains the ratio of gap and viewing distance.
_ROUNDS = 6


def fit_profile(
    lenses: LensArray,
    *,
    thickness: float,
    index: float = DEFAULT_INDEX,
    radius: float | None = None,
    field: float | None = None,
    conic: float = 0.0,
    diameter: float | None = None,
) -> LensProfile:
    """The profile with a stated crest radius, or with a stated viewing angle in degrees, or at best focus.

    Raises
    ------
    DisplayError
        If a value is out of range, radius and field are both given, or no crest does it.
    """
    if radius is not None and field is not None:
        rule = "the crest radius gives the viewing angle"
        raise DisplayError("radius and field are both given", where="lens.field", rule=rule, fix="leave one out")
    thickness = check_length(thickness, "lens.thickness")
    values = (check_index(index, "lens.index"), check_conic(conic, "lens.conic"), diameter)
    if radius is None:
        flat = LensProfile(_FLATTEST * max(thickness, lenses.pitch), thickness, *values)
        flat.check(lenses)
        if field is not None:
            radius = _radius_of_field(flat, lenses, finite(field, "lens.field"))
        else:
            radius = _best_focus(flat, lenses)
    profile = LensProfile(radius, thickness, *values)
    profile.check(lenses)
    return profile


@lru_cache(maxsize=64)
def gap_of(profile: LensProfile, lenses: LensArray) -> float:
    """Gap in mm of the pinhole that shows the same directions near the axis: centre of the light over its slope.

    Raises
    ------
    DisplayError
        If the lens cannot be, or is too thin to form any image of directions.
    """
    lens = Lens(profile, lenses)
    traced = trace(lens, *lens.samples(_samples(lens)), _SMALL_SLOPE)
    gap = -float(np.average(traced.x, weights=traced.light)) / _SMALL_SLOPE
    if gap <= 0.0:
        rule = length_rule("thickness", "behind this crest it forms no image of directions")
        raise DisplayError(f"thickness is {profile.thickness:.4g} mm", where="lens.thickness", rule=rule)
    return gap


def profile_behind(
    make: Callable[[float], LensProfile], apparent_pitch: float, viewing_distance: float
) -> tuple[LensProfile, float, float]:
    """Profile, pitch and gap of cylinders whose micro-images are ``apparent_pitch`` wide; ``make`` takes a pitch."""
    pitch = apparent_pitch
    for _ in range(_ROUNDS):
        profile = make(pitch)
        gap = gap_of(profile, LensArray("lenticular", pitch))
        pitch = apparent_pitch / (1.0 + gap / viewing_distance)
    return profile, pitch, gap


@lru_cache(maxsize=64)
def _best_focus(profile: LensProfile, lenses: LensArray) -> float:
    """The crest radius whose light from straight ahead lies closest together on the panel, in the mean square."""

    def spread(radius: float) -> float:
        lens = Lens(replace(profile, radius=radius), lenses)
        traced = trace(lens, *lens.samples(_samples(lens)), 0.0)
        return float(np.average(traced.x**2 + traced.y**2 * (not lens.is_cylinder), weights=traced.light))

    low, high = _radii(profile, lenses)
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    inner, outer = high - ratio * (high - low), low + ratio * (high - low)
    at_inner, at_outer = spread(inner), spread(outer)
    for _ in range(_GOLDEN_STEPS):
        if at_inner < at_outer:
            high, outer, at_outer = outer, inner, at_inner
            inner = high - ratio * (high - low)
            at_inner = spread(inner)
        else:
            low, inner, at_inner = inner, outer, at_outer
            outer = low + ratio * (high - low)
            at_outer = spread(outer)
    return 0.5 * (low + high)


def _radius_of_field(profile: LensProfile, lenses: LensArray, field: float) -> float:
    """The crest radius whose extreme ray has this viewing angle, which grows with the radius."""

    def field_of(radius: float) -> float:
        angle = extreme_ray_field(replace(profile, radius=radius), lenses.pitch)
        return -math.inf if math.isnan(angle) else angle

    low, high = _radii(profile, lenses)
    narrowest, widest = max(0.0, field_of(low)), field_of(high)
    if not narrowest < field < widest:
        rule = f"crests on {profile.thickness:.4g} mm of index {profile.index:g} have {narrowest:.3g} to {widest:.3g}"
        raise DisplayError(f"field is {field:g} degrees", where="lens.field", rule=rule)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if field_of(middle) < field else (low, middle)
    return 0.5 * (low + high)


def _radii(flat: LensProfile, lenses: LensArray) -> tuple[float, float]:
    """Smallest and largest crest radius that is tried; raises where the smallest is higher than the sheet is thick."""
    reach = flat.reach(lenses)
    steepest = reach * math.sqrt(max(1.0 + flat.conic, 0.25)) / _STEEPEST
    replace(flat, radius=steepest).check(lenses)
    return steepest, flat.radius


def _samples(lens: Lens) -> int:
    """Number of samples for :meth:`Lens.samples`, about as many rays through a micro-lens as through a cylinder."""
    return _RAYS if lens.is_cylinder else math.isqrt(_RAYS) + 1
