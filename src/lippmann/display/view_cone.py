"""The cone of views of a display: its slopes, and the window of a panel or of views in which a box is seen."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.display.display import Display
from lippmann.display.panel import PixelWindow

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


def visible_size(display: Display) -> tuple[float, float]:
    """Width and height in mm of the part of the lens plane whose micro-images lie on the panel."""
    width, height = display.size_mm
    return width / display.magnification, height / display.magnification


#: Pixels about the scene's outline, so that a denoiser sees what the scene stands before.
_MARGIN = 8


def view_window(corners: NDArray[np.float64], display: Display, view_size: tuple[int, int]) -> PixelWindow | None:
    """The smallest window in which all cameras of a quilt see all of a box; None if it is not much smaller than a view.

    A camera with the direction s = x / D to the display's middle sees the point (x, y, z) in the lens plane at
    ``((x - s z) / (1 - z / D), y / (1 - z / D))``.
    """
    if not np.isfinite(corners).all():
        return None
    # Rays begin at the aperture: they cannot meet what stands in front of it.
    z = np.minimum(corners[:, 2], display.aperture_distance)
    nearness = 1 - z / display.viewing_distance
    side = cone_tangent(display) * np.array([[-1.0], [1.0]])
    x, y = (corners[:, 0] - side * z) / nearness, corners[:, 1] / nearness
    (panel_width, panel_height), (width, height) = display.size_mm, view_size
    return _window((0.5 + x / panel_width) * width, (0.5 - y / panel_height) * height, view_size, _MARGIN)


def panel_window(corners: NDArray[np.float64], display: Display) -> PixelWindow | None:
    """The smallest window that holds all pixels of a display which can see something of a box; None if that is most.

    A light line that meets the lens plane at L has the slope ``L / D + e``, where e is that of its place under its
    lens, and meets (x, y, z) if ``L = (x + e z) / (1 - z / D)``; its pixel lies within half a micro-image of
    ``L (D + g) / D``.
    """
    if not np.isfinite(corners).all():
        return None
    z = np.minimum(corners[:, 2], display.aperture_distance)
    lenses, panel = display.lens_array, display.panel
    across = display.micro_image_pitch
    down = 0.0 if lenses.layout == "lenticular" else lenses.row_spacing * display.magnification
    # From the middle of a micro-image to its farthest corner; hexagons reach a little beyond their rows.
    reach = math.hypot(across, 4 / 3 * down) / 2
    slant = math.radians(lenses.slant)
    # Cylinders bend across their axis only.
    shares = (math.cos(slant), math.sin(slant)) if lenses.layout == "lenticular" else (1.0, 1.0)
    either = float(display.pinhole_place(reach)) / display.gap * np.array([[-1.0], [1.0]])
    nearness = (1 - z / display.viewing_distance) / display.magnification
    x, y = ((corners[:, axis] + share * either * z) / nearness for axis, share in enumerate(shares))
    columns = x / panel.pixel_pitch + panel.width / 2
    rows = panel.height / 2 - y / panel.pixel_pitch
    # Rays of real lenses start as far beside their middles. Sub-pixels lie up to a pixel beside their own.
    aside = 0.0 if display.lens is None else reach
    margin = math.ceil((reach + aside) / panel.pixel_pitch) + 1 + _MARGIN
    return _window(columns, rows, (panel.width, panel.height), margin)


def _window(
    columns: NDArray[np.float64], rows: NDArray[np.float64], size: tuple[int, int], margin: int
) -> PixelWindow | None:
    left, right = _span(columns, size[0], margin)
    top, bottom = _span(rows, size[1], margin)
    window = PixelWindow(left, top, right - left, bottom - top)
    return window if window.pixels < 0.9 * size[0] * size[1] else None  # a larger one saves nothing


def _span(places: NDArray[np.float64], count: int, margin: int) -> tuple[int, int]:
    """First pixel and the one past the last that hold the places (in pixels) with a margin; at least one pixel."""
    first = min(max(0, math.floor(places.min()) - margin), count - 1)
    last = max(min(count, math.ceil(places.max()) + margin), first + 1)
    return first, last
