"""Tuned constants of adaptive sampling, each with its unit and the benchmark that set it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AdaptiveTuning:
    """Constants of the stopping rule and of the reserve of samples.

    Attributes
    ----------
    step:
        Samples per pixel: rounds end at multiples of it, so that all batches get the same (the number of batches).
    first_look, first_look_costly:
        Samples per pixel before a denoised picture is first assessed: few where a sample is costly beside the network
        (photons, chains of seen light) or the goal is modest (``goals.py``).
    least_growth, most_growth:
        Factors on the samples by which one round grows: smaller ones cost an assessment each, larger ones overshoot
        (``goals.py``).
    surer_growth:
        The most where the quality is likely there and only the interval is too wide: intervals narrow faster than
        pictures converge (``goals.py``).
    denoised_slope:
        Power of the sample count by which squared errors of denoised pictures fall: 0.5 to 0.8 where it was measured
        (``equal_error.py``); that of Monte Carlo noise is 1.
    slope_range:
        Powers that are believed of two noisy estimates.
    tolerance:
        dB by which a quality that was asked for may be missed, but with a probability of 2.5 %
        (``estimate_coverage.py``).
    most_below:
        dB that a micro-image may have less than the whole picture for which a quality was asked.
    time_share:
        Share of the time left that a round is planned to take: rates vary from round to round.
    modest_quality:
        PSNR in dB that a default picture has anyway (``defaults.py``).
    clean:
        Estimated PSNR in dB from which on a default picture gets no more samples, and for which they are reckoned.
        The estimate is of light before tone mapping, which brings out the noise of highlights by up to 1.5 dB
        (``docs/research/equal-time.md``).
    clean_worst:
        Estimated PSNR in dB from which on the worst micro-image needs no more samples, and for which they are reckoned.
    """

    step: int = 8
    first_look: int = 4
    first_look_costly: int = 2
    least_growth: float = 1.2
    most_growth: float = 4.0
    surer_growth: float = 2.0
    denoised_slope: float = 0.6
    slope_range: tuple[float, float] = (0.3, 1.2)
    tolerance: float = 1.0
    most_below: float = 12.0
    time_share: float = 0.9
    modest_quality: float = 34.0
    clean: float = 35.0
    clean_worst: float = 25.0


TUNING = AdaptiveTuning()
