"""Tuned constants of adaptive sampling, each with its unit and the benchmark that set it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AdaptiveTuning:
    """Constants of the stopping rule.

    Attributes
    ----------
    least_growth, most_growth:
        Factors on the samples by which one round grows: smaller ones cost an assessment each, larger ones overshoot
        (``goals.py``).
    denoised_slope:
        Power of the sample count by which squared errors of denoised pictures fall: 0.5 to 0.8 where it was measured
        (``equal_error.py``); that of Monte Carlo noise is 1.
    tolerance:
        dB by which a quality that was asked for may be missed, but with a probability of 2.5 %
        (``estimate_coverage.py``).
    most_below:
        dB that a micro-image may have less than the quality that the whole picture is to have.
    time_share:
        Share of the time left that a round is planned to take: rates vary from round to round.
    clean:
        Estimated PSNR in dB that a default picture is to have (``docs/research/equal-time.md``).
    """

    least_growth: float = 1.2
    most_growth: float = 4.0
    denoised_slope: float = 0.6
    tolerance: float = 1.0
    most_below: float = 12.0
    time_share: float = 0.9
    clean: float = 37.0


TUNING = AdaptiveTuning()
