"""Tuned constants of the filters across lenses and views, each with its unit and the benchmark that set it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SharingTuning:
    """Constants of the filters across lenses, and across the views of a quilt.

    Weights across lenses are ``(1 - sum / faded)^8`` for a sum of squared differences, which is nearly
    ``exp(-8 sum / faded)`` and takes a fraction of its time.

    Attributes
    ----------
    reach:
        Lenses to either side whose micro-images are filtered.
    faded:
        Sum of squared differences at which a weight is 0. Distances count in pixels; a squared difference of normals of
        1 alone makes the weight 0.
    stop:
        Weight of a squared relative difference of light: between 30 and 200 it moves the PSNR of the bundled scenes by
        less than 0.5 dB (docs/research/pooled-light.md).
    of_height:
        Unit of differences of height: this share of the height, plus the gap across lenses.
    view_reach:
        Largest angle in radians between cameras whose views are filtered; larger ones smear highlights.
    other_normal:
        Squared difference of unit normals at which surfaces count as different ones: an angle of 25 degrees.
    view_pixels:
        Heights across views also count as alike within this length, in pixels.
    """

    reach: int = 4
    faded: float = 10.0
    stop: float = 60.0
    of_height: float = 0.02
    view_reach: float = 0.07
    other_normal: float = 0.19
    view_pixels: float = 2.0


TUNING = SharingTuning()
