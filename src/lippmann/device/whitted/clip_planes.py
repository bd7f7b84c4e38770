"""Clip groups: planes that cut shapes away."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import upload
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Float, Point3f
from lippmann.scene.values.whitted_shapes import Numbers


class Clipping:
    """The clip groups of a scene: arrays ``(k, 4)`` of planes (a, b, c, d) that keep a x + b y + c z <= d."""

    def __init__(self, groups: Sequence[Numbers]) -> None:
        self._groups = [group.tolist() for group in groups]
        sizes = [len(group) for group in groups]
        # Group -1, no clipping, comes first: it has no planes.
        self._planes = upload(np.concatenate([np.zeros((1, 4)), *groups]))
        self._starts = mi.UInt32((1 + np.cumsum([0, 0, *sizes])[:-1]).astype(np.uint32))
        self._sizes = mi.UInt32(np.array([0, *sizes], np.uint32))

    def keeps(self, group: Float, p: Point3f, active: Bool) -> Bool:
        """Whether point ``p`` of a shape in ``group`` (a whole number, or an array of them; -1 for none) is kept."""
        if isinstance(group, float):
            kept = mi.Bool(active)
            for a, b, c, d in self._groups[int(group)] if group >= 0 else []:
                kept &= a * p.x + b * p.y + c * p.z <= d
            return kept
        return self._look_up(group, p, active)

    @syntax
    def _look_up(self, group: Float, p: Point3f, active: Bool) -> Bool:
        slot = mi.UInt32(mi.Int32(group) + 1)
        plane = dr.gather(mi.UInt32, self._starts, slot, active)
        end = plane + dr.gather(mi.UInt32, self._sizes, slot, active)
        kept = mi.Bool(active)
        while dr.hint(kept & (plane < end), label="clip planes"):
            row = dr.gather(mi.Vector4f, self._planes, plane)
            kept = row.x * p.x + row.y * p.y + row.z * p.z <= row.w
            plane += 1
        return kept
