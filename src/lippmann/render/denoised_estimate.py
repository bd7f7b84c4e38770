"""How good a denoised picture is by its own account.

Its halves judge each other (:mod:`lippmann.render.denoised`), which is right on the average but far noisier than what
it measures: strong single hits of the one half meet the smooth other half. Four things keep the statement honest:

- An error cannot be negative. From a measured mean and its uncertainty follows the mean of a normal distribution that
  is cut at zero, which is never below what the uncertainty alone would allow.
- Where a micro-image's own measurement says little, its error is taken to be in proportion to that of the samples which
  the picture was made of: that is known far better, and says where the scene is hard.
- Light that only lone hits have found is as unknown to the denoiser as to anybody. Of the error that those make up in
  the samples, a part is taken to be left, and a larger one is doubted; the better end of an interval is without it.
- A micro-image of few pixels, in a corner of the panel, may differ by chance from what its samples let expect.

The constants were chosen on ``benchmarks/hard_scenes.py``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.render.estimate import (
    CROSS_NOISE,
    DRAWS,
    LEAN,
    LOW_QUANTILE,
    MODEL_UNCERTAINTY,
    NORMAL_95,
    OWN_NOISE,
    ErrorSums,
    Estimate,
    PartErrors,
    PictureEstimator,
    PixelErrors,
    cut_at_zero,
    errors_of_parts,
    parts_with_pixels,
    psnr_of,
)

Real = NDArray[np.float64]

#: Of the error that lone hits make up in the samples: what denoising leaves, and what of it is doubted.
LONE_LEFT, LONE_DOUBTED = 0.1, 0.5
#: How far micro-images are from the proportion to their samples, as a relative variance, where nothing tells; and by
#: how much that is itself uncertain.
USUAL_SPREAD, SPREAD_DOUBT = 0.5, 0.4
#: Squared deviations from which on a micro-image that seems worse than in proportion is taken to be so.
OTHER_FROM = 2.0
#: Pixels that one micro-image has fewer than the usual one count so many times, for its error to be another one.
FEW = 16.0
#: As a part of the error stated: pictures that are hard to judge are often better than that by so much.
OFTEN_BETTER = 0.5
#: A picture without any error still has this mean squared one, so that its logarithm exists.
_FLOOR = 1e-12


class DenoisedEstimator(PictureEstimator):
    """Estimates for denoised pictures; their errors carry those of the samples."""

    #: Intervals are wide where samples are few: with 8 none flattered, on scenes that are hard to judge.
    fewest = 8

    def estimate(self, errors: PixelErrors) -> Estimate:
        """PSNR of the whole and of the worst micro-image."""
        assert errors.samples is not None
        return estimate_denoised(self._sums(errors), self._sums(errors.samples), (self._rows, self._columns))


def estimate_denoised(judged: ErrorSums, samples: ErrorSums, grid: tuple[int, int]) -> Estimate:
    """PSNR of the whole and of the worst part, from what the halves say of each other and from the samples' errors."""
    index, judged = parts_with_pixels(judged)
    _, samples = parts_with_pixels(samples)
    pixels = float(judged.pixels.sum())
    deviation = math.sqrt(CROSS_NOISE.estimate * float(judged.squares.sum())) / pixels
    lone = float(samples.lone.sum()) / pixels
    measured = max(cut_at_zero(float(judged.values.sum()) / pixels, deviation), _FLOOR)
    mean = max(measured, LONE_LEFT * lone)
    worse, better = (math.log1p((deviation / value) ** 2) for value in (mean, measured))
    spreads = [NORMAL_95 * math.sqrt(variance + MODEL_UNCERTAINTY**2) for variance in (worse, better)]
    ends = mean * math.exp(spreads[0]) + LONE_DOUBTED * lone, OFTEN_BETTER * measured * math.exp(-spreads[1])

    of_samples = errors_of_parts(samples, index, grid, OWN_NOISE).expected
    parts = _parts(judged, of_samples, index, mean, samples.lone)
    at_best = _parts(judged, of_samples, index, measured, np.zeros_like(samples.lone))
    worst = np.array(
        [
            *np.quantile(_worst_drawn(parts, worse), (0.5, 0.975)) * (1, 1 + MODEL_UNCERTAINTY),
            np.quantile(_worst_drawn(at_best, better), LOW_QUANTILE) * OFTEN_BETTER / (1 + MODEL_UNCERTAINTY),
        ]
    )
    row, column = divmod(int(index[np.argmax(parts.expected)]), grid[1])
    psnr, psnr_low, psnr_high = (float(value) for value in psnr_of(np.array([mean, *ends])))
    of_worst, worst_low, worst_high = (float(value) for value in psnr_of(worst))
    return Estimate(psnr, psnr_low, psnr_high, of_worst, worst_low, worst_high, (column, row))


def _worst_drawn(parts: PartErrors, common: float) -> Real:
    """Errors of the worst part, as often as is drawn, where all are uncertain by the log variance ``common`` alike."""
    drawn: Real = parts.draws().max(axis=0)
    return drawn * np.exp(math.sqrt(common) * np.random.default_rng(2).standard_normal(DRAWS))


def _parts(judged: ErrorSums, of_samples: Real, index: NDArray[np.intp], mean: float, lone: Real) -> PartErrors:
    """Each part's error: in proportion to its samples' error, drawn from there to its own measurement.

    ``mean`` is that of all; ``lone`` what lone hits make up of the sums of the samples' errors.
    """
    count = judged.pixels
    measured = judged.values / count
    around = of_samples * mean / float((of_samples * count).sum() / count.sum())
    # The mean square of one part is noisy itself: it leans on what all have, in proportion.
    overall = float(judged.squares.sum()) / float((np.square(around) * count).sum())
    noise = CROSS_NOISE.estimate * (judged.squares + LEAN * overall * np.square(around)) / (count + LEAN) / count

    relative = noise / np.square(around)
    # By the median, as a few parts differ from all: that of squared normal values is 0.455 of their variance.
    shown = float(np.median(np.square(measured / around - 1) / 0.455 - relative))
    doubt = 2.3 * (float(np.median(relative)) + USUAL_SPREAD) * math.sqrt(2 / len(count))
    weight = SPREAD_DOUBT**2 / (SPREAD_DOUBT**2 + doubt**2)
    usual = max(0.02, weight * shown + (1 - weight) * USUAL_SPREAD)
    # Where a part seems worse, that is believed early: what a denoiser is wrong by where it meets an edge or a lamp is
    # not in proportion to the samples, and looks like noise, as it is large in few pixels.
    other = np.where(measured > around, np.square(measured - around) - OTHER_FROM * noise, 0.0)
    between = np.maximum(usual * np.square(around), other)
    trust = between / (between + noise)
    lone = lone / count
    expected = np.maximum(around + trust * (measured - around), np.maximum(0.1 * around, LONE_LEFT * lone))
    variance = np.log1p(trust * noise / np.square(expected))
    fewer = np.maximum(1 / count - 1 / np.median(count), 0)
    return PartErrors(index, expected, expected + LONE_DOUBTED * lone, variance, np.log1p(FEW * fewer))
