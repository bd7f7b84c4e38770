"""How far in front of its lenses a display records, where nobody says."""

from __future__ import annotations

import math

#: Share of a finite viewing distance.
_SHARE = 0.1
#: Otherwise, so many times the depth over which a pixel's light spreads by one lens pitch.
_PITCHES = 2.0


def default_aperture(viewing_distance: float, *, lens_pitch: float, gap: float, pixel_pitch: float) -> float:
    """Aperture distance in mm: room to stand out of the screen, as far as scenes may come toward the viewer.

    A tenth of the viewing distance, or where that is infinite, as far as the display resolves anything at all. Lengths
    in millimetres.
    """
    if math.isfinite(viewing_distance):
        return _SHARE * viewing_distance
    return _PITCHES * lens_pitch * gap / pixel_pitch
