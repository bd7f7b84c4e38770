"""Squared bias of photon density estimation (the blur of caustics), per pixel.

All samples that share photons have the same bias, so their variance does not show it. The photons of the two halves of
the samples give two independent estimates of the bias; their product is an unbiased estimate of its square.

The bias is estimated as the difference between a look-up of twice the radius and one of the radius. Squared, this is 9
times too large where light is smooth (bias grows with the square of the radius), and 2.3 times too small at straight
edges (blur keeps its height and grows in width). Caustics have both; ``docs/background/caustics.md`` has figures.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import PIXEL_DIMENSION, SEED_STEP, SampleStream, named_seed
from lippmann.display.panel import PixelWindow
from lippmann.rendering.film.memory_model import PREFERRED_LANES
from lippmann.rendering.film.wavefront import select_colors
from lippmann.rendering.transport.caustic_photons import CausticPhotons, shrink_radius
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.rendering.transport.tuning import TUNING
from lippmann.rendering.transport.visible_caustics import VisibleBlur

Floats = NDArray[np.float32]


class SquaredBlur:
    """Expected squared bias by blur of the linear pixels of a window.

    Parameters
    ----------
    integrator, passes:
        Those of the picture.
    source, window:
        Its rays, and the part of it; a pixel has the same value in any window.
    seed:
        Of the picture, 0 to 2**32 - 1.
    """

    def __init__(
        self, integrator: PathIntegrator, passes: CausticPhotons, source: RaySource, window: PixelWindow, seed: int
    ) -> None:
        self._integrator, self._passes = integrator, passes
        self._source = source
        self._window = window
        self._seed = seed
        self._pass, self._of_pass = 0, np.zeros((0, 3), np.float32)

    def after(self, samples: int) -> Floats:
        """``(H, W, 3)`` squared bias of a picture of ``samples`` samples per pixel.

        It is measured once, at as many pixels as a probe has. Values of single pixels are noisy, and may be negative;
        their sums are not biased.
        """
        passes = self._passes
        if not len(self._of_pass):
            # The photons of the last sample are cached.
            self._pass = (samples - 1) // passes.pass_samples
            share = min(1.0, TUNING.probe_side**2 / (self._source.width * self._source.height))
            self._of_pass = self._measure(passes.of_pass(self._pass), share)
        scaled = _mean_area(passes, samples) / shrink_radius(self._pass) ** 2
        return (self._of_pass * np.float32(scaled**2)).reshape(*self._window.shape, 3)

    def _measure(self, photons: PhotonMap, share: float) -> Floats:
        """``(pixels, 3)`` squared bias, measured at a ``share`` of the pixels and divided by it; 0 at the others."""
        blur = VisibleBlur(self._integrator, photons)
        chosen = _choose_pixels(self._source, self._window, self._seed, share)
        squares = np.zeros((self._window.pixels, 3), np.float32)
        step = max(1, PREFERRED_LANES // (2 * self._source.channels))
        for first in range(0, len(chosen), step):
            part = chosen[first : first + step]
            squares[part] = _products(blur, self._source, self._window, part, self._seed) / np.float32(share)
        return squares


def _mean_area(passes: CausticPhotons, samples: int) -> float:
    """Mean squared radius over the passes of ``samples`` samples, relative to the first: bias is proportional to it."""
    size = passes.pass_samples
    served = (min(size, samples - first) for first in range(0, samples, size))
    return sum(each * shrink_radius(number) ** 2 for number, each in enumerate(served)) / samples


def _choose_pixels(source: RaySource, window: PixelWindow, seed: int, share: float) -> NDArray[np.intp]:
    """Numbers of a share of the pixels of a window, spread evenly."""
    row, column = np.divmod(np.arange(window.pixels, dtype=np.uint64), np.uint64(window.width))
    number = (row + np.uint64(window.top)) * np.uint64(source.width) + column + np.uint64(window.left)
    # Fibonacci hashing.
    mixed = (number * np.uint64(SEED_STEP) + np.uint64(seed)) & np.uint64(0xFFFFFFFF)
    return np.flatnonzero(mixed < share * 2**32)


def _products(blur: VisibleBlur, source: RaySource, window: PixelWindow, pixels: NDArray[np.intp], seed: int) -> Floats:
    """``(pixels, 3)``: product of the bias estimates of the two halves."""
    channels = source.channels
    lanes = len(pixels) * channels * 2
    rest, half = divide(dr.arange(mi.UInt32, lanes), 2)
    place, channel = divide(rest, channels)
    pixel = dr.gather(mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), place)
    row, column = divide(pixel, dr.opaque(mi.UInt32, window.width))
    row += dr.opaque(mi.UInt32, window.top)
    column += dr.opaque(mi.UInt32, window.left)
    number = source.number(column, row) * channels + channel
    own_seed = dr.opaque(mi.UInt32, named_seed("blur of caustics", seed))
    stream = SampleStream.of_pixels(number, dr.zeros(mi.UInt32, lanes), own_seed, half)
    ray = source.rays(column, row, channel, stream.next_2d(PIXEL_DIMENSION))
    added = np.array(dr.ravel(blur.sample(ray, stream, mi.Bool(True)))).reshape(-1, channels, 2, 3)
    product = np.nan_to_num(added[:, :, 0] * added[:, :, 1], posinf=0.0, neginf=0.0)
    return select_colors(product)
