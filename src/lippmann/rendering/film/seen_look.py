"""A look at the seen light of a picture, by single chains of sharp events in many of its pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope
from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import SampleStream
from lippmann.device.types import MitsubaScene
from lippmann.rendering.film.scattered_rays import ScatteredRays
from lippmann.rendering.film.wavefront import shown_colors
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import PixelRays, RaySource
from lippmann.rendering.transport.seen_light import seen_light

Looks = NDArray[np.floating]

#: What a chain costs of a path that looks up photons, and of one that does not.
CHAIN_COST, PLAIN_CHAIN_COST = 0.05, 0.25
#: Share of a picture's time that the look takes, about: where there are caustics, and elsewhere. Its chains within
#: limits, and those of one pixel, at least.
LOOK_COST, PLAIN_LOOK_COST = 0.02, 0.005
FEWEST_LOOKS, MOST_LOOKS, LOOKS_OF_PIXEL = 1 << 13, 1 << 20, 8
#: Linear radiance at which the slope of the codes is taken where seen light brings less: mid-grey.
_GREY = 0.18
#: Pixels whose variance is worked out at once.
_AT_ONCE = 1 << 12
#: Points from which emitters are looked at.
_POINTS = 1 << 10


class SeenLook:
    """What single chains meet.

    Parameters
    ----------
    integrator:
        Ready for the picture.
    source:
        Rays of the whole picture: parts of one picture must be told the same.
    samples:
        Of each pixel, about.
    transfer:
        How values become codes.
    seed:
        Of the picture.

    Attributes
    ----------
    chains:
        How many there are.
    """

    def __init__(
        self, integrator: PathIntegrator, source: RaySource, samples: int, transfer: Transfer, seed: int
    ) -> None:
        self._integrator, self._source, self._transfer, self._seed = integrator, source, transfer, seed
        self._met = self._traced(samples)
        self.chains = self._met.shape[0] * self._met.shape[1]

    def variances(self, together: Sequence[int]) -> list[float]:
        """As :func:`variances_of`."""
        return self._mean_variances(self._met, together)

    def variance_of_means(self, number: int, together: int) -> float:
        """The same of means of ``number`` chains of a pixel that follow each other."""
        pixels, count, _ = self._met.shape
        groups = count // number
        means = self._met[:, : groups * number].reshape(pixels, groups, number, 3).mean(axis=2)
        return self._mean_variances(means, [together])[0]

    def code_of(self, brightness: float) -> float:
        """The step of the code that linear radiance makes at mid-grey."""
        return float(coding_slope(np.array(_GREY), self._transfer)) * brightness

    def brightest(self, of_environment: bool) -> float:
        """Greatest radiance of an emitter of some size, the gain included, by samples from what the picture shows.

        ``of_environment``: no other counts.
        """
        few = ScatteredRays(self._source, math.isqrt(_POINTS))
        place = dr.arange(mi.UInt32, few.width * few.height)
        row, column = divide(place, few.width)
        scene: MitsubaScene = self._integrator.scene
        si = scene.ray_intersect(few.rays(column, row, mi.UInt32(0), mi.Point2f(0.5)))
        point = SampleStream.of_pixels(mi.UInt32(0), place, dr.opaque(mi.UInt32, self._seed)).next_2d(1)
        ds, weight = scene.sample_emitter_direction(si, point, False, si.is_valid())
        counts = si.is_valid() & ~ds.delta
        if of_environment:
            counts &= mi.has_flag(ds.emitter.flags(), mi.EmitterFlags.Infinite)
        radiance = dr.select(counts, dr.max(weight) * ds.pdf, 0)
        if self._integrator.gain is not None:
            radiance *= self._integrator.gain
        return float(np.max(np.array(radiance)))

    def _mean_variances(self, met: NDArray[np.float32], together: Sequence[int]) -> list[float]:
        # Most pixels see no emitter, and nothing varies there.
        lit = met[met.any(axis=(1, 2))]
        sums = np.zeros(len(together))
        for part in _parts(lit):
            sums += len(part) * np.array(variances_of(part, together, self._transfer))
        return [float(each) for each in sums / len(met)]

    def _traced(self, samples: int) -> NDArray[np.float32]:
        """``(pixels, looks, 3)``: what single chains meet, the gain included."""
        integrator, source = self._integrator, self._source
        paths = source.width * source.height * source.channels * samples
        share = LOOK_COST / CHAIN_COST if integrator.photons is not None else PLAIN_LOOK_COST / PLAIN_CHAIN_COST
        wanted = int(np.clip(paths * share, FEWEST_LOOKS, MOST_LOOKS))
        few = ScatteredRays(source, max(1, math.isqrt(wanted // (LOOKS_OF_PIXEL * source.channels))))
        count = max(LOOKS_OF_PIXEL, wanted // (few.width * few.height * few.channels))
        rest, look = divide(
            dr.arange(mi.UInt32, few.width * few.height * few.channels * count), dr.opaque(mi.UInt32, count)
        )
        pixel, channel = divide(rest, few.channels)
        row, column = divide(pixel, dr.opaque(mi.UInt32, few.width))
        stream = SampleStream.of_pixels(rest, look, dr.opaque(mi.UInt32, self._seed))
        pixels = PixelRays(source, *few.in_picture(column, row), channel)
        light, _, _ = seen_light(integrator, pixels, stream, dr.opaque(mi.UInt32, 1), mi.Bool(True))
        if integrator.gain is not None:
            light *= integrator.gain
        values = np.array(dr.ravel(mi.Color3f(light)), dtype=np.float32)
        return shown_colors(values.reshape(-1, few.channels, count, 3))


def variances_of(looks: Looks, together: Sequence[int], transfer: Transfer) -> list[float]:
    """Mean variance of one chain in codes, as far as the others of its pixel leave the code a slope.

    Parameters
    ----------
    looks:
        ``(pixels, looks, 3)`` linear radiance of single chains, two or more of each pixel.
    together:
        For each variance, the chains whose mean a pixel shows: what one of them meets does not count beyond what makes
        that white.
    transfer:
        How values become codes.
    """
    number = looks.shape[1]
    others = (looks.sum(axis=1, keepdims=True) - looks) / (number - 1)
    slope = coding_slope(np.maximum(others, _GREY), transfer)
    apart = np.abs(looks - others)
    # The mean of the others varies, too.
    ratio = (number - 1) / number
    return [float(np.square(slope * np.minimum(apart, each)).mean()) * ratio for each in together]


def _parts(looks: NDArray[np.float32]) -> Iterator[Looks]:
    """Some pixels at a time: what is worked out of them takes several times their memory."""
    for first in range(0, len(looks), _AT_ONCE):
        yield looks[first : first + _AT_ONCE].astype(np.float64)
