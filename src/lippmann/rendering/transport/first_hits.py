"""First hits before a picture is rendered: how deep a camera sees, and which objects the panel's edge cuts.

The edge is probed for window violations. Behind the panel it is a window's frame, which may cut anything. In front of
the panel the border occludes something that stereopsis places nearer than the border: the cues conflict.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import to_numpy
from lippmann.device.pbr import BuiltScene
from lippmann.display import Display
from lippmann.display.view_cone import visible_size, zone_slopes
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
    last = len(depths) - 1
    # As np.quantile, which loads all of NumPy's masked arrays.
    near, far = np.interp((NEAR_SHARE * last, FAR_SHARE * last), np.arange(len(depths)), depths)
    return VisibleDepth(float(near), float(far))


def first_hits(
    built: BuiltScene | BuiltClassic, world_from_frame: Matrix, origins: Reals, directions: Reals
) -> tuple[NDArray[np.bool_], Reals]:
    """Whether rays of a frame meet a surface, ``(n,)``, and the points of the world where they do, ``(n, 3)``, else 0.

    ``origins`` and ``directions`` are ``(..., 3)``, of shapes that broadcast to n rays.
    """
    origin, direction = (
        # By way of lists: arrays would be read where they lie, by a kernel for each alignment that they may have.
        tuple(mi.Float64(axis) for axis in values.reshape(-1, 3).T.tolist())
        for values in np.broadcast_arrays(origins, directions)
    )
    hit, point = make_surfaces(built).first_point(world_ray(world_from_frame, origin, direction))
    point = dr.select(hit, point, 0)
    dr.eval(hit, point)
    return np.array(hit, dtype=bool), to_numpy(point, len(hit)).astype(np.float64)


SIDES = ("left", "right", "bottom", "top")


@dataclass(frozen=True)
class CutEdges:
    """``shares``: the largest share of each side, of the sides that cut something, over all views; ``height``: mm over
    the lens plane of the highest point that is cut."""

    shares: dict[str, float]
    height: float


def find_cut_edges(
    built: BuiltScene | BuiltClassic, display: Display, world_from_display: Matrix, threads: int
) -> CutEdges | None:
    """Objects that the panel's edge cuts in front of the lens plane, in the middle and outermost views; None for none.

    A point at height z counts if it moves by more than the display resolves from the first view to the last. Splats and
    volumes count from the depth at which they absorb half of the light; ``threads`` CPU threads trace those.
    """
    side, _ = slopes = zone_slopes(display)
    views = [(0.0, 0.0), (-side, 0.0), (side, 0.0)]
    if display.lens_array.layout != "lenticular":
        views += [(0.0, -slopes[1]), (0.0, slopes[1])]
    # (view, side, ray, x and y). The eye of slope s sees the point p of the lens plane along p (1 - z / D) + s z.
    edge, slope = _edge(display), np.array(views)[:, None, None]
    steps = slope - edge / display.viewing_distance
    origins = np.concatenate(
        [edge + display.aperture_distance * steps, np.full((*steps.shape[:-1], 1), display.aperture_distance)], axis=-1
    )
    directions = np.concatenate([-steps, np.full((*steps.shape[:-1], 1), -1.0)], axis=-1)
    hit, points = first_hits(built, world_from_display, origins, directions)
    heights = np.where(hit, transform_points(inverse(world_from_display), points)[:, 2], -np.inf)
    least = display.resolved_size / (2.0 * side)
    if isinstance(built, BuiltScene) and not (built.splats is None and built.volume is None):
        from lippmann.device.pbr.half_stopped import half_stopped_by

        for half_stopped in half_stopped_by(built, world_from_display, origins, directions, least, threads):
            heights = np.maximum(heights, half_stopped)
    is_cut = (heights > least).reshape(steps.shape[:-1])
    if not is_cut.any():
        return None
    shares = dict(zip(SIDES, is_cut.mean(axis=-1).max(axis=0).tolist(), strict=True))
    return CutEdges({name: share for name, share in shares.items() if share > 0.0}, float(heights.max()))


def _edge(display: Display) -> Reals:
    """Points ``(side, ray, 2)`` of the lens plane half a pixel within the panel's edge, in mm."""
    rays = TUNING.probe_side
    half_width, half_height = (np.array(visible_size(display)) - display.panel.pixel_pitch) / 2.0
    along = (np.arange(rays) + 0.5) * (2.0 / rays) - 1.0
    upright = [np.stack([np.full(rays, x), along * half_height], axis=-1) for x in (-half_width, half_width)]
    level = [np.stack([along * half_width, np.full(rays, y)], axis=-1) for y in (-half_height, half_height)]
    return np.stack([*upright, *level])
