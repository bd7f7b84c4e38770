"""Probabilities of light sampling, by the contribution of each emitter to one picture.

Mitsuba samples all emitters uniformly unless a scene sets weights. Emitters that light nothing in the picture then take
their share too: a sky outside a closed room takes half of all shadow rays. Here a few thousand paths through the whole
picture estimate each emitter's contribution f. The emitter is sampled in proportion to the root of the second moment
E[f^2], which minimises the variance of f over its probability (importance sampling; Veach 1997, chapter 2.5.2). A
uniform share remains for contributions that those paths missed.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import Float, Ray3f, UInt32
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.transport.light_sampling import LightSampler, SceneLightSampler, WeightedLightSampler
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import RaySource

#: Dimensions of the sample stream at one surface.
DIMENSIONS_PER_SURFACE = 4
#: Seed of the pilot paths: the picture's own would make the probabilities depend on it.
_SEED = 0x6C616D70


def make_light_sampler(integrator: PathIntegrator, source: RaySource) -> LightSampler:
    """Make the light sampler of one picture, by the contributions of the emitters to the pixels of ``source``.

    It depends on the scene, the ray depth and the rays alone. Where uniform sampling is as good as anything known (a
    single emitter, very many, no contribution found), the scene's own weights are used.

    Parameters
    ----------
    integrator:
        Integrator of the scene, still with the sampler that it was made with.
    source:
        Rays of the whole picture.
    """
    scene = integrator.scene
    weights = estimate_emitter_weights(integrator, source)
    return WeightedLightSampler(scene, weights) if len(np.unique(weights)) > 1 else SceneLightSampler(scene)


def estimate_emitter_weights(integrator: PathIntegrator, source: RaySource) -> NDArray[np.float64]:
    """Estimate sampling probabilities of the emitters, ``(emitters,)``, adding up to 1.

    They are the roots of the second moments of the emitters' contributions to the pixels of ``source``, mixed with a
    uniform share, in the order of ``mi.Scene.emitters()``.

    Parameters
    ----------
    integrator:
        Samples all emitters uniformly.
    source:
        Rays of the whole picture.
    """
    count = len(integrator.scene.emitters())
    uniform = np.full(count, 1 / max(count, 1))
    if not 1 < count <= TUNING.most_weighed_emitters:
        return uniform
    roots = np.sqrt(_second_moments(integrator, source, count))
    if roots.sum() == 0:
        return uniform
    share = TUNING.uniform_share
    return np.asarray(share * uniform + (1 - share) * roots / roots.sum())


def _second_moments(integrator: PathIntegrator, source: RaySource, emitters: int) -> NDArray[np.float64]:
    """Second moments of the emitters' contributions to pilot paths, ``(emitters,)``, each contribution clipped at 1.

    All emitters are sampled along the same paths, so that the estimates differ by nothing else.
    """
    paths = max(TUNING.pilot_paths // emitters, TUNING.pilot_paths_of_emitter)
    lane = dr.arange(mi.UInt32, paths * emitters)
    emitter, path = divide(lane, dr.opaque(mi.UInt32, paths))
    stream = SampleStream.of_pixels(mi.UInt32(0), path, dr.opaque(mi.UInt32, _SEED))
    point = stream.next_2d(PIXEL_DIMENSION)
    x, y = point.x * dr.opaque(mi.Float, source.width), point.y * dr.opaque(mi.Float, source.height)
    column, row = mi.UInt32(x), mi.UInt32(y)
    jitter = mi.Point2f(x - mi.Float(column), y - mi.Float(row))
    ray = source.rays(column, row, mi.UInt32(0), jitter)
    contributions = _squared_contributions(integrator, ray, stream, emitter, dr.opaque(mi.Float, emitters))
    # Invalid values, as from a normal of length 0, count as no contribution.
    squares = np.nan_to_num(np.array(contributions, dtype=np.float64), nan=0.0)
    means: NDArray[np.float64] = squares.reshape(emitters, paths).mean(axis=1)
    return means


@syntax
def _squared_contributions(
    integrator: PathIntegrator, ray: Ray3f, stream: SampleStream, emitter: UInt32, emitters: Float
) -> Float:
    """Sum over the surfaces of a path of the squared contribution of ``emitter``, one of ``emitters``, per lane."""
    scene = integrator.scene
    context = mi.BSDFContext()
    o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
    throughput = mi.Spectrum(1)
    squares = mi.Float(0)
    surface = mi.UInt32(0)
    active = mi.Bool(True)
    # What does not change is no state: else Dr.Jit would record the loop a second time, without it.
    while dr.hint(active, label="pilot paths", exclude=[integrator, scene, context, stream, emitter, emitters]):
        toward = mi.Ray3f(o, d)
        si = scene.ray_intersect(toward, mi.RayFlags.All, False, active)
        active &= si.is_valid()
        bsdf = si.bsdf(toward)
        dimension = surface * DIMENSIONS_PER_SURFACE + 1
        # Under uniform sampling each emitter has an equal part of the unit interval.
        point = stream.next_2d(dimension)
        point.x = (mi.Float(emitter) + point.x) / emitters
        sampling = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        light, _, _ = integrator.direct_light(si, bsdf, point, sampling)
        squares += dr.square(dr.minimum(dr.mean(throughput * light / emitters), 1))

        bs, weight = bsdf.sample(context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), active)
        throughput *= weight
        onward = si.spawn_ray(si.to_world(bs.wo))
        o, d = mi.Point3f(onward.o), mi.Vector3f(onward.d)
        surface += 1
        active &= (dr.max(throughput) > 0) & (surface < min(integrator.depth, TUNING.pilot_surfaces))
    return squares
