"""Blur of the caustics that a picture shows: by the photons about the first rough surface along camera rays."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, BSDFPtr, Ray3f, Spectrum, SurfaceInteraction3f, UInt32, Vector3f
from lippmann.rendering.transport.path import DIMENSIONS_PER_VERTEX, PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.shadow_rays import MAX_CROSSINGS
from lippmann.rendering.transport.sharp_events import (
    facing_normal,
    follows_sharply,
    lambertian,
    sharp_lobe,
)


class ShownBlur:
    """Radiance, of either sign, that look-ups of twice the radius add to the caustics that rays of ``integrator`` show.

    It is that of Lambertian lobes; the gloss of the same surfaces is taken to be blurred no more.
    """

    def __init__(self, integrator: PathIntegrator, photons: PhotonMap) -> None:
        self._paths = integrator
        self._usual, self._wide = photons, PhotonMap(photons.halves, 2 * photons.radius)

    @syntax
    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> Spectrum:
        """One sample of it along ``ray`` (world space) per lane."""
        paths = self._paths
        context = mi.BSDFContext()
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
        active = mi.Bool(active)
        shown = mi.Spectrum(0)
        throughput = mi.Spectrum(1)
        depth, crossings = mi.UInt32(0), mi.UInt32(0)
        while dr.hint(active, label="sharp", exclude=[paths, context, stream]):
            toward = mi.Ray3f(o, d)
            si = paths.scene.ray_intersect(toward, mi.RayFlags.All, True, active)
            active &= si.is_valid() & (depth < paths.depth)
            bsdf = si.bsdf(toward)
            lobe = sharp_lobe(si, bsdf, active)
            shown += throughput * self._light(si, bsdf, lobe, depth, stream, active)

            dimension = (depth * 2 + crossings) * DIMENSIONS_PER_VERTEX + 1
            bs, weight = bsdf.sample(context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), active)
            active &= follows_sharply(si, lobe, bs)
            throughput *= weight
            if mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null):
                crossings += 1
            else:
                depth += 1
            active &= (dr.max(throughput) > 0) & (crossings < MAX_CROSSINGS)
            onward = si.spawn_ray(si.to_world(bs.wo))
            o, d = mi.Point3f(onward.o), mi.Vector3f(onward.d)
        return paths.exposed(shown)

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
