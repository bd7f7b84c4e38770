"""The box that a built scene fills, and what rays see that miss it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.options.choices import POOLED_LIGHT
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.values.description import Color

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic


def even_background(built: BuiltScene | BuiltClassic, request: RenderRequest) -> Color | None:
    """The one colour that rays see which meet nothing; None if there is no such colour."""
    if request.integrator not in POOLED_LIGHT or getattr(built, "has_media", False):
        return None  # a medium may surround the scene
    return getattr(built, "background", None)


def scene_corners(built: BuiltScene, display_from_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """``(8, 3)`` corners in mm of a box that holds everything which a ray can meet, light sources included."""
    box = built.mitsuba.bbox()
    low, high = np.array(box.min, dtype=np.float64), np.array(box.max, dtype=np.float64)
    if built.splats is not None:
        low, high = np.minimum(low, built.splats.bounds[0]), np.maximum(high, built.splats.bounds[1])
    if built.volume is not None:
        low, high = np.minimum(low, built.volume.bounds[0]), np.maximum(high, built.volume.bounds[1])
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    moved: NDArray[np.float64] = corners @ display_from_world[:3, :3].T + display_from_world[:3, 3]
    return moved
