"""How deep a camera sees into a scene: a grid of rays that tells where the first surfaces lie."""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.rendering.transport.first_surface import make_surfaces
from lippmann.rendering.transport.ray_source import world_ray
from lippmann.scene.camera_placement import CameraView, VisibleDepth

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic

#: Rays along each side of the view.
SIDE = 128
#: Shares of the rays that meet something nearer than the near depth, and nearer than the far one: neither a few pixels
#: nor a floor that runs to the horizon decides.
NEAR_SHARE, FAR_SHARE = 0.01, 0.9


def probe_depth(built: BuiltScene | BuiltClassic, view: CameraView) -> VisibleDepth | None:
    """Depths that ``view`` shows, along the camera's axis in world units; None where it shows nothing."""
    number = dr.arange(mi.UInt32, SIDE * SIDE)
    x, y = ((mi.Float64(place) + 0.5) * (2 / SIDE) - 1 for place in (number % SIDE, number // SIDE))
    x, y, zero = x * view.half_width, y * view.half_height, dr.zeros(mi.Float64, SIDE * SIDE)
    if view.is_parallel:
        origin, direction = (x, y, zero), (zero, zero, zero - 1)
    else:
        origin, direction = (zero, zero, zero), (x, y, zero - 1)
    ray = world_ray(np.asarray(view.world_from_camera, dtype=np.float64), origin, direction)
    hit = make_surfaces(built).first_hit(ray)
    seen = np.array(hit.hit, dtype=bool)
    if not seen.any():
        return None
    eye, back = view.world_from_camera[:3, 3], view.world_from_camera[:3, 2]
    depths = np.sort(((eye - np.array(hit.p, dtype=np.float64).T) @ back)[seen])
    near, far = np.quantile(depths, (NEAR_SHARE, FAR_SHARE))
    return VisibleDepth(float(near), float(far))
