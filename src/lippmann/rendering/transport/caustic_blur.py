"""By how much look-ups of photons blur caustics, seen along camera rays.

A look-up of twice the radius differs from one of the radius about as much as that one differs from the truth. Squared,
that is 9 times too much where light is smooth, whose blur grows with the square of the radius, and 2.3 times too little
at straight edges, whose blur keeps its height and grows in width. Caustics have both; for those of the bundled scenes
see ``docs/background/caustics.md``.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Ray3f, Spectrum
from lippmann.rendering.transport.path import DIMENSIONS_PER_VERTEX, PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.shadow_rays import MAX_CROSSINGS
from lippmann.rendering.transport.sharp_events import facing_normal, follows_sharply, lambertian, sharp_lobe

#: Radius of the wider look-up over that of the picture's.
WIDER = 2.0


class CausticBlur:
    """Estimates the radiance that the blur of ``photons`` adds along rays of ``integrator``, of either sign.

    It sees what Lambertian lobes show; the gloss of the same surfaces is taken to be blurred no more.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, integrator: PathIntegrator, photons: PhotonMap) -> None:
        self._paths = integrator
        self._narrow = photons
        self._wide = PhotonMap(photons.halves, WIDER * photons.radius)

    @syntax
    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> Spectrum:
        """One sample of it along ``ray`` (world space) per lane."""
        paths = self._paths
        context = mi.BSDFContext()
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
        active = mi.Bool(active)
        added = mi.Spectrum(0)
        throughput = mi.Spectrum(1)
        depth, crossings = mi.UInt32(0), mi.UInt32(0)
        # What does not change is no state: else Dr.Jit would record the loop a second time, without it.
        while dr.hint(active, label="sharp", exclude=[paths, context, stream]):
            toward = mi.Ray3f(o, d)
            si = paths.scene.ray_intersect(toward, mi.RayFlags.All, True, active)
            active &= si.is_valid() & (depth < paths.depth)
            bsdf = si.bsdf(toward)
            lobe, lambert = sharp_lobe(si, bsdf, active), lambertian(si, bsdf, active)
            lands = active & (dr.max(lambert) > 0)
            surfaces, half = paths.depth - depth - 1, mi.UInt32(stream.half)
            normal, choice = facing_normal(si), mi.Float(0)
            wide = self._wide.gather(si, normal, lobe, half, surfaces, choice, mi.Bool(True), lands).irradiance
            narrow = self._narrow.gather(si, normal, lobe, half, surfaces, choice, mi.Bool(True), lands).irradiance
            added += dr.select(lands, throughput * lambert * (wide - narrow) * dr.inv_pi, 0)

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
        if dr.hint(paths.gain is not None, mode="scalar"):
            added *= paths.gain
        return added
