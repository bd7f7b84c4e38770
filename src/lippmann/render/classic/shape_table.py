"""Exact shapes as rows of one table, whatever their kind.

Spheres, tubes, cones and cylinders are all cases of one quadric about an axis: with q = p - center and h = q . axis,

    |q|^2 - k2 h^2 - 2 k1 h - k0 = 0,    low < h < high.

A sphere has k2 = k1 = 0, k0 = r^2; a cylinder k2 = 1, k1 = 0, k0 = r^2; a cone whose radius is r at the center and
grows by s per unit of h has k2 = 1 + s^2, k1 = r s, k0 = r^2. Rings and planes are flat: q . normal = 0 with
inner^2 < |q|^2 < outer^2, a plane being a ring without hole or rim. Boxes are rows of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.classic import ClassicScene
from lippmann.scene.primitives import Batch, Boxes, Cylinders, Numbers, Planes, Rings, Spheres, Tubes

#: Numbers per row: four groups of four, each fetched at once.
ROW = 16


class Kind(IntEnum):
    """How a row is to be read."""

    QUADRIC = 0
    BOX = 1
    FLAT = 2


@dataclass(frozen=True, eq=False)
class ShapeTable:
    """Rows ``(n, 16)`` float32, first those with an end, then ``unbounded`` ones without.

    Columns: center x y z, k0 (flat: inner^2) | axis x y z, k1 (flat: outer^2) | k2, low, high, kind | material, clip
    group, inside only, share of light that passes. A box has its lowest corner for center and its highest for axis.
    ``boxes (n - unbounded, 2, 3)`` are the bounding boxes of those with an end.
    """

    rows: NDArray[np.float32]
    boxes: Numbers
    unbounded: int

    @property
    def bounded(self) -> int:
        return len(self.rows) - self.unbounded

    def has(self, kind: Kind) -> bool:
        """Whether any row is of this kind."""
        return bool((self.rows[:, 11] == kind).any())


def make_shape_table(scene: ClassicScene) -> ShapeTable:
    """All exact shapes of a scene; triangles are none."""
    passing = np.array([0.0 if casts_shadow(m.opacity) else 1.0 - m.opacity for m in scene.materials] or [0.0])
    parts: list[Numbers] = []
    boxes: list[Numbers] = []
    for batch, columns in (
        (scene.spheres, _spheres(scene.spheres)),
        (scene.tubes, _tubes(scene.tubes)),
        (scene.rings, _rings(scene.rings)),
        (scene.boxes, _boxes(scene.boxes)),
        (scene.cylinders, _cylinders(scene.cylinders)),
        (scene.planes, _planes(scene.planes)),
    ):
        if len(batch):
            parts.append(_finish(batch, columns, passing))
            boxes.extend(_extents(batch))
    unbounded = len(scene.cylinders) + len(scene.planes)
    rows = np.concatenate(parts) if parts else np.zeros((0, ROW))
    return ShapeTable(rows.astype(np.float32), np.concatenate(boxes) if boxes else np.zeros((0, 2, 3)), unbounded)


def casts_shadow(opacity: float) -> bool:
    """Whether a surface blocks light altogether (Tachyon's limit)."""
    return opacity >= 0.99999


def _extents(batch: Batch) -> list[Numbers]:
    if isinstance(batch, Cylinders | Planes):
        return []
    low, high = batch.extents()
    return [np.stack([low, high], axis=1)]


def _finish(batch: Batch, columns: Numbers, passing: Numbers) -> Numbers:
    columns[:, 12] = batch.material
    columns[:, 13] = batch.clip_group
    columns[:, 14] = getattr(batch, "inside_only", 0)
    columns[:, 15] = passing[batch.material]
    return columns


def _blank(count: int, kind: Kind) -> Numbers:
    columns = np.zeros((count, ROW))
    columns[:, 9], columns[:, 10], columns[:, 11] = -np.inf, np.inf, kind
    return columns


def _spheres(batch: Spheres) -> Numbers:
    columns = _blank(len(batch), Kind.QUADRIC)
    columns[:, :3], columns[:, 3] = batch.centers, batch.radii**2
    return columns


def _tubes(batch: Tubes) -> Numbers:
    """The center is the middle of the axis: single precision serves best near it."""
    columns = _blank(len(batch), Kind.QUADRIC)
    axis = batch.apex - batch.base
    length = np.linalg.norm(axis, axis=1)
    slope = (batch.apex_radius - batch.base_radius) / np.maximum(length, 1e-300)
    middle = (batch.apex_radius + batch.base_radius) / 2.0
    columns[:, :3], columns[:, 3] = (batch.base + batch.apex) / 2.0, middle**2
    columns[:, 4:7], columns[:, 7] = axis / length[:, None], middle * slope
    columns[:, 8], columns[:, 9], columns[:, 10] = 1.0 + slope**2, -length / 2.0, length / 2.0
    return columns


def _cylinders(batch: Cylinders) -> Numbers:
    columns = _blank(len(batch), Kind.QUADRIC)
    columns[:, :3], columns[:, 3] = batch.centers, batch.radii**2
    columns[:, 4:7], columns[:, 8] = batch.axes, 1.0
    return columns


def _rings(batch: Rings) -> Numbers:
    columns = _blank(len(batch), Kind.FLAT)
    # The middle of a disc belongs to it, although no radius is below 0.
    columns[:, :3], columns[:, 3] = batch.centers, np.where(batch.inner > 0.0, batch.inner**2, -1.0)
    columns[:, 4:7], columns[:, 7] = batch.normals, batch.outer**2
    return columns


def _planes(batch: Planes) -> Numbers:
    """The center is the point of the plane nearest to the world's origin."""
    columns = _blank(len(batch), Kind.FLAT)
    offset = (batch.centers * batch.normals).sum(axis=1, keepdims=True)
    columns[:, :3], columns[:, 3] = batch.normals * offset, -1.0
    columns[:, 4:7], columns[:, 7] = batch.normals, np.inf
    return columns


def _boxes(batch: Boxes) -> Numbers:
    columns = _blank(len(batch), Kind.BOX)
    columns[:, :3], columns[:, 4:7] = batch.minimum, batch.maximum
    return columns
