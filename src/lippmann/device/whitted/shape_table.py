"""Exact shapes as rows of one table, whatever their kind.

Spheres, tubes, cones and cylinders are all cases of one quadric about an axis: with q = p - center and h = q . axis,

    |q|^2 - k2 h^2 - 2 k1 h - k0 = 0,    low < h < high.

A sphere has k2 = k1 = 0, k0 = r^2; a cylinder k2 = 1, k1 = 0, k0 = r^2; a cone whose radius is r at the center and
grows by s per unit of h has k2 = 1 + s^2, k1 = r s, k0 = r^2. Rings and planes are flat: q . axis = 0 with
inner^2 < |q|^2 < outer^2, a plane being a ring without hole or rim. A box has its lowest corner for center and its
highest for axis.

A sphere that dwarfs the rest of the scene, a planet or a sky, has a kind of its own: it is tested in double precision
(k1 = r), and kept out of the hierarchy, whose grid would spread over it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_shapes import Batch, Boxes, Cylinders, Numbers, Planes, Rings, Spheres, Tubes

#: Up to this many spheres are tested one by one, which is cheaper than any hierarchy.
MOST_LISTED_SPHERES = 12
#: Up to this many are left to the engine, which traces them two to three times as fast as the walk here, but takes
#: 0.2 ms to take each one in.
MOST_TRACED_SPHERES = 512
#: Up to this many other shapes with an end are tested one by one.
MOST_LISTED_SHAPES = 48
#: A sphere this many times as large as half of the other shapes, or as the camera's distance from it, is huge.
HUGE = 1000.0
#: Opacity from which a surface blocks light altogether (Tachyon).
_CASTS_SHADOW = 0.99999


class Kind(IntEnum):
    """Kind of the shape in a row of the table, which says what its columns mean."""

    SPHERE = 0
    QUADRIC = 1
    BOX = 2
    FLAT = 3
    HUGE_SPHERE = 4


class Column(IntEnum):
    """Columns of the table; CENTER and AXIS are the first of three.

    A row is fetched in packets of four columns: those that most intersections do not need share the last.
    """

    CENTER = 0
    K0 = 3  # flat: inner^2
    AXIS = 4
    K1 = 7  # flat: outer^2
    K2 = 8
    LOW = 9
    HIGH = 10
    KIND = 11
    MATERIAL = 12  # of a light's sphere: the light's index
    CLIP = 13  # clip group, -1 for none
    INSIDE = 14  # 1: seen from inside alone
    PASSES = 15  # share of light that passes


ROW = 16


@dataclass(frozen=True, eq=False)
class ShapeTable:
    """Rows ``(n, 16)`` float32, in runs, one after the other.

    ``traced`` spheres are left to the engine's own tracer; ``walked`` shapes go into a hierarchy; ``listed`` ones are
    tested one by one; ``lights`` are the visible spheres of light sources, which cast no shadow. ``boxes (walked, 2,
    3)`` bound the walked ones.
    """

    rows: NDArray[np.float32]
    traced: int
    walked: int
    listed: int
    lights: int
    boxes: Numbers

    @property
    def walked_rows(self) -> range:
        return range(self.traced, self.traced + self.walked)

    @property
    def listed_rows(self) -> range:
        return range(self.walked_rows.stop, self.walked_rows.stop + self.listed)

    @property
    def light_rows(self) -> range:
        return range(self.listed_rows.stop, self.listed_rows.stop + self.lights)


def make_shape_table(scene: ClassicScene) -> ShapeTable:
    """All exact shapes of a scene; triangles are none."""
    bounded, boxes = _join(
        scene,
        (scene.spheres, _spheres(scene.spheres)),
        (scene.tubes, _tubes(scene.tubes)),
        (scene.rings, _rings(scene.rings)),
        (scene.boxes, _boxes(scene.boxes)),
    )
    unbounded, _ = _join(scene, (scene.cylinders, _cylinders(scene.cylinders)), (scene.planes, _planes(scene.planes)))
    huge = _huge(scene, bounded, boxes)
    bounded[huge, Column.KIND], bounded[huge, Column.K1] = Kind.HUGE_SPHERE, np.sqrt(bounded[huge, Column.K0])
    traced = _choose_traced(bounded)
    others, other_boxes = bounded[~traced & ~huge], boxes[~traced & ~huge]
    apart = len(others) > MOST_LISTED_SHAPES
    unbounded = np.concatenate([bounded[huge], unbounded])
    walked, listed = (others, unbounded) if apart else (others[:0], np.concatenate([others, unbounded]))
    lights = _light_spheres(scene)
    rows = np.concatenate([bounded[traced], walked, listed, lights])
    return ShapeTable(
        rows=rows.astype(np.float32),
        traced=int(traced.sum()),
        walked=len(walked),
        listed=len(listed),
        lights=len(lights),
        boxes=other_boxes[: len(walked)],
    )


def passing(scene: ClassicScene) -> Numbers:
    """Share of a shadow ray's light that each material lets pass, per crossing ``(materials,)``."""
    unfiltered = 1.0 if not scene.shading.shadow_filter else None
    shares = [
        0.0 if m.opacity >= _CASTS_SHADOW else (1.0 - m.opacity if unfiltered is None else unfiltered)
        for m in scene.materials
    ]
    return np.array(shares or [0.0])


def _choose_traced(rows: Numbers) -> NDArray[np.bool_]:
    """Which rows are spheres for the engine to trace: solid, unclipped, seen from both sides."""
    plain = (rows[:, Column.KIND] == Kind.SPHERE) & (rows[:, Column.CLIP] < 0) & (rows[:, Column.INSIDE] == 0)
    plain &= rows[:, Column.PASSES] == 0
    return plain if MOST_LISTED_SPHERES < plain.sum() <= MOST_TRACED_SPHERES else np.zeros(len(rows), bool)


def _huge(scene: ClassicScene, rows: Numbers, boxes: Numbers) -> NDArray[np.bool_]:
    """Which rows ``(n, 16)`` with boxes ``(n, 2, 3)`` are huge spheres."""
    corners = scene.triangles.positions
    extents = np.concatenate([np.ptp(boxes, axis=1).max(axis=1), np.ptp(corners, axis=1).max(axis=1, initial=0.0)])
    radii = np.sqrt(np.maximum(rows[:, Column.K0], 0.0))
    above = np.abs(np.linalg.norm(rows[:, :3] - np.asarray(scene.camera.center), axis=1) - radii)
    usual = np.median(extents) / 2.0 if len(extents) > 1 else np.inf
    smallest = np.minimum(above, usual)
    return np.asarray((rows[:, Column.KIND] == Kind.SPHERE) & (radii > HUGE * smallest))


def _join(scene: ClassicScene, *parts: tuple[Batch, Numbers]) -> tuple[Numbers, Numbers]:
    """Rows of all parts with material, clip group and light that passes, and the boxes of those that have an end."""
    shares = passing(scene)
    boxes = [np.zeros((0, 2, 3))]
    for batch, rows in parts:
        rows[:, Column.MATERIAL] = batch.material
        rows[:, Column.CLIP] = batch.clip_group
        rows[:, Column.INSIDE] = getattr(batch, "inside_only", 0)
        rows[:, Column.PASSES] = shares[batch.material]
        if len(batch) and not isinstance(batch, Cylinders | Planes):
            boxes.append(np.stack(batch.extents(), axis=1))
    return np.concatenate([rows for _, rows in parts]), np.concatenate(boxes)


def _blank(count: int, kind: Kind) -> Numbers:
    rows = np.zeros((count, ROW))
    rows[:, Column.LOW], rows[:, Column.HIGH], rows[:, Column.KIND], rows[:, Column.CLIP] = -np.inf, np.inf, kind, -1
    return rows


def _spheres(batch: Spheres) -> Numbers:
    rows = _blank(len(batch), Kind.SPHERE)
    rows[:, :3], rows[:, Column.K0] = batch.centers, batch.radii**2
    return rows


def _light_spheres(scene: ClassicScene) -> Numbers:
    lights = enumerate(scene.lights)
    visible = [(number, light) for number, light in lights if light.kind != "directional" and light.radius]
    rows = _blank(len(visible), Kind.SPHERE)
    for row, (number, light) in zip(rows, visible, strict=True):
        row[:3], row[Column.K0] = light.center, light.radius**2
        row[Column.MATERIAL], row[Column.CLIP] = number, light.clip_group
    return rows


def _tubes(batch: Tubes) -> Numbers:
    """The center is the middle of the axis: single precision serves best near it."""
    rows = _blank(len(batch), Kind.QUADRIC)
    axis = batch.apex - batch.base
    length = np.linalg.norm(axis, axis=1)
    slope = (batch.apex_radius - batch.base_radius) / length
    middle = (batch.apex_radius + batch.base_radius) / 2.0
    rows[:, :3], rows[:, Column.K0] = (batch.base + batch.apex) / 2.0, middle**2
    rows[:, 4:7], rows[:, Column.K1] = axis / length[:, None], middle * slope
    rows[:, Column.K2], rows[:, Column.LOW], rows[:, Column.HIGH] = 1.0 + slope**2, -length / 2.0, length / 2.0
    return rows


def _cylinders(batch: Cylinders) -> Numbers:
    """The center is the point of the axis nearest to the world's origin."""
    rows = _blank(len(batch), Kind.QUADRIC)
    along = (batch.centers * batch.axes).sum(axis=1, keepdims=True)
    rows[:, :3], rows[:, Column.K0] = batch.centers - batch.axes * along, batch.radii**2
    rows[:, 4:7], rows[:, Column.K2] = batch.axes, 1.0
    return rows


def _rings(batch: Rings) -> Numbers:
    rows = _blank(len(batch), Kind.FLAT)
    # The middle of a disc belongs to it, although no distance is below 0.
    rows[:, :3], rows[:, Column.K0] = batch.centers, np.where(batch.inner > 0.0, batch.inner**2, -1.0)
    rows[:, 4:7], rows[:, Column.K1] = batch.normals, batch.outer**2
    return rows


def _planes(batch: Planes) -> Numbers:
    """The center is the point of the plane nearest to the world's origin."""
    rows = _blank(len(batch), Kind.FLAT)
    offset = (batch.centers * batch.normals).sum(axis=1, keepdims=True)
    rows[:, :3], rows[:, Column.K0] = batch.normals * offset, -1.0
    rows[:, 4:7], rows[:, Column.K1] = batch.normals, np.inf
    return rows


def _boxes(batch: Boxes) -> Numbers:
    rows = _blank(len(batch), Kind.BOX)
    rows[:, :3], rows[:, 4:7] = batch.minimum, batch.maximum
    return rows
