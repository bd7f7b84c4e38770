"""Physically based light: paths with emitter sampling, multiple importance sampling and Russian roulette.

It differs from Mitsuba's own ``path`` in what integral images and glTF scenes need: straight-through surfaces (alpha
masks, thin glass) neither count as a bounce nor block the light that falls through their holes; light inside solid
coloured glass fades with the distance (Beer-Lambert); what a camera ray sees where nothing is hit can differ from what
lights the scene; the rays are counted; and samples are stratified per pixel. Without such surfaces its expectation is
that of Mitsuba's ``path`` with ``max_depth = depth + 1``, which a test holds.

Ray depth counts surfaces, the primary ray's hit being 1: at depth 1 a surface shows its direct light.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.device.sobol import SampleStream
from lippmann.rendering.transport.integrator import FirstHit, RayCounts
from lippmann.rendering.transport.light_sampling import LightSampler, SceneLights
from lippmann.rendering.transport.scene_flags import SceneTraits

#: Straight-through surfaces that one ray may cross before it counts as blocked: bounds the loop in a hall of panes.
MAX_CROSSINGS = 64
#: Sample dimensions used at one vertex.
DIMENSIONS_PER_VERTEX = 4
#: Emitter samples at the first surface of a path that emitters can light: many for a pixel's first samples, which know
#: little else, and fewer for those that follow. Powers of two, so that all points together stay stratified.
FIRST_EMITTER_SAMPLES, LATER_EMITTER_SAMPLES, FIRST_SAMPLES = 4, 2, 4


def mis_weight(pdf_a: Any, pdf_b: Any) -> Any:
    """Power heuristic (Veach 1997, eq. 9.16 with exponent 2); 0 where both densities vanish."""
    a2, b2 = dr.square(pdf_a), dr.square(pdf_b)
    weight = a2 / (a2 + b2)
    return dr.select(dr.isfinite(weight), weight, 0)


def first_emitter_samples(sample: Any) -> tuple[Any, Any]:
    """Number of emitter samples that sample number ``sample`` (UInt32) takes where its path is first lit, and the first
    one's number.

    Numbers count on from sample to sample: they are places in one sequence of points.
    """
    early = sample < FIRST_SAMPLES
    before = FIRST_EMITTER_SAMPLES * FIRST_SAMPLES
    later = before + LATER_EMITTER_SAMPLES * (sample - FIRST_SAMPLES)
    first = dr.select(early, FIRST_EMITTER_SAMPLES * sample, later)
    return dr.select(early, mi.UInt32(FIRST_EMITTER_SAMPLES), LATER_EMITTER_SAMPLES), first


class PathIntegrator:
    """Paths of up to ``depth`` surfaces in one scene.

    Parameters
    ----------
    scene:
        A ``mi.Scene``.
    traits:
        What of the scene needs more than the plain loop.
    depth:
        Surfaces per path, at least 1.
    roulette_depth:
        Surfaces after which faint paths may be ended by Russian roulette.
    name:
        What the light is called in a request.
    lights:
        Samples the scene's emitters; by default by the scene's own weights.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(
        self,
        scene: Any,
        traits: SceneTraits,
        depth: int,
        roulette_depth: int = 5,
        name: str = "path",
        lights: LightSampler | None = None,
    ) -> None:
        self.scene = scene
        self.traits = traits
        self.depth = depth
        self.roulette_depth = roulette_depth
        self.name = name
        self.lights: LightSampler = SceneLights(scene) if lights is None else lights
        emitters = scene.emitters()
        # All samples of a single point of light are the same.
        self._all_alike = len(emitters) == 1 and bool(mi.has_flag(emitters[0].flags(), mi.EmitterFlags.Delta))

    def sample(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts]:
        """Radiance along ``ray`` and the rays it took."""
        radiance, counts, _ = self.sample_with_hit(ray, stream, active)
        return radiance, counts

    @dr.syntax
    def sample_with_hit(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts, FirstHit]:
        """As :meth:`sample`, with what the primary rays met. A surface that is more than diffuse is view-dependent."""
        scene = self.scene
        context = mi.BSDFContext()
        background = self.traits.background

        ray = mi.Ray3f(ray)  # current ray
        active = mi.Bool(active)
        radiance = mi.Spectrum(0)
        throughput = mi.Spectrum(1)
        eta = mi.Float(1)  # product of relative indices, so that roulette sees unitless throughput
        depth = mi.UInt32(0)  # surfaces met so far, straight-through ones excluded
        crossings = mi.UInt32(0)  # straight-through surfaces met so far
        absorption = mi.Color3f(0)  # of the medium the ray travels in, per world unit
        secondary = mi.UInt32(0)
        shadow = mi.UInt32(0)
        vertex = dr.zeros(mi.Interaction3f)  # last scattering vertex, for the pdf of emitter sampling there
        vertex_pdf = mi.Float(1)
        vertex_delta = mi.Bool(True)
        vertex_samples = mi.UInt32(1)  # emitter samples that were taken there
        unlit = mi.Bool(True)  # no emitter has been sampled yet
        samples_at_start, start = first_emitter_samples(stream.index)

        pi = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        distance_of_first = mi.Float(pi.t)
        view_dependent = mi.Bool(False)

        while dr.hint(active, label="paths"):
            si = pi.compute_surface_interaction(ray, ray_flags=mi.RayFlags.All)
            bsdf = si.bsdf(ray)

            shiny = (bsdf.flags() & int(mi.BSDFFlags.Glossy | mi.BSDFFlags.Delta | mi.BSDFFlags.Null)) != 0
            view_dependent |= (depth == 0) & si.is_valid() & shiny

            # ---- absorption on the way here ----
            if dr.hint(self.traits.has_absorption, mode="scalar"):
                distance = dr.select(si.is_valid(), si.t, 0)
                throughput *= dr.exp(-absorption * distance)

            # ---- emission ----
            ds = mi.DirectionSample3f(scene, si=si, ref=vertex)
            emitter_pdf = self.lights.pdf_direction(vertex, ds, ~vertex_delta) * mi.Float(vertex_samples)
            weight = mis_weight(vertex_pdf, emitter_pdf)
            emission = ds.emitter.eval(si) * weight
            if dr.hint(background is not None, mode="scalar"):
                emission = dr.select((depth == 0) & ~si.is_valid(), mi.Spectrum(background), emission)
            radiance += throughput * emission

            # ---- next-event estimation ----
            going_on = si.is_valid() & (depth < self.depth)
            dimension = (depth * 2 + crossings) * DIMENSIONS_PER_VERTEX + 1
            sampling = going_on & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            samples, number = mi.UInt32(1), mi.UInt32(stream.index)
            if dr.hint(not self._all_alike, mode="scalar"):
                samples, number = dr.select(unlit, samples_at_start, samples), dr.select(unlit, start, number)
            last = number + samples
            while dr.hint(sampling, label="emitters"):
                point = stream.at(number).next_2d(dimension)
                light, tests = self.direct_light(si, bsdf, point, sampling, samples=mi.Float(samples))
                radiance += throughput * light / mi.Float(samples)
                shadow += tests
                number += 1
                sampling &= number != last

            # ---- the next direction ----
            bs, bsdf_weight = bsdf.sample(
                context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), going_on
            )
            passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            throughput *= bsdf_weight
            eta *= bs.eta
            if dr.hint(self.traits.has_absorption, mode="scalar"):
                crosses = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission) & ~passes
                inside = dr.dot(bs.wo, mi.Vector3f(0, 0, 1)) < 0
                absorption = dr.select(crosses, dr.select(inside, self.traits.absorption_of(si.shape), 0), absorption)
            ray = si.spawn_ray(si.to_world(bs.wo))
            if ~passes:
                vertex = mi.Interaction3f(si)
                vertex_pdf = bs.pdf
                vertex_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
                vertex_samples = samples
                unlit &= ~mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
                depth += 1
            else:
                crossings += 1
            going_on &= (dr.max(throughput) > 0) & (crossings < MAX_CROSSINGS)

            # ---- Russian roulette ----
            survival = dr.minimum(dr.max(throughput) * dr.square(eta), 0.95)
            at_stake = going_on & (depth >= self.roulette_depth) & ~passes
            throughput = dr.select(at_stake, throughput * dr.rcp(survival), throughput)
            going_on &= ~at_stake | (stream.next_1d(dimension + 3) < survival)

            active = going_on
            pi = scene.ray_intersect_preliminary(ray, coherent=False, active=active)
            secondary += dr.select(active, mi.UInt32(1), mi.UInt32(0))

        return radiance, RayCounts(secondary, shadow), FirstHit(distance_of_first, view_dependent)

    def direct_light(self, si: Any, bsdf: Any, point: Any, active: Any, samples: Any = 1) -> tuple[Any, Any]:
        """Radiance toward ``si.wi`` from the emitter that ``point`` samples, and the shadow rays that it took.

        It is divided by the sample's pdf, and weighted by MIS against scattered rays that meet the emitter, as one of
        ``samples``.
        """
        ds, light = self.lights.sample_direction(si, point, active)
        lit = active & (ds.pdf != 0) & (dr.max(light) > 0)
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(ds.d), lit)
        weight = dr.select(ds.delta, 1, mis_weight(ds.pdf * samples, pdf))
        found = value * light * weight
        lit &= dr.max(found) > 0
        visible, tests = self.visibility(si, ds, lit)
        return dr.select(lit, found * visible, 0), tests

    @dr.syntax
    def visibility(self, si: Any, ds: Any, active: Any) -> tuple[Any, Any]:
        """Share of light that passes from the emitter sample to the surface, and the rays that finding out took."""
        scene = self.scene
        ray = si.spawn_ray_to(ds.p)
        tests = dr.select(active, mi.UInt32(1), mi.UInt32(0))
        passed = mi.Spectrum(1)
        if dr.hint(not self.traits.has_null, mode="scalar"):
            passed = dr.select(scene.ray_test(ray, active), mi.Spectrum(0), passed)
        else:
            active = mi.Bool(active)
            crossings = mi.UInt32(0)
            while dr.hint(active, label="visibility"):
                hit = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
                blocked = hit.is_valid()
                through = hit.bsdf(ray).eval_null_transmission(hit, blocked)
                passed = dr.select(blocked, passed * through, passed)
                crossings += 1
                passed = dr.select(blocked & (crossings >= MAX_CROSSINGS), mi.Spectrum(0), passed)
                active = blocked & (dr.max(passed) > 0) & (crossings < MAX_CROSSINGS)
                tests += dr.select(active, mi.UInt32(1), mi.UInt32(0))
                ray = hit.spawn_ray_to(ds.p)
        return passed, tests
