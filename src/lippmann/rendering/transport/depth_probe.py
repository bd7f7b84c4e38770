"""Visible depth range of a camera, from a grid of primary rays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.transport.first_surface import make_surfaces
from lippmann.rendering.transport.ray_source import world_ray
from lippmann.rendering.transport.tuning import TUNING
from lippmann.scene.camera_placement import CameraView, VisibleDepth
from lippmann.scene.matrices import inverse, transform_points
from lippmann.scene.values.description import Matrix

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic

Reals = NDArray[np.float64]

#: Quantiles of the hit distances that count as the near and the far depth, robust against a few pixels and against a
#: floor that runs to the horizon.
NEAR_SHARE, FAR_SHARE = 0.01, 0.9


def probe_depth(built: BuiltScene | BuiltClassic, view: CameraView) -> VisibleDepth | None:
    """Near and far depth of ``view`` along the camera's axis in world units; None if no ray hits."""
    side = TUNING.probe_side
    across = (np.arange(side) + 0.5) * (2 / side) - 1
    plane = np.zeros((side, side, 3))
    plane[..., 0], plane[..., 1] = across * view.half_width, across[:, None] * view.half_height
    toward = np.array((0.0, 0.0, -1.0))
    origins, directions = (plane, toward) if view.is_parallel else (np.zeros(3), plane + toward)
    hit, points = first_hits(built, view.world_from_camera, origins, directions)
    if not hit.any():
        return None
    depths = np.sort(-transform_points(inverse(view.world_from_camera), points[hit])[:, 2])
    near, far = np.quantile(depths, (NEAR_SHARE, FAR_SHARE))
    return VisibleDepth(float(near), float(far))


def first_hits(
    built: BuiltScene | BuiltClassic, world_from_frame: Matrix, origins: Reals, directions: Reals
) -> tuple[NDArray[np.bool_], Reals]:
    """Whether rays of a frame meet a surface, ``(n,)``, and the points of the world where they do, ``(n, 3)``, else 0.

    ``origins`` and ``directions`` are ``(..., 3)``, of shapes that broadcast to n rays.
    """
    origin, direction = (
        tuple(mi.Float64(np.ascontiguousarray(axis)) for axis in values.reshape(-1, 3).T)
        for values in np.broadcast_arrays(origins, directions)
    )
    hit, point = make_surfaces(built).first_point(world_ray(world_from_frame, origin, direction))
    point = dr.select(hit, point, 0)
    dr.eval(hit, point)
    return np.array(hit, dtype=bool), np.array(point, dtype=np.float64).T
