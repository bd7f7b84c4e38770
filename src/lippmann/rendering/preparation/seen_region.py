"""The part of a scene that a picture shows."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.preparation.scattered_rays import ScatteredRays
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import RaySource


def seen_points(integrator: PathIntegrator, source: RaySource) -> NDArray[np.float64]:
    """``(n, 3)``: what the picture's rays meet first, of some of them that lie evenly in it."""
    few = ScatteredRays(source, TUNING.seen_side)
    place = dr.arange(mi.UInt32, few.width * few.height)
    row = place // few.width
    ray = few.rays(place - row * few.width, row, mi.UInt32(0), mi.Point2f(0.5))
    si = integrator.scene.ray_intersect(ray)
    points: NDArray[np.float64] = np.array(si.p, dtype=np.float64).T[np.array(si.is_valid())]
    return points


def region_about(points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Corners ``(2, 3)`` of a box about points that are seen; None where there are none."""
    if not len(points):
        return None
    corners: NDArray[np.float64] = np.quantile(points, [TUNING.apart, 1 - TUNING.apart], axis=0)
    middle, size = corners.mean(axis=0), np.ptp(corners, axis=0)
    reach = (0.5 + TUNING.wider) * size + TUNING.wider * size.max()
    return np.stack([middle - reach, middle + reach])
