"""Formulas of a single lenticule that need no tracing: field of the extreme ray, and the rule of depth."""

from __future__ import annotations

import math

from lippmann.display.lens_profile import LensProfile


def extreme_ray_field(profile: LensProfile, pitch: float) -> float:
    """Angle in degrees between the outermost views, by the ray from the edge of the micro-image to the crest's edge.

    ``A = arcsin(p / 2R)``, ``r = A - arctan(p / h)`` with h the height of the crest's edge over the panel, and the
    field ``2 (A - arcsin(n sin r))``; the encyclopaedia's formula for circular crests. Another conic's A is the slope
    of its edge. NaN where that ray is totally reflected.
    """
    half = 0.5 * pitch
    sag = profile.sag(half)
    slope = half / (profile.radius - (1.0 + profile.conic) * sag)
    edge = math.atan(slope)
    inside = edge - math.atan(pitch / (profile.thickness - sag))
    sine = profile.index * math.sin(inside)
    return math.degrees(2.0 * (edge - math.asin(sine))) if abs(sine) <= 1.0 else math.nan


def rule_of_depth(profile: LensProfile, strips: float) -> float:
    """Usable depth in mm by the rule of the trade, ``2 N t / n`` for N resolved strips: half before, half behind."""
    return 2.0 * strips * profile.thickness / profile.index
