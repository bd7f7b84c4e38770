"""What a ray meets among exact shapes: a walk through the hierarchy of those with an end, and a list of the others."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.render.classic.bvh import make_bvh
from lippmann.render.classic.clipping import Clipping
from lippmann.render.classic.crossings import Traits, crossings, fetch, reciprocal, slab, xyz
from lippmann.render.classic.shape_table import Kind, ShapeTable

#: Index of what is not there.
NONE = 0xFFFFFFFF


class ShapeTracer:
    """The shapes of a scene on the device.

    ``rows`` is the flat table; ``closest`` and ``passing`` find the nearest crossing beyond the origin, and the light
    that passes.
    """

    def __init__(self, table: ShapeTable, clipping: Clipping) -> None:
        kinds = frozenset(kind for kind in Kind if table.has(kind))
        self.traits = Traits(kinds, bool(table.rows[:, 14].any()))
        self.rows = mi.Float(table.rows.ravel())
        self.clipping = clipping if (table.rows[:, 13] >= 0).any() else None
        self.filters = bool((table.rows[:, 15] > 0).any())
        self.bounded = table.bounded
        self.unbounded = table.unbounded
        self._bounded_traits = Traits(_kinds(table.rows[: table.bounded]), self.traits.inside_only)
        self._unbounded_traits = Traits(_kinds(table.rows[table.bounded :]), False)
        if table.bounded:
            layouts = make_bvh(table.boxes)
            self._nodes = mi.Float(layouts.ravel())
            self._count = layouts.shape[1]

    def closest(self, o: Any, d: Any, t: Any, active: Any) -> tuple[Any, Any]:
        """Distance and row of the nearest crossing before ``t`` (then ``t`` and ``NONE``)."""
        found = mi.UInt32(NONE)
        if self.unbounded:
            t, found = self._nearest_unbounded(o, d, t, found, active)
        if self.bounded:
            t, found = self._nearest_bounded(o, d, t, found, active)
        return t, found

    def passing(self, o: Any, d: Any, t: Any, active: Any) -> Any:
        """Share of light that passes all shapes crossed before ``t``."""
        light = dr.select(active, mi.Float(1), mi.Float(0))
        if self.unbounded:
            light = self._past_unbounded(o, d, t, light)
        if self.bounded:
            light = self._past_bounded(o, d, t, light)
        return light

    @dr.syntax
    def _nearest_bounded(self, o: Any, d: Any, t: Any, found: Any, active: Any) -> tuple[Any, Any]:
        inverse = reciprocal(d)
        node, end = self._range(d)
        node = dr.select(active, node, end)
        while dr.hint(node < end, label="shapes"):
            low = dr.gather(mi.Vector4f, self._nodes, 2 * node)
            high = dr.gather(mi.Vector4f, self._nodes, 2 * node + 1)
            enter, leave = slab(xyz(low), xyz(high), o, inverse)
            meets = (enter <= dr.minimum(leave, t)) & (leave >= 0)
            leaf = high.w >= 0
            if meets & leaf:
                index = mi.UInt32(high.w)
                t, found = self._nearer(self._bounded_traits, index, o, d, t, found)
            node += dr.select(meets, mi.UInt32(1), mi.UInt32(low.w))
        return t, found

    @dr.syntax
    def _nearest_unbounded(self, o: Any, d: Any, t: Any, found: Any, active: Any) -> tuple[Any, Any]:
        index = mi.UInt32(self.bounded)
        while dr.hint(active & (index < self.bounded + self.unbounded), label="unbounded shapes"):
            t, found = self._nearer(self._unbounded_traits, index, o, d, t, found)
            index += 1
        return t, found

    def _nearer(self, traits: Traits, index: Any, o: Any, d: Any, t: Any, found: Any) -> tuple[Any, Any]:
        row = fetch(self.rows, index, True)
        for crossing in reversed(crossings(traits, row, o, d)):
            good = crossing.good & (crossing.t > 0) & (crossing.t < t)
            if self.clipping is not None:
                good &= self.clipping.keeps(row[3].y, o + d * crossing.t, good)
            t = dr.select(good, crossing.t, t)
            found = dr.select(good, index, found)
        return t, found

    @dr.syntax
    def _past_bounded(self, o: Any, d: Any, t: Any, light: Any) -> Any:
        inverse = reciprocal(d)
        node, end = self._range(d)
        while dr.hint((node < end) & (light > 0), label="shadows of shapes"):
            low = dr.gather(mi.Vector4f, self._nodes, 2 * node)
            high = dr.gather(mi.Vector4f, self._nodes, 2 * node + 1)
            enter, leave = slab(xyz(low), xyz(high), o, inverse)
            meets = (enter <= dr.minimum(leave, t)) & (leave >= 0)
            leaf = high.w >= 0
            if meets & leaf:
                light = self._past(self._bounded_traits, mi.UInt32(high.w), o, d, t, light)
            node += dr.select(meets, mi.UInt32(1), mi.UInt32(low.w))
        return light

    @dr.syntax
    def _past_unbounded(self, o: Any, d: Any, t: Any, light: Any) -> Any:
        index = mi.UInt32(self.bounded)
        while dr.hint((light > 0) & (index < self.bounded + self.unbounded), label="shadows of unbounded shapes"):
            light = self._past(self._unbounded_traits, index, o, d, t, light)
            index += 1
        return light

    def _past(self, traits: Traits, index: Any, o: Any, d: Any, t: Any, light: Any) -> Any:
        row = fetch(self.rows, index, True)
        for crossing in crossings(traits, row, o, d):
            good = crossing.good & (crossing.t > 0) & (crossing.t < t)
            if self.clipping is not None:
                # Tachyon clips only the shadows of what is opaque.
                good &= (row[3].w > 0) | self.clipping.keeps(row[3].y, o + d * crossing.t, good)
            light = dr.select(good, light * row[3].w, light)
        return light

    def _range(self, d: Any) -> tuple[Any, Any]:
        """First and last entry of the layout for a direction."""
        octant = dr.select(d.x < 0, mi.UInt32(1), mi.UInt32(0))
        octant += dr.select(d.y < 0, mi.UInt32(2), mi.UInt32(0)) + dr.select(d.z < 0, mi.UInt32(4), mi.UInt32(0))
        return octant * self._count, (octant + 1) * self._count


def _kinds(rows: Any) -> frozenset[Kind]:
    return frozenset(Kind(int(kind)) for kind in np.unique(rows[:, 11]))
