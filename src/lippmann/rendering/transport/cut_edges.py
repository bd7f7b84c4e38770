"""Window violations: objects in front of the lens plane that the panel's edge cuts, found by rays along the edge.

Behind the panel the edge is a window's frame, which may cut anything. In front of it the border occludes something that
stereopsis places nearer than the border: the cues conflict.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lippmann.device.pbr import BuiltScene
from lippmann.display import Display
from lippmann.display.view_cone import size_seen, zone_slopes
from lippmann.rendering.transport.depth_probe import Reals, first_hits
from lippmann.rendering.transport.tuning import TUNING
from lippmann.scene.matrices import inverse, transform_points
from lippmann.scene.values.description import Matrix

if TYPE_CHECKING:
    from lippmann.device.whitted.scene import BuiltClassic

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
    half_width, half_height = (np.array(size_seen(display)) - display.panel.pixel_pitch) / 2.0
    along = (np.arange(rays) + 0.5) * (2.0 / rays) - 1.0
    upright = [np.stack([np.full(rays, x), along * half_height], axis=-1) for x in (-half_width, half_width)]
    level = [np.stack([along * half_width, np.full(rays, y)], axis=-1) for y in (-half_height, half_height)]
    return np.stack([*upright, *level])
