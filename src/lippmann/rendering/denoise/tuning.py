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
        Linear value above which light bypasses the network, white being 1: the network would spread it over the pixels
        around (docs/research/seen-light.md).
    reaches:
        Pixels to each side over which halves are compared, in a near and in a far neighbourhood.
    far_above:
        Multiple of the halves' mean difference nearby by which a pixel must exceed its samples to be far brighter: then
        the finite difference of codes replaces the slope of the curve.
    hidden:
        Difference in codes between a half-buffer and its denoised version beyond which the half cannot measure the
        pixel's bias; larger with fewer samples, whose outliers are more often real light (``estimate_coverage.py``).
    untold_outliers:
        Share of the samples' error that is assumed to rest on outliers where too few batches reveal them
        (docs/research/first-statements.md).
    """

    runs: float = 3.0
    guide_samples: int = 12
    far_beyond_white: float = 8.0
    reaches: tuple[int, int] = (2, 8)
    far_above: float = 4.0
    hidden: float = 8.0
    assumed_outliers: float = 0.25


TUNING = DenoiseTuning()
