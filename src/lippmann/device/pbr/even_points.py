"""Points spread evenly over shapes, the same on every device and at every call."""

from __future__ import annotations

import math
from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import binary_search
from lippmann.device.pbr.scene import is_instance
from lippmann.device.types import Point2f, Point3f, Vector3f

#: Gives a point and its unit normal for a sample in [0, 1)^2.
PointOf = Callable[[Point2f], tuple[Point3f, Vector3f]]


class Triangles:
    """Points spread evenly over a mesh, the same each time.

    Mitsuba's own are not, on the GPU: it sums the triangles' areas in the order in which threads come by, and every sum
    is rounded another way. A point moves by little then, but shares of the emissions follow from points.
    """

    def __init__(self, mesh: mi.Mesh) -> None:
        faces = np.array(mesh.faces_buffer()).reshape(-1, 3)
        corners = np.array(mesh.vertex_positions_buffer(), dtype=np.float64).reshape(-1, 3)[faces]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        upto = np.cumsum(0.5 * np.linalg.norm(sides, axis=1))
        self.area = float(upto[-1])
        self._mesh = mesh
        self._last = len(faces) - 1
        self._upto = mi.Float((upto / (self.area or 1.0)).astype(np.float32))

    def point(self, sample: Point2f) -> tuple[Point3f, Vector3f]:
        """A point and its unit geometric normal."""
        number = binary_search(0, self._last, lambda place: dr.gather(mi.Float, self._upto, place) <= sample.y)
        before = dr.gather(mi.Float, self._upto, number - 1, number > 0)
        share = dr.gather(mi.Float, self._upto, number) - before
        at = mi.warp.square_to_uniform_triangle(mi.Point2f(sample.x, (sample.y - before) / share))
        face = self._mesh.face_indices(number)
        a, b, c = (self._mesh.vertex_position(corner) for corner in (face.x, face.y, face.z))
        n = dr.normalize(dr.cross(b - a, c - a))
        p = dr.fma(b - a, at.x, dr.fma(c - a, at.y, a))
        return mi.Point3f(p), mi.Vector3f(-n if self._mesh.has_flipped_normals() else n)


def evenly(shape: mi.Shape) -> tuple[PointOf | None, float]:
    """A function that spreads points evenly over a shape, and its area; None for shapes that give no points."""
    if not _gives_points(shape):
        return None, 0.0
    triangles = Triangles(shape) if shape.is_mesh() else None
    area = area_of(shape) if triangles is None else triangles.area
    if not 0 < area < math.inf:
        return None, 0.0
    return _point_of(shape) if triangles is None else triangles.point, area


def _point_of(shape: mi.Shape) -> PointOf:
    def sampled(sample: Point2f) -> tuple[Point3f, Vector3f]:
        point = shape.sample_position(mi.Float(0), sample, mi.Bool(True))
        return mi.Point3f(point.p), mi.Vector3f(point.n)

    return sampled


def no_point(sample: Point2f) -> tuple[Point3f, Vector3f]:
    """The origin, in place of a point."""
    return mi.Point3f(sample.x * 0), mi.Vector3f(sample.x * 0)


def area_of(shape: mi.Shape) -> float:
    """Area of a shape; not a number for shapes that do not tell it."""
    try:
        return float(np.array(shape.surface_area()).ravel()[0])
    except (RuntimeError, NotImplementedError):
        return math.nan


def _gives_points(shape: mi.Shape) -> bool:
    if is_instance(shape):
        return False
    try:
        point = shape.sample_position(0.0, mi.Point2f(0.5), True)
        return bool(np.isfinite(np.array(point.p)).all() and np.array(point.pdf).ravel()[0] > 0)
    except (RuntimeError, NotImplementedError):
        return False
