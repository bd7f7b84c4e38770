"""Which emitter is sampled at a surface: by the light that each brings to what the picture shows.

Mitsuba samples all emitters alike unless told otherwise, those that light nothing, too: a sky outside a closed room
takes half of all shadow rays there. Here a few thousand paths from all over the picture find out what each brings. An
emitter whose light f reaches a path with second moment E[f^2] is best sampled in proportion to its root: then the
variance of f over its probability is least (importance sampling; Veach 1997, chapter 2.5.2). A share goes to all alike,
for what was not found.

The probabilities belong to a sampler that the integrator holds. Nothing is written into the scene, which other renders
may use at the same time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream
from lippmann.rendering.transport.ray_source import RaySource

if TYPE_CHECKING:
    from lippmann.rendering.transport.path import PathIntegrator

#: Paths that look, and the fewest for each emitter; of more emitters than ``MOST_EMITTERS`` all are sampled alike.
PATHS, LEAST_PATHS, MOST_EMITTERS = 1 << 14, 1 << 8, 1 << 10
#: Surfaces along a path that are looked at.
SURFACES = 3
#: Share of the samples that all emitters have alike.
EVEN_SHARE = 0.2
#: Dimensions of the sample stream at one surface.
DIMENSIONS_PER_SURFACE = 4
#: Their own seed: the picture's would make the probabilities depend on it.
_SEED = 0x6C616D70


class LightSampler(Protocol):
    """Samples directions toward the emitters of a scene."""

    def sample_direction(self, reference: Any, point: Any, active: Any) -> tuple[Any, Any]:
        """A direction from ``reference`` (Interaction3f) toward an emitter, chosen by ``point`` (Point2f in [0, 1)^2).

        Returns
        -------
        DirectionSample3f, Spectrum
            ``pdf`` of the sample is per steradian and counts the choice of the emitter; the radiance is divided by it.
            Visibility is not tested.
        """
        ...

    def pdf_direction(self, reference: Any, sample: Any, active: Any) -> Any:
        """Density per steradian with which :meth:`sample_direction` gives ``sample`` (DirectionSample3f)."""
        ...


class SceneLights:
    """Emitters by the scene's own sampling weights, which are 1 unless its author set them."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene

    def sample_direction(self, reference: Any, point: Any, active: Any) -> tuple[Any, Any]:
        found: tuple[Any, Any] = self._scene.sample_emitter_direction(reference, point, False, active)
        return found

    def pdf_direction(self, reference: Any, sample: Any, active: Any) -> Any:
        return self._scene.pdf_emitter_direction(reference, sample, active)


class WeightedLights:
    """Emitters by probabilities given here.

    Parameters
    ----------
    scene:
        A ``mi.Scene`` of two emitters or more.
    weights:
        ``(emitters,)`` in the order of ``mi.Scene.emitters()``, at least one above 0.
    """

    def __init__(self, scene: Any, weights: NDArray[np.float64]) -> None:
        self._emitters = scene.emitters_dr()
        self._choice = mi.DiscreteDistribution(mi.Float(weights.astype(np.float32)))
        # An emitter that a ray has met is known by its place in Dr.Jit's registry; 0 is none.
        registry = np.array(dr.reinterpret_array(mi.UInt32, self._emitters))
        probability = np.zeros(int(registry.max()) + 1, np.float32)
        probability[registry] = np.array(self._choice.eval_pmf_normalized(dr.arange(mi.UInt32, len(weights))))
        self._probability = mi.Float(probability)

    def sample_direction(self, reference: Any, point: Any, active: Any) -> tuple[Any, Any]:
        index, again, probability = self._choice.sample_reuse_pmf(point.x, active)
        emitter = dr.gather(type(self._emitters), self._emitters, index, active)
        sample, radiance = emitter.sample_direction(reference, mi.Point2f(again, point.y), active)
        sample.pdf *= probability
        return sample, radiance * dr.rcp(probability)

    def pdf_direction(self, reference: Any, sample: Any, active: Any) -> Any:
        probability = dr.gather(mi.Float, self._probability, dr.reinterpret_array(mi.UInt32, sample.emitter), active)
        return sample.emitter.pdf_direction(reference, sample, active) * probability


def lights_for_picture(integrator: PathIntegrator, source: RaySource) -> LightSampler:
    """The sampler that suits a picture: emitters by what they bring to the pixels of ``source``.

    It depends on the scene and the rays alone. Scenes of one emitter, or of very many, keep their own.
    """
    scene = integrator.scene
    weights = emitter_weights(integrator, source)
    return WeightedLights(scene, weights) if len(np.unique(weights)) > 1 else SceneLights(scene)


def emitter_weights(integrator: PathIntegrator, source: RaySource) -> NDArray[np.float64]:
    """Probabilities of the emitters, ``(emitters,)``, by what each brings to the pixels of ``source``.

    In the order of ``mi.Scene.emitters()``; they add up to 1. ``integrator`` samples all emitters alike.
    """
    emitters = len(integrator.scene.emitters())
    even = np.full(emitters, 1 / max(emitters, 1))
    if not 1 < emitters <= MOST_EMITTERS:
        return even
    found = np.sqrt(_second_moments(integrator, source, emitters))
    return EVEN_SHARE * even + (1 - EVEN_SHARE) * found / found.sum() if found.sum() > 0 else even


def _second_moments(integrator: PathIntegrator, source: RaySource, emitters: int) -> NDArray[np.float64]:
    """Mean squares of the light that paths find at each emitter, ``(emitters,)``; white, 1, is the most that counts.

    All emitters are looked at along the same paths, so that they differ by nothing else.
    """
    paths = max(PATHS // emitters, LEAST_PATHS)
    lane = dr.arange(mi.UInt32, paths * emitters)
    emitter = lane // dr.opaque(mi.UInt32, paths)
    path = lane - emitter * dr.opaque(mi.UInt32, paths)
    stream = SampleStream.of_pixels(mi.UInt32(0), path, dr.opaque(mi.UInt32, _SEED))
    place = stream.next_2d(PIXEL_DIMENSION)
    x, y = place.x * dr.opaque(mi.Float, source.width), place.y * dr.opaque(mi.Float, source.height)
    column, row = mi.UInt32(x), mi.UInt32(y)
    jitter = mi.Point2f(x - mi.Float(column), y - mi.Float(row))
    ray = source.rays(column, row, mi.UInt32(0), jitter)
    found = _squares_along(integrator, ray, stream, emitter, dr.opaque(mi.Float, emitters))
    # A path may meet what has no value, such as a normal of no length: there it has found nothing.
    squares = np.nan_to_num(np.array(found, dtype=np.float64), nan=0.0)
    means: NDArray[np.float64] = squares.reshape(emitters, paths).mean(axis=1)
    return means


@dr.syntax
def _squares_along(integrator: PathIntegrator, ray: Any, stream: SampleStream, emitter: Any, emitters: Any) -> Any:
    """Per path the squares of what ``emitter`` brings to its surfaces, added up."""
    scene = integrator.scene
    context = mi.BSDFContext()
    ray = mi.Ray3f(ray)
    throughput = mi.Spectrum(1)
    squares = mi.Float(0)
    surface = mi.UInt32(0)
    active = mi.Bool(True)
    while dr.hint(active, label="lit surfaces"):
        si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        active &= si.is_valid()
        bsdf = si.bsdf(ray)
        dimension = surface * DIMENSIONS_PER_SURFACE + 1
        # Sampled alike, emitters hold equal parts of the unit interval.
        point = stream.next_2d(dimension)
        point.x = (mi.Float(emitter) + point.x) / emitters
        lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        light, _ = integrator.direct_light(si, bsdf, point, lit)
        squares += dr.square(dr.minimum(dr.mean(throughput * light / emitters), 1))

        bs, weight = bsdf.sample(context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), active)
        throughput *= weight
        ray = si.spawn_ray(si.to_world(bs.wo))
        surface += 1
        active &= (dr.max(throughput) > 0) & (surface < min(integrator.depth, SURFACES))
    return squares
