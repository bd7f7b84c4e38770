"""Crossings of rays with exact shapes: the formulas of :mod:`lippmann.device.whitted.shape_table` on the device.

A ray is an origin and a unit direction; distances are along it. A shape's numbers come either from a table on the
device (:func:`fetch`) or are written into the kernel (:func:`literal`), which makes a handful of shapes cheaper than
any hierarchy. Everything is written for single precision: quadrics are solved about the point of the ray nearest to
their center, so that far origins cost no digits.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import larger, smaller
from lippmann.device.types import Bool, Float, Point3f, UInt32, Vector3f, Vector4f
from lippmann.device.whitted.shape_table import Column, Kind

#: Direction components below this are taken for it: their reciprocal stays finite.
_SMALLEST = 1e-20


@dataclass
class Row:
    """One row of the shape table; each field is a number or a device array."""

    center: Vector3f
    axis: Vector3f
    k0: Float
    k1: Float
    k2: Float
    low: Float
    high: Float
    kind: Float
    material: Float
    clip: Float
    inside: Float
    passes: Float


@dataclass
class Crossing:
    """A distance and whether the ray does cross the shape there."""

    t: Float
    good: Bool


def fetch(rows: Float, index: UInt32, active: Bool) -> Row:
    """Row ``index`` of a flat table."""
    first = index * 4
    a = dr.gather(mi.Vector4f, rows, first, active)
    b = dr.gather(mi.Vector4f, rows, first + 1, active)
    c = dr.gather(mi.Vector4f, rows, first + 2, active)
    d = dr.gather(mi.Vector4f, rows, first + 3, active)
    return Row(xyz(a), xyz(b), a.w, b.w, c.x, c.y, c.z, c.w, d.x, d.y, d.z, d.w)


def literal(row: NDArray[np.float32]) -> Row:
    """A row whose numbers become part of the kernel."""
    n = [float(number) for number in row]
    center, axis = mi.Vector3f(*n[:3]), mi.Vector3f(*n[Column.AXIS : Column.AXIS + 3])
    rest = [n[Column.K0], n[Column.K1], *n[Column.K2 :]]
    return Row(center, axis, *rest)


def xyz(v: Vector4f) -> Vector3f:
    """The first three of four."""
    return mi.Vector3f(v.x, v.y, v.z)


def reciprocal(d: Vector3f) -> Vector3f:
    """One over each component of a direction, never infinite."""
    return dr.rcp(dr.select(dr.abs(d) < _SMALLEST, dr.copysign(mi.Vector3f(_SMALLEST), d), d))


def formulas(kinds: Collection[Kind]) -> list[Kind]:
    """The kinds whose formulas serve shapes of all of ``kinds``: a sphere is a quadric too, where both occur."""
    return sorted(set(kinds) - ({Kind.SPHERE} if Kind.QUADRIC in kinds else set()))


def serves(formula: Kind, row: Row) -> Bool:
    """Whether a shape is one for this formula, of several."""
    return row.kind <= float(formula) if formula is Kind.QUADRIC else row.kind == float(formula)


def crossings(formula: Kind, inside_only: bool, row: Row, o: Point3f, d: Vector3f) -> list[Crossing]:
    """All crossings of a ray with a shape by one of the :func:`formulas`, at any distance, the nearer first.

    ``inside_only`` says that some shapes may be seen from within alone.
    """
    cross = {
        Kind.SPHERE: _sphere,
        Kind.QUADRIC: _quadric,
        Kind.BOX: _box,
        Kind.FLAT: _flat,
        Kind.HUGE_SPHERE: _huge_sphere,
    }
    return cross[formula](inside_only, row, o, d)


def _sphere(inside_only: bool, row: Row, o: Point3f, d: Vector3f) -> list[Crossing]:
    to_center = row.center - o
    to_foot = dr.dot(to_center, d)
    foot = d * to_foot - to_center
    discriminant = row.k0 - dr.dot(foot, foot)
    half = dr.sqrt(discriminant)
    good = discriminant > 0
    entering = good & (row.inside == 0) if inside_only else good
    return [Crossing(to_foot - half, entering), Crossing(to_foot + half, good)]


def _huge_sphere(inside_only: bool, row: Row, o: Point3f, d: Vector3f) -> list[Crossing]:
    """As :func:`_sphere`, in double precision: a millionth of the radius may be the whole scene."""
    to_center, along = mi.Vector3d(row.center) - mi.Vector3d(o), mi.Vector3d(d)
    squared = dr.squared_norm(along)
    to_foot = dr.dot(to_center, along) / squared
    foot = along * to_foot - to_center
    discriminant = (mi.Float64(row.k1) * row.k1 - dr.dot(foot, foot)) / squared
    half = dr.sqrt(discriminant)
    good = mi.Bool(discriminant > 0)
    entering = good & (row.inside == 0) if inside_only else good
    return [Crossing(mi.Float(to_foot - half), entering), Crossing(mi.Float(to_foot + half), good)]


def _quadric(inside_only: bool, row: Row, o: Point3f, d: Vector3f) -> list[Crossing]:
    to_center = row.center - o
    to_foot = dr.dot(to_center, d)
    foot = d * to_foot - to_center
    h, dh = dr.dot(foot, row.axis), dr.dot(d, row.axis)
    # a s^2 + 2 b s + c = 0 with s counted from the foot; foot . d = 0.
    a = 1 - row.k2 * dh * dh
    b = -(row.k2 * h + row.k1) * dh
    c = dr.dot(foot, foot) - (row.k2 * h + 2 * row.k1) * h - row.k0
    discriminant = b * b - a * c
    # Neither root loses digits to cancellation; a cone's a may vanish.
    q = -(b + dr.copysign(dr.sqrt(discriminant), b))
    s1, s2 = q / a, c / q
    roots = []
    for s in (smaller(s1, s2), larger(s1, s2)):
        along = h + s * dh
        good = (discriminant > 0) & (along > row.low) & (along < row.high)
        if inside_only:
            good &= (row.inside == 0) | (a * s + b > 0)
        roots.append(Crossing(to_foot + s, good))
    return roots


def _box(inside_only: bool, row: Row, o: Point3f, d: Vector3f) -> list[Crossing]:
    # A ray along a face counts as inside.
    along = dr.abs(d) < _SMALLEST
    between = (o >= row.center) & (o <= row.axis)
    inverse = reciprocal(d)
    a, b = (row.center - o) * inverse, (row.axis - o) * inverse
    near = dr.select(along, dr.select(between, -dr.inf, dr.inf), smaller(a, b))
    far = dr.select(along, dr.inf, larger(a, b))
    enter = larger(larger(near.x, near.y), near.z)
    leave = smaller(smaller(far.x, far.y), far.z)
    return [Crossing(enter, enter <= leave), Crossing(leave, enter <= leave)]


def _flat(inside_only: bool, row: Row, o: Point3f, d: Vector3f) -> list[Crossing]:
    t = dr.dot(row.center - o, row.axis) / dr.dot(d, row.axis)
    if isinstance(row.k1, float) and row.k1 == np.inf:
        return [Crossing(t, dr.isfinite(t))]
    q = o - row.center + d * t
    r2 = dr.dot(q, q)
    return [Crossing(t, (r2 > row.k0) & (r2 < row.k1))]
