"""Tuned constants of the preparation of light, each with its unit, the benchmark that set it and what others cost."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PreparationTuning:
    """Constants of specular chains, exposure, emitter weights, photon passes and light vertices.

    Attributes
    ----------
    chains:
        Specular chains with each path of a denoised picture. With 3, pictures of 16 samples lose up to 0.2 dB, and
        1.0 dB of primitives; with 2 up to 0.5 dB, and primitives 1 dB (docs/research/seen-light.md).
    most_weighed_emitters:
        Scenes with more emitters sample them uniformly.
    mid_grey:
        Linear value that the median of lit pixels gets: photographic mid-grey.
    exposure_block:
        Pixels along each side of a block. The exposure follows from the median of block means over lit pixels, as
        single pixels are too noisy.
    pass_samples:
        Samples per pixel that one pass of photons, or one set of light vertices, serves.
    kept_share:
        Share of the memory for cached photon passes, which tiles and bands of a picture use in turn.
    """

    chains: int = 4
    most_weighed_emitters: int = 1 << 10
    mid_grey: float = 0.18
    exposure_block: int = 16
    pass_samples: int = 16
    kept_share: float = 0.25


TUNING = PreparationTuning()
