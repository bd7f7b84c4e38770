"""Nearest crossings of rays with exact shapes: a walk through the hierarchy of the many, and a list of the few."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import larger, smaller, upload
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Float, Int32, Point3f, UInt32, Vector3f
from lippmann.device.whitted.bvh import GRID, LEAF, make_bvh
from lippmann.device.whitted.clip_planes import Clipping
from lippmann.device.whitted.intersections import Row, crossings, fetch, formulas, literal, reciprocal, serves
from lippmann.device.whitted.light_buffer import make_light_buffer
from lippmann.device.whitted.light_buffer_lookup import LightBufferLookup
from lippmann.device.whitted.shape_table import Column, Kind, ShapeTable
from lippmann.scene.values.whitted_surfaces import ClassicLight

#: Up to this many listed shapes are written into the kernel; more are looped over.
MOST_LITERAL = 64


class ShapeTracer:
    """The walked and listed shapes of a table, and its lights.

    ``closest`` finds the nearest crossing beyond the origin, ``passing`` the light that gets past the shapes.
    """

    def __init__(self, table: ShapeTable, clipping: Clipping, lights: Sequence[ClassicLight]) -> None:
        self._table = table
        self._clipping = clipping if (table.rows[:, Column.CLIP] >= 0).any() else None
        self._inside_only = bool(table.rows[:, Column.INSIDE].any())
        self.rows = upload(table.rows)
        self.filters = bool((table.rows[:, Column.PASSES] > 0).any())
        if table.walked:
            self._bvh = make_bvh(table.boxes)
            self._nodes = upload(self._bvh.nodes)
        buffer = make_light_buffer(table, lights)
        self._light_buffer = None if buffer is None else LightBufferLookup(buffer)

    def closest(self, o: Point3f, d: Vector3f, t: Float, index: UInt32, active: Bool) -> tuple[Float, UInt32]:
        """Distance and row of the nearest crossing before ``t``; where there is none, ``t`` and ``index``."""
        for rows in (self._table.listed_rows, self._table.light_rows):
            if len(rows) <= MOST_LITERAL:
                for number in rows:
                    row = literal(self._table.rows[number])
                    t, index = self._nearer(Kind(int(row.kind)), row, mi.UInt32(number), o, d, t, index)
            else:
                t, index = self._nearest_of_list(rows, o, d, t, index, active)
        if self._table.walked:
            t, index = self._walk_to_nearest(o, d, t, index, active)
        return t, index

    def passing(self, o: Point3f, d: Vector3f, t: Float, light: Float, source: UInt32 | None = None) -> Float:
        """The part of ``light`` that passes all shapes crossed before ``t``.

        ``source``: the number of the light source that the rays end at; None where they end elsewhere.
        """
        rows = self._table.listed_rows
        if len(rows) <= MOST_LITERAL:
            for number in rows:
                row = literal(self._table.rows[number])
                light = self._past(Kind(int(row.kind)), row, o, d, t, light)
        else:
            light = self._past_list(rows, o, d, t, light)
        if source is not None and self._light_buffer is not None:
            light = self._look_up_past(self._light_buffer, source, o, d, t, light)
        elif self._table.walked:
            light = self._walk_past(o, d, t, light)
        return light

    @syntax
    def _walk_to_nearest(self, o: Point3f, d: Vector3f, t: Float, index: UInt32, active: Bool) -> tuple[Float, UInt32]:
        kinds = self._formulas(self._table.walked_rows)
        foot, scale, shift, node, end = self._start(o, d)
        node = dr.select(active, node, end)
        while dr.hint(node < end, label="shapes"):
            first, second, step = self._meets(node, scale, shift, -foot, t - foot)
            if first >= 0:
                number = mi.UInt32(first)
                t, index = self._nearer_of_row(kinds, number, o, d, t, index)
            if second >= 0:
                number = mi.UInt32(second)
                t, index = self._nearer_of_row(kinds, number, o, d, t, index)
            node += step
        return t, index

    @syntax
    def _nearest_of_list(
        self, rows: range, o: Point3f, d: Vector3f, t: Float, index: UInt32, active: Bool
    ) -> tuple[Float, UInt32]:
        kinds = self._formulas(rows)
        number = mi.UInt32(rows.start)
        while dr.hint(active & (number < rows.stop), label="listed shapes"):
            t, index = self._nearer_of_row(kinds, number, o, d, t, index)
            number += 1
        return t, index

    @syntax
    def _nearer_of_row(
        self, kinds: list[Kind], number: UInt32, o: Point3f, d: Vector3f, t: Float, index: UInt32
    ) -> tuple[Float, UInt32]:
        row = fetch(self.rows, number, True)
        if dr.hint(len(kinds) == 1, mode="scalar"):
            t, index = self._nearer(kinds[0], row, number, o, d, t, index)
        else:
            # Few lanes are at a shape at once: mostly one formula of several is run.
            for kind in kinds:
                if serves(kind, row):
                    t, index = self._nearer(kind, row, number, o, d, t, index)
        return t, index

    def _nearer(
        self, kind: Kind, row: Row, number: UInt32, o: Point3f, d: Vector3f, t: Float, index: UInt32
    ) -> tuple[Float, UInt32]:
        for crossing in reversed(crossings(kind, self._inside_only, row, o, d)):
            good = crossing.good & (crossing.t > 0) & (crossing.t < t)
            if self._clipping is not None:
                good = self._clipping.keeps(row.clip, o + d * crossing.t, good)
            t = dr.select(good, crossing.t, t)
            index = dr.select(good, number, index)
        return t, index

    @syntax
    def _walk_past(self, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        kinds = self._formulas(self._table.walked_rows)
        foot, scale, shift, node, end = self._start(o, d)
        while dr.hint((node < end) & (light > 0), label="shadows of shapes"):
            first, second, step = self._meets(node, scale, shift, -foot, t - foot)
            if first >= 0:
                light = self._past_row(kinds, mi.UInt32(first), o, d, t, light)
            if second >= 0:
                light = self._past_row(kinds, mi.UInt32(second), o, d, t, light)
            node += step
        return light

    @syntax
    def _look_up_past(
        self, buffer: LightBufferLookup, source: UInt32, o: Point3f, d: Vector3f, t: Float, light: Float
    ) -> Float:
        kinds = self._formulas(self._table.walked_rows)
        place, end, depth = buffer.find(source, o, d, t)
        while dr.hint((place < end) & (light > 0), label="shadows by the light buffer"):
            near, number = buffer.entry(place)
            light = self._past_row(kinds, number, o, d, t, light)
            # Shapes behind the ray's start cast no shadow on it, nor do all that follow.
            place = dr.select(near < depth, place + 1, end)
        return light

    @syntax
    def _past_list(self, rows: range, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        kinds = self._formulas(rows)
        number = mi.UInt32(rows.start)
        while dr.hint((light > 0) & (number < rows.stop), label="shadows of listed shapes"):
            light = self._past_row(kinds, number, o, d, t, light)
            number += 1
        return light

    @syntax
    def _past_row(self, kinds: list[Kind], number: UInt32, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        row = fetch(self.rows, number, True)
        if dr.hint(len(kinds) == 1, mode="scalar"):
            light = self._past(kinds[0], row, o, d, t, light)
        else:
            for kind in kinds:
                if serves(kind, row):
                    light = self._past(kind, row, o, d, t, light)
        return light

    def _past(self, kind: Kind, row: Row, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        for crossing in crossings(kind, self._inside_only, row, o, d):
            good = crossing.good & (crossing.t > 0) & (crossing.t < t)
            if self._clipping is not None:
                # Tachyon clips the shadows of opaque shapes alone.
                kept = self._clipping.keeps(row.clip, o + d * crossing.t, good)
                good &= (row.passes > 0) | kept if self.filters else kept
            light = dr.select(good, light * row.passes if self.filters else 0, light)
        return light

    def _formulas(self, rows: range) -> list[Kind]:
        return formulas({Kind(int(kind)) for kind in np.unique(self._table.rows[rows.start : rows.stop, Column.KIND])})

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
        self, entry: UInt32, scale: Vector3f, shift: Vector3f, nearest: Float, farthest: Float
    ) -> tuple[Int32, Int32, UInt32]:
        """Rows of the one or two shapes of an entry whose boxes a ray meets, -1 for none; the step to the next entry.

        ``nearest`` and ``farthest`` bound the distances that count. A single row always is the first, so that the code
        for a second one seldom runs.
        """
        words = dr.gather(mi.ArrayXu, self._nodes, entry, shape=(8, dr.width(entry)))
        meets, leaf, row, below = [], [], [], []
        for node in (0, 4):
            sides = [(words[node + axis] & 0xFFFF, words[node + axis] >> 16) for axis in range(3)]
            near, far = (
                [dr.fma(mi.Float(sides[axis][side]), scale[axis], shift[axis]) for axis in range(3)] for side in (0, 1)
            )
            enter = larger(larger(near[0], near[1]), larger(near[2], nearest))
            leave = smaller(smaller(far[0], far[1]), smaller(far[2], farthest))
            last = words[node + 3]
            meets.append(enter <= leave)
            leaf.append(last >= LEAF)
            row.append(mi.Int32(last - LEAF + self._table.traced))
            below.append(dr.select(leaf[-1], 0, last))
        inside = [met & ~single for met, single in zip(meets, leaf, strict=True)]
        first_shape, second_shape = (met & single for met, single in zip(meets, leaf, strict=True))
        first = dr.select(first_shape, row[0], dr.select(second_shape, row[1], -1))
        second = dr.select(first_shape & second_shape, row[1], -1)
        step = dr.select(inside[0], 1, 1 + below[0] + dr.select(inside[1], 0, below[1]))
        return first, second, step
