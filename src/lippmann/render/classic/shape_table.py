"""Exact shapes as rows of one table, whatever their kind.

Spheres, tubes, cones and cylinders are all cases of one quadric about an axis: with q = p - center and h = q . axis,

    |q|^2 - k2 h^2 - 2 k1 h - k0 = 0,    low < h < high.

A sphere has k2 = k1 = 0, k0 = r^2; a cylinder k2 = 1, k1 = 0, k0 = r^2; a cone whose radius is r at the center and
grows by s per unit of h has k2 = 1 + s^2, k1 = r s, k0 = r^2. Rings and planes are flat: q . axis = 0 with
inner^2 < |q|^2 < outer^2, a plane being a ring without hole or rim. A box has its lowest corner for center and its
highest for axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.classic import ClassicScene
from lippmann.scene.primitives import Batch, Boxes, Cylinders, Numbers, Planes, Rings, Spheres, Tubes

#: Up to this many spheres are tested one by one: cheaper than a hierarchy, and seen from inside too.
MOST_LISTED_SPHERES = 12
#: Up to this many other shapes with an end are tested one by one.
MOST_LISTED_SHAPES = 48
#: Up to this many shapes without an end have their numbers written into the kernel.
MOST_LISTED_UNBOUNDED = 64


class Kind(IntEnum):
    """How a row is to be read."""

    SPHERE = 0
    QUADRIC = 1
    BOX = 2
    FLAT = 3


class Column(IntEnum):
    """Columns of the table; CENTER and AXIS are the first of three."""

    CENTER = 0
    K0 = 3  # flat: inner^2
    AXIS = 4
    K1 = 7  # flat: outer^2
    K2 = 8
    LOW = 9
    HIGH = 10
    KIND = 11
    MATERIAL = 12  # of a lamp's sphere: the number of the lamp
    CLIP = 13  # clip group, -1 for none
    INSIDE = 14  # 1: seen from inside alone
    PASSES = 15  # share of light that passes


ROW = 16


@dataclass(frozen=True, eq=False)
class ShapeTable:
    """Rows ``(n, 16)`` float32, in runs, one after the other.

    ``traced`` spheres are left to the engine's own tracer; ``walked`` shapes go into a hierarchy; ``listed`` ones are
    tested one by one; ``lamps`` are the visible spheres of lamps, which cast no shadow. ``boxes (walked, 2, 3)`` bound
    the walked ones.
    """

    rows: NDArray[np.float32]
    traced: int
    walked: int
    listed: int
    lamps: int
    boxes: Numbers

    @property
    def walked_rows(self) -> range:
        return range(self.traced, self.traced + self.walked)

    @property
    def listed_rows(self) -> range:
        return range(self.walked_rows.stop, self.walked_rows.stop + self.listed)

    @property
    def lamp_rows(self) -> range:
        return range(self.listed_rows.stop, self.listed_rows.stop + self.lamps)


def make_shape_table(scene: ClassicScene) -> ShapeTable:
    """All exact shapes of a scene; triangles are none."""
    passes = passing(scene)
    bounded, boxes = _all(scene, passes, (_spheres, _tubes, _rings, _boxes))
    unbounded, _ = _all(scene, passes, (_cylinders, _planes))
    lamps = _lamps(scene)

    traced = _traced(scene, bounded, boxes)
    others, other_boxes = bounded[~traced], boxes[~traced]
    walked = others, other_boxes
    listed = unbounded
    if len(others) <= MOST_LISTED_SHAPES:
        walked = others[:0], other_boxes[:0]
        listed = np.concatenate([others, unbounded])
    if len(unbounded) > MOST_LISTED_UNBOUNDED:
        pass
    rows = np.concatenate([bounded[traced], walked[0], listed, lamps])
    return ShapeTable(rows.astype(np.float32), int(traced.sum()), len(walked[0]), len(listed), len(lamps), walked[1])


