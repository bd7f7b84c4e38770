"""Properties of the first surface, without light: what proofs of geometry and light-field ground truth are made of."""

from __future__ import annotations

from typing import Any, Literal

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.sobol import SampleStream
from lippmann.rendering.transport.integrator import RayCounts

SurfaceProperty = Literal["normal", "depth", "position", "albedo"]


class SurfaceIntegrator:
    """One property of the first surface hit; 0 where nothing is hit.

    ``normal`` is the shading normal and ``position`` the point hit, both in the display's frame (mm); ``depth`` is the
    display-frame z in mm (positive toward the viewer), in all three channels; ``albedo`` is the diffuse reflectance as
    the surface reports it.
    """

    def __init__(self, scene: Any, prop: SurfaceProperty, display_from_world: NDArray[np.float64]) -> None:
        self.scene = scene
        self.name = prop
        self.depth = 1
        self._matrix = np.asarray(display_from_world, dtype=np.float64)

    def sample(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts]:
        del stream
        si = self.scene.ray_intersect(ray, mi.RayFlags.All, True, active)
        hit = si.is_valid()
        if self.name == "albedo":
            value = mi.Color3f(si.bsdf(ray).eval_diffuse_reflectance(si, hit))
        elif self.name == "normal":
            value = mi.Color3f(dr.normalize(self._linear(si.sh_frame.n)))
        else:
            point = self._linear(si.p) + mi.Vector3f(self._matrix[:3, 3].tolist())
            value = mi.Color3f(point) if self.name == "position" else mi.Color3f(point.z)
        none = dr.zeros(mi.UInt32, dr.width(si.t))
        return dr.select(hit, value, mi.Color3f(0)), RayCounts(none, none)

    def _linear(self, vector: Any) -> Any:
        rows = self._matrix[:3, :3].tolist()
        return mi.Vector3f(*(row[0] * vector.x + row[1] * vector.y + row[2] * vector.z for row in rows))
