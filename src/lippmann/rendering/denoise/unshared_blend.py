"""How much of a pixel's shared light its own, as the denoiser left it, should make up.

Micro-images share their denoised light (:mod:`lippmann.rendering.sharing.cross_lens`), for what is left of its noise is
another in each. Where none is left, after many samples or on plain surfaces, sharing only blurs what differs from lens
to lens. Of two pictures S and D of which neither is the truth t, the best mix S + w (D - S) over some pixels has w =
sum (S - t) (S - D) / sum (S - D)^2, the coefficient of a linear regression. The other half of the samples stands for t:
it knows nothing of S and D, so the upper sum is right on the average, and the lower one holds no chance at all.

That sum counts as far as it exceeds its own standard deviation, and a pixel has no say in its own weight, for the
reasons that :mod:`lippmann.rendering.denoise.noisy_blend` gives.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer
from lippmann.rendering.denoise.local_statistics import Halves, leave_one_out_mean, mean_around, measured
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: How far the neighbourhood reaches, in pixels to each side: in a smaller one the sum rarely says anything for sure.
REACH = 32


def own_light(noisy: Halves, clean: Halves, shared: Halves, transfer: Transfer, *, threads: int) -> Floats:
    """The weight of each pixel's own clean light against the shared one, ``(H, W, 1)`` in [0, 1].

    Parameters
    ----------
    noisy, clean, shared:
        Two halves of the samples that know nothing of each other, what a denoiser made of each, and what sharing made
        of that; ``(H, W, 3)`` linear.
    transfer:
        How values become codes; differences are measured between codes.
    threads:
        CPU threads; the result does not depend on them.
    """
    bands = Bands(threads)
    gain, apart = measured(_gain_and_distance, noisy, clean, shared, transfer=transfer, bands=bands)
    # With one standard deviation in place of three a room in which few paths find the emitter lost up to 1 dB: where
    # none has found it, what is too dark seems to be right.
    known = leave_one_out_mean(gain, REACH, 3.0, bands)
    return np.minimum(known / (mean_around(apart, REACH, bands) + np.float32(1e-12)), 1)[..., None]


def _gain_and_distance(
    a: Floats, b: Floats, clean_a: Floats, clean_b: Floats, shared_a: Floats, shared_b: Floats, slope: Floats
) -> tuple[Floats, Floats]:
    """The terms of both sums, between codes, ``(H, W)``: the upper one's is right on the average."""
    weight = np.square(slope)
    step_a, step_b = shared_a - clean_a, shared_b - clean_b
    gain = (shared_a - b) * step_a + (shared_b - a) * step_b
    apart = np.square(step_a) + np.square(step_b)
    return np.einsum("hwc,hwc->hw", weight, gain), np.einsum("hwc,hwc->hw", weight, apart)
