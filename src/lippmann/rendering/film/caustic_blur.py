"""The squared error that the blur of caustics by photons adds to the pixels of a picture.

It is the same for all samples that share photons, so that nothing in how they differ tells of it. The photons of either
half of the samples tell it independently, and the product of what they say is its square without bias.

A look-up of twice the radius differs from one of the radius about as much as that one differs from the truth. Squared,
that is 9 times too much where light is smooth, whose blur grows with the square of the radius, and 2.3 times too little
at straight edges, whose blur keeps its height and grows in width. Caustics have both; for those of the bundled scenes
see ``docs/background/caustics.md``.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import PIXEL_DIMENSION, SEED_STEP, SampleStream, named_seed
from lippmann.display.pixel_window import PixelWindow
from lippmann.rendering.film.memory_model import PREFERRED_LANES
from lippmann.rendering.film.wavefront import select_colors
from lippmann.rendering.transport.caustic_photons import CausticPhotons, radius_of_pass
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.ray_source import RaySource, pixel_number
from lippmann.rendering.transport.shown_caustics import ShownBlur

Floats = NDArray[np.float32]

#: Of a picture of fewer samples only some pixels are looked at, one for each in this many samples; and so many of the
#: whole picture, at least.
SAMPLES_OF_LOOK, FEWEST_LOOKED_AT = 256, 1 << 12


class SquaredBlur:
    """Expected square of what blur adds to the linear pixels of a window.

    Parameters
    ----------
    integrator, source, window:
        Of the picture; pixels have the same values in any window.
    seed:
        Of the picture, 0 to 2**32 - 1.
    """

    def __init__(self, integrator: Integrator, source: RaySource, window: PixelWindow, seed: int) -> None:
        self._integrator = integrator
        self._source = source
        self._window = window
        self._seed = seed
        self._share, self._pass = 0.0, 0
        self._of_pass = np.zeros((0, 3), np.float32)

    def after(self, samples: int) -> Floats | None:
        """``(H, W, 3)`` for a picture of so many samples per pixel; None where no photons are in passes.

        Values of single pixels are noisy, and may be negative; their sums are not biased.
        """
        passes = self._integrator.light.photon_passes if isinstance(self._integrator, PathIntegrator) else None
        if passes is None:
            return None
        pixels = self._source.width * self._source.height
        share = min(1.0, max(samples / SAMPLES_OF_LOOK, FEWEST_LOOKED_AT / pixels))
        # A look is worth its time again at twice the share.
        if share >= 2 * self._share or share == 1.0 > self._share:
            # The photons that the last sample met are at hand.
            self._share, self._pass = share, (samples - 1) // passes.pass_samples
            self._of_pass = self._measure(passes.of_pass(self._pass), share)
        scaled = _mean_area(passes, samples) / radius_of_pass(self._pass) ** 2
        return (self._of_pass * np.float32(scaled**2)).reshape(*self._window.shape, 3)

    def _measure(self, photons: PhotonMap, share: float) -> Floats:
        """``(pixels, 3)``, of this share of the pixels, each of which stands for its like."""
        assert isinstance(self._integrator, PathIntegrator)
        blur = ShownBlur(self._integrator, photons)
        chosen = _choose_pixels(self._source, self._window, self._seed, share)
        squares = np.zeros((self._window.pixels, 3), np.float32)
        step = max(1, PREFERRED_LANES // (2 * self._source.channels))
        for first in range(0, len(chosen), step):
            part = chosen[first : first + step]
            squares[part] = _products(blur, self._source, self._window, part, self._seed) / np.float32(share)
        return squares


def _mean_area(passes: CausticPhotons, samples: int) -> float:
    """Mean squared radius of the passes that serve so many samples, over that of the first: blur is as that."""
    size = passes.pass_samples
    served = (min(size, samples - first) for first in range(0, samples, size))
    return sum(each * radius_of_pass(number) ** 2 for number, each in enumerate(served)) / samples


def _choose_pixels(source: RaySource, window: PixelWindow, seed: int, share: float) -> NDArray[np.intp]:
    """Numbers of a share of the pixels of a window, spread evenly."""
    row, column = np.divmod(np.arange(window.pixels, dtype=np.uint64), np.uint64(window.width))
    number = (row + np.uint64(window.top)) * np.uint64(source.width) + column + np.uint64(window.left)
    # Fibonacci hashing.
    mixed = (number * np.uint64(SEED_STEP) + np.uint64(seed)) & np.uint64(0xFFFFFFFF)
    return np.flatnonzero(mixed < share * 2**32)


def _products(blur: ShownBlur, source: RaySource, window: PixelWindow, pixels: NDArray[np.intp], seed: int) -> Floats:
    """``(pixels, 3)``: what the first half's photons say times what the second's do."""
    channels = source.channels
    lanes = len(pixels) * channels * 2
    rest, half = divide(dr.arange(mi.UInt32, lanes), 2)
    place, channel = divide(rest, channels)
    pixel = dr.gather(mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), place)
    row, column = divide(pixel, dr.opaque(mi.UInt32, window.width))
    row += dr.opaque(mi.UInt32, window.top)
    column += dr.opaque(mi.UInt32, window.left)
    number = pixel_number(source, column, row) * channels + channel
    own_seed = dr.opaque(mi.UInt32, named_seed("blur of caustics", seed))
    stream = SampleStream.of_pixels(number, dr.zeros(mi.UInt32, lanes), own_seed, half)
    ray = source.rays(column, row, channel, stream.next_2d(PIXEL_DIMENSION))
    added = np.array(dr.ravel(blur.sample(ray, stream, mi.Bool(True)))).reshape(-1, channels, 2, 3)
    product = np.nan_to_num(added[:, :, 0] * added[:, :, 1], posinf=0.0, neginf=0.0)
    return select_colors(product)
