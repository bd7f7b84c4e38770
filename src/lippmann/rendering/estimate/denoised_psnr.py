"""How good a denoised picture is by its own account, and the estimator of all pictures.

Each half is denoised by itself (:mod:`lippmann.rendering.denoise.dual_buffer`). By chance they differ, and by how much
is known exactly: a quarter of the mean squared difference D is the error by chance of the mean of both. What a denoiser
gets wrong in either alike, a blurred edge, a highlight that it smooths away, is C: the mean product of the halves'
errors. The error is D + C. That C is measured without bias, (a - D(a)) (b - D(b)) pixel by pixel, but where samples are
noisy the measurement drowns in the product of two noises, which is far larger than any error left.

Yet whatever the scene, C keeps to D. The scenes of ``benchmarks/hard_scenes.py``, made to mislead denoisers, and the
bundled ones, on four kinds of displays with 8 to 128 samples, have ratios C / D of 0.05 to 18, half of them within 1.3
and 4.6: a denoiser balances what it blurs against the noise it leaves. It is larger where much of the samples' error
rests on outliers, for what one half has not met the other has most likely not met either.

So the ratio has a prior with heavy tails about these values, and the measurement speaks as loud as its own uncertainty
lets it (Bayes). Stripes that are taken for noise, 10 times the usual ratio, are plain in the measurement.

A micro-image's share of the error is in proportion to what the halves differ by there, drawn a little towards its
neighbours: that tells micro-images apart far better than the samples' errors do. Its own measurement corrects it as far
as that can be trusted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.image.micro_images import row_blocks
from lippmann.rendering.estimate.pixel_errors import ErrorSums, PixelErrors, parts_with_pixels
from lippmann.rendering.estimate.psnr import (
    NORMAL_95,
    Estimate,
    PartErrors,
    Parts,
    estimate_plain,
    make_estimate,
    neighbourhood,
)
from lippmann.rendering.estimate.tuning import TUNING

Real = NDArray[np.float64]

_LOGARITHMS = np.linspace(math.log(1e-2), math.log(1e4), 600)
_RATIOS = np.exp(_LOGARITHMS)


class PictureEstimator:
    """Estimates for pictures of one display, or of whatever has these parts; whose a pixel is is found once.

    ``is_among_mirrors``: sharp surfaces may mirror emitters, see :meth:`Estimate.among_mirrors`.
    """

    def __init__(self, of: Display | Parts, is_among_mirrors: bool = False) -> None:
        parts = Parts.micro_images(of) if isinstance(of, Display) else of
        self._grid = parts.rows, parts.columns
        self._owner = parts.owner.ravel()
        self._pixels = np.bincount(self._owner, minlength=parts.rows * parts.columns) + parts.known
        self._is_among_mirrors = is_among_mirrors

    def estimate(self, errors: PixelErrors, samples: int) -> Estimate:
        """PSNR of the whole and of the worst micro-image of a picture of so many samples per pixel."""
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
    """PSNR of the whole and of the worst of the parts, which lie in a ``grid`` of rows and columns.

    ``of_samples`` are the errors of a denoised picture's samples, ``samples`` their number in each pixel;
    ``is_among_mirrors`` is that of :class:`PictureEstimator`.
    """
    found = estimate_plain(sums, grid) if of_samples is None else estimate_denoised(sums, of_samples, grid)
    return found.among_mirrors(samples) if is_among_mirrors else found


def estimate_denoised(judged: ErrorSums, samples: ErrorSums, grid: tuple[int, int]) -> Estimate:
    """PSNR of the whole and of the worst part, from what the halves say of each other and from the samples' errors."""
    index, judged = parts_with_pixels(judged)
    _, samples = parts_with_pixels(samples)
    pixels = float(judged.pixels.sum())
    by_chance, error = float(judged.apart.sum()) / pixels, float(judged.values.sum()) / pixels
    deviation = math.sqrt(float(judged.squares.sum())) / pixels
    of_samples = max(float(samples.values.sum()), 1e-30)
    outliers = min(1.0, float(samples.outliers.sum()) / of_samples)
    # Halves that differ by less than a 10 000th of their samples' errors do so for another reason than vanished noise.
    likely = likely_error(max(by_chance, 1e-4 * of_samples / pixels), error - by_chance, deviation, outliers)
    middle = float(likely.quantiles(0.5))
    model = math.exp(NORMAL_95 * TUNING.model_uncertainty)
    often_better = TUNING.often_better * (1 - judged.share_less(middle))
    worse, better = likely.quantiles(np.array([0.975, 0.025])) * (model, often_better / model)

    parts = _parts(judged, samples.squares, index, grid, middle)
    drawn = _worst_drawn(parts, likely.quantiles((np.arange(TUNING.draws) + 0.5) / TUNING.draws) / middle)
    worst = np.quantile(drawn, (0.5, 0.975, 0.025)) * (1, 1, TUNING.worst_often_better)
    return make_estimate((middle, worse, better, *worst), int(index[np.argmax(parts.expected)]), grid)


def _worst_drawn(parts: PartErrors, common: Real) -> Real:
    """Errors of the worst part, as often as is drawn; ``common`` are the factors that all parts may have alike."""
    random = np.random.default_rng(2)
    model = np.exp(TUNING.model_uncertainty * random.standard_normal(len(common)))
    return np.asarray(parts.draws().max(axis=0) * common[random.permutation(len(common))] * model)


def _parts(
    judged: ErrorSums, of_samples: Real, index: NDArray[np.intp], grid: tuple[int, int], mean: float
) -> PartErrors:
    """Each part's error: in proportion to what its halves differ by, drawn from there to its own measurement.

    ``mean`` is that of all; ``of_samples`` are the sums of the squares of the samples' errors.
    """
    count = judged.pixels
    apart = judged.apart / count
    (near,), _ = neighbourhood(apart[None], index, grid)
    least = 1e-3 * float(judged.apart.sum() / count.sum()) + 1e-30
    power = TUNING.toward_neighbours
    around = np.maximum(apart, least) ** (1 - power) * np.maximum(near, least) ** power
    around *= mean / float((around * count).sum() / count.sum())
    # The mean square of one part is noisy itself: it leans on what all have, in proportion.
    overall = float(judged.squares.sum()) / float((np.square(around) * count).sum())
    noise = (judged.squares + TUNING.lean * overall * np.square(around)) / (count + TUNING.lean) / count
    measured = judged.values / count
    # A part that seems worse by what noise does not explain is so: a denoiser is wrong by much in few pixels, beside
    # emitters, where the samples themselves are good.
    explained = TUNING.worse_from * noise + TUNING.explained * of_samples / np.square(count)
    other = np.where(measured > around, np.square(measured - around) - explained, 0.0)
    between = np.maximum(TUNING.spread * np.square(around), other)
    trust = between / (between + noise)
    expected = np.maximum(around + trust * (measured - around), 0.2 * around)
    # One of few pixels, in a corner of the panel, may differ by chance.
    fewer = TUNING.few * np.maximum(1 / count - 1 / np.median(count), 0)
    return PartErrors(index, expected, expected, np.log1p(trust * noise / np.square(expected)) + np.log1p(fewer))


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
    middle = (1 - outliers) * math.log(TUNING.usual_ratio) + outliers * math.log(TUNING.outlier_ratio)
    prior = _log_t((_LOGARITHMS - middle) / TUNING.ratio_scale)
    off = (common - _RATIOS * by_chance) / max(deviation, 1e-3 * by_chance)  # no measurement is better than that
    weights = prior + _log_t(off)
    weights = np.exp(weights - weights.max())
    return LikelyError(by_chance, weights / weights.sum())


def _log_t(deviations: Real) -> Real:
    """The logarithm of the density of Student's t distribution, but for a constant."""
    return np.asarray(-0.5 * (TUNING.freedom + 1) * np.log1p(np.square(deviations) / TUNING.freedom))
