"""Path tracing with next-event estimation, multiple importance sampling and Russian roulette.

The integrator differs from Mitsuba's own ``path`` in what integral images and glTF scenes need. Straight-through
surfaces (alpha masks, thin glass) do not count as a bounce, and shadow rays pass through their holes. Radiance inside
solid coloured glass decays with distance (Beer-Lambert). The background that a camera ray sees may differ from the
environment that lights the scene. Rays are counted, and samples are stratified per pixel. In a scene without such
surfaces the expectation is that of Mitsuba's ``path`` with ``max_depth = depth + 1``.

Ray depth counts surfaces, the primary ray's hit being 1: at depth 1 a surface shows its direct light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.surface_point import widen_lobes
from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    BSDFPtr,
    Color3f,
    DirectionSample3f,
    Float,
    MitsubaScene,
    Point2f,
    Point3f,
    Ray3f,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
    Vector2f,
)
from lippmann.rendering.transport.beam import Beam, turn_of_normals, widening
from lippmann.rendering.transport.caustic_light import caustic_light
from lippmann.rendering.transport.integrator import FirstHit, RayCounts
from lippmann.rendering.transport.light_sampling import LightSampler, SceneLightSampler, WithoutSize
from lippmann.rendering.transport.light_vertices import Arrival, JointLight, reach_of
from lippmann.rendering.transport.path_weights import (
    ROULETTE_DEPTH,
    first_emitter_samples,
    mis_weight,
    roulette_survival,
)
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.scene_features import SceneFeatures
from lippmann.rendering.transport.shadow_rays import MAX_CROSSINGS, ShadowRays
from lippmann.rendering.transport.sharp_events import (
    MOST_EVENTS,
    follows_sharply,
    has_wide_lobes,
    is_sharp,
    lambertian,
    lambertian_share,
    sharp_lobe,
)

if TYPE_CHECKING:
    from lippmann.rendering.transport.caustic_photons import CausticPhotons
    from lippmann.rendering.transport.light_vertices import LightVertexPasses, LightVertices

#: Sample dimensions used at one vertex.
DIMENSIONS_PER_VERTEX = 4
#: Sample dimension, from a vertex's first, of the photon chosen there.
GATHER_DIMENSION = 1 << 24
#: Sample dimension, from a vertex's first, of the light vertex that it is joined to.
JOIN_DIMENSION = 1 << 25


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

    Attributes
    ----------
    light_sampler:
        Samples the scene's emitters; at first by the scene's own weights.
    gain:
        Factor on the radiance, the background's apart; None for 1.
    most_indirect:
        What one indirect contribution may bring at most, before ``gain``; None for no limit.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, scene: MitsubaScene, features: SceneFeatures, depth: int, name: str = "path") -> None:
        self.scene = scene
        self.features = features
        self.depth = depth
        self.name = name
        self.light_sampler: LightSampler = SceneLightSampler(scene)
        self.gain: Float | None = None
        emitters = scene.emitters()
        self.most_indirect: Float | None = None
        #: Photons of caustics in place of paths that would have to find them; None for paths.
        self.photons: PhotonMap | None = None
        #: Gives :attr:`photons` for each part of a picture's samples; None where they are the same for all.
        self.photon_passes: CausticPhotons | None = None
        #: Points lit by emitters, to which paths are joined; None where paths find all light themselves.
        self.light_vertices: LightVertices | None = None
        #: Gives :attr:`light_vertices` for each part of a picture's samples; None where there are none.
        self.vertex_passes: LightVertexPasses | None = None
        #: Chains of sharp events that stand for the seen light of each path, see :mod:`.seen_light`; None for none.
        self.seen_chains: UInt32 | None = None
        #: Beam of a sample, by which lobes of curved surfaces are widened; None for lobes as they are.
        self.beam: Beam | None = None
        self.shadow_rays = ShadowRays(scene, features.has_null)
        self._environment = scene.environment()
        # A single delta emitter: more than one sample of it tells nothing more.
        self.without_size = WithoutSize(emitters)
        self._single_delta = len(emitters) == len(self.without_size) == 1

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """Radiance along ``ray``, and the rays traced for it."""
        radiance, counts, _ = self.sample_with_hit(ray, stream, active)
        return radiance, counts

    @syntax
    def sample_with_hit(
        self, ray: Ray3f, stream: SampleStream, active: Bool, without_seen: bool = False
    ) -> tuple[Spectrum, RayCounts, FirstHit]:
        """As :meth:`sample`, with the first hit. Every surface that is not purely diffuse is view-dependent.

        Light that is met by sharp events alone is left out ``without_seen``, that of emitters without size included,
        but for sky behind nothing: at outlines samples of both sides belong together.
        """
        scene = self.scene
        context = mi.BSDFContext()

        # What does not change is no state, and rays are told by origin and direction: else Dr.Jit would record loops a
        # second time, without what is the same in all turns.
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)  # current ray
        active = mi.Bool(active)
        radiance = mi.Spectrum(0)
        throughput = mi.Spectrum(1)
        eta = mi.Float(1)  # product of relative indices, so that roulette sees unitless throughput
        depth = mi.UInt32(0)  # surfaces hit so far, straight-through ones excluded
        crossings = mi.UInt32(0)  # straight-through surfaces hit so far
        # Of the medium the ray travels in, per world unit.
        absorption: Color3f = mi.Color3f(0) if self.features.has_absorption else None
        secondary = mi.UInt32(0)
        shadow = mi.UInt32(0)
        vertex = mi.Point3f(0)  # where light last scattered, for the pdf of emitter sampling there
        vertex_pdf = mi.Float(1)
        vertex_delta = mi.Bool(True)
        vertex_samples = mi.UInt32(1)  # emitter samples taken there
        all_specular = mi.Bool(True)  # no emitter has been sampled yet
        # Paths that leave nothing to others need not know which events are sharp.
        divides = self.photons is not None or without_seen
        seen: Bool = mi.Bool(True) if divides else None  # all events were sharp
        sharp: UInt32 = None
        by_photons: Spectrum = None
        if dr.hint(self.photons is not None, mode="scalar"):
            sharp = mi.UInt32(0)  # sharp events since the last rough one, straight-through surfaces excluded
            by_photons = mi.Spectrum(0)  # share of the light met by sharp events from that one on that photons bring
        departure: Float = None
        vertex_share: Spectrum = None
        vertex_reach: Float = None
        vertex_cosine: Float = None
        if dr.hint(self.light_vertices is not None, mode="scalar"):
            departure = mi.Float(0)  # pdf of the way here from a vertex that was joined to them; 0 from others
            vertex_share, vertex_reach, vertex_cosine = mi.Spectrum(0), mi.Float(0), mi.Float(0)  # of a JointLight
        samples_at_start, start = first_emitter_samples(stream.index)
        width: Vector2f = None
        spread: Vector2f = None
        is_beam: Bool = None
        needed = mi.RayFlags.All
        if dr.hint(self.beam is not None, mode="scalar"):
            beam = cast("Beam", self.beam)
            width, spread = mi.Vector2f(beam.width), mi.Vector2f(beam.spread)
            is_beam = mi.Bool(True)  # no rough event has widened it beyond use
            needed = mi.RayFlags.All | mi.RayFlags.dNSdUV

        pi = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        first_distance = mi.Float(pi.t)
        view_dependent = mi.Bool(False)

        while dr.hint(
            active, label="paths", exclude=[scene, context, stream, needed, divides, samples_at_start, start]
        ):
            toward = mi.Ray3f(o, d)
            si = pi.compute_surface_interaction(toward, ray_flags=needed)
            bsdf = si.bsdf(toward)

            shiny = (bsdf.flags() & int(mi.BSDFFlags.Glossy | mi.BSDFFlags.Delta | mi.BSDFFlags.Null)) != 0
            view_dependent |= (depth == 0) & si.is_valid() & shiny

            # ---- absorption along the ray ----
            if dr.hint(self.features.has_absorption, mode="scalar"):
                distance = dr.select(si.is_valid(), si.t, 0)
                throughput *= dr.exp(-absorption * distance)

            # ---- emission ----
            emission = self.emission(
                si,
                vertex,
                vertex_pdf,
                vertex_delta,
                vertex_samples,
                depth,
                self._joint(vertex_share, vertex_reach, vertex_cosine, stream),
            )
            if dr.hint(self.photons is not None, mode="scalar"):
                is_caustic = ~seen & (sharp > 0) & (sharp <= MOST_EVENTS) & si.is_valid()
                emission = dr.select(is_caustic, emission * (1 - by_photons), emission)
            met = self.limited(throughput * emission, depth)
            if dr.hint(without_seen, mode="scalar"):
                met = dr.select(seen & ((depth > 0) | si.is_valid()), 0, met)
            radiance += met

            # ---- next-event estimation ----
            continues = si.is_valid() & (depth < self.depth)
            dimension = (depth * 2 + crossings) * DIMENSIONS_PER_VERTEX + 1
            sampling = continues & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            samples, number = mi.UInt32(1), mi.UInt32(stream.index)
            if dr.hint(not self._single_delta, mode="scalar"):
                samples, number = (
                    dr.select(all_specular, samples_at_start, samples),
                    dr.select(all_specular, start, number),
                )
            lobe, lambert, wide, lands = mi.Vector3f(0), mi.Color3f(0), mi.Bool(False), mi.Bool(False)
            if dr.hint(divides, mode="scalar"):
                lobe = sharp_lobe(si, bsdf, continues)
            if dr.hint(self.photons is not None or self.light_vertices is not None, mode="scalar"):
                lambert = lambertian(si, bsdf, continues)
            if dr.hint(self.photons is not None, mode="scalar"):
                wide = has_wide_lobes(si, bsdf, continues)
                lands = continues & (wide | (dr.max(lambert) > 0))
            turn = mi.Float(0)
            if dr.hint(self.beam is not None, mode="scalar"):
                # After what surfaces say of their lobes: light is divided by lobes as they are.
                width += spread * dr.select(si.is_valid(), si.t, 0)
                turn = dr.select(is_beam & si.is_valid(), turn_of_normals(si, width), 0)
                widen_lobes(si, widening(turn))
            if dr.hint(self.photons is not None, mode="scalar"):
                choice = stream.next_1d(dimension + GATHER_DIMENSION)
                photons = cast("PhotonMap", self.photons)
                further = self.depth - depth - 1
                radiance += throughput * caustic_light(
                    photons, si, bsdf, lobe, lambert, wide, stream, further, choice, seen, lands
                )
            joins, reach = mi.Bool(False), mi.Float(0)
            if dr.hint(self.light_vertices is not None, mode="scalar"):
                vertices = cast("LightVertices", self.light_vertices)
                reach = reach_of(si, bsdf, d, departure, continues)
                joins = sampling & (depth + 1 < self.depth)
                if dr.hint(self.features.has_absorption, mode="scalar"):
                    joins &= dr.max(absorption) == 0
                choice = stream.next_1d(dimension + JOIN_DIMENSION)
                joined, join_tests = vertices.join(
                    si, bsdf, choice, mi.UInt32(stream.half), joins, not self.features.has_absorption
                )
                joined = throughput * joined
                if dr.hint(self.most_indirect is not None, mode="scalar"):
                    joined = self._clamped(joined)
                radiance += joined
                shadow += join_tests
            last = number + samples
            while dr.hint(
                sampling,
                label="emitters",
                exclude=[
                    stream,
                    dimension,
                    si,
                    bsdf,
                    samples,
                    lambert,
                    reach,
                    lobe,
                    seen,
                    sharp,
                    by_photons,
                    throughput,
                    depth,
                    last,
                ],
            ):
                point = stream.at(number).next_2d(dimension)
                light, ds, tests = self.direct_light(
                    si, bsdf, point, sampling, mi.Float(samples), self._arrival(lambert, reach, stream)
                )
                if dr.hint(self.photons is not None, mode="scalar"):
                    brings_caustic = ~seen & (sharp < MOST_EVENTS) & is_sharp(si, lobe, si.to_local(ds.d))
                    brings_caustic &= self._is_near(ds)
                    light = dr.select(brings_caustic, light * (1 - by_photons), light)
                if dr.hint(without_seen and len(self.without_size) > 0, mode="scalar"):
                    light = dr.select(seen & ds.delta & is_sharp(si, lobe, si.to_local(ds.d)), 0, light)
                drawn = throughput * light
                if dr.hint(self.most_indirect is not None, mode="scalar"):
                    drawn = dr.select(depth > 0, self._clamped(drawn), drawn)
                radiance += drawn / mi.Float(samples)
                shadow += tests
                number += 1
                sampling &= number != last

            # ---- BSDF sampling ----
            bs, bsdf_weight = bsdf.sample(
                context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), continues
            )
            passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            is_event, becomes_rough = continues & ~passes, mi.Bool(False)
            if dr.hint(divides, mode="scalar"):
                becomes_rough = is_event & ~follows_sharply(si, lobe, bs)
                seen &= ~becomes_rough
            if dr.hint(self.photons is not None, mode="scalar"):
                share = lambertian_share(si, lambert, mi.Color3f(bsdf_weight) * bs.pdf, bs.wo)
                share = dr.select(wide & (si.wi.z * bs.wo.z > 0), 1, share)
                by_photons = dr.select(becomes_rough, share, by_photons)
                sharp = dr.select(becomes_rough, mi.UInt32(0), sharp + dr.select(is_event, mi.UInt32(1), mi.UInt32(0)))
            if dr.hint(self.light_vertices is not None, mode="scalar"):
                joint = Arrival(lambert, reach, mi.UInt32(stream.half)).joint(
                    si, mi.Color3f(bsdf_weight) * bs.pdf, bs.wo, si.to_world(bs.wo)
                )
                vertex_share, vertex_cosine = joint.share, joint.cosine
                vertex_reach = dr.select(passes, 0, joint.reach)
                departs = joins & ~passes & ~mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
                if dr.hint(self.features.has_absorption, mode="scalar"):
                    departs &= bs.wo.z * si.wi.z > 0
                departure = dr.select(departs, bs.pdf, 0)
            throughput *= bsdf_weight
            eta *= bs.eta
            if dr.hint(self.beam is not None, mode="scalar"):
                is_beam &= ~becomes_rough & ~mi.has_flag(bs.sampled_type, mi.BSDFFlags.DiffuseReflection)
                spread += dr.select(mi.has_flag(bs.sampled_type, mi.BSDFFlags.GlossyReflection), 2 * turn, 0)
            if dr.hint(self.features.has_absorption, mode="scalar"):
                crosses = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission) & ~passes
                inside = dr.dot(bs.wo, mi.Vector3f(0, 0, 1)) < 0
                absorption = dr.select(crosses, dr.select(inside, self.features.absorption_of(si.shape), 0), absorption)
            onward = si.spawn_ray(si.to_world(bs.wo))
            o, d = mi.Point3f(onward.o), mi.Vector3f(onward.d)
            if ~passes:
                vertex = mi.Point3f(si.p)
                vertex_pdf = bs.pdf
                vertex_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
                vertex_samples = samples
                all_specular &= ~mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
                depth += 1
            else:
                crossings += 1
            continues &= (dr.max(throughput) > 0) & (crossings < MAX_CROSSINGS)

            # ---- Russian roulette ----
            survival = roulette_survival(throughput, eta)
            at_risk = continues & (depth >= ROULETTE_DEPTH) & ~passes
            throughput = dr.select(at_risk, throughput * dr.rcp(survival), throughput)
            continues &= ~at_risk | (stream.next_1d(dimension + 3) < survival)

            active = continues
            pi = scene.ray_intersect_preliminary(onward, coherent=False, active=active)
            secondary += dr.select(active, mi.UInt32(1), mi.UInt32(0))

        if dr.hint(self.gain is not None, mode="scalar"):
            radiance *= self.gain
        return radiance, RayCounts(secondary, shadow), FirstHit(first_distance, view_dependent)

    def _joint(self, share: Spectrum, reach: Float, cosine: Float, stream: SampleStream) -> JointLight | None:
        """A :class:`JointLight`, where there are light vertices."""
        return None if self.light_vertices is None else JointLight(share, reach, cosine, mi.UInt32(stream.half))

    def _arrival(self, albedo: Color3f, reach: Float, stream: SampleStream) -> Arrival | None:
        """An :class:`Arrival`, where there are light vertices."""
        return None if self.light_vertices is None else Arrival(albedo, reach, mi.UInt32(stream.half))

    def emission(
        self,
        si: SurfaceInteraction3f,
        vertex: Point3f,
        vertex_pdf: Float,
        vertex_delta: Bool,
        vertex_samples: UInt32,
        depth: UInt32,
        joint: JointLight | None = None,
    ) -> Spectrum:
        """Radiance that a path meets after ``depth`` surfaces, by MIS against emitter sampling at its last vertex.

        Parameters
        ----------
        si:
            What the path meets; the environment where it is not valid.
        vertex, vertex_pdf, vertex_delta, vertex_samples:
            The last scattering vertex, the pdf of the direction taken there, whether its lobe had no width, and how
            many emitter samples are taken there.
        joint:
            How much of it light vertices bring too; None for nothing.
        """
        reference = dr.zeros(mi.Interaction3f)
        reference.p = vertex
        ds = mi.DirectionSample3f(self.scene, si=si, ref=reference)
        emitter_pdf = self.light_sampler.pdf_direction(reference, ds, ~vertex_delta) * mi.Float(vertex_samples)
        weight = mis_weight(vertex_pdf, emitter_pdf)
        if joint is not None:
            vertices = cast("LightVertices", self.light_vertices)
            scattered_pdf = joint.cosine * dr.inv_pi
            weight = vertices.weight(joint, ds, weight, scattered_pdf, emitter_pdf, si.is_valid())
        emission = ds.emitter.eval(si) * weight
        if self.features.background is None:
            return emission
        shown = mi.Spectrum(self.features.background)
        if self.gain is not None:
            shown /= self.gain  # a colour that is to be seen as it was said
        return dr.select((depth == 0) & ~si.is_valid(), shown, emission)

    @property
    def has_surroundings(self) -> bool:
        """Whether rays that meet nothing show something."""
        return self._environment is not None or self.features.background is not None

    def limited(self, met: Spectrum, depth: UInt32) -> Spectrum:
        """What a path brings that it met after ``depth`` surfaces, with :attr:`most_indirect`."""
        return met if self.most_indirect is None else dr.select(depth > 1, self._clamped(met), met)

    def first_emitter_samples(self, sample: UInt32) -> UInt32:
        """Emitter samples at the first surface that is not purely specular, of a pixel's path number ``sample``."""
        return mi.UInt32(1) if self._single_delta else first_emitter_samples(sample)[0]

    def _clamped(self, light: Spectrum) -> Spectrum:
        """``light`` with no component above :attr:`most_indirect`, its hue unchanged."""
        return light * dr.minimum(1, self.most_indirect / dr.maximum(dr.max(light), 1e-20))

    def direct_light(
        self,
        si: SurfaceInteraction3f,
        bsdf: BSDFPtr,
        point: Point2f,
        active: Bool,
        samples: Float = 1,
        arrival: Arrival | None = None,
    ) -> tuple[Spectrum, DirectionSample3f, UInt32]:
        """Radiance toward ``si.wi`` from the emitter that ``point`` samples, that sample, and the shadow rays traced.

        The radiance is divided by the pdf of the sample, and weighted by MIS against BSDF sampling, as one of
        ``samples`` emitter samples at this surface; and against light vertices, where ``arrival`` tells how the path
        came here.
        """
        ds, light = self.light_sampler.sample_direction(si, point, active)
        lit = active & (ds.pdf != 0) & (dr.max(light) > 0)
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(ds.d), lit)
        weight = dr.select(ds.delta, 1, mis_weight(ds.pdf * samples, pdf))
        reflected = value * light * weight
        lit &= dr.max(reflected) > 0
        visible, tests = self.visibility(si, ds, lit)
        if arrival is not None:
            vertices = cast("LightVertices", self.light_vertices)
            joint = arrival.joint(si, mi.Color3f(value), si.to_local(ds.d), ds.d)
            # Rays from emitters do not pass holes and panes on their way.
            joint.reach = dr.select(tests > 1, 0, joint.reach)
            scattered_pdf = dr.select(ds.delta, 0, joint.cosine * dr.inv_pi)
            reflected = value * light * vertices.weight(joint, ds, weight, ds.pdf * samples, scattered_pdf, lit)
        return dr.select(lit, reflected * visible, 0), ds, tests

    def _is_near(self, ds: DirectionSample3f) -> Bool:
        """Whether a sampled emitter is another than the environment."""
        if self._environment is None:
            return mi.Bool(True)
        return ds.emitter != mi.EmitterPtr(self._environment)

    def visibility(self, si: SurfaceInteraction3f, ds: DirectionSample3f, active: Bool) -> tuple[Spectrum, UInt32]:
        """Transmittance in [0, 1] from the emitter sample ``ds`` to the surface, and the shadow rays traced."""
        found: tuple[Spectrum, UInt32] = self.shadow_rays.transmittance(si.spawn_ray_to(ds.p), ds.p, active)
        return found
