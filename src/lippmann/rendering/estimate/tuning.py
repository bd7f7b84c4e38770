"""Tuned constants of the error estimates, each with its unit and the benchmark that set it.

All were set on ``estimate_coverage.py``, whose scenes are made to mislead estimates.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EstimateTuning:
    """Constants of the jackknife, of intervals, and of the prior of a denoiser's bias.

    Attributes
    ----------
    outlier_share, outlier_step:
        A hit is an outlier if it makes up this part of the largest share of what the batches differ by that one can
        have, ``(batches - 1) / batches``, and moves the code by as much as the step: below it the curve is nearly
        straight, and what is missing elsewhere is small as well.
    outlier_doubt:
        By how much more than what outliers show the error may be: measured where they are most of it.
    doubt_among_mirrors:
        dB by which the PSNR of a picture and of its worst micro-image may be lower than stated among mirrors, where
        fewer than the usual number of samples may all miss a mirrored emitter.
    model_uncertainty:
        What curve and clipping leave of bias, as a share of the error.
    often_better, worst_often_better:
        As parts of the error stated for all and for the worst: pictures that are hard to judge are often better.
    usual_ratio, outlier_ratio:
        Bias of a denoised picture over the variance between its halves, where no hit is an outlier, and where all are.
    ratio_scale:
        Scale of the prior of that ratio's logarithm, a t distribution.
    freedom:
        Its degrees of freedom, and those of the measurement: single hits decide what it says and how sure it seems.
    toward_neighbours:
        How far a micro-image's difference between the halves is drawn to its neighbours', as a power.
    spread:
        How far micro-images are from the proportion to that, as a relative variance.
    worse_from, explained:
        A micro-image is worse than in proportion from so many squared deviations of its measurement on, and so many
        times the squares of its samples' errors: hits that are rare and strong show in these, too.
    few:
        Pixels that one micro-image has fewer than the usual one count so many times, for its error to be another one.
    lean:
        Weight, in pixels, of the prior that a micro-image is as noisy as others.
    draws:
        Micro-images that may be the worst are drawn this many times.
    """

    outlier_share: float = 0.8 * 8 / 7
    outlier_step: float = 0.15
    outlier_doubt: float = 0.8
    doubt_among_mirrors: tuple[float, float] = (5.0, 7.0)
    model_uncertainty: float = 0.08
    often_better: float = 0.8
    worst_often_better: float = 0.6
    usual_ratio: float = 3.0
    outlier_ratio: float = 10.0
    ratio_scale: float = 0.6
    freedom: float = 4.0
    toward_neighbours: float = 0.25
    spread: float = 0.5
    worse_from: float = 2.0
    explained: float = 400.0
    few: float = 40.0
    lean: float = 64.0
    draws: int = 2000


TUNING = EstimateTuning()
