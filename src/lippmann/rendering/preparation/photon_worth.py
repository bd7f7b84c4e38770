"""How much a picture would lack if caustics were left to paths: whether photons are worth their time."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import SampleStream
from lippmann.rendering.preparation.scattered_rays import ScatteredRays
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.rendering.transport.shown_caustics import ShownCaustics

#: Mean squared error of a sample, in linear radiance, below which photons would not be missed: the rest of a path's
#: light has thirty times as much as a rule, and photons take up to half of a picture's time.
LEAST_WORTH = 3e-4


def are_worth_photons(light: NDArray[np.floating], radiance: float, share: float, samples: int, gain: float) -> bool:
    """Whether caustics would be seen to be noisy, or missing, by paths alone.

    Sharp events keep radiance: where light from an emitter of radiance L shows as the radiance C, it comes from a part
    C / L of the directions that a white matt surface samples, and brings L each time: the variance of a path is C L.
    Paths never meet an emitter without size: the squared error is that of C itself, which more samples do not lessen.
    No pixel is wrong by more than white, so that both count up to there.

    Parameters
    ----------
    light:
        C of some pixels, spread over the picture.
    radiance:
        Mean of L over emitters of some size.
    share:
        Share of C that comes from those.
    samples:
        Of each pixel, about.
    gain:
        Factor by which the picture is exposed.
    """
    shown = np.minimum(light * gain, 1)
    met = share * min(1.0, radiance * gain) + (1 - share) * shown * samples
    return float((shown * met).mean()) > LEAST_WORTH


def shown_light(integrator: PathIntegrator, source: RaySource, photons: PhotonMap, seed: int) -> NDArray[np.float64]:
    """``(n,)``: radiance of the caustics in pixels spread over the picture of ``source``, before the gain."""
    few = ScatteredRays(source, TUNING.seen_side)
    pixel = dr.arange(mi.UInt32, few.width * few.height)
    row, column = divide(pixel, few.width)
    stream = SampleStream.of_pixels(pixel, mi.UInt32(0), dr.opaque(mi.UInt32, seed))
    ray = few.rays(column, row, mi.UInt32(0), mi.Point2f(0.5))
    shown = ShownCaustics(integrator, photons).sample(ray, stream, mi.Bool(True))
    return np.array(dr.max(shown), dtype=np.float64)
