"""Hits by the engine's own tracer (Embree, OptiX): triangles, and spheres where they are many.

Triangles that let light pass or that are clipped ("airy") are kept apart from the solid ones: a ray goes on behind
them. On the CPU the shadows of solid things are tested by themselves, which needs one question instead of one per
surface; a GPU kernel can use one scene alone, so there every shadow ray goes from surface to surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import upload
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    Float,
    Mesh,
    MitsubaScene,
    Point2f,
    Point3f,
    PreliminaryIntersection3f,
    Ray3f,
    Shape,
    UInt32,
    Vector3f,
)
from lippmann.device.whitted.clip_planes import Clipping
from lippmann.device.whitted.shape_table import ShapeTable, passing
from lippmann.scene.values.whitted_scene import ClassicScene

#: Surfaces that one ray may cross before it counts as blocked: a bound where rounding would hold a ray in place.
MAX_CROSSINGS = 1024
#: Step past a surface that was crossed, relative to the size of the coordinates.
_STEP = 2e-6


@dataclass(frozen=True, eq=False)
class TriangleOrder:
    """The triangles of a scene, solid ones first: ``order`` are their numbers in the scene."""

    order: NDArray[np.int64]
    solid: int

    def __len__(self) -> int:
        return len(self.order)


def triangle_order(scene: ClassicScene) -> TriangleOrder:
    """Solid triangles, then those that let light pass or are clipped."""
    shares = passing(scene)
    airy = (shares[scene.triangles.material] > 0) | (scene.triangles.clip_group >= 0)
    return TriangleOrder(np.argsort(airy, kind="stable"), int((~airy).sum()))


class EngineTracer:
    """Triangles (indices from 0) and the traced spheres of a shape table (indices from the number of triangles)."""

    def __init__(self, scene: ClassicScene, triangles: TriangleOrder, table: ShapeTable, clipping: Clipping) -> None:
        self._on_gpu = mi.variant().startswith("cuda")
        positions = scene.triangles.positions[triangles.order]
        solid, airy = positions[: triangles.solid], positions[triangles.solid :]
        parts = [
            (_mesh("solid", solid), 0) if len(solid) else None,
            *((sphere, len(triangles) + row) for row, sphere in enumerate(_spheres(table))),
            (_mesh("airy", airy), triangles.solid) if len(airy) else None,
        ]
        shapes = [part[0] for part in parts if part is not None]
        self._airy = bool(len(airy))
        self._clips = bool((scene.triangles.clip_group >= 0).any())
        self._clipping = clipping
        self._all = _scene(shapes)
        if self._airy and not self._on_gpu:
            self._solid, self._through = _scene(shapes[:-1]), _scene(shapes[-1:])
        else:
            self._solid, self._through = self._all, self._all
        self._starts = _starts([part for part in parts if part is not None])
        shares = np.concatenate([passing(scene)[scene.triangles.material[triangles.order]], np.zeros(table.traced)])
        groups = np.concatenate([scene.triangles.clip_group[triangles.order], np.full(table.traced, -1)])
        self._passes = upload(shares) if self._airy else None
        self._groups = upload(groups.astype(np.float32)) if self._clips else None

    def closest(self, o: Point3f, d: Vector3f, t: Float, active: Bool, coherent: Bool) -> tuple[Float, UInt32, Point2f]:
        """Distance, index and barycentric coordinates of the nearest hit before ``t``; ``t`` and ``NONE`` without."""
        if self._all is None:
            return t, mi.UInt32(dr.full(mi.UInt32, _NONE)), mi.Point2f(0)
        if self._clips:
            distance, index, at = self._closest_kept(o, d, t, active)
            return distance, index, at
        ray = mi.Ray3f(mi.Point3f(o), mi.Vector3f(d), t, 0, [])
        pi = self._all.ray_intersect_preliminary(ray, coherent=coherent, active=active)
        hit = pi.is_valid()
        return dr.select(hit, pi.t, t), dr.select(hit, self._index(self._all, pi), _NONE), pi.prim_uv

    @syntax
    def _closest_kept(self, o: Point3f, d: Vector3f, t: Float, active: Bool) -> tuple[Float, UInt32, Point2f]:
        """As :meth:`closest`, behind what is clipped away."""
        index, uv, distance = mi.UInt32(_NONE), mi.Point2f(0), mi.Float(t)
        start = mi.Float(0)
        crossed = mi.UInt32(0)
        active = mi.Bool(active)
        while dr.hint(active, label="behind clipped triangles"):
            ray = mi.Ray3f(mi.Point3f(o + d * start), mi.Vector3f(d), t - start, 0, [])
            pi = self._all.ray_intersect_preliminary(ray, coherent=False, active=active)
            active &= pi.is_valid()
            met = start + pi.t
            nearest = self._index(self._all, pi)
            group = dr.gather(mi.Float, self._groups, nearest, active)
            kept = self._clipping.keeps(group, o + d * met, active)
            if kept:
                index, uv, distance = nearest, mi.Point2f(pi.prim_uv), met
            start = _past(o, d, met)
            crossed += 1
            active &= ~kept & (crossed < MAX_CROSSINGS)
        return distance, index, uv

    def passing(self, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        """The part of ``light`` that passes all surfaces before ``t``."""
        if self._all is None:
            return light
        if not (self._airy and self._on_gpu) and self._solid is not None:
            ray = mi.Ray3f(mi.Point3f(o), mi.Vector3f(d), t, 0, [])
            light = dr.select(self._solid.ray_test(ray, coherent=False, active=light > 0), 0, light)
        return self._filter_light(o, d, t, light) if self._airy else light

    @syntax
    def _filter_light(self, o: Point3f, d: Vector3f, t: Float, light: Float) -> Float:
        """Light past each surface in turn."""
        start = mi.Float(0)
        crossed = mi.UInt32(0)
        active = mi.Bool(light > 0)
        while dr.hint(active, label="through surfaces"):
            ray = mi.Ray3f(mi.Point3f(o + d * start), mi.Vector3f(d), t - start, 0, [])
            pi = self._through.ray_intersect_preliminary(ray, coherent=False, active=active)
            active &= pi.is_valid()
            index = self._index(self._through, pi)
            share = dr.gather(mi.Float, self._passes, index, active)
            met = start + pi.t
            counts = mi.Bool(active)
            if dr.hint(self._clips, mode="scalar"):
                group = dr.gather(mi.Float, self._groups, index, active)
                counts &= (share > 0) | self._clipping.keeps(group, o + d * met, active)
            light = dr.select(counts, light * share, light)
            start = _past(o, d, met)
            crossed += 1
            active &= (light > 0) & (crossed < MAX_CROSSINGS)
        return light

    def _index(self, scene: MitsubaScene, pi: PreliminaryIntersection3f) -> UInt32:
        if self._starts is None:
            return pi.prim_index
        return dr.gather(mi.UInt32, self._starts, dr.reinterpret_array(mi.UInt32, pi.shape)) + pi.prim_index


_NONE = 0xFFFFFFFF


def _past(o: Point3f, d: Vector3f, t: Float) -> Ray3f:
    """A distance just beyond ``t``: by more than what rounding may have made of the hit."""
    size = dr.maximum(dr.max(dr.abs(o)), t)
    return t + size * _STEP


def _scene(shapes: Sequence[Shape]) -> MitsubaScene:
    if not shapes:
        return None
    # Robust: else level rays slip through the edge between two triangles.
    named = {f"shape{number}": shape for number, shape in enumerate(shapes)}
    return mi.load_dict({"type": "scene", "embree_use_robust_intersections": True, **named})


def _starts(parts: Sequence[tuple[Shape, int]]) -> UInt32:
    """Index of the first primitive of each shape, by the shape's number in the engine; None where all begin at 0."""
    if all(start == 0 for _, start in parts):
        return None
    numbers = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0]) for shape, _ in parts]
    starts = np.zeros(max(numbers) + 1, np.uint32)
    starts[numbers] = [start for _, start in parts]
    return mi.UInt32(starts)


def _mesh(name: str, positions: NDArray[np.float64]) -> Mesh:
    """Triangles ``(n, 3, 3)`` that share no corners."""
    mesh: Mesh = mi.Mesh(name, 3 * len(positions), len(positions))
    params = mi.traverse(mesh)
    params["vertex_positions"] = mi.Float(positions.astype(np.float32).ravel())
    params["faces"] = dr.arange(mi.UInt32, 3 * len(positions))
    params.update()
    return mesh


def _spheres(table: ShapeTable) -> list[Shape]:
    """One shape each: what costs time with many shapes is asking them for their surface, which is not done here."""
    bsdf = mi.load_dict({"type": "diffuse"})
    return [
        mi.load_dict({"type": "sphere", "center": row[:3].tolist(), "radius": float(np.sqrt(row[3])), "bsdf": bsdf})
        for row in table.rows[: table.traced]
    ]
