"""The cone in which a lenticular display shows its own views, for eyes that move sideways."""

from __future__ import annotations

import math

from lippmann.display.display import Display


def cone_tangent(display: Display) -> float:
    """Tangent of half the angle over which an eye sees a lenticular display's own views as it moves level, sideways.

    ``(p (D + g) / D) / (2 g cos slant)``: an eye at the viewing distance that moves by x to the side moves by x cos
    slant across the lenses. A calibration's ``viewCone`` is twice the angle. At ``x = (2 f - 1) D`` times this tangent
    the eye sees, through every lens, the fraction f of its micro-image, counted from the right edge.
    """
    return 0.5 * display.micro_image_pitch / (display.gap * math.cos(math.radians(display.lens_array.slant)))
