"""Blur (bias) of the caustics that camera rays see, estimated at the first rough surface from the photons there."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.surface_lobes import is_sharp_event
from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, BSDFPtr, Ray3f, Spectrum, SurfaceInteraction3f, UInt32, Vector3f
from lippmann.rendering.transport.light_sampling import MAX_CROSSINGS
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.path_vertex import DIMENSIONS
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.sharp_events import (
    facing_normal,
    lambertian,
    sharp_lobe,
)


class VisibleBlur:
    """Change of the radiance of visible caustics, of either sign, when photons are looked up with twice the radius.

    Only for Lambertian lobes; the glossy lobes of the same surfaces are assumed to be blurred no more than these.
    """

    def __init__(self, integrator: PathIntegrator, photons: PhotonMap) -> None:
        self._paths = integrator
        self._usual, self._wide = photons, PhotonMap(photons.halves, 2 * photons.radius)

    @syntax
    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> Spectrum:
        """One sample per lane of the change along ``ray`` (world space)."""
        paths = self._paths
        context = mi.BSDFContext()
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
        active = mi.Bool(active)
        added = mi.Spectrum(0)
        throughput = mi.Spectrum(1)
        depth, crossings = mi.UInt32(0), mi.UInt32(0)
        while dr.hint(active, label="sharp", exclude=[paths, context, stream]):
            toward = mi.Ray3f(o, d)
            si = paths.scene.ray_intersect(toward, mi.RayFlags.All, True, active)
            active &= si.is_valid() & (depth < paths.depth)
            bsdf = si.bsdf(toward)
            lobe = sharp_lobe(si, bsdf, active)
            added += throughput * self._light(si, bsdf, lobe, depth, stream, active)

            dimension = (depth * 2 + crossings) * DIMENSIONS + 1
            bs, weight = bsdf.sample(context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), active)
            active &= is_sharp_event(bs)
            throughput *= weight
            if mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null):
                crossings += 1
            else:
                depth += 1
            active &= (dr.max(throughput) > 0) & (crossings < MAX_CROSSINGS)
            onward = si.spawn_ray(si.to_world(bs.wo))
            o, d = mi.Point3f(onward.o), mi.Vector3f(onward.d)
        return paths.expose(added)

    def _light(
        self,
        si: SurfaceInteraction3f,
        bsdf: BSDFPtr,
        lobe: Vector3f,
        depth: UInt32,
        stream: SampleStream,
        active: Bool,
    ) -> Spectrum:
        surfaces, lambert = self._paths.depth - depth - 1, lambertian(si, bsdf, active)
        lands, normal, half = active & (dr.max(lambert) > 0), facing_normal(si), mi.UInt32(stream.half)
        wider, usual = (
            photons.gather(si, normal, lobe, half, surfaces, mi.Float(0), mi.Bool(True), lands).irradiance
            for photons in (self._wide, self._usual)
        )
        return dr.select(lands, lambert * (wider - usual) * dr.inv_pi, 0)
