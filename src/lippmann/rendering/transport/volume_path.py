"""Volumetric path tracing: surfaces and participating media, by delta tracking and ratio tracking.

The expectation is that of Mitsuba's ``volpath`` with ``max_depth = depth + 1``. Free-flight distances are sampled by
the majorant (delta tracking; Woodcock 1965). The colour whose extinction samples a distance is drawn for each distance,
and all colours share the weight (one-sample MIS by the balance heuristic; Veach 1997, chapter 9.2.4). Transmittance
toward emitters is exact in homogeneous media and found by ratio tracking in others (Novak et al. 2014). Boundaries
without a surface do not count as a bounce; a scattering event in a medium counts as a surface does.

Unlike a sensor, a display has no medium of its own: the medium in which a ray begins is that on the near side of the
first boundary ahead of it.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.media import surrounding_medium
from lippmann.device.sobol import SampleStream, hash32
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    Interaction3f,
    MediumPtr,
    MitsubaScene,
    Point3f,
    Ray3f,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
)
from lippmann.rendering.transport.integrator import FirstHit, RayCounts
from lippmann.rendering.transport.light_sampling import (
    MAX_CROSSINGS,
    LightSampler,
    SceneLightSampler,
    choose_survival,
    mis_weight,
)
from lippmann.rendering.transport.path_vertex import DIMENSIONS
from lippmann.rendering.transport.tuning import TUNING
from lippmann.scene.values.description import Color

#: Collisions, null collisions included, along one path or shadow ray: bounds the loop in media that are all but opaque.
MAX_COLLISIONS = 1 << 16


class VolumePathIntegrator:
    """Paths of up to ``depth`` surfaces and scattering events in a scene with participating media.

    Parameters
    ----------
    scene:
        A ``mi.Scene``.
    depth:
        Surfaces and scattering events per path, at least 1.
    name:
        Name of the integrator in a request.
    background:
        Linear RGB that camera rays see where nothing is hit; by default the environment itself.

    Attributes
    ----------
    light_sampler:
        Samples the scene's emitters, by the scene's own weights.
    """

    def __init__(self, scene: MitsubaScene, depth: int, name: str = "path", background: Color | None = None) -> None:
        self.scene = scene
        self.depth = depth
        self.name = name
        self.background = background
        self.light_sampler: LightSampler = SceneLightSampler(scene)
        self._surrounding = surrounding_medium(scene)

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """Radiance along ``ray``, and the rays traced for it."""
        radiance, counts, _ = self.sample_with_hit(ray, stream, active)
        return radiance, counts

    @syntax
    def sample_with_hit(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts, FirstHit]:
        """As :meth:`sample`, with the first surface, boundaries of media included.

        Surfaces that are not purely diffuse, and those seen through a medium, are view-dependent.
        """
        scene = self.scene
        context = mi.BSDFContext()
        phase_context = mi.PhaseFunctionContext(None)

        ray = mi.Ray3f(ray)  # current ray
        active = mi.Bool(active)
        radiance = mi.Spectrum(0)
        throughput = mi.Spectrum(1)
        eta = mi.Float(1)  # product of relative indices, so that roulette sees unitless throughput
        depth = mi.UInt32(0)  # surfaces and scattering events so far, straight-through ones excluded
        crossings = mi.UInt32(0)  # straight-through surfaces so far
        event = mi.UInt32(0)  # collisions and surfaces so far
        secondary = mi.UInt32(0)
        shadow = mi.UInt32(0)
        vertex = dr.zeros(mi.Interaction3f)  # last scattering vertex, for the pdf of emitter sampling there
        vertex_pdf = mi.Float(1)
        vertex_delta = mi.Bool(True)

        si = scene.ray_intersect(ray, mi.RayFlags.All, True, active)  # the surface ahead of the ray
        first_distance = mi.Float(si.t)
        medium, secondary = self._find_first_medium(ray, si, active)
        view_dependent = mi.Bool(False)

        while dr.hint(active, label="volume paths"):
            dimension = event * DIMENSIONS + 1

            # ---- free flight through the medium ----
            inside = active & (medium != None)  # noqa: E711 (compares lane by lane)
            channel = mi.UInt32(dr.minimum(stream.next_1d(dimension) * 3, 2))
            mei = medium.sample_interaction(ray, stream.next_1d(dimension + 1), channel, inside)
            collided = inside & mei.is_valid() & (mei.t <= si.t)
            extinction = mi.Spectrum(mei.combined_extinction)
            length = dr.select(collided, mei.t, si.t) - mei.mint
            # Relative to the clearest colour, so that long ways do not underflow.
            relative = dr.exp(-(extinction - dr.min(extinction)) * length)
            weight = relative / dr.mean(dr.select(collided, extinction * relative, relative))
            throughput *= dr.select(inside & (length < dr.inf), weight, 1)

            # ---- null collisions and scattering ----
            null_probability = dr.clip(dr.mean(mei.sigma_n / extinction), 0, 1)
            is_null = collided & (stream.next_1d(dimension + 2) < null_probability)
            scattered = collided & ~is_null
            throughput *= dr.select(is_null, mi.Spectrum(mei.sigma_n) / null_probability, 1)
            throughput *= dr.select(scattered, mi.Spectrum(mei.sigma_s) / (1 - null_probability), 1)

            # ---- emission ----
            at_surface = active & ~collided
            ds = mi.DirectionSample3f(scene, si=si, ref=vertex)
            emitter_pdf = self.light_sampler.pdf_direction(vertex, ds, at_surface & ~vertex_delta)
            emission = ds.emitter.eval(si, at_surface) * mis_weight(vertex_pdf, emitter_pdf)
            if dr.hint(self.background is not None, mode="scalar"):
                emission = dr.select((depth == 0) & ~si.is_valid(), mi.Spectrum(self.background), emission)
            radiance += dr.select(at_surface, throughput * emission, 0)

            at_surface &= si.is_valid()
            may_bounce = depth < self.depth  # paths of full depth still pass straight through boundaries
            scattered &= may_bounce
            bsdf = si.bsdf(ray)
            shiny = (bsdf.flags() & int(mi.BSDFFlags.Glossy | mi.BSDFFlags.Delta | mi.BSDFFlags.Null)) != 0
            view_dependent |= (depth == 0) & (inside | (at_surface & shiny))

            # ---- next-event estimation ----
            phase = mei.medium.phase_function()
            smooth = at_surface & may_bounce & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            # Media may opt out of emitter sampling; phase sampling alone then finds their light.
            lit_medium = scattered & medium.use_emitter_sampling()
            reference = dr.select(scattered, mi.Interaction3f(mei), mi.Interaction3f(si))
            light_ds, light = self.light_sampler.sample_direction(
                reference, stream.next_2d(dimension + 3), smooth | lit_medium
            )
            lit = (smooth | lit_medium) & (light_ds.pdf != 0) & (dr.max(light) > 0)
            bsdf_value, bsdf_pdf = bsdf.eval_pdf(context, si, si.to_local(light_ds.d), lit & smooth)
            phase_value, phase_pdf = phase.eval_pdf(phase_context, mei, light_ds.d, lit & lit_medium)
            scattering_pdf = dr.select(scattered, phase_pdf, bsdf_pdf)
            reflected = dr.select(scattered, mi.Spectrum(phase_value), bsdf_value) * light
            reflected *= dr.select(light_ds.delta, 1, mis_weight(light_ds.pdf, scattering_pdf))
            lit &= dr.max(reflected) > 0
            toward_light = mi.MediumPtr(medium)
            toward_light[at_surface & si.is_medium_transition()] = si.target_medium(light_ds.d)
            # A stream of its own: a shadow ray may collide any number of times.
            of_shadow = SampleStream(hash32(stream.key ^ (dimension + 7)), stream.index, stream.half)
            visible, tests = self._estimate_transmittance(reference, light_ds.p, toward_light, of_shadow, lit)
            radiance += dr.select(lit, throughput * reflected * visible, 0)
            shadow += tests

            # ---- BSDF and phase function sampling ----
            number, point = stream.next_1d(dimension + 4), stream.next_2d(dimension + 5)
            bs, bsdf_weight = bsdf.sample(context, si, number, point, at_surface)
            direction, phase_weight, sampled_pdf = phase.sample(phase_context, mei, number, point, scattered)
            passes = at_surface & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            bounces = scattered | (at_surface & may_bounce & ~passes)
            throughput *= dr.select(at_surface, bsdf_weight, 1)
            throughput *= dr.select(scattered, phase_weight, 1)
            eta *= dr.select(at_surface, bs.eta, 1)
            vertex[bounces] = reference
            vertex_pdf = dr.select(bounces, dr.select(scattered, sampled_pdf, bs.pdf), vertex_pdf)
            is_delta = (scattered & ~lit_medium) | (at_surface & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta))
            vertex_delta = dr.select(bounces, is_delta, vertex_delta)
            depth += dr.select(bounces, mi.UInt32(1), 0)
            crossings += dr.select(passes, mi.UInt32(1), 0)

            # ---- the ray goes on ----
            ray.o[is_null] = mei.p
            si.t[is_null] = si.t - mei.t
            ray[scattered] = mei.spawn_ray(direction)
            ray[at_surface] = si.spawn_ray(si.to_world(bs.wo))
            medium[at_surface & si.is_medium_transition()] = si.target_medium(ray.d)
            continues = (is_null | bounces | passes) & (dr.max(throughput) > 0)
            event += 1
            continues &= (crossings < MAX_CROSSINGS) & (event < MAX_COLLISIONS)

            # ---- Russian roulette ----
            survival = choose_survival(throughput, eta)
            at_risk = continues & bounces & (depth >= TUNING.roulette_depth)
            throughput = dr.select(at_risk, throughput * dr.rcp(survival), throughput)
            continues &= ~at_risk | (stream.next_1d(dimension + 6) < survival)

            active = continues
            turns = active & ~is_null
            si[turns] = scene.ray_intersect(ray, mi.RayFlags.All, False, turns)
            secondary += dr.select(turns, mi.UInt32(1), 0)

        return radiance, RayCounts(secondary, shadow), FirstHit(first_distance, view_dependent)

    @syntax
    def _find_first_medium(self, ray: Ray3f, si: SurfaceInteraction3f, active: Bool) -> tuple[MediumPtr, UInt32]:
        """The medium at the origin of ``ray``, whose first surface is ``si``, and the rays traced to find it.

        It is that before the first boundary of a medium along the ray, whatever surfaces come first; where the ray
        meets none, the medium that surrounds the scene.
        """
        si = mi.SurfaceInteraction3f(si)
        medium = dr.zeros(mi.MediumPtr, dr.width(ray))
        if dr.hint(self._surrounding is not None, mode="scalar"):
            medium = mi.MediumPtr(self._surrounding)
        crossings = mi.UInt32(0)
        searching = active & si.is_valid()
        while dr.hint(searching, label="first medium"):
            boundary = searching & si.is_medium_transition()
            medium[boundary] = si.target_medium(-ray.d)
            crossings += 1
            searching &= ~boundary & (crossings < MAX_CROSSINGS)
            si = self.scene.ray_intersect(si.spawn_ray(ray.d), mi.RayFlags.All, False, searching)
            searching &= si.is_valid()
        return medium, crossings

    @syntax
    def _estimate_transmittance(
        self,
        reference: Interaction3f,
        target: Point3f,
        medium: MediumPtr,
        stream: SampleStream,
        active: Bool,
    ) -> tuple[Spectrum, UInt32]:
        """Estimated transmittance from ``reference``, just inside ``medium``, to ``target``; and the rays traced."""
        active = mi.Bool(active)
        medium = mi.MediumPtr(medium)
        ray = reference.spawn_ray_to(target)
        si = self.scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        tests = dr.select(active, mi.UInt32(1), 0)
        transmittance = mi.Spectrum(1)
        step = mi.UInt32(0)
        crossings = mi.UInt32(0)
        while dr.hint(active, label="transmittance"):
            inside = active & (medium != None)  # noqa: E711 (compares lane by lane)
            mei = medium.sample_interaction(ray, stream.next_1d(step), mi.UInt32(0), inside)
            extinction = mi.Spectrum(mei.combined_extinction)
            end = dr.minimum(si.t, ray.maxt)
            uniform = inside & medium.is_homogeneous()
            transmittance *= dr.select(uniform, dr.exp(-extinction * end), 1)

            collided = inside & ~uniform & mei.is_valid() & (mei.t < end)
            transmittance *= dr.select(collided, mi.Spectrum(mei.sigma_n) / extinction, 1)
            ray.o[collided] = mei.p
            ray.maxt[collided] = ray.maxt - mei.t
            si.t[collided] = si.t - mei.t

            crossed = active & ~collided & si.is_valid()
            transmittance *= dr.select(crossed, si.bsdf(ray).eval_null_transmission(si, crossed), 1)
            medium[crossed & si.is_medium_transition()] = si.target_medium(ray.d)
            ray[crossed] = si.spawn_ray_to(target)
            step += 1
            crossings += dr.select(crossed, mi.UInt32(1), 0)
            stuck = (crossings >= MAX_CROSSINGS) | (step >= MAX_COLLISIONS)
            transmittance = dr.select((collided | crossed) & stuck, 0, transmittance)
            active = (collided | crossed) & (dr.max(transmittance) > 0)
            turns = active & crossed
            si[turns] = self.scene.ray_intersect(ray, mi.RayFlags.All, False, turns)
            tests += dr.select(turns, mi.UInt32(1), 0)
        return transmittance, tests
