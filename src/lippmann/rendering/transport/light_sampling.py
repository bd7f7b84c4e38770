"""Next-event estimation: which emitters are sampled at a surface, with what pdf and weight, and which rays reach them.

An integrator holds its light sampler. Nothing is written into the scene, which other renders may use at the same time.
"""

from __future__ import annotations

from typing import Protocol

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import binary_search
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    DirectionSample3f,
    EmitterPtr,
    Float,
    Interaction3f,
    MitsubaScene,
    Point2f,
    Point3f,
    Ray3f,
    Spectrum,
    UInt32,
)
from lippmann.rendering.transport.tuning import TUNING


class LightSampler(Protocol):
    """Samples directions toward the emitters of a scene."""

    def sample_direction(
        self, reference: Interaction3f, point: Point2f, active: Bool
    ) -> tuple[DirectionSample3f, Spectrum]:
        """Sample a direction from ``reference`` toward an emitter.

        Parameters
        ----------
        reference:
            The point that is lit.
        point:
            Sample in [0, 1)^2; its first coordinate chooses the emitter and is then used again.
        active:
            Lanes that sample.

        Returns
        -------
        DirectionSample3f, Spectrum
            The direction, with ``pdf`` per steradian including the probability of the emitter (of delta emitters, that
            probability alone); and the radiance divided by ``pdf``. Visibility is not tested.
        """
        ...

    def pdf_direction(self, reference: Interaction3f, sample: DirectionSample3f, active: Bool) -> Float:
        """Pdf per steradian with which :meth:`sample_direction` at ``reference`` gives ``sample``.

        0 where ``sample`` has no emitter, or one that a scattered ray cannot hit.
        """
        ...

    def probability(self, emitter: EmitterPtr) -> Float:
        """Probability with which :meth:`sample_direction` chooses ``emitter``."""
        ...


class SceneLightSampler:
    """Samples emitters by the scene's own sampling weights, which are uniform unless its author set them."""

    def __init__(self, scene: MitsubaScene) -> None:
        self._scene = scene

    def sample_direction(
        self, reference: Interaction3f, point: Point2f, active: Bool
    ) -> tuple[DirectionSample3f, Spectrum]:
        sample: tuple[DirectionSample3f, Spectrum] = self._scene.sample_emitter_direction(
            reference, point, False, active
        )
        return sample

    def pdf_direction(self, reference: Interaction3f, sample: DirectionSample3f, active: Bool) -> Float:
        return self._scene.pdf_emitter_direction(reference, sample, active)

    def probability(self, emitter: EmitterPtr) -> Float:
        emitters = self._scene.emitters_dr()
        weights = np.array(emitters.sampling_weight(), dtype=np.float64).reshape(-1)
        pmf = mi.Float(by_registry(emitters, weights / weights.sum()))
        return dr.gather(mi.Float, pmf, dr.reinterpret_array(mi.UInt32, emitter))


class WeightedLightSampler:
    """Samples emitters by a discrete distribution of its own.

    Parameters
    ----------
    scene:
        A scene of at least two emitters.
    weights:
        ``(emitters,)`` in the order of ``mi.Scene.emitters()``, none negative, at least one above 0. They need not add
        up to 1.
    """

    # As Mitsuba's DiscreteDistribution, whose arrays cannot be inputs of a recorded kernel.
    def __init__(self, scene: MitsubaScene, weights: NDArray[np.float64]) -> None:
        self._emitters = scene.emitters_dr()
        single = weights.astype(np.float32)
        cumulative = np.cumsum(single, dtype=np.float64)
        possible = np.flatnonzero(single)
        self._first, self._last = int(possible[0]), int(possible[-1])
        self._weights, self._cumulative = mi.Float(single), mi.Float(cumulative.astype(np.float32))
        self._total = dr.opaque(mi.Float, float(np.float32(cumulative[-1])))
        self._normalization = dr.opaque(mi.Float, float(np.float32(1 / cumulative[-1])))
        self._pmf = mi.Float(by_registry(self._emitters, single * np.float32(1 / cumulative[-1])))

    def sample_direction(
        self, reference: Interaction3f, point: Point2f, active: Bool
    ) -> tuple[DirectionSample3f, Spectrum]:
        index, reused, probability = self._sample_emitter(point.x, active)
        emitter = dr.gather(type(self._emitters), self._emitters, index, active)
        sample, radiance = emitter.sample_direction(reference, mi.Point2f(reused, point.y), active)
        sample.pdf *= probability
        return sample, radiance * dr.rcp(probability)

    def _sample_emitter(self, number: Float, active: Bool) -> tuple[UInt32, Float, Float]:
        """Index of an emitter, ``number`` in [0, 1) made uniform again, and the emitter's probability."""
        target = number * self._total
        index = binary_search(
            self._first, self._last, lambda place: dr.gather(mi.Float, self._cumulative, place, active) < target
        )
        probability = dr.gather(mi.Float, self._weights, index, active) * self._normalization
        before = dr.gather(mi.Float, self._cumulative, index - 1, active & (index > 0)) * self._normalization
        return index, (number - before) / probability, probability

    def pdf_direction(self, reference: Interaction3f, sample: DirectionSample3f, active: Bool) -> Float:
        probability = dr.gather(mi.Float, self._pmf, dr.reinterpret_array(mi.UInt32, sample.emitter), active)
        return sample.emitter.pdf_direction(reference, sample, active) * probability

    def probability(self, emitter: EmitterPtr) -> Float:
        return dr.gather(mi.Float, self._pmf, dr.reinterpret_array(mi.UInt32, emitter))


def registry_numbers(emitters: EmitterPtr) -> NDArray[np.uint32]:
    """``(emitters,)``: indices in Dr.Jit's registry, in which 0 is no emitter."""
    return np.asarray(np.array(dr.reinterpret_array(mi.UInt32, emitters)).reshape(-1))


def by_registry(emitters: EmitterPtr, values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Table of one value an emitter, indexed by :func:`registry_numbers`: a ray that hits an emitter has that index.

    Entries of other indices are 0.
    """
    numbers = registry_numbers(emitters)
    table = np.zeros(int(numbers.max()) + 1, np.float32)
    table[numbers] = values
    return table


class DeltaEmitters:
    """The delta emitters of a scene, which no ray can hit: points, spots and directional ones; sampled uniformly.

    Parameters
    ----------
    emitters:
        All of the scene's.
    """

    def __init__(self, emitters: list[mi.Emitter]) -> None:
        chosen = [each for each in emitters if bool(mi.has_flag(each.flags(), mi.EmitterFlags.Delta))]
        self._count = len(chosen)
        self._emitters = mi.EmitterPtr(chosen) if chosen else None

    def __len__(self) -> int:
        return self._count

    def sample_direction(
        self, reference: Interaction3f, point: Point2f, active: Bool
    ) -> tuple[DirectionSample3f, Spectrum]:
        """As :meth:`LightSampler.sample_direction`, of one of these emitters; there must be one."""
        index = dr.minimum(mi.UInt32(point.x * self._count), self._count - 1)
        emitter = dr.gather(mi.EmitterPtr, self._emitters, index, active)
        sample, radiance = emitter.sample_direction(reference, point, active)
        sample.pdf /= self._count
        return sample, radiance * self._count


#: Straight-through surfaces that one ray may cross before it counts as blocked. Bounds the loop between many panes.
MAX_CROSSINGS = 64


class ShadowRays:
    """Shadow rays in one scene.

    Parameters
    ----------
    scene:
        A ``mi.Scene``.
    has_null:
        Whether some of its surfaces let rays straight through.
    """

    def __init__(self, scene: MitsubaScene, has_null: bool) -> None:
        self._scene, self._has_null = scene, has_null

    @syntax
    def transmittance(self, ray: Ray3f, end: Point3f, active: Bool) -> tuple[Spectrum, UInt32]:
        """Transmittance in [0, 1] along ``ray``, which stops short of ``end``, and the rays traced for it.

        A ray that crosses n surfaces counts n + 1 times.
        """
        active = mi.Bool(active)
        tests = dr.select(active, mi.UInt32(1), mi.UInt32(0))
        transmittance = mi.Spectrum(1)
        if dr.hint(not self._has_null, mode="scalar"):
            transmittance = dr.select(self._scene.ray_test(ray, active), mi.Spectrum(0), transmittance)
        else:
            crossings = mi.UInt32(0)
            o, d, distance = mi.Point3f(ray.o), mi.Vector3f(ray.d), mi.Float(ray.maxt)
            while dr.hint(active, label="visibility", exclude=[end]):
                part = mi.Ray3f(o, d)
                part.maxt = distance
                hit = self._scene.ray_intersect(part, mi.RayFlags.All, False, active)
                crosses = hit.is_valid()
                hit.wi = -hit.wi  # as the light comes
                through = hit.bsdf(part).eval_null_transmission(hit, crosses)
                transmittance = dr.select(crosses, transmittance * through, transmittance)
                crossings += 1
                transmittance = dr.select(crosses & (crossings >= MAX_CROSSINGS), mi.Spectrum(0), transmittance)
                active = crosses & (dr.max(transmittance) > 0) & (crossings < MAX_CROSSINGS)
                tests += dr.select(active, mi.UInt32(1), mi.UInt32(0))
                rest = hit.spawn_ray_to(end)
                o, d, distance = mi.Point3f(rest.o), mi.Vector3f(rest.d), mi.Float(rest.maxt)
        return transmittance, tests


# ---- Weights of samples, and how many there are ----


def mis_weight(pdf: Float, *others: Float) -> Float:
    """MIS weight of a sample with ``pdf`` against ``others``, by the power heuristic; 0 where all are 0.

    Veach 1997, eq. 9.16 with exponent 2.
    """
    squared = dr.square(pdf)
    weight = squared / sum((dr.square(other) for other in others), squared)
    return dr.select(dr.isfinite(weight), weight, 0)


def choose_survival(throughput: Spectrum, eta: Float) -> Float:
    """Survival probability of a path in Russian roulette, from its throughput and the product of relative indices.

    The root of the unitless throughput, at most 0.95. With the throughput itself hardly any path survives in a room
    with grey walls, and the few survivors have large weights: 0.5 dB less PSNR at equal samples.
    """
    survival: Float = dr.minimum(dr.sqrt(dr.max(throughput)) * eta, 0.95)
    return survival


def count_first_samples(sample: UInt32) -> tuple[UInt32, UInt32]:
    """Count of emitter samples at the first non-specular surface of a pixel's path number ``sample``, and their start.

    The start is the index of the first emitter sample in the pixel's sequence of points. The paths of a pixel use this
    sequence one after another, without gaps.
    """
    number = TUNING.emitter_samples
    early, fewer = sample < number, max(1, number // 2)
    first = dr.select(early, number * sample, number * number + fewer * (sample - number))
    return dr.select(early, mi.UInt32(number), fewer), first


class Clamp:
    """Clamp on single contributions of indirect light; None for no limit."""

    def __init__(self, most: Float | None) -> None:
        self._most = most

    def apply(self, light: Spectrum, is_indirect: Bool | None = None) -> Spectrum:
        """``light`` scaled so that no component exceeds the limit; only where ``is_indirect``, if that is given."""
        if self._most is None:
            return light
        clamped = light * dr.minimum(1, self._most / dr.maximum(dr.max(light), 1e-20))
        return clamped if is_indirect is None else dr.select(is_indirect, clamped, light)
