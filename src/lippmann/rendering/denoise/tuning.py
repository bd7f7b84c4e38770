"""Tuned constants of denoising, each with its unit, the benchmark that set it and what others cost."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DenoiseTuning:
    """Constants of the denoising network, and of the light that bypasses it.

    Attributes
    ----------
    runs:
        Cost of denoising two half-buffers over that of one run of the network, feature buffers and sharing included.
    guide_samples:
        Samples of a pixel for the guides. With 8 a textured or glossy surface may lose 0.3 dB, and 0.6 dB behind a
        ``[lens]``, where a pixel holds more of the scene; 16 gain up to 0.1 and 0.4 dB.
    far_beyond_white:
        Linear value above which light goes past the network, white being 1: it would make the pixels around white, too
        (docs/research/seen-light.md).
    reaches:
        Pixels to each side over which halves are compared, in a near and in a far neighbourhood.
    far_above:
        A pixel that is brighter than its samples by so many times the halves' mean difference nearby is so by no
        accident: then the step of its code counts.
    hidden:
        Codes by which samples are off that hide what is wrong in their pixel. With fewer than the usual number a single
        one is farther off, and more likely all there is of its light: less is left out then (``estimate_coverage.py``).
    untold_outliers:
        Share of the samples' error that is taken to rest on outliers where too few batches tell them
        (docs/research/first-statements.md).
    """

    runs: float = 3.0
    guide_samples: int = 12
    far_beyond_white: float = 8.0
    reaches: tuple[int, int] = (2, 8)
    far_above: float = 4.0
    hidden: float = 8.0
    untold_outliers: float = 0.25


TUNING = DenoiseTuning()
