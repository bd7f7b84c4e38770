"""Unfiltered samples of a picture at the centres of all lenses, for comparison with renders of the same rays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lippmann.display import NUMPY
from lippmann.image.views import view_grid
from lippmann.viewing.replay import check_eye, eye_of_offset, is_on_panel, pixel_at


@dataclass(frozen=True, eq=False)
class LensSamples:
    """Samples that one eye sees at the centres of all lenses.

    Arrays are ``(lens_rows, lens_cols, ...)``. For a lenticular sheet the rows are the panel's, and the points are on
    the lens's axis where the eye sees the middle of the row.

    Parameters
    ----------
    points:
        ``(..., 2)`` positions in the lens plane, mm.
    pixels:
        ``(..., 2)`` column and row of the pixel seen; may lie off the panel.
    offsets:
        ``(..., 2)`` offset right and down of the point seen from that pixel's centre, in pixels.
    colors:
        ``(..., 3)`` linear RGB of the pixel; zero off the panel.
    own:
        True if the pixel is on the panel and belongs to the lens; otherwise the eye is outside the lens's field.
    """

    points: np.ndarray
    pixels: np.ndarray
    offsets: np.ndarray
    colors: np.ndarray
    own: np.ndarray


def replay_at_lens_centers(image, eye):
    """Unfiltered samples at the centres of all lenses, for comparison with renders of the same rays."""
    eye = check_eye(eye)
    display = image.display
    x, y, i, j = _lens_points(display, eye)
    panel_x, panel_y = display.visible_panel_point(*eye, x, y, NUMPY)
    u, v = display.pixel_coordinates(panel_x, panel_y)
    column, row = pixel_at(u), pixel_at(v)
    owner_i, owner_j = display.lens_of(*display.panel_point(column + 0.5, row + 0.5), NUMPY)
    inside = is_on_panel(display, column, row)
    colors = np.zeros((*x.shape, 3), dtype=np.float32)
    colors[inside] = image.take(row[inside], column[inside])
    return LensSamples(
        points=np.stack([x, y], axis=-1),
        pixels=np.stack([column, row], axis=-1),
        offsets=np.stack([u - (column + 0.5), v - (row + 0.5)], axis=-1),
        colors=colors,
        own=inside & (owner_i == i) & (owner_j == j),
    )


def _lens_points(display, eye):
    """Points ``(x, y)`` of the lens plane to look at, one per lens, and the lenses ``(i, j)``."""
    grid, lattice = display.lens_grid, display.lattice
    if lattice.layout != "lenticular":
        j, i = np.indices((grid.rows, grid.columns)).astype(np.float64)
        x, y = lattice.center(i, j, 0.0 * i, 0.0 * j, NUMPY)
        return x, y, i, j
    row, i = np.indices((display.panel.height, grid.columns)).astype(np.float64)
    _, panel_y = display.panel_point(0.0 * row, row + 0.5)
    # The line from the eye meets the panel at y + (y - eye_y) g / eye_z.
    scale = display.gap / eye[2]
    y = (panel_y + eye[1] * scale) / (1 + scale)
    across = lattice.origin_x + i * lattice.pitch
    slant = math.radians(lattice.slant)
    return across / math.cos(slant) + y * math.tan(slant), y, i, 0.0 * i


def eye_of_view(display, ky, kx):
    """Position ``(x, y, z)`` in mm of the eye that sees view ``(ky, kx)`` through all lenses.

    Its distance is the viewing distance; if that is infinite, :data:`FAR`.
    """
    grid = view_grid(display)
    return eye_of_offset(display, grid.right[kx], grid.down[ky])
