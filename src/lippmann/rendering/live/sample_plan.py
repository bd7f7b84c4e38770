"""Which pixels of a view at rest get the next samples.

The squared error of a picture whose pixels have n samples of variance v each is the sum of v / n. For a given number of
samples in all it is least where n is in proportion to the root of v.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Counts = NDArray[np.int64]
Floats = NDArray[np.float32]

#: Share of the mean number of samples that a pixel gets where no noise was seen: rare light may come there, too.
LEAST_SHARE = 0.25


def even_samples(taken: Counts, lanes: int) -> Counts:
    """Samples that each pixel gets next, where all shall have as many.

    Parameters
    ----------
    taken:
        ``(n,)``: samples that each pixel has.
    lanes:
        Samples to give away, at least 1.

    Returns
    -------
    ``(n,)``, at most ``lanes`` together: the same for all, or one for the first of those that have the fewest.
    """
    fewest = np.flatnonzero(taken == taken.min())
    more = np.zeros_like(taken)
    if len(fewest) == len(taken) <= lanes:
        more[:] = lanes // len(taken)
    else:
        more[fewest[:lanes]] = 1
    return more


def samples_by_noise(taken: Counts, noise: Floats, lanes: int) -> Counts:
    """Samples that each pixel gets next, where the noise shall be as low as it can be.

    Parameters
    ----------
    taken:
        ``(n,)``: samples that each pixel has.
    noise:
        ``(n,)``: standard deviation of one sample of each; it must not be told by the pixel's own samples, whose mean
        would then depend on when they happened to agree.
    lanes:
        Samples to give away, at least 1.

    Returns
    -------
    ``(n,)``, ``lanes`` together: to those that have fewer than is best.
    """
    mean = float(noise.mean(dtype=np.float64))
    if mean <= 0.0:
        return even_samples(taken, lanes)
    weight = np.maximum(noise.astype(np.float64), LEAST_SHARE * mean)
    wanted = (int(taken.sum()) + lanes) * weight / weight.sum()
    lacking = np.cumsum(np.maximum(wanted - taken, 0.0))
    # Whole numbers whose sums keep to those that are wanted.
    given = np.rint(lacking * (lanes / lacking[-1])).astype(np.int64)
    return np.asarray(np.diff(given, prepend=0), np.int64)
