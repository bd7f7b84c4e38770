"""Specular light: emitters and sky that the eye sees by specular chains alone (paths L S* E, mirrors, gloss, glass).

Small emitters, and emitters mirrored in small curved objects, cover a small part of a pixel, so few of its paths hit
them. A specular chain is much cheaper than a path: it samples no emitters, looks up no photons and ends at the first
rough surface. So each path leaves this light out, and several chains through other points of the pixel estimate it,
with the same expectation. Sky that the primary ray sees stays with the path.

Delta emitters, which no ray can hit, are sampled at each sharp surface. They count where the half vector makes the
event sharp.

A pixel that is bright by a single chain is more likely an outlier than truly bright. The part of a chain's contribution
beyond :func:`limit_chain` is its *excess*. A picture without excess is biased, darker where images of emitters were
missed, but has a smaller error (docs/research/seen-light.md). The limit grows with the number of chains, so that the
bias vanishes.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.gltf_bsdf import SHARP_FIRST, SHARP_LOBE
from lippmann.device.pbr.microfacet import is_sharp
from lippmann.device.pbr.surface_lobes import is_sharp_event
from lippmann.device.sobol import SampleStream, hash32, named_seed
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    BSDFPtr,
    Float,
    Point2f,
    PreliminaryIntersection3f,
    Ray3f,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)
from lippmann.rendering.transport.integrator import FirstHit, PixelSample, RayCounts
from lippmann.rendering.transport.light_sampling import MAX_CROSSINGS
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.path_vertex import Scattering, Trail, Vertex
from lippmann.rendering.transport.ray_source import PixelRays
from lippmann.rendering.transport.tuning import TUNING


def sample_pixel(
    integrator: PathIntegrator, pixel: PixelRays, stream: SampleStream, active: Bool, samples: Float | None = None
) -> PixelSample:
    """One sample of ``pixel`` per lane; specular light by chains where the integrator has some.

    With ``samples``, the number of samples of the pixel up to and including these, specular light, its excess and
    coverage are returned separately, too.
    """
    ray = pixel.ray(stream)
    light = integrator.light
    if light.chains is None:
        radiance, counts, hit = integrator.sample_with_hit(ray, stream, active)
        return PixelSample(radiance, counts, covered=None if samples is None else _find_coverage(hit))
    rest, counts, hit = integrator.sample_with_hit(ray, stream, active, without_specular=True)
    chains = mi.Float(light.chains)
    scale = dr.rcp(chains) if light.gain is None else light.gain / chains
    most = None if samples is None else limit_chain(samples * chains) / (scale * chains)
    specular, excess, traced = trace_specular_light(integrator, pixel, stream, light.chains, active, most)
    specular *= scale
    counts = RayCounts(counts.secondary + traced.secondary, counts.shadow + traced.shadow)
    if samples is None:
        return PixelSample(rest + specular, counts)
    return PixelSample(rest + specular, counts, specular, excess * scale, _find_coverage(hit))


def _find_coverage(hit: FirstHit) -> Float:
    return dr.select(dr.isfinite(hit.distance), mi.Float(1), mi.Float(0))


def limit_chain(chains: Float) -> Float:
    """Largest contribution of one of ``chains`` chains of a pixel that is no excess; linear, white is 1."""
    return chains**TUNING.most_power


@syntax
def trace_specular_light(
    integrator: PathIntegrator,
    pixel: PixelRays,
    stream: SampleStream,
    chains: UInt32,
    active: Bool,
    most: Float | None = None,
) -> tuple[Spectrum, Spectrum, RayCounts]:
    """Sum of the light of ``chains`` chains through each lane's pixel, its excess over ``most``, and the rays traced.

    All before the gain.
    """
    light = mi.Spectrum(0)
    excess: Any = None if most is None else mi.Spectrum(0)
    takes_shadow_rays = len(integrator.delta_emitters) > 0
    rays = mi.UInt32(0)
    shadow: Any = mi.UInt32(0) if takes_shadow_rays else None
    number = mi.UInt32(0)
    of_chains = SampleStream(hash32(stream.key ^ named_seed("chains of seen light")), stream.index, stream.half)
    first = stream.index * chains
    tracing = active & (number < chains)
    while dr.hint(
        tracing, label="chains", exclude=[integrator, of_chains, pixel, stream, chains, first, most, takes_shadow_rays]
    ):
        further = of_chains.at(first + number)
        met, traced, tests = _trace_chain(integrator, pixel.ray(further), further, stream.index, tracing)
        met = dr.select(dr.isfinite(dr.sum(met)), met, 0)
        light += met
        if dr.hint(most is not None, mode="scalar"):
            brightest = dr.max(met)
            excess += dr.select(brightest > most, met * (1 - most / brightest), 0)
        rays += traced
        if dr.hint(takes_shadow_rays, mode="scalar"):
            shadow += tests
        number += 1
        tracing &= number < chains
    return (
        light,
        mi.Spectrum(0) if most is None else excess,
        RayCounts(rays, shadow if takes_shadow_rays else mi.UInt32(0)),
    )


@syntax
def _trace_chain(
    integrator: PathIntegrator, ray: Ray3f, stream: SampleStream, path: UInt32, active: Bool
) -> tuple[Spectrum, UInt32, UInt32 | None]:
    """Light of one chain with the MIS weights of the path number ``path``, and the rays and shadow rays traced.

    Shadow rays are None in scenes without delta emitters.
    """
    scene, techniques = integrator.scene, integrator.absorption
    trail = Trail.along(ray)
    active = mi.Bool(active)
    light, throughput = mi.Spectrum(0), mi.Spectrum(1)
    rays = dr.select(active, mi.UInt32(1), mi.UInt32(0))
    shadow = mi.UInt32(0) if len(integrator.delta_emitters) > 0 else None
    at_first = integrator.count_first_samples(path)
    states = techniques.begin()

    pi = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
    active &= _may_show_light(pi)
    while dr.hint(active, label="chain", exclude=[integrator, scene, stream, at_first]):
        toward = trail.ray
        si = pi.compute_surface_interaction(toward)
        bsdf = si.bsdf(toward)
        throughput = techniques.attenuate(states, si, throughput)
        emission = integrator.emission(si, trail.last, trail.depth, techniques, states, mi.UInt32(0))
        light += integrator.clamp_indirect(throughput * emission, trail.depth)

        continues = active & si.is_valid() & (trail.depth < integrator.depth)
        vertex = Vertex(si, bsdf, trail, continues, throughput, stream, states)
        states, throughput, continues, *state = _leave(integrator, vertex, at_first, (light, shadow, trail))
        light, shadow, trail = state
        active = continues & (dr.max(throughput) > 0) & (trail.crossings < MAX_CROSSINGS)
        pi = scene.ray_intersect_preliminary(trail.ray, coherent=False, active=active)
        rays += dr.select(active, mi.UInt32(1), mi.UInt32(0))
        # A chain that leaves the scene counts as sky, but not before its first event.
        active &= _may_show_light(pi) | (integrator.has_surroundings & ~pi.is_valid() & (trail.depth > 0))
    return light, rays, shadow


@syntax
def _leave(integrator: PathIntegrator, vertex: Vertex, at_first: UInt32, state: tuple[Any, ...]) -> tuple[Any, ...]:
    """State of a chain after a vertex, in a branch as in paths."""
    si, bsdf, stream, dimension = vertex.si, vertex.bsdf, vertex.stream, vertex.dimension
    states, throughput, continues = vertex.states, vertex.throughput, vertex.active
    light, shadow, trail = state
    context = mi.BSDFContext()
    context.type_mask |= SHARP_FIRST
    if continues:
        if dr.hint(len(integrator.delta_emitters) > 0, mode="scalar"):
            point = stream.next_2d(dimension + 2)
            reflection, tests = _reflect_delta_emitter(integrator, si, bsdf, vertex.lobe, point, continues)
            light += integrator.clamp_indirect(throughput * reflection, vertex.depth + 1)
            shadow += tests
        bs, weight = bsdf.sample(context, si, stream.next_1d(dimension), stream.next_2d(dimension + 1), continues)
        scattering = Scattering(vertex, bs, weight)
        states = integrator.absorption.scatter(vertex, scattering)
        continues &= is_sharp_event(bs)
        throughput *= weight
        trail = trail.extend(vertex, scattering, dr.select(trail.all_specular, at_first, mi.UInt32(1)))
    return states, throughput, continues, light, shadow, trail


def _reflect_delta_emitter(
    integrator: PathIntegrator, si: SurfaceInteraction3f, bsdf: BSDFPtr, lobe: Vector3f, point: Point2f, active: Bool
) -> tuple[Spectrum, UInt32]:
    """Radiance toward ``si.wi`` by a sharp event from a sampled delta emitter, and the shadow rays traced."""
    ds, radiance = integrator.delta_emitters.sample_direction(si, point, active)
    wo = si.to_local(ds.d)
    lit = active & is_sharp(si.wi, wo, lobe) & (dr.max(radiance) > 0)
    reflected = bsdf.eval(mi.BSDFContext(), si, wo, lit) * radiance
    lit &= dr.max(reflected) > 0
    visible, tests = integrator.visibility(si, ds, lit)
    return dr.select(lit, reflected * visible, 0), tests


def _may_show_light(pi: PreliminaryIntersection3f) -> Bool:
    """Whether the hit may emit or continue the chain: most surfaces are rough and do neither."""
    bsdf = pi.shape.bsdf()
    return pi.is_valid() & (pi.shape.is_emitter() | _has_no_width(bsdf) | bsdf.has_attribute(SHARP_LOBE, pi.is_valid()))


def _has_no_width(bsdf: BSDFPtr) -> Bool:
    """Whether a BSDF has delta lobes, or lets rays straight through."""
    return (bsdf.flags() & int(mi.BSDFFlags.Delta | mi.BSDFFlags.Null)) != 0
