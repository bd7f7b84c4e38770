"""Estimated PSNR of a denoised picture, and the estimator of all pictures.

Each half-buffer is denoised by itself (:mod:`lippmann.rendering.denoise.dual_buffer`). The mean squared error of their
mean is V + C:

- V, the variance, is a quarter of the mean squared difference of the denoised halves. It is known exactly.
- C, the squared bias, is the mean product of the halves' errors: a blurred edge, a highlight that is smoothed away. The
  mean of (a - D(a)) (b - D(b)) estimates it without bias, but with a standard error that may be far larger than C.

The ratio C / V varies little between scenes. On ``benchmarks/hard_scenes.py``, made to mislead denoisers, and on the
bundled scenes, with four kinds of displays and 8 to 128 samples, it is 0.05 to 18, and 1.3 to 4.6 in half of the cases:
a denoiser balances bias against variance. It is larger where much of the samples' error rests on outliers: light that
one half misses, the other most likely misses, too.

So the ratio has a heavy-tailed prior around these values, and the measurement of C updates it (Bayes). Stripes that a
denoiser takes for noise, with 10 times the usual ratio, stand out in the measurement.

The error of one micro-image is taken in proportion to its own V, shrunk a little towards its neighbours'. This ranks
micro-images far better than the errors of the samples do. Its own measurement corrects it as far as its standard error
permits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.micro_image_layout import row_blocks
from lippmann.rendering.estimate.psnr import (
    NORMAL_95,
    ErrorSums,
    Estimate,
    PartErrors,
    Parts,
    PixelErrors,
    average_neighbours,
    estimate_plain,
    make_estimate,
    quantiles,
    select_parts,
)
from lippmann.rendering.estimate.tuning import TUNING

Real = NDArray[np.float64]

_LOGARITHMS = np.linspace(math.log(1e-2), math.log(1e4), 600)
_RATIOS = np.exp(_LOGARITHMS)


class PictureEstimator:
    """Estimator of the PSNR of pictures of one display, or of one division into parts.

    ``is_among_mirrors``: whether mirrors may show small emitters, see :meth:`Estimate.widen_for_mirrors`.
    """

    def __init__(self, of: Display | Parts, is_among_mirrors: bool = False) -> None:
        parts = Parts.micro_images(of) if isinstance(of, Display) else of
        self._grid = parts.rows, parts.columns
        self._owner = parts.owner.ravel()
        self._pixels = np.bincount(self._owner, minlength=parts.rows * parts.columns) + parts.known
        self._is_among_mirrors = is_among_mirrors

    def estimate(self, errors: PixelErrors, samples: int) -> Estimate:
        """PSNR of a picture of so many samples per pixel, and of its worst micro-image."""
        of_samples = None if errors.samples is None else self._sums(errors.samples)
        return estimate_sums(self._sums(errors), of_samples, self._grid, samples, self._is_among_mirrors)

    def _sums(self, errors: PixelErrors) -> ErrorSums:
        sums = ErrorSums.none(len(self._pixels), self._pixels)
        height, width = errors.values.shape
        # Block by block: double precision of a whole panel would take gigabytes.
        for first, last in row_blocks(height, width):
            sums.add(self._owner[first * width : last * width], errors.part(slice(first, last)))
        return sums


def estimate_sums(
    sums: ErrorSums, of_samples: ErrorSums | None, grid: tuple[int, int], samples: int, is_among_mirrors: bool = False
) -> Estimate:
    """PSNR of a picture, and of its worst part; ``grid`` is the parts' rows and columns.

    ``of_samples`` are the errors of a denoised picture's samples, None without a denoiser; ``samples`` is their number
    per pixel; ``is_among_mirrors`` is that of :class:`PictureEstimator`.
    """
    estimate = estimate_plain(sums, grid) if of_samples is None else estimate_denoised(sums, of_samples, grid)
    return estimate.widen_for_mirrors(samples) if is_among_mirrors else estimate


def estimate_denoised(errors: ErrorSums, samples: ErrorSums, grid: tuple[int, int]) -> Estimate:
    """PSNR of a denoised picture, and of its worst part.

    ``errors``: sums of the denoised picture; ``samples``: those of the samples it was made of.
    """
    index, errors = select_parts(errors)
    _, samples = select_parts(samples)
    pixels = float(errors.pixels.sum())
    variance, error = float(errors.halves_variance.sum()) / pixels, float(errors.values.sum()) / pixels
    deviation = math.sqrt(float((errors.squares + errors.products).sum())) / pixels
    of_samples = max(float(samples.values.sum()), 1e-30)
    outliers = min(1.0, float(samples.outliers.sum()) / of_samples)
    # Denoised halves may agree by clipping, not by low noise: at least a 10 000th of the samples' error remains.
    posterior = estimate_posterior(max(variance, 1e-4 * of_samples / pixels), error - variance, deviation, outliers)
    middle = float(posterior.quantiles(0.5))
    model = math.exp(NORMAL_95 * TUNING.model_uncertainty)
    often_better = TUNING.often_better * (1 - errors.bound_blur_share(middle))
    worse, better = posterior.quantiles(np.array([0.975, 0.025])) * (model, often_better / model)

    parts = _estimate_parts(errors, samples.squares, index, grid, middle)
    common = posterior.quantiles((np.arange(TUNING.draws) + 0.5) / TUNING.draws) / middle
    largest, without_blur = _draw_worst(parts, common)
    worst = *quantiles(largest, (0.5, 0.975)), quantiles(without_blur, 0.025) * TUNING.often_better**2
    return make_estimate((middle, worse, better, *worst, variance), int(index[np.argmax(parts.expected)]), grid)


def _draw_worst(parts: PartErrors, common: Real) -> tuple[Real, Real]:
    """Random draws of the worst part's squared error, with and without blur, ``(draws,)`` each.

    ``common`` are factors that all parts share.
    """
    random = np.random.default_rng(2)
    model = np.exp(TUNING.model_uncertainty * random.standard_normal(len(common)))
    factors = common[random.permutation(len(common))] * model
    largest, without_blur = parts.draw_largest()
    return largest * factors, without_blur * factors


def _estimate_parts(
    errors: ErrorSums, of_samples: Real, index: NDArray[np.intp], grid: tuple[int, int], mean: float
) -> PartErrors:
    """Posterior error of each part: a prior in proportion to the variance of its halves, and its own measurement.

    ``mean`` is the mean squared error of the picture; ``of_samples`` are sums of squares of the samples' errors.
    """
    count = errors.pixels
    halves_variance = errors.halves_variance / count
    (near,), _ = average_neighbours(halves_variance[None], index, grid)
    least = 1e-3 * float(errors.halves_variance.sum() / count.sum()) + 1e-30
    power = TUNING.neighbour_power
    around = np.maximum(halves_variance, least) ** (1 - power) * np.maximum(near, least) ** power
    around *= mean / float((around * count).sum() / count.sum())
    # The moments of a single part are noisy estimates: they are shrunk towards those of all parts together.
    moments = np.stack([errors.squares, errors.products])
    overall = moments.sum(axis=1, keepdims=True) / float((np.square(around) * count).sum())
    prior = TUNING.prior_pixels
    noise, products = (moments + prior * overall * np.square(around)) / (count + prior) / count
    measured = errors.values / count
    # A part that is worse than noise explains gets a prior variance of its own: a denoiser may be far off in a few
    # pixels beside an emitter, where the samples themselves are good.
    explained = TUNING.noise_factor * noise + TUNING.outlier_factor * of_samples / np.square(count)
    other = np.where(measured > around, np.square(measured - around) - explained, 0.0)
    between = np.maximum(TUNING.part_variance * np.square(around), other)
    trust = between / (between + noise)
    expected = np.maximum(around + trust * (measured - around), 0.2 * around)
    # A part of few pixels, in a corner of the panel, has a larger variance.
    fewer = prior * np.maximum(1 / count - 1 / quantiles(count, 0.5), 0)
    variance = np.log1p((trust * noise + products) / np.square(expected)) + np.log1p(fewer)
    return PartErrors(index, expected, expected, variance, errors.bound_blur_shares(expected))


@dataclass(frozen=True, eq=False)
class ErrorPosterior:
    """Posterior of the mean squared error of a denoised picture: its ``variance`` V times 1 plus the ratio C / V.

    ``weights`` are the probabilities of ratios from 0.01 to 10000, evenly spaced in their logarithm.
    """

    variance: float
    weights: Real

    def quantiles(self, shares: Real | float) -> Real:
        """Quantiles of the mean squared error, for probabilities ``shares``."""
        below = np.cumsum(self.weights) - 0.5 * self.weights
        return np.asarray(self.variance * (1 + np.exp(np.interp(shares, below, _LOGARITHMS))))


def estimate_posterior(variance: float, squared_bias: float, deviation: float, outliers: float) -> ErrorPosterior:
    """Posterior of the mean squared error, from the prior of C / V and the measured C.

    Parameters
    ----------
    variance, squared_bias:
        V and C as measured, means over all pixels, in squared codes.
    deviation:
        Standard error of ``squared_bias``.
    outliers:
        The share of the samples' error that rests on outliers, 0 to 1.
    """
    # At least a thousandth of a C that is surely larger; and above 0, so that its logarithm exists.
    variance = max(variance, 1e-3 * (squared_bias - 3 * deviation), 1e-12)
    middle = (1 - outliers) * math.log(TUNING.usual_ratio) + outliers * math.log(TUNING.outlier_ratio)
    prior = _log_t((_LOGARITHMS - middle) / TUNING.ratio_scale)
    off = (squared_bias - _RATIOS * variance) / max(deviation, 1e-3 * variance)
    weights = prior + _log_t(off)
    weights = np.exp(weights - weights.max())
    return ErrorPosterior(variance, weights / weights.sum())


def _log_t(deviations: Real) -> Real:
    """The logarithm of the density of Student's t distribution, but for a constant."""
    return np.asarray(-0.5 * (TUNING.freedom + 1) * np.log1p(np.square(deviations) / TUNING.freedom))
