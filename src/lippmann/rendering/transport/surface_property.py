"""Properties of the first surface (normal, position, depth, albedo), for geometry tests and as ground truth."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import transform_point, transform_vector
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Color3f, MitsubaScene, Ray3f
from lippmann.rendering.transport.integrator import RayCounts
from lippmann.scene.matrices import normal_matrix


class SurfaceIntegrator:
    """Integrator of one property of the first surface; 0 where nothing is hit.

    Parameters
    ----------
    scene:
        The scene.
    prop:
        ``normal``: the unit shading normal, in the display's frame. ``position``: the point hit, in the display's frame
        (mm). ``depth``: the display-frame z of that point in mm, positive toward the viewer, in all three channels.
        ``albedo``: the diffuse reflectance in [0, 1].
    display_from_world:
        ``(4, 4)``, an affine map.
    """

    def __init__(self, scene: MitsubaScene, prop: str, display_from_world: NDArray[np.float64]) -> None:
        self.scene = scene
        self.name = prop
        self.depth = 1
        self._matrix = np.asarray(display_from_world, dtype=np.float64)

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Color3f, RayCounts]:
        """The property where ``ray`` first hits, as the channels of a colour."""
        del stream
        si = self.scene.ray_intersect(ray, mi.RayFlags.All, True, active)
        hit = si.is_valid()
        if self.name == "albedo":
            value = mi.Color3f(si.bsdf(ray).eval_diffuse_reflectance(si, hit))
        elif self.name == "normal":
            value = mi.Color3f(dr.normalize(mi.Vector3f(transform_vector(normal_matrix(self._matrix), si.sh_frame.n))))
        else:
            point = transform_point(self._matrix, si.p)
            value = mi.Color3f(point if self.name == "position" else point[2])
        none = dr.zeros(mi.UInt32, dr.width(si.t))
        return dr.select(hit, value, mi.Color3f(0)), RayCounts(none, none)
