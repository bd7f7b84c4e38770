"""A look at the seen light of a picture, by single chains of sharp events in many of its pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope
from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import SampleStream
from lippmann.rendering.film.scattered_rays import ScatteredRays
from lippmann.rendering.film.wavefront import shown_colors
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import PixelRays, RaySource
from lippmann.rendering.transport.seen_light import seen_light

Looks = NDArray[np.floating]

#: Chains of the look for each path of the picture, about: it takes half a hundredth of the picture's time, as a chain
#: takes a quarter of a path's. Within limits; and those of one pixel, at least.
LOOKS_OF_PATH = 0.02
FEWEST_LOOKS, MOST_LOOKS, LOOKS_OF_PIXEL = 1 << 13, 1 << 20, 8
#: Linear radiance at which the slope of the codes is taken where seen light brings less: mid-grey.
_GREY = 0.18
#: Pixels whose variance is worked out at once.
_AT_ONCE = 1 << 12


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
    """

    def __init__(
        self, integrator: PathIntegrator, source: RaySource, samples: int, transfer: Transfer, seed: int
    ) -> None:
        self._integrator, self._source, self._transfer, self._seed = integrator, source, transfer, seed
        self._met = self._traced(samples)

    def variance_of_means(self, number: int, together: int) -> float:
        """As :func:`variance_of`, of means of ``number`` chains of a pixel that follow each other."""
        pixels, count, _ = self._met.shape
        groups = count // number
        means = self._met[:, : groups * number].reshape(pixels, groups, number, 3).mean(axis=2)
        # Most pixels see no emitter, and nothing varies there.
        lit = means[means.any(axis=(1, 2))]
        total = sum(len(part) * variance_of(part, together, self._transfer) for part in _parts(lit))
        return total / float(pixels)

    def _traced(self, samples: int) -> NDArray[np.float32]:
        """``(pixels, looks, 3)``: what single chains meet, the gain included."""
        integrator, source = self._integrator, self._source
        paths = source.width * source.height * source.channels * samples
        wanted = int(np.clip(paths * LOOKS_OF_PATH, FEWEST_LOOKS, MOST_LOOKS))
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


def variance_of(looks: Looks, together: int, transfer: Transfer) -> float:
    """Mean variance of one chain in codes, as far as the others of its pixel leave the code a slope.

    Parameters
    ----------
    looks:
        ``(pixels, looks, 3)`` linear radiance of single chains, two or more of each pixel.
    together:
        Chains whose mean a pixel shows: what one of them meets does not count beyond what makes that white.
    transfer:
        How values become codes.
    """
    number = looks.shape[1]
    others = (looks.sum(axis=1, keepdims=True) - looks) / (number - 1)
    slope = coding_slope(np.maximum(others, _GREY), transfer)
    apart = np.abs(looks - others)
    # The mean of the others varies, too.
    variance = float(np.square(slope * np.minimum(apart, together)).mean())
    return variance * float(number - 1) / float(number)


def _parts(looks: NDArray[np.float32]) -> Iterator[Looks]:
    """Some pixels at a time: what is worked out of them takes several times their memory."""
    for first in range(0, len(looks), _AT_ONCE):
        yield looks[first : first + _AT_ONCE].astype(np.float64)
