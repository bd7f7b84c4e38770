"""How good a denoised picture is by its own account.

Its halves judge each other (:mod:`lippmann.rendering.denoise.dual_buffer`). What they differ by is known exactly; what
they have wrong in common is measured, right on the average but often far noisier than what it measures. How the one
follows from the other, and how both are weighed, is in :mod:`lippmann.rendering.estimate.bias_posterior`; that is the
whole picture's error.

A micro-image's share of it is in proportion to what the halves differ by there, drawn a little towards its neighbours:
that tells micro-images apart far better than the samples' errors do, and the worst of all lies within a few dB of where
it says. Its own measurement corrects it as far as that can be trusted. Where a micro-image seems worse by what noise
does not explain, it is: what a denoiser is wrong by where it meets an edge or an emitter is large in few pixels, where
the samples themselves are good. One of few pixels, in a corner of the panel, may differ by chance.

Seen light that goes past the denoiser has its own noise: where one half has met what the other has not, there is as
a rule more that neither has met. Errors that rest on such outliers widen the interval downward, as those of samples.

The constants were chosen on ``benchmarks/hard_scenes.py``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.estimate.bias_posterior import likely_error
from lippmann.rendering.estimate.pixel_errors import CROSS_NOISE, ErrorSums, PixelErrors, parts_with_pixels
from lippmann.rendering.estimate.psnr import (
    DRAWS,
    FEWEST_AMONG_MIRRORS,
    LEAN,
    MODEL_UNCERTAINTY,
    NO_MARGIN,
    NORMAL_95,
    Estimate,
    Margin,
    PartErrors,
    PictureEstimator,
    margin_among_mirrors,
    neighbourhood,
    psnr_of,
)

Real = NDArray[np.float64]

#: How far a micro-image's difference between the halves is drawn to its neighbours', as a power.
TOWARDS_NEIGHBOURS = 0.25
#: How far micro-images are from the proportion to that, as a relative variance.
SPREAD = 0.5
#: A micro-image seems worse than in proportion from so many squared deviations of its measurement on, and ...
WORSE_FROM = 2.0
#: ... so many times the squares of its samples' errors: hits that are rare and strong show in these, too.
EXPLAINED = 400.0
#: Pixels that one micro-image has fewer than the usual one count so many times, for its error to be another one.
FEW = 40.0
#: By how much more than what outliers of seen light show the error may be: on heaps of mirror balls under small
#: emitters, of few samples, there was up to that much more.
SEEN_DOUBT = 1.5
#: As parts of the error stated for all and for the worst: pictures that are hard to judge are often better by that.
OFTEN_BETTER, WORST_OFTEN_BETTER = 0.8, 0.6


class DenoisedEstimator(PictureEstimator):
    """Estimates for denoised pictures; their errors carry those of the samples, and what the halves differ by."""

    #: With these intervals are honest on scenes that are hard to judge.
    first = fewest = 2

    def expect_mirrors(self) -> None:
        """Trust without a margin later: sharp surfaces may mirror emitters."""
        self.fewest = FEWEST_AMONG_MIRRORS

    def margin(self, samples: int) -> Margin:
        """By how many dB the estimate of a picture of ``samples`` must be better than what is asked for."""
        return NO_MARGIN if samples >= self.fewest else margin_among_mirrors(samples)

    def estimate(self, errors: PixelErrors) -> Estimate:
        """PSNR of the whole and of the worst micro-image."""
        assert errors.samples is not None
        return estimate_denoised(self._sums(errors), self._sums(errors.samples), (self._rows, self._columns))


def estimate_denoised(judged: ErrorSums, samples: ErrorSums, grid: tuple[int, int]) -> Estimate:
    """PSNR of the whole and of the worst part, from what the halves say of each other and from the samples' errors."""
    index, judged = parts_with_pixels(judged)
    _, samples = parts_with_pixels(samples)
    pixels = float(judged.pixels.sum())
    by_chance, error = float(judged.apart.sum()) / pixels, float(judged.values.sum()) / pixels
    deviation = math.sqrt(CROSS_NOISE.estimate * float(judged.squares.sum())) / pixels
    of_samples = max(float(samples.values.sum()), 1e-30)
    outliers = min(1.0, float(samples.outliers.sum()) / of_samples)
    # Halves that differ by less than a 10 000th of their samples' errors do so for another reason than vanished noise.
    likely = likely_error(max(by_chance, 1e-4 * of_samples / pixels), error - by_chance, deviation, outliers)
    middle = float(likely.quantiles(0.5))
    model = math.exp(NORMAL_95 * MODEL_UNCERTAINTY)
    # What no half has met is in no difference between them.
    doubt = 1 + SEEN_DOUBT * min(1.0, float(judged.outliers.sum()) / (middle * pixels))
    often_better = OFTEN_BETTER * (1 - judged.share_less(middle))
    worse, better = likely.quantiles(np.array([0.975, 0.025])) * (model * doubt, often_better / model)

    parts = _parts(judged, samples.squares, index, grid, middle)
    drawn = _worst_drawn(parts, likely.quantiles((np.arange(DRAWS) + 0.5) / DRAWS) / middle)
    worst = np.quantile(drawn, (0.5, 0.975, 0.025))  # what is stated, and the ends of its interval
    row, column = divmod(int(index[np.argmax(parts.expected)]), grid[1])
    psnr, psnr_low, psnr_high = (float(value) for value in psnr_of(np.array([middle, worse, better])))
    of_worst, worst_low, worst_high = (float(value) for value in psnr_of(worst * (1, 1, WORST_OFTEN_BETTER)))
    return Estimate(psnr, psnr_low, psnr_high, of_worst, worst_low, worst_high, (column, row))


def _worst_drawn(parts: PartErrors, common: Real) -> Real:
    """Errors of the worst part, as often as is drawn; ``common`` are the factors that all parts may have alike."""
    random = np.random.default_rng(2)
    model = np.exp(MODEL_UNCERTAINTY * random.standard_normal(DRAWS))
    drawn: Real = parts.draws().max(axis=0) * common[random.permutation(DRAWS)] * model
    return drawn


def _parts(
    judged: ErrorSums, of_samples: Real, index: NDArray[np.intp], grid: tuple[int, int], mean: float
) -> PartErrors:
    """Each part's error: in proportion to what its halves differ by, drawn from there to its own measurement.

    ``mean`` is that of all; ``of_samples`` are the sums of the squares of the samples' errors.
    """
    count = judged.pixels
    measured, apart = judged.values / count, judged.apart / count
    (near,), _ = neighbourhood(apart[None], index, grid)
    least = 1e-3 * float(judged.apart.sum() / count.sum()) + 1e-30
    around = np.maximum(apart, least) ** (1 - TOWARDS_NEIGHBOURS) * np.maximum(near, least) ** TOWARDS_NEIGHBOURS
    around *= mean / float((around * count).sum() / count.sum())
    # The mean square of one part is noisy itself: it leans on what all have, in proportion.
    overall = float(judged.squares.sum()) / float((np.square(around) * count).sum())
    noise = CROSS_NOISE.estimate * (judged.squares + LEAN * overall * np.square(around)) / (count + LEAN) / count

    explained = WORSE_FROM * noise + EXPLAINED * of_samples / np.square(count)
    other = np.where(measured > around, np.square(measured - around) - explained, 0.0)
    between = np.maximum(SPREAD * np.square(around), other)
    trust = between / (between + noise)
    expected = np.maximum(around + trust * (measured - around), 0.2 * around)
    variance = np.log1p(trust * noise / np.square(expected))
    fewer = np.maximum(1 / count - 1 / np.median(count), 0)
    doubted = expected + SEEN_DOUBT * np.clip(judged.outliers / count, 0, expected)
    return PartErrors(index, expected, doubted, variance, np.log1p(FEW * fewer))
