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
        A sample is an outlier if it makes up this part of the batches' differences, relative to the most that a single
        sample can make up, ``(batches - 1) / batches``, and moves the code by at least the step. Below the step the
        transfer curve is nearly straight, and what samples of that size miss elsewhere is small as well.
    outlier_doubt:
        Relative increase of the upper end of the error where all of it rests on outliers.
    doubt_among_mirrors:
        dB by which the PSNR of a picture and of its worst micro-image may be lower than stated among mirrors, where
        fewer than the usual number of samples may all miss a mirrored emitter.
    model_uncertainty:
        Standard deviation of the logarithm of the error for what the model leaves out, such as clipping.
    often_better:
        Factor on the lower end of the interval of the squared error, squared for the worst micro-image: denoised
        pictures are often better than estimated.
    usual_ratio, outlier_ratio:
        Bias of a denoised picture over the variance between its halves, where no hit is an outlier, and where all are.
    ratio_scale:
        Scale of the prior of that ratio's logarithm, a t distribution.
    freedom:
        Degrees of freedom of that distribution, and of the measurement's: heavy tails, as single hits decide it.
    neighbour_power:
        Exponent of the neighbours' variance in a micro-image's prior, a weighted geometric mean with its own variance.
    part_variance:
        Relative prior variance of a micro-image's error about that prior.
    noise_factor, outlier_factor:
        A micro-image gets a larger prior variance where its squared deviation exceeds ``noise_factor`` times the
        variance of its measurement plus ``outlier_factor`` times the mean square of its samples' errors, in which rare
        and strong hits show.
    prior_pixels:
        Weight, in pixels, of the prior that a micro-image is as noisy as others. Also the numerator of the extra
        variance of micro-images with fewer pixels than the median one.
    draws:
        Random draws from the posterior of the worst micro-image.
    """

    outlier_share: float = 0.8 * 8 / 7
    outlier_step: float = 0.15
    outlier_doubt: float = 0.8
    doubt_among_mirrors: tuple[float, float] = (5.0, 7.0)
    model_uncertainty: float = 0.08
    often_better: float = 0.8
    usual_ratio: float = 3.0
    outlier_ratio: float = 10.0
    ratio_scale: float = 0.6
    freedom: float = 4.0
    neighbour_power: float = 0.25
    part_variance: float = 0.5
    noise_factor: float = 2.0
    outlier_factor: float = 400.0
    prior_pixels: float = 64.0
    draws: int = 2000


TUNING = EstimateTuning()
