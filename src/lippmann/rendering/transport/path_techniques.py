"""Techniques beside plain next-event estimation and BSDF sampling, each an object with hooks.

The path loop (:mod:`.path`) calls every hook of every technique in turn. A hook without work returns its argument.
:meth:`Technique.begin` makes the per-lane state of a technique, :meth:`Technique.scatter` replaces it after each
vertex. It is loop state, so each of its values must change from vertex to vertex.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.microfacet import is_sharp
from lippmann.device.pbr.scene import SceneFeatures
from lippmann.device.types import (
    Bool,
    Color3f,
    DirectionSample3f,
    Emitter,
    Float,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
)
from lippmann.rendering.transport.light_sampling import Clamp
from lippmann.rendering.transport.light_vertices import Arrival, JointLight, LightVertices, reach_of
from lippmann.rendering.transport.path_vertex import Scattering, Vertex
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.sharp_events import MOST_EVENTS, facing_normal, lambertian_share
from lippmann.rendering.transport.tuning import TUNING


class Technique:
    """A technique that does nothing.

    Attributes
    ----------
    reads:
        Cached properties of a vertex that the hooks use. They are evaluated before the hooks, one of which runs in a
        loop.
    """

    reads: tuple[str, ...] = ()

    def begin(self) -> Any:
        """State of a path that begins at the eye."""
        return ()

    def attenuate(self, state: Any, si: SurfaceInteraction3f, throughput: Spectrum) -> Spectrum:
        """Throughput of a path that has arrived at ``si``, which need not be valid."""
        return throughput

    def weigh_emission(
        self, state: Any, half: UInt32, ds: DirectionSample3f, weight: Float, emitter_pdf: Float, active: Bool
    ) -> Float | Spectrum:
        """MIS weight of the emitter ``ds`` that BSDF sampling hit; ``weight`` is that without the technique."""
        return weight

    def keep_emission(self, state: Any, depth: UInt32, si: SurfaceInteraction3f, emission: Spectrum) -> Spectrum:
        """The part of the ``emission`` at ``si`` that the technique leaves to the path."""
        return emission

    def add_light(self, state: Any, vertex: Vertex, radiance: Spectrum, shadow: UInt32) -> tuple[Spectrum, UInt32]:
        """Radiance and shadow rays of a path with the technique's contribution at a vertex added."""
        return radiance, shadow

    def keep_emitter_sample(self, state: Any, vertex: Vertex, ds: DirectionSample3f, light: Spectrum) -> Spectrum:
        """The part of an emitter sample's ``light`` that the technique leaves to the path."""
        return light

    def scatter(self, state: Any, vertex: Vertex, scattering: Scattering) -> Any:
        """State after a vertex."""
        return state


class Absorption(Technique):
    """Beer-Lambert absorption inside solid coloured glass. State: its coefficients where the path travels, per unit."""

    def __init__(self, features: SceneFeatures) -> None:
        self._features = features

    def begin(self) -> Color3f:
        return mi.Color3f(0)

    def attenuate(self, state: Color3f, si: SurfaceInteraction3f, throughput: Spectrum) -> Spectrum:
        return throughput * dr.exp(-state * dr.select(si.is_valid(), si.t, 0))

    def add_light(self, state: Color3f, vertex: Vertex, radiance: Spectrum, shadow: UInt32) -> tuple[Spectrum, UInt32]:
        vertex.is_in_clear = dr.max(state) == 0
        return radiance, shadow

    def scatter(self, state: Color3f, vertex: Vertex, scattering: Scattering) -> Color3f:
        bs = scattering.bs
        crosses = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission) & ~scattering.passes
        inside = dr.dot(bs.wo, mi.Vector3f(0, 0, 1)) < 0
        return dr.select(crosses, dr.select(inside, self._features.absorption_of(vertex.si.shape), 0), state)


@dataclass
class _Caustics:
    """State of :class:`PhotonGathering`.

    ``all_sharp``: all events were sharp. ``sharp``: sharp events since the last rough one, straight-through surfaces
    excluded. ``by_photons``: share in [0, 1] of the light behind these events that photons bring instead of the path.
    """

    all_sharp: Bool
    sharp: UInt32
    by_photons: Spectrum


class PhotonGathering(Technique):
    """Caustics by photon density estimation, in place of paths that hit the emitter.

    Parameters
    ----------
    photons:
        Looked up at each rough surface.
    depth:
        Surfaces of a path.
    environment:
        The environment emitter, whose light stays with paths; None without one.
    """

    def __init__(self, photons: PhotonMap, depth: int, environment: Emitter | None) -> None:
        self._photons, self._depth, self._environment = photons, depth, environment

    reads = ("lobe", "albedo", "has_wide_lobes")

    def begin(self) -> _Caustics:
        return _Caustics(mi.Bool(True), mi.UInt32(0), mi.Spectrum(0))

    def keep_emission(self, state: _Caustics, depth: UInt32, si: SurfaceInteraction3f, emission: Spectrum) -> Spectrum:
        is_caustic = ~state.all_sharp & (state.sharp > 0) & (state.sharp <= MOST_EVENTS) & si.is_valid()
        return dr.select(is_caustic, emission * (1 - state.by_photons), emission)

    def add_light(
        self, state: _Caustics, vertex: Vertex, radiance: Spectrum, shadow: UInt32
    ) -> tuple[Spectrum, UInt32]:
        """Adds the photons around the vertex.

        The Lambertian part of the BSDF scatters all of them. The rest of the BSDF scatters one chosen photon that
        stands for all, where its lobes are wide enough.
        """
        si, stream = vertex.si, vertex.stream
        lands = vertex.active & (vertex.has_wide_lobes | (dr.max(vertex.albedo) > 0))
        gathered = self._photons.gather(
            si,
            facing_normal(si),
            vertex.lobe,
            mi.UInt32(stream.half),
            self._depth - vertex.depth - 1,
            stream.next_1d(vertex.dimension + 4),
            state.all_sharp,
            lands,
            stream.key + stream.index,
            TUNING.photons_of_cell,
        )
        light = vertex.albedo * gathered.irradiance * dr.inv_pi
        wo = si.to_local(gathered.toward)
        wide = lands & vertex.has_wide_lobes & (dr.max(gathered.flux) > 0) & (wo.z * si.wi.z > 0)
        rest = vertex.bsdf.eval(mi.BSDFContext(), si, wo, wide) / dr.abs(wo.z) - vertex.albedo * dr.inv_pi
        light = dr.select(lands, light, 0) + dr.select(wide, rest * gathered.flux, 0)
        return radiance + vertex.throughput * light, shadow

    def keep_emitter_sample(self, state: _Caustics, vertex: Vertex, ds: DirectionSample3f, light: Spectrum) -> Spectrum:
        is_caustic = ~state.all_sharp & (state.sharp < MOST_EVENTS)
        is_caustic &= is_sharp(vertex.si.wi, vertex.si.to_local(ds.d), vertex.lobe)
        if self._environment is not None:
            is_caustic &= ds.emitter != mi.EmitterPtr(self._environment)
        return dr.select(is_caustic, light * (1 - state.by_photons), light)

    def scatter(self, state: _Caustics, vertex: Vertex, scattering: Scattering) -> _Caustics:
        is_rough, wo = scattering.is_rough, scattering.bs.wo
        share = lambertian_share(vertex.si, vertex.albedo, scattering.scattered, wo)
        share = dr.select(vertex.has_wide_lobes & (vertex.si.wi.z * wo.z > 0), 1, share)
        event = dr.select(scattering.is_event, mi.UInt32(1), mi.UInt32(0))
        return _Caustics(
            state.all_sharp & ~is_rough,
            dr.select(is_rough, mi.UInt32(0), state.sharp + event),
            dr.select(is_rough, share, state.by_photons),
        )


class WithoutSpecularLight(Technique):
    """Leaves out light by specular chains alone, which :mod:`.specular_chains` adds.

    Delta emitters are left out as well; sky that the primary ray sees is not. State: whether all events were sharp.
    """

    def __init__(self, has_delta_emitters: bool) -> None:
        self._has_delta_emitters = has_delta_emitters
        self.reads = ("lobe",) if has_delta_emitters else ()

    def begin(self) -> Bool:
        return mi.Bool(True)

    def keep_emission(self, state: Bool, depth: UInt32, si: SurfaceInteraction3f, emission: Spectrum) -> Spectrum:
        return dr.select(state & ((depth > 0) | si.is_valid()), 0, emission)

    def keep_emitter_sample(self, state: Bool, vertex: Vertex, ds: DirectionSample3f, light: Spectrum) -> Spectrum:
        if not self._has_delta_emitters:
            return light
        is_specular = state & ds.delta & is_sharp(vertex.si.wi, vertex.si.to_local(ds.d), vertex.lobe)
        return dr.select(is_specular, 0, light)

    def scatter(self, state: Bool, vertex: Vertex, scattering: Scattering) -> Bool:
        return state & ~scattering.is_rough


@dataclass
class _Joint:
    """State of :class:`LightVertexJoins`.

    ``departure``: pdf of the current direction if it left a joined vertex, else 0. ``light``: the light along it.
    """

    departure: Float
    light: JointLight


class LightVertexJoins(Technique):
    """Joins each vertex of a path to a light vertex, with MIS against the other ways to sample the same light.

    Parameters
    ----------
    vertices:
        The light vertices.
    depth:
        Surfaces of a path.
    has_absorption:
        Whether a path may travel inside coloured glass, where no vertex is joined.
    clamp:
        Limit on the contribution of one join.
    """

    def __init__(self, vertices: LightVertices, depth: int, has_absorption: bool, clamp: Clamp) -> None:
        self._vertices, self._depth, self._has_absorption, self._clamp = vertices, depth, has_absorption, clamp

    reads = ("albedo",)

    def begin(self) -> _Joint:
        return _Joint(mi.Float(0), JointLight(mi.Spectrum(0), mi.Float(0), mi.Float(0)))

    def weigh_emission(
        self, state: _Joint, half: UInt32, ds: DirectionSample3f, weight: Float, emitter_pdf: Float, active: Bool
    ) -> Spectrum:
        scattered_pdf = state.light.cosine * dr.inv_pi
        return self._vertices.weight(state.light, ds, weight, scattered_pdf, emitter_pdf, half, active)

    def add_light(self, state: _Joint, vertex: Vertex, radiance: Spectrum, shadow: UInt32) -> tuple[Spectrum, UInt32]:
        vertex.arrival = self._arrival(state, vertex)
        choice = vertex.stream.next_1d(vertex.dimension + 5)
        half = mi.UInt32(vertex.stream.half)
        light, tests = self._vertices.join(
            vertex.si, vertex.bsdf, choice, half, self._joins(vertex), not self._has_absorption
        )
        return radiance + self._clamp.apply(vertex.throughput * light), shadow + tests

    def _arrival(self, state: _Joint, vertex: Vertex) -> Arrival:
        reach = reach_of(vertex.si, vertex.bsdf, vertex.trail.d, state.departure, vertex.active)
        return Arrival(self._vertices, vertex.albedo, reach, mi.UInt32(vertex.stream.half))

    def _joins(self, vertex: Vertex) -> Bool:
        joins = vertex.smooth & (vertex.depth + 1 < self._depth)
        return joins & vertex.is_in_clear if self._has_absorption else joins

    def scatter(self, state: _Joint, vertex: Vertex, scattering: Scattering) -> _Joint:
        bs, passes = scattering.bs, scattering.passes
        assert vertex.arrival is not None
        joint = vertex.arrival.joint(vertex.si, scattering.scattered, bs.wo, vertex.si.to_world(bs.wo))
        departs = self._joins(vertex) & ~passes & ~mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        if self._has_absorption:
            departs &= bs.wo.z * vertex.si.wi.z > 0
        joint.reach = dr.select(passes, 0, joint.reach)
        return _Joint(dr.select(departs, bs.pdf, 0), joint)


class Techniques:
    """Techniques of one kernel, each hook called in turn; ``states`` are a list of theirs."""

    def __init__(self, *techniques: Technique) -> None:
        self._each = techniques

    def begin(self) -> list[Any]:
        return [each.begin() for each in self._each]

    def attenuate(self, states: list[Any], si: SurfaceInteraction3f, throughput: Spectrum) -> Spectrum:
        for each, state in zip(self._each, states, strict=True):
            throughput = each.attenuate(state, si, throughput)
        return throughput

    def weigh_emission(
        self, states: list[Any], half: UInt32, ds: DirectionSample3f, weight: Float, emitter_pdf: Float, active: Bool
    ) -> Float | Spectrum:
        for each, state in zip(self._each, states, strict=True):
            weight = each.weigh_emission(state, half, ds, weight, emitter_pdf, active)
        return weight

    def keep_emission(self, states: list[Any], depth: UInt32, si: SurfaceInteraction3f, emission: Spectrum) -> Spectrum:
        for each, state in zip(self._each, states, strict=True):
            emission = each.keep_emission(state, depth, si, emission)
        return emission

    def add_light(self, vertex: Vertex, radiance: Spectrum, shadow: UInt32) -> tuple[Spectrum, UInt32]:
        for name in dict.fromkeys(name for each in self._each for name in each.reads):
            getattr(vertex, name)
        for each, state in zip(self._each, vertex.states, strict=True):
            radiance, shadow = each.add_light(state, vertex, radiance, shadow)
        return radiance, shadow

    def keep_emitter_sample(self, vertex: Vertex, ds: DirectionSample3f, light: Spectrum) -> Spectrum:
        for each, state in zip(self._each, vertex.states, strict=True):
            light = each.keep_emitter_sample(state, vertex, ds, light)
        return light

    def scatter(self, vertex: Vertex, scattering: Scattering) -> list[Any]:
        return [each.scatter(state, vertex, scattering) for each, state in zip(self._each, vertex.states, strict=True)]
