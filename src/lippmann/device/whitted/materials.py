"""Materials as one table on the device, fetched per hit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import upload
from lippmann.device.types import Bool, Color3f, Float, UInt32
from lippmann.device.whitted.intersections import xyz
from lippmann.scene.values.whitted_surfaces import ClassicMaterial

#: Smallest share of anything that Tachyon takes into account.
LEAST = 0.001959


@dataclass
class Finish:
    """A material at a hit; fields as those of :class:`ClassicMaterial`."""

    color: Color3f
    ambient: Float
    diffuse: Float
    specular: Float
    opacity: Float
    phong: Float
    phong_size: Float
    metal: Bool
    texture: UInt32
    raster3d: Bool
    outline: Float
    outline_width: Float
    ior: Float


class MaterialTable:
    """The materials of a scene, and what any of them needs."""

    def __init__(self, materials: Sequence[ClassicMaterial], textures: Sequence[int]) -> None:
        """``textures`` are the numbers of the materials' textures, -1 for a constant colour."""
        rows = [
            [
                *(*m.color, m.ambient),
                *(m.diffuse, m.specular, m.opacity, m.phong),
                *(m.phong_size, m.phong_kind == "metal", texture, m.raster3d),
                *(m.outline, m.outline_width, m.ior, 0.0),
            ]
            for m, texture in zip(materials, textures, strict=True)
        ]
        self._rows = upload(np.array(rows, np.float32))

        def some(holds: Callable[[ClassicMaterial], bool]) -> bool:
            return any(holds(material) for material in materials)

        self.mirrors = some(lambda m: m.specular > 0)
        self.lets_through = some(lambda m: m.opacity < 1.0)
        self.branches = some(lambda m: m.specular > 0 and m.opacity < 1.0)
        self.shines = some(lambda m: m.phong > LEAST)
        self.metal = some(lambda m: m.phong_kind == "metal" and m.phong > LEAST)
        self.outlined = some(lambda m: m.outline > 0)
        self.raster3d = some(lambda m: m.raster3d)

    def fetch(self, index: UInt32, active: Bool) -> Finish:
        """The material of each lane."""
        a, b, c, d = (dr.gather(mi.Vector4f, self._rows, 4 * index + part, active) for part in range(4))
        return Finish(
            *(mi.Color3f(xyz(a)), a.w),
            *(b.x, b.y, b.z, b.w),
            *(c.x, c.y > 0, mi.Int32(c.z), c.w > 0),
            *(d.x, d.y, d.z),
        )
