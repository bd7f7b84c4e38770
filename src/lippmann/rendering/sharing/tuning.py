"""Tuned constants of shared light, each with its unit and the benchmark that set it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SharingTuning:
    """Constants of light that is shared across lenses, and across the views of a quilt.

    Weights are ``(1 - sum / faded)^8`` for a sum of squared differences, which is nearly ``exp(-8 sum / faded)`` and
    takes a fraction of its time.

    Attributes
    ----------
    reach:
        Lenses to either side from which light is fetched.
    faded:
        Sum from which on nothing is shared. Differences of place count in pixels, of normals as much as that a right
        angle is far too much.
    stop:
        Weight of a squared relative difference of light: between 30 and 200 it moves the PSNR of the bundled scenes by
        less than 0.5 dB (docs/research/pooled-light.md).
    of_height:
        Heights count as alike within this share of the height, and the gap.
    view_reach:
        How far light is fetched across views, in radians between cameras; farther, highlights are smeared.
    other_normal:
        Squared difference of normals from which on they are those of different surfaces: an angle of 25 degrees.
    view_pixels:
        Heights across views count as alike within so many pixels, too.
    """

    reach: int = 4
    faded: float = 10.0
    stop: float = 60.0
    of_height: float = 0.02
    view_reach: float = 0.07
    other_normal: float = 0.19
    view_pixels: float = 2.0


TUNING = SharingTuning()
