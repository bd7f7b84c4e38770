"""Keys of the light at a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.render.pooled.keys import key_of
from lippmann.render.pooled.surfaces import Split

#: Finest gloss: root cells of direction per quarter map.
FINEST_GLOSS = 8


@dataclass(frozen=True)
class Scale:
    """How finely light is told apart: cells of side ``finest`` (world units) up to the distance ``near``, where the
    pixels' rays are as wide as a lens; beyond it doubling as the distance doubles."""

    finest: Any
    near: Any


def scaled(scale: Scale, distance: Any) -> tuple[Any, Any]:
    """Side of the finest cells at a distance from the pixel, and a number for it."""
    octave = dr.clip(dr.floor(dr.log2(dr.maximum(distance / scale.near, 1))), 0, 20)
    octave = dr.select(dr.isfinite(octave), octave, 0)
    return scale.finest * dr.exp2(octave), mi.UInt32(octave)


def diffuse_key(p: Any, split: Split, finest: Any, octave: Any) -> Any:
    """Key of the light that falls on a surface point."""
    return key_of(p, split.normal, mi.UInt32(1), octave, finest)


def gloss_key(p: Any, split: Split, ray_d: Any, finest: Any, octave: Any) -> Any:
    """Key of what a rough lobe sends back: along the mirrored ray, as finely as the lobe is narrow."""
    n = split.normal
    mirrored = dr.normalize(mi.Vector3f(ray_d) - n * (2 * dr.dot(n, ray_d)))
    fineness = dr.clip(mi.UInt32(dr.ceil(0.08 / split.alpha)), 1, FINEST_GLOSS)
    return key_of(p, mirrored, fineness, octave, finest)
