"""Tracing a list of pixels: those that no point reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.render.full import PIXEL_DIMENSION, RayTotals, divide, lane_total
from lippmann.render.integrators.base import ReusableIntegrator
from lippmann.render.rays import DisplayRays
from lippmann.render.reuse.points import BACKGROUND, TRACED, PointImage
from lippmann.render.sampling import SampleStream


@dataclass
class PixelTracer:
    """Traces any pixels of a display's picture and enters what they hit into a point image.

    A pixel gets the very samples that the full renderer would give it, so that its colour is the same.
    """

    integrator: ReusableIntegrator
    source: DisplayRays
    samples: int
    seed: int
    box_filter: bool
    most_lanes: int
    display_from_world: NDArray[np.float64]

    def trace(self, indices: NDArray[np.uint32], points: PointImage, totals: RayTotals) -> None:
        """Fill the pixels ``indices`` (row * width + column) of ``points``."""
        per_call = max(1, self.most_lanes // self.samples)
        for start in range(0, len(indices), per_call):
            self._trace(indices[start : start + per_call], points, totals)

    def _trace(self, indices: NDArray[np.uint32], points: PointImage, totals: RayTotals) -> None:
        lanes = len(indices) * self.samples
        chosen, sample = divide(dr.arange(mi.UInt32, lanes), dr.opaque(mi.UInt32, self.samples))
        pixel = dr.gather(mi.UInt32, mi.UInt32(indices), chosen)
        row, column = divide(pixel, self.source.width)
        stream = SampleStream.of_pixels(pixel, sample, dr.opaque(mi.UInt32, self.seed))
        jitter = stream.next_2d(PIXEL_DIMENSION) if self.box_filter else mi.Point2f(0.5)
        ray = self.source.rays(column, row, mi.UInt32(0), jitter)
        radiance, counts, first = self.integrator.sample_with_hit(ray, stream, mi.Bool(True))
        finite = dr.isfinite(radiance.x) & dr.isfinite(radiance.y) & dr.isfinite(radiance.z)
        radiance = dr.select(finite, radiance, mi.Color3f(0))
        z = self._height(ray, first.distance)
        fragile = dr.select(first.view_dependent, mi.UInt32(1), mi.UInt32(0))
        dr.eval(radiance, counts.secondary, counts.shadow, finite, z, fragile)
        totals.primary += lanes
        totals.secondary += lane_total(counts.secondary)
        totals.shadow += lane_total(counts.shadow)
        totals.discarded += lanes - int(dr.count(finite)[0])
        if self.samples > 1:
            # The nearest of a pixel's points stands for it: it is what hides others.
            z = dr.block_reduce(dr.ReduceOp.Max, z, self.samples)
            fragile = dr.block_reduce(dr.ReduceOp.Max, fragile, self.samples)
            radiance = mi.Color3f(*(dr.block_sum(part, self.samples) / self.samples for part in radiance))
        colors = np.array(dr.ravel(radiance)).reshape(-1, 3)
        points.color.reshape(-1, 3)[indices] = colors
        points.z.reshape(-1)[indices] = np.array(z)
        points.fragile.reshape(-1)[indices] = np.array(fragile) != 0
        points.status.reshape(-1)[indices] = TRACED

    def _height(self, ray: Any, distance: Any) -> Any:
        """Display-frame z of the point at ``distance`` along ``ray``."""
        row = self.display_from_world[2].tolist()
        p = ray(dr.select(dr.isfinite(distance), distance, 0))
        z = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]
        return dr.select(dr.isfinite(distance), z, BACKGROUND)
