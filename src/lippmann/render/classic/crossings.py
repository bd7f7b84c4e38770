"""Where rays cross exact shapes: the formulas of :mod:`lippmann.render.classic.shape_table` on the device.

A ray is an origin and a unit direction; distances are along it. Rows are four ``mi.Vector4f``, as :func:`fetch` gives
them. Everything is written for single precision: quadrics are solved about the point of the ray nearest to their
center, so that far origins cost no digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.render.classic.shape_table import Kind

#: Direction components below this are taken for it: their reciprocal stays finite.
_SMALLEST = 1e-20


@dataclass
class Crossing:
    """A distance and whether the ray does cross the shape there."""

    t: Any
    good: Any


def fetch(rows: Any, index: Any, active: Any) -> tuple[Any, Any, Any, Any]:
    """The four groups of row ``index`` of a flat table."""
    first = index * 4
    return (
        dr.gather(mi.Vector4f, rows, first, active),
        dr.gather(mi.Vector4f, rows, first + 1, active),
        dr.gather(mi.Vector4f, rows, first + 2, active),
        dr.gather(mi.Vector4f, rows, first + 3, active),
    )


def reciprocal(d: Any) -> Any:
    """One over each component of a direction, never infinite."""
    return dr.rcp(dr.select(dr.abs(d) < _SMALLEST, dr.copysign(mi.Vector3f(_SMALLEST), d), d))


def slab(low: Any, high: Any, o: Any, inverse: Any) -> tuple[Any, Any]:
    """Distances at which a ray enters and leaves a box along the axes; it misses where the second is smaller."""
    a, b = (low - o) * inverse, (high - o) * inverse
    near, far = dr.minimum(a, b), dr.maximum(a, b)
    return dr.maximum(dr.maximum(near.x, near.y), near.z), dr.minimum(dr.minimum(far.x, far.y), far.z)


@dataclass(frozen=True)
class Traits:
    """What the rows of a table hold, so that kernels do no more than needed: ``kinds``, and whether some are seen from
    within alone."""

    kinds: frozenset[Kind]
    inside_only: bool


def crossings(traits: Traits, row: tuple[Any, Any, Any, Any], o: Any, d: Any) -> tuple[Crossing, Crossing]:
    """Both crossings of a ray with a shape, at any distance, the nearer first."""
    ways = {Kind.QUADRIC: _quadric, Kind.BOX: _box, Kind.FLAT: _flat}
    found = {kind: ways[kind](traits, row, o, d) for kind in sorted(traits.kinds)}
    first, second = found.popitem()[1]
    for kind, (near, far) in found.items():
        this = row[2].w == float(kind)
        first = Crossing(dr.select(this, near.t, first.t), dr.select(this, near.good, first.good))
        second = Crossing(dr.select(this, far.t, second.t), dr.select(this, far.good, second.good))
    return first, second


def _quadric(traits: Traits, row: tuple[Any, Any, Any, Any], o: Any, d: Any) -> tuple[Crossing, Crossing]:
    center, axis, k2, k1, k0 = xyz(row[0]), xyz(row[1]), row[2].x, row[1].w, row[0].w
    low, high = row[2].y, row[2].z
    to_foot = dr.dot(center - o, d)
    foot = o - center + d * to_foot
    h, dh = dr.dot(foot, axis), dr.dot(d, axis)
    # a s^2 + 2 b s + c = 0 with s counted from the foot; foot . d = 0.
    a = 1 - k2 * dh * dh
    b = -(k2 * h + k1) * dh
    c = dr.dot(foot, foot) - (k2 * h + 2 * k1) * h - k0
    discriminant = b * b - a * c
    # Neither root loses digits to cancellation; a cone's a may vanish.
    q = -(b + dr.copysign(dr.sqrt(discriminant), b))
    s1, s2 = q / a, c / q
    found = []
    for s in (dr.minimum(s1, s2), dr.maximum(s1, s2)):
        along = h + s * dh
        good = (discriminant > 0) & (along > low) & (along < high)
        if traits.inside_only:
            good &= (row[3].z == 0) | (a * s + b > 0)
        found.append(Crossing(to_foot + s, good))
    return found[0], found[1]


def _box(traits: Traits, row: tuple[Any, Any, Any, Any], o: Any, d: Any) -> tuple[Crossing, Crossing]:
    near, far = slab(xyz(row[0]), xyz(row[1]), o, reciprocal(d))
    return Crossing(near, near <= far), Crossing(far, near <= far)


def _flat(traits: Traits, row: tuple[Any, Any, Any, Any], o: Any, d: Any) -> tuple[Crossing, Crossing]:
    offset, normal = o - xyz(row[0]), xyz(row[1])
    t = -dr.dot(offset, normal) / dr.dot(d, normal)
    q = offset + d * t
    r2 = dr.dot(q, q)
    return Crossing(t, (r2 > row[0].w) & (r2 < row[1].w)), Crossing(mi.Float(dr.inf), mi.Bool(False))


def xyz(v: Any) -> Any:
    """The first three of four."""
    return mi.Vector3f(v.x, v.y, v.z)
