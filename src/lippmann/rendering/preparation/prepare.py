"""Prepares the light of a picture: emitter weights, photons, exposure, light vertices, and specular chains.

A pilot comes first: a few paths through pixels all over the picture. Each emitter is sampled along the same paths, so
that differences between contributions come from the emitters alone.

Mitsuba samples all emitters uniformly unless a scene sets weights, also emitters that light nothing in the picture: a
sky outside a closed room takes half of all shadow rays. Here the probability of an emitter is proportional to the root
of the second moment E[f^2] of its contribution f. This minimises the variance (importance sampling; Veach 1997, chapter
2.5.2). A uniform share remains for contributions that the pilot missed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream, named_seed
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Float, MitsubaScene, Point2f, Point3f, Ray3f, UInt32
from lippmann.options.choices import REUSING
from lippmann.rendering.film import memory_model
from lippmann.rendering.preparation.exposure import compute_gain, measure_exposure
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.casters import find_casters, has_sharp_surfaces, hides_caustics
from lippmann.rendering.transport.caustic_photons import CausticPhotons, emissions, make_empty_map
from lippmann.rendering.transport.first_hits import NEAR_SHARE
from lippmann.rendering.transport.light_sampling import LightSampler, SceneLightSampler, WeightedLightSampler
from lippmann.rendering.transport.light_vertices import LightVertexPasses
from lippmann.rendering.transport.path import PathIntegrator, PreparedLight
from lippmann.rendering.transport.path_vertex import DIMENSIONS
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.ray_source import PixelRays, RaySource
from lippmann.rendering.transport.sharp_events import sharp_lobe
from lippmann.rendering.transport.specular_chains import trace_specular_light
from lippmann.rendering.transport.tuning import TUNING as TRANSPORT
from lippmann.scene.values.description import Color


def prepare_light(
    paths: PathIntegrator,
    request: RenderRequest,
    source: RaySource,
    memory: int,
    background: Color | None = None,
    own_exposure: float = 0.0,
    stands_alone: bool = True,
    weighs_emitters: bool = True,
    pilot: Pilot | None = None,
) -> PreparedLight:
    """The prepared light of a picture, for :meth:`PathIntegrator.lit_by`.

    Parameters
    ----------
    paths:
        A path integrator of the scene; its own light is ignored.
    request:
        The resolved request.
    source:
        Rays of the whole picture, also where a part of it is rendered.
    memory:
        Bytes for photons.
    background:
        Colour of rays without a hit; see :func:`~lippmann.rendering.preparation.exposure.measure_exposure`.
    own_exposure:
        The camera's own exposure in stops, to which a fixed exposure is added.
    stands_alone:
        Whether the integrator's radiance is all that is seen: nothing, such as splats, is composited over it.
    weighs_emitters:
        Whether emitters are sampled by their contribution to the picture, not by the scene's weights.
    pilot:
        That of a frame a little earlier; None to trace one.

    Raises
    ------
    MemoryLimitError
        ``memory`` bytes do not hold the photons that were asked for.
    """
    choices = dict[str, object]()
    if pilot is None or len(pilot.moments) != len(paths.scene.emitters()):
        pilot = trace_pilot(paths.lit_by(PreparedLight()), source)
    light = PreparedLight(pilot=pilot)
    if weighs_emitters:
        light = replace(light, sampler=make_light_sampler(paths.scene, pilot))
    if own_exposure:
        choices["camera_exposure"] = own_exposure
    if request.exposure != "auto":
        request = replace(request, exposure=request.exposure + own_exposure)

    caustics = shoot_photons(paths.lit_by(light), request, source, pilot, memory)
    light = replace(light, photons=caustics.photons, photon_passes=caustics.passes)
    exposure = request.exposure
    if exposure == "auto":
        exposure = measure_exposure(paths.lit_by(light), source, background, memory, request.seed)
    gain = compute_gain(exposure) if exposure else 1.0
    if caustics.technique is not None:
        choices["caustics"] = caustics.technique
    if exposure:
        light = replace(light, gain=mi.Float(gain))
        choices["exposure"] = exposure

    passes = trace_light_vertices(paths.lit_by(light), request, pilot, gain)
    if passes is not None:
        light = replace(light, light_vertices=passes.of_pass(0), vertex_passes=passes)
        choices["light_vertices"] = TRANSPORT.light_vertices
    if request.clamp_indirect is not None:
        light = replace(light, most_indirect=mi.Float(request.clamp_indirect / gain))
    chains = count_chains(paths.lit_by(light), request, source) if stands_alone else 0
    if chains:
        light = replace(light, chains=dr.opaque(mi.UInt32, chains))
        choices["seen_chains"] = chains
    return replace(light, choices=choices)


def trace_light_vertices(
    integrator: PathIntegrator, request: RenderRequest, pilot: Pilot, gain: float
) -> LightVertexPasses | None:
    """Light vertices for a picture whose indirect light is noisy without them; None for others.

    Parameters
    ----------
    pilot:
        The picture's pilot.
    gain:
        Factor on radiance of the picture's exposure.
    """
    if request.integrator != "path" or request.surfaces < 2 or gain * pilot.brightest_indirect <= 1:
        return None
    sampler, scene = integrator.light_sampler, integrator.scene
    passes = LightVertexPasses(scene, sampler, TUNING.pass_samples, request.seed, pilot.region)
    return None if passes.are_none else passes


def count_chains(integrator: PathIntegrator, request: RenderRequest, source: RaySource) -> int:
    """Specular chains per path (:mod:`~lippmann.rendering.transport.specular_chains`): a fixed number, or 0.

    A denoiser takes highlights for noise. So a denoised picture has specular chains if one of the pilot's meets light
    brighter than white. Pictures of one ray through each pixel's centre and reprojected ones have none.
    """
    is_denoised = request.denoise != "none" and request.box_filter and request.method not in REUSING
    if not is_denoised or not has_sharp_surfaces(integrator.scene):
        return 0
    return TUNING.chains if find_brightest_specular_light(integrator, source) > 1 else 0


@dataclass(frozen=True, eq=False)
class Caustics:
    """The technique that renders a picture's caustics, with its photons.

    Attributes
    ----------
    technique:
        ``photons``, ``paths`` or ``none`` (left out); None where the scene has no caustics.
    photons, passes:
        See :class:`~lippmann.rendering.transport.path.PreparedLight`.
    """

    technique: Literal["photons", "paths", "none"] | None
    photons: PhotonMap | None = None
    passes: CausticPhotons | None = None


def shoot_photons(
    integrator: PathIntegrator, request: RenderRequest, source: RaySource, pilot: Pilot, memory: int
) -> Caustics:
    """Choose the technique of caustics for the picture of ``source``, and shoot their photons.

    Photons are used wherever an emitter and a caster form a pair, and some photons land within the visible region.

    Raises
    ------
    MemoryLimitError
        Photons were asked for, and ``memory`` bytes do not hold them. Where they were not, caustics are left to paths.
    """
    if request.integrator != "path" or request.surfaces < 2:
        return Caustics(None)
    if request.caustics == "paths":
        return _leave_to_paths(integrator)
    if request.caustics == "none":
        return Caustics("none", make_empty_map())
    casters = find_casters(integrator.scene)
    if casters.pairs == 0:
        return Caustics(None)
    pixels = source.width * source.height * source.channels
    # A pass serves no more samples than the picture has.
    samples = pixels * (TUNING.pass_samples if request.is_open_ended else min(TUNING.pass_samples, request.samples))
    passes = 2 if request.is_open_ended else -(-request.samples // TUNING.pass_samples)
    # Memory that is short does not reduce the photons: a picture does not depend on it.
    required = memory_model.photons(emissions(samples), passes)
    if required > memory:
        if request.caustics == "auto":
            return _leave_to_paths(integrator)
        raise memory_model.make_memory_error(memory, "photons of caustics", required)
    photons = CausticPhotons(
        integrator.scene,
        integrator.features,
        casters,
        samples=samples,
        pass_samples=TUNING.pass_samples,
        seed=request.seed,
        region=pilot.region,
        kept=max(1, min(passes, int(TUNING.kept_share * memory) // memory_model.photons(emissions(samples), 1))),
    )
    return Caustics(None) if photons.are_none else Caustics("photons", photons.of_pass(0), photons)


def _leave_to_paths(integrator: PathIntegrator) -> Caustics:
    return Caustics("paths" if hides_caustics(integrator.scene) else None)


# ---- Pilot: its paths, and the emitter weights that follow from them ----


@dataclass(frozen=True, eq=False)
class Pilot:
    """Results of the pilot paths of a picture.

    Attributes
    ----------
    moments:
        ``(emitters,)`` in the order of ``mi.Scene.emitters()``: second moment of the contribution of each emitter to a
        path, clipped at 1; all 0 in scenes with too many emitters to weight them.
    brightest_indirect:
        Largest indirect radiance of a path, mean of its components, from emitters at a finite distance (areas, points,
        spots): light at rough surfaces that a path reaches by diffuse scattering. 0 with too many emitters.
    region:
        Corners ``(2, 3)`` of a box around the visible points; None where the picture shows no surface.
    """

    moments: NDArray[np.float64]
    brightest_indirect: float
    region: NDArray[np.float64] | None


def trace_pilot(integrator: PathIntegrator, source: RaySource) -> Pilot:
    """Trace the pilot of the picture of ``source``, which depends on the scene, the ray depth and the rays alone.

    In scenes that are lit by their environment alone nothing is traced, nor of direct light of a single emitter, as no
    rule needs it. ``integrator`` samples emitters uniformly.
    """
    lights = integrator.scene.emitters()
    count = len(lights)
    if all(each.is_environment() for each in lights) or (count == 1 and integrator.depth < 2):
        return Pilot(np.zeros(count), 0.0, None)
    emitters = count if 0 < count <= TUNING.most_weighed_emitters else 1
    paths = TRANSPORT.rays_of_each(emitters)
    lane = dr.arange(mi.UInt32, paths * emitters)
    emitter, path = divide(lane, dr.opaque(mi.UInt32, paths))
    stream, column, row, jitter = _choose_pixels(path, source)
    ray = source.rays(column, row, mi.UInt32(0), jitter)
    traced = _sample_contributions(integrator, ray, stream, emitter, dr.opaque(mi.Float, emitters))
    dr.eval(traced)
    squares, indirect = (np.array(each, dtype=np.float64).reshape(emitters, -1) for each in traced[:2])
    hit, point = (np.array(each)[..., :paths] for each in traced[2:])
    # Invalid values, as from a normal of length 0, count as no contribution.
    moments = np.nan_to_num(squares).mean(axis=1) if emitters == count else np.zeros(count)
    placed = _are_local(lights) if emitters == count else np.zeros(emitters, bool)
    brightest = float(np.nan_to_num(indirect[placed]).sum(axis=0).max())
    return Pilot(moments, brightest, _bound_region(point.T[hit != 0].astype(np.float64)))


def find_brightest_specular_light(integrator: PathIntegrator, source: RaySource) -> float:
    """Largest exposed radiance, mean of its components, of the pilot's specular chains."""
    stream, column, row, _ = _choose_pixels(dr.arange(mi.UInt32, TRANSPORT.probe_side**2), source)
    pixel, number = PixelRays(source, column, row, mi.UInt32(0)), dr.opaque(mi.UInt32, 1)
    light = integrator.expose(trace_specular_light(integrator, pixel, stream, number, mi.Bool(True))[0])
    return float(dr.max(dr.mean(light))[0])


def _choose_pixels(path: UInt32, source: RaySource) -> tuple[SampleStream, UInt32, UInt32, Point2f]:
    """For each path by its number: its sample stream, the column and row of its pixel, and the point in the pixel."""
    stream = SampleStream.of_pixels(mi.UInt32(0), path, dr.opaque(mi.UInt32, named_seed("pilot")))
    place = stream.next_2d(PIXEL_DIMENSION)
    x, y = place.x * dr.opaque(mi.Float, source.width), place.y * dr.opaque(mi.Float, source.height)
    column, row = mi.UInt32(x), mi.UInt32(y)
    return stream, column, row, mi.Point2f(x - mi.Float(column), y - mi.Float(row))


def make_light_sampler(scene: MitsubaScene, pilot: Pilot) -> LightSampler:
    """Make the light sampler of one picture.

    The scene's own weights are used where the pilot gives no better ones: with a single emitter, with very many, or
    where no contribution was found.
    """
    weights = weigh_emitters(pilot)
    return WeightedLightSampler(scene, weights) if (weights != weights[:1]).any() else SceneLightSampler(scene)


def weigh_emitters(pilot: Pilot) -> NDArray[np.float64]:
    """Sampling probabilities of the emitters, ``(emitters,)``, adding up to 1, in the order of ``pilot.moments``."""
    roots = np.sqrt(pilot.moments)
    uniform = np.full(len(roots), 1 / max(len(roots), 1))
    if not roots.any():
        return uniform
    share = TRANSPORT.uniform_share
    return np.asarray(share * uniform + (1 - share) * roots / roots.sum())


def _are_local(emitters: list[mi.Emitter]) -> NDArray[np.bool_]:
    """``(emitters,)``: which are at a finite distance, neither an environment nor directional."""
    flags = np.array([int(emitter.flags()) for emitter in emitters], np.uint32)
    return np.asarray(flags & int(mi.EmitterFlags.Surface | mi.EmitterFlags.DeltaPosition), bool)


def _bound_region(points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Corners ``(2, 3)`` of the box of visible points ``(n, 3)``, outliers apart, padded; None without points."""
    if not len(points):
        return None
    corners: NDArray[np.float64] = np.quantile(points, [NEAR_SHARE, 1 - NEAR_SHARE], axis=0)
    middle, size = corners.mean(axis=0), np.ptp(corners, axis=0)
    reach = (size + size.max()) / 2
    return np.stack([middle - reach, middle + reach])


@syntax
def _sample_contributions(
    integrator: PathIntegrator, ray: Ray3f, stream: SampleStream, emitter: UInt32, emitters: Float
) -> tuple[Float, Float, Bool, Point3f]:
    """Contributions of ``emitter``, one of ``emitters``, to the path of each lane.

    Returns the sum of squared contributions over its surfaces, the sum of indirect contributions, whether the primary
    ray hits a surface, and the hit point.
    """
    scene = integrator.scene
    context = mi.BSDFContext()
    o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
    throughput = mi.Spectrum(1)
    squares, indirect = mi.Float(0), mi.Float(0)
    is_indirect = mi.Bool(False)  # the surface before scattered evenly
    hit, point = mi.Bool(False), mi.Point3f(0)
    surface = mi.UInt32(0)
    active = mi.Bool(True)
    # Constants are excluded from the loop's state: else Dr.Jit would record the loop a second time, without them.
    while dr.hint(active, label="pilot paths", exclude=[integrator, scene, context, stream, emitter, emitters]):
        toward = mi.Ray3f(o, d)
        si = scene.ray_intersect(toward, mi.RayFlags.All, False, active)
        active &= si.is_valid()
        hit = dr.select(surface == 0, active, hit)
        point = dr.select((surface == 0) & active, si.p, point)
        bsdf = si.bsdf(toward)
        dimension = surface * DIMENSIONS + 1
        # Under uniform sampling each emitter has an equal part of the unit interval.
        uniform = stream.next_2d(dimension)
        uniform.x = (mi.Float(emitter) + uniform.x) / emitters
        sampling = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        # By MIS as if the emitter were the only one.
        ds, emitted = integrator.light_sampler.sample_direction(si, uniform, sampling)
        value, pdf = bsdf.eval_pdf(context, si, si.to_local(ds.d), sampling)
        light, _ = integrator.reflect(si, ds, emitted, value, pdf, sampling, emitters)
        contribution = dr.mean(throughput * light / emitters)
        squares += dr.square(dr.minimum(contribution, 1))
        is_rough = dr.squared_norm(sharp_lobe(si, bsdf, sampling)) == 0
        indirect += dr.select(is_indirect & is_rough, contribution, 0)

        bs, weight = bsdf.sample(context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), active)
        throughput *= weight
        is_indirect = mi.has_flag(bs.sampled_type, mi.BSDFFlags.DiffuseReflection)
        onward = si.spawn_ray(si.to_world(bs.wo))
        o, d = mi.Point3f(onward.o), mi.Vector3f(onward.d)
        surface += 1
        active &= (dr.max(throughput) > 0) & (surface < min(integrator.depth, TRANSPORT.roulette_depth))
    return squares, indirect, hit, point
