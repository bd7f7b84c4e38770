"""What a ray meets among exact shapes: a walk through the hierarchy of the many, and a list of the few."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import larger, smaller, upload
from lippmann.device.types import Bool, Float, Point3f, UInt32, Vector3f
from lippmann.device.whitted.bvh import GRID, LEAF, make_bvh
from lippmann.device.whitted.clip_planes import Clipping
from lippmann.device.whitted.intersections import Row, crossings, fetch, literal, reciprocal
from lippmann.device.whitted.shape_table import Column, Kind, ShapeTable

#: Up to this many listed shapes are written into the kernel; more are looped over.
MOST_LITERAL = 64


class ShapeTracer:
    """The walked and listed shapes of a table, and its lights.

    ``closest`` finds the nearest crossing beyond the origin, ``passing`` the light that gets past the shapes.
    """

    def __init__(self, table: ShapeTable, clipping: Clipping) -> None:
        self._table = table
        self._clipping = clipping if (table.rows[:, Column.CLIP] >= 0).any() else None
        self._inside_only = bool(table.rows[:, Column.INSIDE].any())
        self.rows = upload(table.rows)
        self.filters = bool((table.rows[:, Column.PASSES] > 0).any())
        if table.walked:
            self._bvh = make_bvh(table.boxes)
            self._nodes = upload(self._bvh.nodes)

    def closest(self, o: Point3f, d: Vector3f, t: Float, index: UInt32, active: Bool) -> tuple[Float, UInt32]:
        """Distance and row of the nearest crossing before ``t``; where there is none, ``t`` and ``index``."""
        for rows in (self._table.listed_rows, self._table.light_rows):
            if len(rows) <= MOST_LITERAL:
                for number in rows:
                    row = literal(self._table.rows[number])
                    t, index = self._nearer({Kind(int(row.kind))}, row, mi.UInt32(number), o, d, t, index)
            else:
                t, index = self._nearest_of_list(rows, o, d, t, index, active)
        if self._table.walked:
            t, index = self._nearest_walked(o, d, t, index, active)
        return t, index

    def passing(self, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        """What remains of ``light`` past all shapes crossed before ``t``."""
        rows = self._table.listed_rows
        if len(rows) <= MOST_LITERAL:
            for number in rows:
                row = literal(self._table.rows[number])
                light = self._past({Kind(int(row.kind))}, row, o, d, t, light)
        else:
            light = self._past_list(rows, o, d, t, light)
        if self._table.walked:
            light = self._past_walked(o, d, t, light)
        return light

    @dr.syntax
    def _nearest_walked(self, o: Point3f, d: Vector3f, t: Float, index: UInt32, active: Bool) -> tuple[Float, UInt32]:
        kinds = self._kinds(self._table.walked_rows)
        foot, scale, shift, node, end = self._start(o, d)
        node = dr.select(active, node, end)
        while dr.hint(node < end, label="shapes"):
            meets, last = self._meets(node, scale, shift, -foot, t - foot)
            if meets & (last >= LEAF):
                number = last - LEAF + self._table.traced
                t, index = self._nearer(kinds, fetch(self.rows, number, True), number, o, d, t, index)
            node += dr.select(meets | (last >= LEAF), 1, last)
        return t, index

    @dr.syntax
    def _nearest_of_list(
        self, rows: range, o: Point3f, d: Vector3f, t: Float, index: UInt32, active: Bool
    ) -> tuple[Float, UInt32]:
        kinds = self._kinds(rows)
        number = mi.UInt32(rows.start)
        while dr.hint(active & (number < rows.stop), label="listed shapes"):
            t, index = self._nearer(kinds, fetch(self.rows, number, True), number, o, d, t, index)
            number += 1
        return t, index

    def _nearer(
        self, kinds: set[Kind], row: Row, number: UInt32, o: Point3f, d: Vector3f, t: Float, index: UInt32
    ) -> tuple[Float, UInt32]:
        for crossing in reversed(crossings(kinds, self._inside_only, row, o, d)):
            good = crossing.good & (crossing.t > 0) & (crossing.t < t)
            if self._clipping is not None:
                good = self._clipping.keeps(row.clip, o + d * crossing.t, good)
            t = dr.select(good, crossing.t, t)
            index = dr.select(good, number, index)
        return t, index

    @dr.syntax
    def _past_walked(self, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        kinds = self._kinds(self._table.walked_rows)
        foot, scale, shift, node, end = self._start(o, d)
        while dr.hint((node < end) & (light > 0), label="shadows of shapes"):
            meets, last = self._meets(node, scale, shift, -foot, t - foot)
            if meets & (last >= LEAF):
                row = fetch(self.rows, last - LEAF + self._table.traced, True)
                light = self._past(kinds, row, o, d, t, light)
            node += dr.select(meets | (last >= LEAF), 1, last)
        return light

    @dr.syntax
    def _past_list(self, rows: range, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        kinds = self._kinds(rows)
        number = mi.UInt32(rows.start)
        while dr.hint((light > 0) & (number < rows.stop), label="shadows of listed shapes"):
            light = self._past(kinds, fetch(self.rows, number, True), o, d, t, light)
            number += 1
        return light

    def _past(self, kinds: set[Kind], row: Row, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        for crossing in crossings(kinds, self._inside_only, row, o, d):
            good = crossing.good & (crossing.t > 0) & (crossing.t < t)
            if self._clipping is not None:
                # Tachyon clips the shadows of opaque shapes alone.
                kept = self._clipping.keeps(row.clip, o + d * crossing.t, good)
                good &= (row.passes > 0) | kept if self.filters else kept
            light = dr.select(good, light * row.passes if self.filters else 0, light)
        return light

    def _kinds(self, rows: range) -> set[Kind]:
        return {Kind(int(kind)) for kind in np.unique(self._table.rows[rows.start : rows.stop, Column.KIND])}

    def _start(self, o: Point3f, d: Vector3f) -> tuple[Float, Vector3f, Vector3f, UInt32, UInt32]:
        """A ray on the grid of the hierarchy, counted from its point nearest to the middle: distance of that point,
        what makes distances of steps along an axis (times ``scale``, plus ``shift``), and the first entry and the end
        of the layout to walk."""
        bvh = self._bvh
        middle = mi.Vector3f(*(bvh.origin + bvh.step * (GRID / 2)).tolist())
        per_step = mi.Vector3f(*(1 / bvh.step).tolist())
        foot = dr.dot(middle - o, d)
        place = (o - middle + d * foot) * per_step + GRID / 2
        octant = dr.select(d.x < 0, mi.UInt32(1), mi.UInt32(0))
        octant += dr.select(d.y < 0, mi.UInt32(2), mi.UInt32(0)) + dr.select(d.z < 0, mi.UInt32(4), mi.UInt32(0))
        scale = reciprocal(d * per_step)
        return foot, scale, -place * scale, octant * bvh.count, (octant + 1) * bvh.count

    def _meets(
        self, node: UInt32, scale: Vector3f, shift: Vector3f, nearest: Float, farthest: Float
    ) -> tuple[Bool, UInt32]:
        """Whether a ray meets a node's box between two distances, and the node's last word."""
        words = dr.gather(mi.Vector4u, self._nodes, node)
        near, far = (
            [dr.fma(mi.Float(side(words[axis])), scale[axis], shift[axis]) for axis in range(3)]
            for side in (lambda word: word & 0xFFFF, lambda word: word >> 16)
        )
        enter = larger(larger(near[0], near[1]), larger(near[2], nearest))
        leave = smaller(smaller(far[0], far[1]), smaller(far[2], farthest))
        return enter <= leave, words[3]
