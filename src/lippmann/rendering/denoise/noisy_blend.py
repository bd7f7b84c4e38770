"""How much of a denoised pixel its own samples should make up, by what the halves of a picture say of each other.

A denoiser knows pictures, not this scene: it wipes out stripes that it takes for noise, and what is seen through water.
Such errors stay, however many samples there are, while the samples' own noise falls. So where a clean half lies farther
from the truth than its noisy samples scatter, it gives way to them: of two pictures with squared errors E and V that
know nothing of each other the best mean has E / (E + V) of the second. Both are measured, E by the other half. That
such means converge was shown by A. Firmino, J. R. Frisvad, H. W. Jensen, *Progressive Denoising of Monte Carlo Rendered
Images*, Computer Graphics Forum 41(2), 2022, where a network chooses; here the measurement does, over the pixels
around.

Single pixels tell nothing. E counts as far as it exceeds its own standard deviation, so that few and noisy samples
change nothing, and over small and large neighbourhoods: in a small one a bright hit may be missing by chance, in a
large one what is wrong with an edge is lost. The geometric mean of what both say is zero where either says nothing.

A pixel's own difference to the other half has no say in its weight: where that half happens to agree with the noise of
the samples, these would seem to be right, and the other half could not judge the picture any more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer
from lippmann.rendering.denoise.local_statistics import Halves, leave_one_out_mean, mean_around, measured
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: How far the two neighbourhoods reach, in pixels to each side.
NEAR, FAR = 2, 8


def weigh_samples(noisy: Halves, clean: Halves, transfer: Transfer, *, threads: int) -> Floats:
    """The weight of each pixel's own samples against its clean value, ``(H, W, 1)`` in [0, 1].

    Parameters
    ----------
    noisy, clean:
        Two halves of the samples that know nothing of each other, and what a denoiser made of each; ``(H, W, 3)``
        linear.
    transfer:
        How values become codes; errors are measured between codes.
    threads:
        CPU threads; the result does not depend on them.
    """
    bands = Bands(threads)
    noise, error = measured(_noise_and_error, noisy, clean, transfer=transfer, bands=bands)
    share = np.ones_like(noise)
    for reach in (NEAR, FAR):
        of_noise = np.maximum(mean_around(noise, reach, bands), 0)
        known = leave_one_out_mean(error, reach, 1.0, bands)
        share *= known / (known + of_noise + np.float32(1e-12))  # 0 where there is neither noise nor error
    return np.sqrt(share)[..., None]


def _noise_and_error(a: Floats, b: Floats, clean_a: Floats, clean_b: Floats, slope: Floats) -> tuple[Floats, Floats]:
    """Squared errors, between codes, of a noisy half and of a clean one, ``(H, W)``; right on the average."""
    weight = np.square(slope) / 6
    scatter = np.square(a - b)
    error = np.square(clean_a - b) + np.square(clean_b - a) - scatter
    return np.einsum("hwc,hwc->hw", weight, scatter), np.einsum("hwc,hwc->hw", weight, error)
