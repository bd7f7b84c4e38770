"""The view zone: the directions in which a display shows its own micro-images."""

from __future__ import annotations

import math

from lippmann.display.display import Display

#: Degrees to which programs that render quilts narrow the cone of newer panels, so that neighbouring views fuse: in 50
#: degrees the same views lie farther apart (``STANDARD_VIEW_CONE`` of quiltwright, 2026).
FUSED_CONE = 35.0


def view_cone(display: Display) -> float:
    """Degrees over which an eye that moves level sees a display's own views."""
    return 2.0 * math.degrees(math.atan(zone_slopes(display)[0]))


def depth_gain_of_fused_cone(display: Display) -> float:
    """Resolved depth in :data:`FUSED_CONE` over that in the display's own cone, of the same panel and lenses.

    The depth in which a point spreads over at most one lens grows with the gap, and that as the cone's tangent falls.
    """
    return zone_slopes(display)[0] / math.tan(math.radians(FUSED_CONE) / 2.0)


def cone_in_words(cone: float, gain: float) -> str:
    """A view cone in degrees, and what :func:`depth_gain_of_fused_cone` says if it is wider than that."""
    is_wide = cone > FUSED_CONE + 0.5  # a nominal cone is 35 after rounding
    fused = f" (in {FUSED_CONE:.0f}, {gain:.1f} times as much would fuse)" if is_wide else ""
    return f"in a view cone of {cone:.0f} degrees{fused}"


def cone_tangent(display: Display) -> float:
    """Tangent of half the angle over which an eye sees a lenticular display's own views as it moves level, sideways.

    ``(p (D + g) / D) / (2 g cos slant)``: an eye at the viewing distance that moves by x to the side moves by x cos
    slant across the lenses. A calibration's ``viewCone`` is twice the angle. At ``x = (2 f - 1) D`` times this tangent
    the eye sees, through every lens, the fraction f of its micro-image, counted from the right edge.
    """
    return (
        0.5
        * display.micro_image_pitch
        * display.edge_factor
        / (display.gap * math.cos(math.radians(display.lens_array.slant)))
    )


def zone_slopes(display: Display) -> tuple[float, float]:
    """Largest slopes, sideways and up, of a display's light lines and views against the line to the viewing point.

    A display shows a point at height z over the lens plane within ``z`` times these slopes of where its middle view
    shows it. Micro-lenses: half a micro-image over the gap. Lenticular sheets: what their light lines reach across the
    slanted axis, and eyes that move level over the whole of :func:`cone_tangent`.
    """
    across, along = (
        edge * display.magnification * display.edge_factor / display.gap for edge in display.lens_array.half_cell
    )
    return (cone_tangent(display) if display.lens_array.layout == "lenticular" else across), along


def size_seen(display: Display) -> tuple[float, float]:
    """Width and height in mm of the part of the lens plane whose micro-images lie on the panel."""
    width, height = display.size_mm
    return width / display.magnification, height / display.magnification
