"""Light vertices for a picture whose indirect light is noisy without them."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import SampleStream
from lippmann.rendering.film.memory_model import LIGHT_VERTEX
from lippmann.rendering.preparation.scattered_rays import ScatteredRays
from lippmann.rendering.preparation.seen_region import region_about, seen_points
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.light_vertices import (
    Arrival,
    LightVertexPasses,
    LightVertices,
    reach_of,
)
from lippmann.rendering.transport.pass_schedule import PassSchedule
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.rendering.transport.sharp_events import lambertian
from lippmann.rendering.transport.tuning import TUNING as TRANSPORT

Floats = NDArray[np.float32]

#: Seed of the look.
_SEED = 0x6C697473


def trace_light_vertices(
    integrator: PathIntegrator, request: RenderRequest, source: RaySource, memory: int, gain: float
) -> LightVertexPasses | None:
    """Light vertices for the picture of ``source``, if joining its paths to them saves noise; else None.

    A look at the first indirect light that the picture shows tells it: how it varies between paths that find it
    themselves, and between such as are joined.

    Parameters
    ----------
    memory:
        Bytes that they may take; where these do not hold them, paths find all light themselves.
    gain:
        Exposure of the picture.
    """
    if request.integrator != "path" or request.surfaces < 2 or memory < 2 * TRANSPORT.light_vertices * LIGHT_VERTEX:
        return None
    if not request.is_open_ended and request.samples < TUNING.fewest_joined_samples:
        return None
    look = _Look(integrator, source)
    if not 0 < look.emitters <= TRANSPORT.most_vertex_emitters:
        return None
    alone = look.variance(gain)
    if alone < TUNING.least_saved:
        return None
    passes = LightVertexPasses(
        integrator.scene,
        integrator.light_sampler,
        PassSchedule(TUNING.vertex_pass_samples, TUNING.vertex_pass_samples),
        request.seed,
        region_about(seen_points(integrator, source)),
    )
    if passes.are_none or alone - look.variance(gain, passes.of_pass(0)) < TUNING.least_saved:
        return None
    return passes


class _Look:
    """A few paths of two surfaces through a picture, the first of which scatters evenly."""

    def __init__(self, integrator: PathIntegrator, source: RaySource) -> None:
        self._integrator = integrator
        self._few = ScatteredRays(source, TUNING.vertex_side)
        flags = np.array([int(emitter.flags()) for emitter in integrator.scene.emitters()], np.uint32)
        has_place = int(mi.EmitterFlags.Surface | mi.EmitterFlags.DeltaPosition)
        #: Number of emitters that have a place in the scene.
        self.emitters = int(np.count_nonzero(flags & has_place))

    def variance(self, gain: float, vertices: LightVertices | None = None) -> float:
        """Mean variance of a path, joined to light vertices where there are any."""
        limited = (np.minimum(light * gain, TUNING.vertex_most) for light in self._traced(vertices))
        ways = (light.reshape(3, -1, TUNING.vertex_paths) for light in limited)
        return sum(float(pixels.var(axis=2, ddof=1, dtype=np.float64).mean()) for pixels in ways)

    def _traced(self, vertices: LightVertices | None) -> list[Floats]:
        """``(3, lanes)``: light that comes by the second surface, and what joins bring, where there are any."""
        integrator, few = self._integrator, self._few
        scene = integrator.scene
        lane = dr.arange(mi.UInt32, few.width * few.height * TUNING.vertex_paths)
        place, path = divide(lane, TUNING.vertex_paths)
        row, column = divide(place, few.width)
        stream = SampleStream.of_pixels(place, path, dr.opaque(mi.UInt32, _SEED))
        si = scene.ray_intersect(few.rays(column, row, mi.UInt32(0), mi.Point2f(0.5)))
        bsdf = si.bsdf()
        albedo = lambertian(si, bsdf, si.is_valid())
        active = si.is_valid() & (dr.max(albedo) > 0)

        wo = mi.warp.square_to_cosine_hemisphere(stream.next_2d(0))
        wo.z *= dr.sign(si.wi.z)
        ray = si.spawn_ray(si.to_world(wo))
        second = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        scatters = second.bsdf()
        smooth = active & second.is_valid() & mi.has_flag(scatters.flags(), mi.BSDFFlags.Smooth)
        arrival = None
        if vertices is not None:
            reach = reach_of(second, scatters, ray.d, dr.abs(wo.z) * dr.inv_pi, smooth)
            arrival = Arrival(vertices, lambertian(second, scatters, smooth), reach, mi.UInt32(0))
        light, _, _ = integrator.direct_light(second, scatters, stream.next_2d(1), smooth, arrival=arrival)
        found = [dr.select(active, albedo * light, 0)]
        if vertices is not None:
            found.append(vertices.join(si, bsdf, stream.next_1d(2), mi.UInt32(0), active, through=False)[0])
        dr.eval(found)
        return [np.array(mi.Color3f(each), dtype=np.float32) for each in found]
