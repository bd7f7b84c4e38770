"""MIS weights, Russian roulette, emitter samples per vertex, and the clamp on indirect light."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.types import Bool, Float, Spectrum, UInt32
from lippmann.rendering.transport.tuning import TUNING


def mis_weight(pdf: Float, *others: Float) -> Float:
    """MIS weight of a sample with ``pdf`` against ``others``, by the power heuristic; 0 where all are 0.

    Veach 1997, eq. 9.16 with exponent 2.
    """
    squared = dr.square(pdf)
    weight = squared / sum((dr.square(other) for other in others), squared)
    return dr.select(dr.isfinite(weight), weight, 0)


def roulette_survival(throughput: Spectrum, eta: Float) -> Float:
    """Survival probability of a path in Russian roulette, from its throughput and the product of relative indices.

    The root of the unitless throughput, at most 0.95. With the throughput itself hardly any path survives in a room
    with grey walls, and the few survivors have large weights: 0.5 dB less PSNR at equal samples.
    """
    survival: Float = dr.minimum(dr.sqrt(dr.max(throughput)) * eta, 0.95)
    return survival


def first_emitter_samples(sample: UInt32) -> tuple[UInt32, UInt32]:
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

    def limited(self, light: Spectrum, is_indirect: Bool | None = None) -> Spectrum:
        """``light`` scaled so that no component exceeds the limit; only where ``is_indirect``, if that is given."""
        if self._most is None:
            return light
        clamped = light * dr.minimum(1, self._most / dr.maximum(dr.max(light), 1e-20))
        return clamped if is_indirect is None else dr.select(is_indirect, clamped, light)
