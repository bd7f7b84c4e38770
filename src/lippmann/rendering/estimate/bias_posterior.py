"""What both halves of a denoised picture have wrong in common, for what they differ by.

Each half is denoised by itself. By chance they differ, and by how much is known exactly: a quarter of the mean squared
difference D is the error by chance of the mean of both. What a denoiser gets wrong in either alike, a blurred edge, a
highlight that it smooths away, is C: the mean product of the halves' errors. The error is D + C. That C is measured
without bias, (a - D(a)) (b - D(b)) pixel by pixel, but where samples are noisy the measurement drowns in the product of
two noises, which is far larger than any error left.

Yet whatever the scene, C keeps to D. The scenes of ``benchmarks/hard_scenes.py``, made to mislead denoisers, and the
bundled ones, on four kinds of displays with 8 to 128 samples, have ratios C / D of 0.05 to 18, half of them within 1.3
and 4.6: a denoiser balances what it blurs against the noise it leaves. It is larger where much of the samples' error
rests on outliers, for what one half has not met the other has most likely not met either.

So the ratio has a prior with heavy tails about these values, and the measurement speaks as loud as its own uncertainty
lets it (Bayes). Stripes that are taken for noise, 10 times the usual ratio, are plain in the measurement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]

#: The usual ratio where no hit is an outlier, and where all are.
USUAL_RATIO, OUTLIER_RATIO = 3.0, 10.0
#: The prior of its logarithm is a t distribution of this scale.
SCALE = 0.6
#: Degrees of freedom of the prior, and of the measurement: single hits decide what it says and how uncertain it seems.
FREEDOM = 4.0
_LOGARITHMS = np.linspace(math.log(1e-2), math.log(1e4), 600)
_RATIOS = np.exp(_LOGARITHMS)


@dataclass(frozen=True, eq=False)
class LikelyError:
    """What the mean squared error of a denoised picture may be: ``by_chance`` times one and the ratio.

    ``weights`` are those of the ratios from 0.01 to 10000, evenly spaced in their logarithm.
    """

    by_chance: float
    weights: Real

    def quantiles(self, shares: Real | float) -> Real:
        """The errors below which the true one lies with these probabilities."""
        below = np.cumsum(self.weights) - 0.5 * self.weights
        return np.asarray(self.by_chance * (1 + np.exp(np.interp(shares, below, _LOGARITHMS))))


def likely_error(by_chance: float, common: float, deviation: float, outliers: float) -> LikelyError:
    """The posterior of the error.

    Parameters
    ----------
    by_chance, common:
        D and C as measured, means over all pixels, in squared codes.
    deviation:
        The standard deviation of ``common``.
    outliers:
        The share of the samples' error that rests on outliers, 0 to 1.
    """
    # A thousandth of a C that is measured beyond all ratios; and something, so that its logarithm exists.
    by_chance = max(by_chance, 1e-3 * (common - 3 * deviation), 1e-12)
    middle = (1 - outliers) * math.log(USUAL_RATIO) + outliers * math.log(OUTLIER_RATIO)
    prior = _log_t((_LOGARITHMS - middle) / SCALE)
    off = (common - _RATIOS * by_chance) / max(deviation, 1e-3 * by_chance)  # no measurement is better than that
    weights = prior + _log_t(off)
    weights = np.exp(weights - weights.max())
    return LikelyError(by_chance, weights / weights.sum())


def _log_t(deviations: Real) -> Real:
    """The logarithm of the density of Student's t distribution, but for a constant."""
    return np.asarray(-0.5 * (FREEDOM + 1) * np.log1p(np.square(deviations) / FREEDOM))
