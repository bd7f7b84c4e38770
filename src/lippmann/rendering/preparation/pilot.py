"""The pilot of a picture: a few paths through all its pixels, whose results decide how its light is prepared.

Each emitter is sampled along the same paths, so that differences between contributions come from the emitters alone.

Mitsuba samples all emitters uniformly unless a scene sets weights. Emitters that light nothing in the picture then take
their share too: a sky outside a closed room takes half of all shadow rays. Here an emitter is sampled in proportion to
the root of the second moment E[f^2] of its contribution f, which minimises the variance of f over its probability
(importance sampling; Veach 1997, chapter 2.5.2). A uniform share remains for contributions that the pilot missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream, named_seed
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Float, MitsubaScene, Point2f, Point3f, Ray3f, UInt32
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.transport.first_hits import NEAR_SHARE
from lippmann.rendering.transport.light_sampling import LightSampler, SceneLightSampler, WeightedLightSampler
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.path_vertex import DIMENSIONS
from lippmann.rendering.transport.ray_source import PixelRays, RaySource
from lippmann.rendering.transport.sharp_events import sharp_lobe
from lippmann.rendering.transport.specular_chains import specular_light
from lippmann.rendering.transport.tuning import TUNING as TRANSPORT


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

    In scenes that are lit by their environment alone nothing is traced, as no rule needs it. ``integrator`` samples
    emitters uniformly.
    """
    lights = integrator.scene.emitters()
    count = len(lights)
    if all(each.is_environment() for each in lights):
        return Pilot(np.zeros(count), 0.0, None)
    emitters = count if 0 < count <= TUNING.most_weighed_emitters else 1
    paths = TRANSPORT.rays_of_each(emitters)
    lane = dr.arange(mi.UInt32, paths * emitters)
    emitter, path = divide(lane, dr.opaque(mi.UInt32, paths))
    stream, column, row, jitter = _place_of(path, source)
    ray = source.rays(column, row, mi.UInt32(0), jitter)
    traced = _contributions(integrator, ray, stream, emitter, dr.opaque(mi.Float, emitters))
    dr.eval(traced)
    squares, indirect = (np.array(each, dtype=np.float64).reshape(emitters, -1) for each in traced[:2])
    hit, point = (np.array(each)[..., :paths] for each in traced[2:])
    # Invalid values, as from a normal of length 0, count as no contribution.
    moments = np.nan_to_num(squares).mean(axis=1) if emitters == count else np.zeros(count)
    placed = _has_place(lights) if emitters == count else np.zeros(emitters, bool)
    brightest = float(np.nan_to_num(indirect[placed]).sum(axis=0).max())
    return Pilot(moments, brightest, _region_about(point.T[hit != 0].astype(np.float64)))


def brightest_specular_light(integrator: PathIntegrator, source: RaySource) -> float:
    """Largest exposed radiance, mean of its components, of the pilot's specular chains."""
    stream, column, row, _ = _place_of(dr.arange(mi.UInt32, TRANSPORT.probe_side**2), source)
    pixel, number = PixelRays(source, column, row, mi.UInt32(0)), dr.opaque(mi.UInt32, 1)
    light = integrator.exposed(specular_light(integrator, pixel, stream, number, mi.Bool(True))[0])
    return float(dr.max(dr.mean(light))[0])


def _place_of(path: UInt32, source: RaySource) -> tuple[SampleStream, UInt32, UInt32, Point2f]:
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
    weights = emitter_weights(pilot)
    return WeightedLightSampler(scene, weights) if (weights != weights[:1]).any() else SceneLightSampler(scene)


def emitter_weights(pilot: Pilot) -> NDArray[np.float64]:
    """Sampling probabilities of the emitters, ``(emitters,)``, adding up to 1, in the order of ``pilot.moments``."""
    roots = np.sqrt(pilot.moments)
    uniform = np.full(len(roots), 1 / max(len(roots), 1))
    if not roots.any():
        return uniform
    share = TRANSPORT.uniform_share
    return np.asarray(share * uniform + (1 - share) * roots / roots.sum())


def _has_place(emitters: list[mi.Emitter]) -> NDArray[np.bool_]:
    """``(emitters,)``: which are at a finite distance, neither an environment nor directional."""
    flags = np.array([int(emitter.flags()) for emitter in emitters], np.uint32)
    return np.asarray(flags & int(mi.EmitterFlags.Surface | mi.EmitterFlags.DeltaPosition), bool)


def _region_about(points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Corners ``(2, 3)`` of a box about points ``(n, 3)`` that are seen, wider by its longest side; None for none."""
    if not len(points):
        return None
    corners: NDArray[np.float64] = np.quantile(points, [NEAR_SHARE, 1 - NEAR_SHARE], axis=0)
    middle, size = corners.mean(axis=0), np.ptp(corners, axis=0)
    reach = (size + size.max()) / 2
    return np.stack([middle - reach, middle + reach])


@syntax
def _contributions(
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
    # What does not change is no state: else Dr.Jit would record the loop a second time, without it.
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
        light, _, _ = integrator.direct_light(si, bsdf, uniform, sampling, emitters)
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
