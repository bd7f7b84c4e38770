"""Path tracing with next-event estimation, multiple importance sampling and Russian roulette.

The integrator differs from Mitsuba's own ``path`` in what integral images and glTF scenes need. Straight-through
surfaces (alpha masks, thin glass) do not count as a bounce, and shadow rays pass through their holes. The background
that a camera ray sees may differ from the environment that lights the scene. Rays are counted, and samples are
stratified per pixel. Everything else, from absorption in coloured glass to caustics by photons, is a technique of
:mod:`.path_techniques`. Without techniques the expectation is that of Mitsuba's ``path`` with ``max_depth = depth +
1``.

Ray depth counts surfaces, the primary ray's hit being 1: at depth 1 a surface shows its direct light.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.scene import SceneFeatures
from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    DirectionSample3f,
    Float,
    MitsubaScene,
    Ray3f,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
)
from lippmann.rendering.transport.integrator import FirstHit, RayCounts
from lippmann.rendering.transport.light_sampling import (
    MAX_CROSSINGS,
    Clamp,
    DeltaEmitters,
    SceneLightSampler,
    ShadowRays,
    choose_survival,
    count_first_samples,
    mis_weight,
)
from lippmann.rendering.transport.light_vertices import Arrival
from lippmann.rendering.transport.path_techniques import (
    Absorption,
    LightVertexJoins,
    PhotonGathering,
    Technique,
    Techniques,
    WithoutSpecularLight,
)
from lippmann.rendering.transport.path_vertex import LastVertex, Scattering, Trail, Vertex
from lippmann.rendering.transport.tuning import TUNING

if TYPE_CHECKING:
    from lippmann.rendering.transport.caustic_photons import CausticPhotons
    from lippmann.rendering.transport.light_sampling import LightSampler
    from lippmann.rendering.transport.light_vertices import LightVertexPasses, LightVertices
    from lippmann.rendering.transport.photon_map import PhotonMap


@dataclass(frozen=True, eq=False)
class PreparedLight:
    """The light of one picture, made by :func:`lippmann.rendering.preparation.prepare.prepare_light`.

    Attributes
    ----------
    sampler:
        Samples the scene's emitters; None for the scene's own weights.
    gain:
        Factor on the radiance, the background's apart; None for 1.
    most_indirect:
        Clamp on one indirect contribution, before ``gain``; None for no limit.
    photons:
        Photon map of caustics; None where paths have to find them.
    photon_passes:
        Makes ``photons`` for each run of a picture's samples; None where all samples share one map.
    light_vertices, vertex_passes:
        The same of light vertices, to which paths are joined; None without joins.
    chains:
        Specular chains per path, see :mod:`.specular_chains`; None for none.
    choices:
        Decisions and measured values for the picture's metadata.
    pilot:
        The :class:`~lippmann.rendering.preparation.prepare.Pilot` by which it was prepared.
    """

    sampler: LightSampler | None = None
    gain: Float | None = None
    most_indirect: Float | None = None
    photons: PhotonMap | None = None
    photon_passes: CausticPhotons | None = None
    light_vertices: LightVertices | None = None
    vertex_passes: LightVertexPasses | None = None
    chains: UInt32 | None = None
    choices: Mapping[str, object] = field(default_factory=dict)
    pilot: Any = None

    def at(self, sample: int) -> tuple[PreparedLight, int | None]:
        """The light for sample number ``sample`` of each pixel, and for how many samples it serves; None: for all."""
        light, served = self, list[int]()
        if self.photon_passes is not None:
            number, before = divmod(sample, self.photon_passes.pass_samples)
            light = replace(light, photons=self.photon_passes.of_pass(number))
            served.append(self.photon_passes.pass_samples - before)
        if self.vertex_passes is not None:
            number, before = divmod(sample, self.vertex_passes.pass_samples)
            light = replace(light, light_vertices=self.vertex_passes.of_pass(number))
            served.append(self.vertex_passes.pass_samples - before)
        return light, min(served, default=None)


class PathIntegrator:
    """Paths of up to ``depth`` surfaces in one scene.

    Parameters
    ----------
    scene:
        A ``mi.Scene``.
    features:
        Features of the scene that need more than the plain loop.
    depth:
        Surfaces per path, at least 1.
    name:
        Name of the integrator in a request.
    light:
        Prepared light of the picture; None to sample emitters by the scene's own weights.
    shadow_rays:
        Those of another integrator of the scene; None to make them.
    """

    def __init__(
        self,
        scene: MitsubaScene,
        features: SceneFeatures,
        depth: int,
        name: str = "path",
        light: PreparedLight | None = None,
        shadow_rays: ShadowRays | None = None,
    ) -> None:
        self.scene, self.features, self.depth, self.name = scene, features, depth, name
        self.light = light or PreparedLight()
        self.choices = self.light.choices
        self.light_sampler = self.light.sampler or SceneLightSampler(scene)
        self.shadow_rays = shadow_rays or ShadowRays(scene, features.has_null)
        emitters, self._environment = scene.emitters(), scene.environment()
        self.delta_emitters = DeltaEmitters(emitters)
        # All samples of a single delta emitter are the same.
        self._single_delta = len(emitters) == len(self.delta_emitters) == 1
        self._clamp = Clamp(self.light.most_indirect)
        self.absorption = Techniques(*self._make_absorption())
        self._techniques = Techniques(*self._make_absorption(), *self._make_sharing())
        apart = WithoutSpecularLight(len(self.delta_emitters) > 0)
        self._techniques_without_specular = Techniques(*self._make_absorption(), *self._make_sharing(), apart)

    def _make_absorption(self) -> list[Technique]:
        return [] if self.features.absorption is None else [Absorption(self.features)]

    def _make_sharing(self) -> list[Technique]:
        """Techniques that sample a part of the light in place of, or beside, the plain path."""
        light, techniques = self.light, list[Technique]()
        if light.photons is not None:
            techniques.append(PhotonGathering(light.photons, self.depth, self._environment))
        if light.light_vertices is not None:
            techniques.append(
                LightVertexJoins(light.light_vertices, self.depth, self.features.absorption is not None, self._clamp)
            )
        return techniques

    def lit_by(self, light: PreparedLight) -> PathIntegrator:
        """The same integrator with other prepared light."""
        return PathIntegrator(self.scene, self.features, self.depth, self.name, light, self.shadow_rays)

    def with_depth(self, depth: int) -> PathIntegrator:
        """The same integrator for paths of up to ``depth`` surfaces, without prepared light."""
        return PathIntegrator(self.scene, self.features, depth, self.name, shadow_rays=self.shadow_rays)

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """Radiance along ``ray``, and the rays traced for it."""
        radiance, counts, _ = self.sample_with_hit(ray, stream, active)
        return radiance, counts

    @syntax
    def sample_with_hit(
        self, ray: Ray3f, stream: SampleStream, active: Bool, without_specular: bool = False
    ) -> tuple[Spectrum, RayCounts, FirstHit]:
        """As :meth:`sample`, with the first hit. Every surface that is not purely diffuse is view-dependent.

        ``without_specular`` leaves out light from emitters and sky by specular chains alone, delta emitters included.
        Sky that the primary ray sees stays: at outlines samples of both sides belong together.
        """
        scene = self.scene
        techniques = self._techniques_without_specular if without_specular else self._techniques

        trail = Trail.along(ray)
        active = mi.Bool(active)
        radiance = mi.Spectrum(0)
        throughput = mi.Spectrum(1)
        eta = mi.Float(1)  # product of relative indices, so that roulette sees unitless throughput
        states = techniques.begin()
        secondary = mi.UInt32(0)
        shadow = mi.UInt32(0)

        pi = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        first_distance = mi.Float(pi.t)
        view_dependent = mi.Bool(False)

        while dr.hint(active, label="paths", exclude=[scene, stream]):
            toward = trail.ray
            si = pi.compute_surface_interaction(toward)
            bsdf = si.bsdf(toward)
            shiny = (bsdf.flags() & int(mi.BSDFFlags.Glossy | mi.BSDFFlags.Delta | mi.BSDFFlags.Null)) != 0
            view_dependent |= (trail.depth == 0) & si.is_valid() & shiny
            throughput = techniques.attenuate(states, si, throughput)

            # ---- emission ----
            depth = trail.depth
            emission = self.emission(si, trail.last, depth, techniques, states, mi.UInt32(stream.half))
            radiance += self.clamp_indirect(throughput * techniques.keep_emission(states, depth, si, emission), depth)

            # ---- next-event estimation ----
            continues = si.is_valid() & (depth < self.depth)
            vertex = Vertex(si, bsdf, trail, continues, throughput, stream, states)
            state = radiance, shadow, eta, trail
            states, throughput, continues, passes, radiance, shadow, eta, trail = self._leave(vertex, techniques, state)

            # ---- Russian roulette ----
            survival = choose_survival(throughput, eta)
            at_risk = continues & (trail.depth >= TUNING.roulette_depth) & ~passes
            throughput = dr.select(at_risk, throughput * dr.rcp(survival), throughput)
            continues &= ~at_risk | (stream.next_1d(vertex.dimension + 3) < survival)

            active = continues
            pi = scene.ray_intersect_preliminary(trail.ray, coherent=False, active=active)
            secondary += dr.select(active, mi.UInt32(1), mi.UInt32(0))

        return self.expose(radiance), RayCounts(secondary, shadow), FirstHit(first_distance, view_dependent)

    @syntax
    def _leave(self, vertex: Vertex, techniques: Techniques, state: tuple[Any, ...]) -> tuple[Any, ...]:
        """State of a path after a vertex: with emitter samples and the next ray.

        In a branch, so that the processor skips it for a vector of lanes that have all left the scene.
        """
        si, bsdf, stream, dimension = vertex.si, vertex.bsdf, vertex.stream, vertex.dimension
        states, throughput, continues = vertex.states, vertex.throughput, vertex.active
        radiance, shadow, eta, trail = state
        context, passes = mi.BSDFContext(), mi.Bool(False)
        if continues:
            radiance, shadow = techniques.add_light(vertex, radiance, shadow)
            samples, number = self._count_emitter_samples(stream.index, trail.all_specular)
            count, last_number = mi.Float(samples), number + samples - 1
            sampling = vertex.smooth & (number != last_number)
            while dr.hint(sampling, label="emitters", exclude=[stream, dimension, si, bsdf, count, last_number]):
                ds, emitted = self.light_sampler.sample_direction(si, stream.at(number).next_2d(dimension), sampling)
                value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(ds.d), sampling)
                light, tests = self._reflect_emitter(vertex, techniques, ds, emitted, value, pdf, count, sampling)
                radiance += light
                shadow += tests
                number += 1
                sampling &= number != last_number

            # ---- the last emitter sample, and BSDF sampling: the surface is evaluated once for both ----
            ds, emitted = self.light_sampler.sample_direction(si, stream.at(number).next_2d(dimension), vertex.smooth)
            value, pdf, bs, weight = bsdf.eval_pdf_sample(
                context, si, si.to_local(ds.d), stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), continues
            )
            light, tests = self._reflect_emitter(vertex, techniques, ds, emitted, value, pdf, count, vertex.smooth)
            radiance += light
            shadow += tests
            scattering = Scattering(vertex, bs, weight)
            passes = scattering.passes
            states = techniques.scatter(vertex, scattering)
            throughput *= weight
            eta *= bs.eta
            trail = trail.extend(vertex, scattering, samples)
            continues &= (dr.max(throughput) > 0) & (trail.crossings < MAX_CROSSINGS)
        return states, throughput, continues, passes, radiance, shadow, eta, trail

    def expose(self, radiance: Spectrum) -> Spectrum:
        """``radiance`` times the gain."""
        return radiance if self.light.gain is None else radiance * self.light.gain

    def _count_emitter_samples(self, sample: UInt32, all_specular: Bool) -> tuple[UInt32, UInt32]:
        """Count of emitter samples at a vertex of a pixel's path number ``sample``, and the number of the first."""
        samples, number = mi.UInt32(1), mi.UInt32(sample)
        if self._single_delta:
            return samples, number
        at_start, start = count_first_samples(sample)
        return dr.select(all_specular, at_start, samples), dr.select(all_specular, start, number)

    def emission(
        self,
        si: SurfaceInteraction3f,
        last: LastVertex,
        depth: UInt32,
        techniques: Techniques,
        states: list[Any],
        half: UInt32,
    ) -> Spectrum:
        """Emitted radiance where a path ends after ``depth`` surfaces, by MIS against emitter sampling at its last
        vertex.

        Parameters
        ----------
        si:
            The intersection; the environment where it is not valid.
        last:
            Its last scattering vertex.
        techniques, states:
            Techniques that may sample the same light.
        half:
            Of the picture, see :class:`~lippmann.device.sobol.SampleStream`.
        """
        emission = self._weigh_emission(si, last, techniques, states, half)
        if self.features.background is None:
            return emission
        background = mi.Spectrum(self.features.background)
        if self.light.gain is not None:
            background /= self.light.gain  # the background is not exposed
        return dr.select((depth == 0) & ~si.is_valid(), background, emission)

    @syntax
    def _weigh_emission(
        self, si: SurfaceInteraction3f, last: LastVertex, techniques: Techniques, states: list[Any], half: UInt32
    ) -> Spectrum:
        """Emission by MIS; in a branch, so that the processor skips it for a vector of lanes of which none emits."""
        reference = dr.zeros(mi.Interaction3f)
        reference.p = last.p
        ds = mi.DirectionSample3f(self.scene, si=si, ref=reference)
        emission = mi.Spectrum(0)
        if ds.emitter != dr.zeros(mi.EmitterPtr):
            samples = mi.Float(last.emitter_samples)
            emitter_pdf = self.light_sampler.pdf_direction(reference, ds, ~last.is_delta) * samples
            weight = mis_weight(last.pdf, emitter_pdf)
            weight = techniques.weigh_emission(states, half, ds, weight, emitter_pdf, si.is_valid())
            emission = ds.emitter.eval(si) * weight
        return emission

    @property
    def has_surroundings(self) -> bool:
        """Whether rays that hit no surface carry radiance."""
        return self._environment is not None or self.features.background is not None

    def clamp_indirect(self, light: Spectrum, depth: UInt32) -> Spectrum:
        """A path's contribution after ``depth`` surfaces, clamped where it is indirect."""
        return self._clamp.apply(light, depth > 1)

    def count_first_samples(self, sample: UInt32) -> UInt32:
        """Emitter samples at the first surface that is not purely specular, of a pixel's path number ``sample``."""
        return mi.UInt32(1) if self._single_delta else count_first_samples(sample)[0]

    def _reflect_emitter(
        self,
        vertex: Vertex,
        techniques: Techniques,
        ds: DirectionSample3f,
        emitted: Spectrum,
        value: Spectrum,
        pdf: Float,
        samples: Float,
        active: Bool,
    ) -> tuple[Spectrum, UInt32]:
        """A path's contribution by one of ``samples`` emitter samples at a vertex, and the shadow rays traced."""
        light, tests = self.reflect(vertex.si, ds, emitted, value, pdf, active, samples, vertex.arrival)
        light = techniques.keep_emitter_sample(vertex, ds, light)
        return self._clamp.apply(vertex.throughput * light, vertex.depth > 0) / samples, tests

    def reflect(
        self,
        si: SurfaceInteraction3f,
        ds: DirectionSample3f,
        emitted: Spectrum,
        value: Spectrum,
        pdf: Float,
        active: Bool,
        samples: Float = 1,
        arrival: Arrival | None = None,
    ) -> tuple[Spectrum, UInt32]:
        """Radiance toward ``si.wi`` from the emitter sample ``ds``, and the shadow rays traced.

        ``emitted`` is the emitter's radiance divided by the pdf of the sample; ``value`` (the BSDF times the cosine)
        and ``pdf`` are those of its direction. The result is weighted by MIS against BSDF sampling, as one of
        ``samples`` emitter samples at this surface; and against light vertices where ``arrival`` is given.
        """
        weight = dr.select(ds.delta, 1, mis_weight(ds.pdf * samples, pdf))
        reflected = value * emitted * weight
        lit = active & (ds.pdf != 0) & (dr.max(emitted) > 0) & (dr.max(reflected) > 0)
        visible, tests = self.visibility(si, ds, lit)
        if arrival is not None:
            reflected = value * emitted * arrival.weigh(si, ds, value, weight, ds.pdf * samples, tests <= 1, lit)
        return dr.select(lit, reflected * visible, 0), tests

    def visibility(self, si: SurfaceInteraction3f, ds: DirectionSample3f, active: Bool) -> tuple[Spectrum, UInt32]:
        """Transmittance in [0, 1] from the emitter sample ``ds`` to the surface, and the shadow rays traced."""
        result: tuple[Spectrum, UInt32] = self.shadow_rays.transmittance(si.spawn_ray_to(ds.p), ds.p, active)
        return result
