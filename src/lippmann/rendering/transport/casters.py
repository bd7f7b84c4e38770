"""Casters: shapes whose mirrors, glass or smooth gloss may make caustics, and where emitters' light meets them."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr.even_points import PointOf, area_of, evenly, no_point
from lippmann.device.pbr.gltf_bsdf import SHARP_LOBE
from lippmann.device.pbr.scene import is_instance
from lippmann.device.types import (
    Bool,
    Float,
    MitsubaScene,
    Point2f,
    ShapePtr,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)
from lippmann.rendering.transport.tuning import TUNING


@dataclass(frozen=True, eq=False)
class Casters:
    """Emitters and shapes of a scene that can make caustics.

    Attributes
    ----------
    emitters, shapes:
        Indices of emitters and of casters in the scene; each pair may make caustics.
    boxes:
        ``(len(shapes), 6)``: least and greatest corners of the boxes of shapes without surface sampling (instances,
        curves); NaN for others.
    areas:
        ``(len(shapes),)``: surface areas of the shapes, or of their boxes.
    points:
        ``len(shapes)`` functions that sample points uniformly on each; :func:`no_point` for those with boxes.
    """

    emitters: NDArray[np.uint32]
    shapes: NDArray[np.uint32]
    boxes: NDArray[np.float32]
    areas: NDArray[np.float32]
    points: tuple[PointOf, ...]

    @property
    def boxed(self) -> NDArray[np.bool_]:
        """``(len(shapes),)``: which have boxes."""
        return np.asarray(np.isfinite(self.boxes).all(axis=1))

    @property
    def pairs(self) -> int:
        """Number of pairs of an emitter and a caster."""
        return len(self.emitters) * len(self.shapes)


def find_casters(scene: MitsubaScene) -> Casters:
    """Emitters other than the environment, and shapes with lobes that may be sharp; instances always count."""
    environment = scene.environment()
    emitters = [number for number, each in enumerate(scene.emitters()) if each is not environment]
    shapes, boxes, areas, points = [], [], [], []
    for number, shape in enumerate(scene.shapes() if emitters else ()):
        if not (is_instance(shape) or _may_be_sharp(shape.bsdf())):
            continue
        box, (point, area) = np.full(6, np.nan), evenly(shape)
        if point is None:
            box = _box_about(shape)
            sides = box[3:] - box[:3]
            area = 2 * float(sides @ np.roll(sides, 1))
        shapes.append(number)
        boxes.append(box)
        areas.append(area)
        points.append(point or no_point)
    return Casters(
        np.array(emitters, np.uint32),
        np.array(shapes, np.uint32),
        np.array(boxes, np.float32).reshape(-1, 6),
        np.array(areas, np.float32),
        tuple(points),
    )


def hides_caustics(scene: MitsubaScene) -> bool:
    """Whether a scene has sharp surfaces, and an emitter so small that paths by way of these hardly find it."""
    return _has_small_emitter(scene) and has_sharp_surfaces(scene)


def has_sharp_surfaces(scene: MitsubaScene) -> bool:
    """Whether a scene has mirrors, clear glass or smooth gloss, instances apart."""
    return any(_may_be_sharp(shape.bsdf()) for shape in scene.shapes())


def _has_small_emitter(scene: MitsubaScene) -> bool:
    if any(mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta) for emitter in scene.emitters()):
        return True
    box = scene.bbox()
    small = TUNING.small_emitter * float(dr.squared_norm(box.max - box.min))
    return any(area_of(shape) < small for shape in scene.shapes() if shape.is_emitter())


def _may_be_sharp(bsdf: mi.BSDF) -> bool:
    if int(bsdf.flags()) & int(mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.DeltaTransmission):
        return True
    return bool(np.any(np.array(bsdf.has_attribute(SHARP_LOBE, True))))


def _box_about(shape: mi.Shape) -> NDArray[np.float64]:
    box = shape.bbox()
    low, high = np.array(box.min, dtype=float).ravel(), np.array(box.max, dtype=float).ravel()
    margin = TUNING.rounding * float(np.linalg.norm(high - low))
    return np.concatenate([low - margin, high + margin])


class CasterPoints:
    """Points on the casters of a wavefront, toward which emitters are sampled.

    Shapes with surface sampling are sampled at their surface. For the others the point lies on their box, where the ray
    leaves the box: each ray from an emitter leaves a convex box once.

    Parameters
    ----------
    scene, casters:
        The scene, and its casters.
    caster:
        Indices of the casters of the lanes.
    sample, face:
        Uniform in [0, 1): the place, and for boxes the side on which it lies.
    """

    def __init__(self, scene: MitsubaScene, casters: Casters, caster: UInt32, sample: Point2f, face: Float) -> None:
        number = dr.gather(mi.UInt32, mi.UInt32(casters.shapes), caster)
        self._shape: ShapePtr = dr.gather(mi.ShapePtr, scene.shapes_dr(), number)
        self.area: Float = dr.gather(mi.Float, mi.Float(casters.areas), caster)
        self._boxed = mi.Bool(False)
        boxed = casters.boxed
        # Not a virtual call, which would include all shapes of the scene: some cannot be sampled.
        self.p, self._n = dr.switch(caster, list(casters.points), sample)
        if boxed.any():
            self._boxed = dr.gather(mi.Bool, mi.Bool(boxed), caster)
            corners = [
                dr.gather(mi.Vector3f, mi.Float(np.nan_to_num(part).astype(np.float32).ravel()), caster)
                for part in (casters.boxes[:, :3], casters.boxes[:, 3:])
            ]
            p, n = _point_on_box(corners[0], corners[1], sample, face)
            self.p, self._n = dr.select(self._boxed, p, self.p), dr.select(self._boxed, n, self._n)

    def reference(self) -> SurfaceInteraction3f:
        """The points as reference points for emitter sampling."""
        reference = dr.zeros(mi.SurfaceInteraction3f, dr.width(self.p))
        reference.p, reference.n = self.p, mi.Normal3f(self._n)
        return reference

    def cosine(self, si: SurfaceInteraction3f, toward: Vector3f) -> Float:
        """Cosine between the sampled surface's normal and ``toward``; 0 for rays that enter a box.

        ``si`` is where light from ``toward`` hits the caster.
        """
        leaves = dr.maximum(-dr.dot(self._n, toward), 0)
        return dr.select(self._boxed, leaves, dr.abs(dr.dot(si.n, toward)))

    def is_met(self, si: SurfaceInteraction3f, distance: Float) -> Bool:
        """Whether ``si`` is the sampled caster (point), seen from an emitter at ``distance``."""
        near = dr.squared_norm(si.p - self.p) < dr.square(TUNING.rounding * distance)
        # On a thin body a point of the back side may lie as near; its normal tells it apart.
        near &= dr.dot(si.n, self._n) > TUNING.least_agreement
        return dr.select(self._boxed, (si.instance == self._shape) | (si.shape == self._shape), near)


def _point_on_box(low: Vector3f, high: Vector3f, sample: Point2f, face: Float) -> tuple[Vector3f, Vector3f]:
    """A uniformly sampled point on a box, and the outward unit normal there."""
    sides = high - low
    areas = mi.Vector3f(sides.y * sides.z, sides.z * sides.x, sides.x * sides.y)
    place = face * (2 * dr.sum(areas))
    upper = place >= dr.sum(areas)
    place = dr.select(upper, place - dr.sum(areas), place)
    is_x, is_y = place < areas.x, place < areas.x + areas.y
    sign = dr.select(upper, mi.Float(1), -1)
    n = dr.select(is_x, mi.Vector3f(sign, 0, 0), dr.select(is_y, mi.Vector3f(0, sign, 0), mi.Vector3f(0, 0, sign)))
    end = dr.select(upper, mi.Float(1), 0)
    u, v = sample.x, sample.y
    at = dr.select(is_x, mi.Vector3f(end, u, v), dr.select(is_y, mi.Vector3f(u, end, v), mi.Vector3f(u, v, end)))
    return low + at * sides, n
