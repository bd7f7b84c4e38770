"""All geometry of a classic scene as one: where a ray hits, how the surface lies there, what light gets past.

A hit is a distance and an index: triangles first, in the order of ``engine_tracer.triangle_order``, then the rows of
the shape table, lights last.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import upload
from lippmann.device.types import Bool, Color3f, Float, Point2f, Point3f, UInt32, Vector3f
from lippmann.device.whitted.bvh_traversal import ShapeTracer
from lippmann.device.whitted.clip_planes import Clipping
from lippmann.device.whitted.embree_tracer import EngineTracer, triangle_order
from lippmann.device.whitted.intersections import Row, fetch, xyz
from lippmann.device.whitted.shape_table import Column, Kind, make_shape_table
from lippmann.scene.parsing.normals import unit_face_normals
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_shapes import Numbers

#: Index of a ray that hits nothing.
NONE = 0xFFFFFFFF
#: "Anywhere along the ray", as Tachyon's.
FAR = 1e18
#: How far a secondary ray starts from its surface, relative to the size of the coordinates there.
_LIFT = 1e-5


@dataclass
class Hit:
    """Distance ``t``, ``index`` (``NONE``: nothing), barycentric ``uv`` on triangles."""

    t: Float
    index: UInt32
    uv: Point2f

    def is_valid(self) -> Bool:
        """Whether anything is hit."""
        return self.index != NONE


@dataclass
class Surface:
    """A surface where a ray hits it.

    ``p`` is the point; ``n`` the normal to shade with, turned as the light model says; ``face`` the true one, of unit
    length, to either side; ``lift`` how far rays start from the surface; ``material`` the index; ``color`` the
    interpolated colour where ``colored``.
    """

    p: Point3f
    n: Vector3f
    face: Vector3f
    lift: Float
    material: UInt32
    color: Color3f
    colored: Bool

    def start(self, direction: Vector3f) -> Point3f:
        """Origin of a ray into ``direction``: just off the surface, on the side that it leaves to."""
        return self.p + self.face * dr.copysign(self.lift, dr.dot(self.face, direction))


class Geometry:
    """The geometry of a classic scene on the device."""

    def __init__(self, scene: ClassicScene) -> None:
        self._order = triangle_order(scene)
        self._table = make_shape_table(scene)
        clipping = Clipping(scene.clip_groups)
        self._engine = EngineTracer(scene, self._order, self._table, clipping)
        casts_shadows = scene.shading.mode == "full"
        self._shapes = ShapeTracer(self._table, clipping, scene.lights if casts_shadows else ())
        self._triangles = len(self._order)
        self._smooth = bool(scene.triangles.smooth.any())
        self._colored = bool(scene.triangles.colored.any())
        if self._table.lights:
            numbers = self._table.rows[self._table.light_rows.start :, Column.MATERIAL]
            self._lights = upload(numbers.astype(np.uint32))
        self._load_triangles(scene)

    def _load_triangles(self, scene: ClassicScene) -> None:
        if not self._triangles:
            return
        batch, order = scene.triangles, self._order.order
        corners = batch.positions[order]
        normal = unit_face_normals(corners)
        offset = (normal * corners[:, 0]).sum(axis=1)
        rows = np.zeros((len(order), 8))
        rows[:, :3], rows[:, 3] = normal, offset
        rows[:, 4], rows[:, 5] = batch.material[order], batch.colored[order]
        rows[:, 6] = np.abs(corners).max(axis=(1, 2))
        self._faces = upload(rows)
        if self._smooth:
            self._normals = _corner_table(batch.normals[order])
        if self._colored:
            self._colors = _corner_table(batch.colors[order])

    def closest(self, o: Point3f, d: Vector3f, active: Bool, coherent: Bool = False) -> Hit:
        """The nearest hit of rays from ``o`` along unit ``d``."""
        t, index, uv = self._engine.closest(o, d, mi.Float(FAR), active, coherent)
        beyond = mi.UInt32(NONE)
        nearer, row = self._shapes.closest(o, d, t, beyond, active)
        return Hit(nearer, dr.select(row == NONE, index, row + self._triangles), uv)

    def passing(self, o: Point3f, d: Vector3f, t: Float, active: Bool, source: UInt32 | None = None) -> Float:
        """Share of light that gets from ``o`` as far as ``t`` along ``d``; 0 where not active.

        ``source``: the number of the light source that is there; None for anything else.
        """
        light = dr.select(active, mi.Float(1), mi.Float(0))
        return self._engine.passing(o, d, t, self._shapes.passing(o, d, t, light, source))

    def find_light(self, hit: Hit) -> tuple[Bool, UInt32]:
        """Whether a hit is the visible sphere of a light source, and that light's index."""
        if not self._table.lights:
            return mi.Bool(False), mi.UInt32(0)
        first = self._triangles + self._table.light_rows.start
        is_light = (hit.index >= first) & hit.is_valid()
        return is_light, dr.gather(mi.UInt32, self._lights, hit.index - first, is_light)

    def surface(self, hit: Hit, o: Point3f, d: Vector3f, active: Bool) -> Surface:
        """How the surface lies that a ray from ``o`` along ``d`` hits; not for light sources."""
        p = o + d * hit.t
        if not self._table.light_rows.start:
            return self._triangle(hit, p, d, active)
        if not self._triangles:
            return self._shape(hit.index, p, d, active)
        on_triangle = hit.index < self._triangles
        triangle = self._triangle(hit, p, d, active & on_triangle)
        shape = self._shape(hit.index - self._triangles, p, d, active & ~on_triangle)
        return Surface(
            *(
                dr.select(on_triangle, getattr(triangle, name), getattr(shape, name))
                for name in Surface.__dataclass_fields__
            )
        )

    def _triangle(self, hit: Hit, p: Point3f, d: Vector3f, active: Bool) -> Surface:
        plane = dr.gather(mi.Vector4f, self._faces, 2 * hit.index, active)
        rest = dr.gather(mi.Vector4f, self._faces, 2 * hit.index + 1, active)
        face = xyz(plane)
        p = p - face * (dr.dot(face, p) - plane.w)
        u, v = hit.uv.x, hit.uv.y
        n = face
        if self._smooth:
            n = dr.normalize(_interpolate(self._normals, hit.index, u, v, active))
        n = dr.select(dr.dot(face, d) > 0, -n, n)
        color, colored = mi.Color3f(0), mi.Bool(False)
        if self._colored:
            colored = rest.y > 0
            color = mi.Color3f(_interpolate(self._colors, hit.index, u, v, active & colored))
        lift = _LIFT * dr.maximum(rest.z, dr.max(dr.abs(p)))
        return Surface(p, n, face, lift, mi.UInt32(rest.x), color, colored)

    def _shape(self, index: UInt32, p: Point3f, d: Vector3f, active: Bool) -> Surface:
        row = fetch(self._shapes.rows, index, active)
        kinds = {Kind(int(kind)) for kind in np.unique(self._table.rows[: self._table.light_rows.start, Column.KIND])}
        q = p - row.center
        n, face, refined, size = mi.Vector3f(0), mi.Vector3f(0), mi.Point3f(p), dr.max(dr.abs(q))
        ways = {
            Kind.SPHERE: _on_sphere,
            Kind.QUADRIC: _on_quadric,
            Kind.FLAT: _on_flat,
            Kind.BOX: _on_box,
            Kind.HUGE_SPHERE: _on_huge_sphere,
        }
        for kind in sorted(kinds):
            this = row.kind == float(kind)
            kind_n, kind_face, kind_p = ways[kind](row, p if kind is Kind.HUGE_SPHERE else q)
            n, face = dr.select(this, kind_n, n), dr.select(this, kind_face, face)
            refined = dr.select(this, kind_p, refined)
            if kind is Kind.HUGE_SPHERE:  # double precision: the error is that of the point's own coordinates
                size = dr.select(this, 0, size)
        n = dr.select(dr.dot(n, d) > 0, -n, n)
        lift = _LIFT * dr.maximum(size, dr.max(dr.abs(p)))
        return Surface(refined, n, face, lift, mi.UInt32(row.material), mi.Color3f(0), mi.Bool(False))


def _on_sphere(row: Row, q: Vector3f) -> tuple[Vector3f, Vector3f, Point3f]:
    """Normal to shade with, true normal and point, all for the point of the sphere next to ``q``."""
    n = dr.normalize(q)
    return n, n, row.center + n * dr.sqrt(row.k0)


def _on_huge_sphere(row: Row, p: Point3f) -> tuple[Vector3f, Vector3f, Point3f]:
    """As :func:`_on_sphere`, for the point itself and in double precision."""
    exact = mi.Vector3d(p)
    q = exact - mi.Vector3d(row.center)
    distance = dr.norm(q)
    n = mi.Vector3f(q / distance)
    return n, n, mi.Point3f(exact + q * (row.k1 / distance - 1))


def _on_quadric(row: Row, q: Vector3f) -> tuple[Vector3f, Vector3f, Point3f]:
    h = dr.dot(q, row.axis)
    gradient = q - row.axis * (row.k2 * h + row.k1)
    value = dr.dot(q, q) - (row.k2 * h + 2 * row.k1) * h - row.k0
    squared = dr.dot(gradient, gradient)
    n = gradient * dr.rsqrt(squared)
    return n, n, row.center + q - gradient * (value / (2 * squared))


def _on_flat(row: Row, q: Vector3f) -> tuple[Vector3f, Vector3f, Point3f]:
    return row.axis, row.axis, row.center + q - row.axis * dr.dot(q, row.axis)


def _on_box(row: Row, q: Vector3f) -> tuple[Vector3f, Vector3f, Point3f]:
    """Tachyon shades a box by the axis along which the point lies farthest from the middle, whatever the proportions.

    Along two or three axes at once where it lies equally far.
    """
    half = (row.axis - row.center) / 2
    offset = q - half
    reach = dr.abs(offset)
    n = dr.normalize(dr.select(reach == dr.max(reach), offset, mi.Vector3f(0)))
    beyond = reach - half
    nearest = dr.max(beyond)
    first_x, first_y = beyond.x == nearest, (beyond.y == nearest) & (beyond.x != nearest)
    one, zero = mi.Float(1), mi.Float(0)
    face = mi.Vector3f(
        dr.select(first_x, one, zero), dr.select(first_y, one, zero), dr.select(first_x | first_y, zero, one)
    )
    return n, face, row.center + q


def _corner_table(values: Numbers) -> Float:
    """Vectors at three corners ``(n, 3, 3)`` as rows of four."""
    rows = np.zeros((len(values), 3, 4), np.float32)
    rows[:, :, :3] = values
    return upload(rows)


def _interpolate(table: Float, index: UInt32, u: Float, v: Float, active: Bool) -> Vector3f:
    a, b, c = (xyz(dr.gather(mi.Vector4f, table, 3 * index + corner, active)) for corner in range(3))
    return a * (1 - u - v) + b * u + c * v
