"""What lies behind something that is composited on the CPU: its light, and how far in front of it rays run free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Point3f, Ray3f, Spectrum
from lippmann.rendering.transport.first_surface import PhysicalSurfaces
from lippmann.rendering.transport.integrator import Integrator, RayCounts

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene


@dataclass(frozen=True, eq=False)
class FreeRays:
    """Rays up to the first surface that stops them.

    Attributes
    ----------
    radiance, counts:
        What the integrator behind them brings from there, and the rays traced for it.
    origins, directions:
        ``(n, 3)`` float32, one row per lane.
    ends:
        ``(n,)`` float32: distance of the surface, infinite without one.
    """

    radiance: Spectrum
    counts: RayCounts
    origins: NDArray[np.float32]
    directions: NDArray[np.float32]
    ends: NDArray[np.float32]


class Behind:
    """Surfaces and background of a scene.

    Parameters
    ----------
    integrator:
        Brings their radiance.
    built:
        The scene on the device.
    """

    def __init__(self, integrator: Integrator, built: BuiltScene) -> None:
        self.integrator = integrator
        self._surfaces = PhysicalSurfaces(built) if len(built.mitsuba.shapes()) else None

    def trace(self, ray: Ray3f, stream: SampleStream, active: Bool) -> FreeRays:
        """The light behind, evaluated, and the rays as they are read on the CPU; all lanes, whether active or not."""
        radiance, counts = self.integrator.sample(ray, stream, active)
        end = mi.Float(dr.inf)
        if self._surfaces is not None:
            hit = self._surfaces.first_hit(ray)
            end = dr.select(hit.hit, dr.dot(hit.p - ray.o, ray.d), dr.inf)
        # All at once: each evaluated alone would trace the paths anew.
        dr.eval(radiance, counts.secondary, counts.shadow, end, ray)
        lanes = max(dr.width(ray), dr.width(radiance), dr.width(end))
        return FreeRays(radiance, counts, _rows(ray.o, lanes), _rows(ray.d, lanes), _rows(end, lanes))


def _rows(value: Point3f, lanes: int) -> NDArray[np.float32]:
    """``(lanes,)`` or ``(lanes, 3)`` float32 of an evaluated array; one of a single entry counts for every lane."""
    array = np.asarray(value, dtype=np.float32).T
    return np.ascontiguousarray(np.broadcast_to(array, (lanes, *array.shape[1:])))
