"""Properties of the first surface (normal, position, depth, albedo), for geometry tests and as ground truth."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Color3f, MitsubaScene, Ray3f, Vector3f
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
            value = mi.Color3f(dr.normalize(transform_vector(normal_matrix(self._matrix), si.sh_frame.n)))
        else:
            point = transform_vector(self._matrix, si.p) + mi.Vector3f(self._matrix[:3, 3].tolist())
            value = mi.Color3f(point) if self.name == "position" else mi.Color3f(point.z)
        none = dr.zeros(mi.UInt32, dr.width(si.t))
        return dr.select(hit, value, mi.Color3f(0)), RayCounts(none, none)


def transform_vector(matrix: NDArray[np.float64], vector: Vector3f) -> Vector3f:
    """Transform a vector on the device by the linear part ``(3, 3)`` of ``matrix``."""
    rows = matrix[:3, :3].tolist()
    return mi.Vector3f(*(row[0] * vector.x + row[1] * vector.y + row[2] * vector.z for row in rows))
