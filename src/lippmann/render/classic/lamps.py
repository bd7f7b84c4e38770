"""Lamps of the classic light models, as one table on the device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.render.classic.crossings import xyz
from lippmann.render.classic.geometry import FAR
from lippmann.scene.classic import ClassicLight


@dataclass
class Illumination:
    """What one lamp does to a point: unit direction ``toward`` it, its ``distance``, its ``strength`` there."""

    toward: Any
    distance: Any
    strength: Any
    color: Any


class LampTable:
    """The lamps of a scene."""

    def __init__(self, lamps: Sequence[ClassicLight]) -> None:
        self.count = len(lamps)
        rows = [_row(lamp) for lamp in lamps] or [[0.0] * 16]
        self._rows = mi.Float(np.array(rows, np.float32).ravel())
        self._directional = any(lamp.kind == "directional" for lamp in lamps)
        self._attenuated = any(lamp.attenuation is not None for lamp in lamps)
        self._spots = any(lamp.kind == "spot" for lamp in lamps)

    def color(self, index: Any, active: Any) -> Any:
        """What the lamp itself looks like."""
        return mi.Color3f(xyz(dr.gather(mi.Vector4f, self._rows, 4 * index + 1, active)))

    def illuminate(self, index: Any, p: Any, n: Any) -> Illumination:
        """Light of a lamp at ``p``; its strength includes the cosine to ``n`` and may be negative."""
        a = dr.gather(mi.Vector4f, self._rows, 4 * index)
        b = dr.gather(mi.Vector4f, self._rows, 4 * index + 1)
        toward = xyz(a) - p
        distance = dr.norm(toward)
        toward *= dr.rcp(distance)
        if self._directional or self._spots:
            c = dr.gather(mi.Vector4f, self._rows, 4 * index + 2)
        if self._directional:
            directional = a.w > 0
            toward = dr.select(directional, -xyz(c), toward)
            distance = dr.select(directional, FAR, distance)
        strength = dr.dot(n, toward)
        if self._attenuated or self._spots:
            d = dr.gather(mi.Vector4f, self._rows, 4 * index + 3)
        if self._attenuated:
            reached = mi.Float(distance)
            if self._directional:
                reached = dr.select(directional, 0, reached)
            strength *= dr.rcp(d.x + (d.y + d.z * reached) * reached)
        if self._spots:
            angle = dr.safe_acos(dr.dot(-xyz(c), toward))
            start, end = c.w, d.w
            inside = 1 - (angle - start) / (end - start)
            strength *= dr.select(angle > start, dr.select(angle > end, 0, inside), 1)
        return Illumination(toward, distance, strength, mi.Color3f(xyz(b)))


def _row(lamp: ClassicLight) -> list[float]:
    """Center, directional | color, - | direction, start of the falloff | attenuation, end of the falloff."""
    spot = lamp.kind == "spot"
    start, end = (radians(lamp.falloff_start), radians(lamp.falloff_end)) if spot else (4.0, 5.0)
    return [
        *lamp.center,
        float(lamp.kind == "directional"),
        *lamp.color,
        0.0,
        *lamp.direction,
        start,
        *(lamp.attenuation or (1.0, 0.0, 0.0)),
        end,
    ]
