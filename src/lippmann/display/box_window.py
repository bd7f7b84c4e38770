"""Where on a panel, or in the views of a quilt, a box can be seen: around that window nothing is to be traced."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.display.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.display.view_cone import cone_tangent

#: Pixels about the scene's outline, so that a denoiser sees what the scene stands before.
_MARGIN = 8


def view_window(corners: NDArray[np.float64], display: Display, view_size: tuple[int, int]) -> PixelWindow | None:
    """The smallest window in which all cameras of a quilt see all of a box; None if it is not much smaller than a view.

    A camera with the direction s = x / D to the display's middle sees the point (x, y, z) in the lens plane at
    ``((x - s z) / (1 - z / D), y / (1 - z / D))``.
    """
    if not np.isfinite(corners).all():
        return None
    # What stands in front of where rays begin is not seen.
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
    # Sub-pixels lie up to a pixel beside their own.
    margin = math.ceil(reach / panel.pixel_pitch) + 1 + _MARGIN
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
