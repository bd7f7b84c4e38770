"""Tuned constants of plans: samples and qualities where none are asked for, with the benchmark that set each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RequestTuning:
    """Constants of the number of samples.

    Attributes
    ----------
    usual:
        Default samples per pixel of a picture whose light is not pooled, and the largest default of one whose light is
        (``docs/research/equal-time.md``). From this number on the network runs at high effort, which costs the time of
        12 rays per pixel and gains 0.7 dB on average (``docs/background/denoising.md``). With fewer samples all may
        miss rare light such as mirrored emitters.
    fewest:
        Smallest default of samples per pixel of a pooled picture: with fewer the worst micro-images are noisy, and
        outliers cannot be recognized. Sub-pixels with rays of their own have one sample less each, or two less if they
        number over ``values * usual`` (``docs/research/adaptive-sampling.md``).
    values:
        Samples of a pooled picture, of all its pixels together: half a second of two cores (``defaults.py``).
    reserve, most_in_reserve:
        Factor on the samples up to which a picture that is not clean takes more, and the most samples of all pixels
        together that this may come to: minutes of two cores.
    final_quality:
        PSNR in dB, by its own estimate, of a picture of the effort ``final``: noise of 2.5 codes of 8 bits, which a
        print hides (``goals.py``).
    final_most:
        Most samples per pixel of such a picture, with which it stops short of the quality.
    final_samples:
        Samples per pixel of one where no estimate says when to stop: tiles, forecasts, plain pictures, reprojection.
    """

    usual: int = 16
    fewest: int = 4
    values: int = 1 << 20
    reserve: int = 8
    most_in_reserve: int = 200_000_000
    final_quality: float = 40.0
    final_most: int = 256
    final_samples: int = 64


TUNING = RequestTuning()
