"""Denoised light, shared by all micro-images that show the same surface.

What a denoiser leaves of the noise in one micro-image or view, it leaves by chance: in the next one, which had samples
of its own, it is wrong another way. So every pixel takes the mean of its own light and of that which other lenses, and
the pixels around, show at the same point of the scene. The light of a pixel is its colour over its albedo, so that
textures stay where they are.

A point that is seen at height z under one lens lies under its neighbours where the geometry says; along with place,
height and normal must agree, and the light itself roughly: a shadow's edge or a highlight, which moves over the surface
from lens to lens, is not smeared. What is seen in mirrors and through glass counts as lying as far behind as light
travels to it, which is exact for flat ones; where it is not, things do not agree and nothing is shared.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.render.reuse.bands import Bands
from lippmann.render.reuse.sharing import share_rows

if TYPE_CHECKING:
    from lippmann.render.guides import Guides
    from lippmann.render.outline import PixelWindow

Floats = NDArray[np.float32]

#: How far light is fetched, in lenses to either side: of a lenticular sheet, and of an array in each direction.
REACH, REACH_OF_ARRAYS = 4, 3
#: Added to the albedo that colour is divided by: black surfaces that shine have light, too.
_LEAST_ALBEDO = 0.02
#: Rows whose lenses are found at a time.
_BLOCK = 64


def share_light(
    pixels: Floats,
    display: Display,
    guides: Guides,
    *,
    stop: float,
    threads: int,
    lenses: NDArray[np.int32] | None = None,
    subpixels: bool = False,
) -> Floats:
    """A denoised picture whose micro-images have shared their light.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` linear RGB >= 0 of the panel, or of its ``window``, without noise; or ``(H, 3 W, 3)`` of its
        sub-pixels, see :class:`~lippmann.render.rays.SubpixelRays`.
    guides:
        Albedo, normal and height of the same pixels.
    stop:
        Weight of a squared relative difference of light: the less noise is left, the larger it may be.
    threads:
        CPU threads; the result does not depend on them.
    lenses:
        From :func:`lens_numbers`, of a window; None for the whole panel.
    subpixels:
        The pixels are sub-pixels.

    Returns
    -------
    float32 of the same shape.
    """
    albedo = np.clip(guides.albedo, 0, 1) + np.float32(_LEAST_ALBEDO)
    light = np.ascontiguousarray(pixels / albedo, dtype=np.float32)
    shared = np.empty_like(light)
    is_lenticular = display.lens_array.layout == "lenticular"
    reach = (REACH, 0) if is_lenticular else (REACH_OF_ARRAYS, REACH_OF_ARRAYS)
    if lenses is None:
        lenses = lens_numbers(display, subpixels=subpixels)
    centers = _lens_centers(display) * (3 if subpixels else 1, 1)
    with Bands(threads) as bands:
        surface = (guides.normal, guides.height, lenses, centers)
        bands.lines(
            share_rows, len(light), light, *surface, float(display.gap), *reach, is_lenticular, float(stop), shared
        )
    return np.asarray(shared * albedo, dtype=np.float32)


def lens_numbers(display: Display, window: PixelWindow | None = None, *, subpixels: bool = False) -> NDArray[np.int32]:
    """``(H, W)`` number of the lens of every pixel, lenses counted row by row; ``(H, 3 W)`` of every sub-pixel."""
    panel, grid = display.panel, display.lens_grid
    left, top, columns, rows = window or (0, 0, panel.width, panel.height)
    order = panel.subpixel_order if subpixels else (0,)
    result = np.empty((rows, columns, len(order)), dtype=np.int32)
    for first in range(0, rows, _BLOCK):
        last = min(first + _BLOCK, rows)
        v, u = (index + 0.5 for index in np.mgrid[top + first : top + last, left : left + columns].astype(np.float64))
        for place, channel in enumerate(order):
            x, y = display.subpixel_point(u, v, np.full_like(u, channel)) if subpixels else display.panel_point(u, v)
            i, j = display.lens_of(x, y)
            i, j = np.clip(i, 0, grid.columns - 1), np.clip(j, 0, grid.rows - 1)
            result[first:last, :, place] = j * grid.columns + i
    return result.reshape(rows, -1)


def _lens_centers(display: Display) -> NDArray[np.float64]:
    """``(rows, columns, 2)`` places of the lenses in the lens plane, in pixels to the right and downwards."""
    grid, pitch = display.lens_grid, display.panel.pixel_pitch
    j, i = (index.astype(np.float64) for index in np.indices((grid.rows, grid.columns)))
    x, y = display.lens_center(i, j, 0 * i, 0 * j)
    if display.lens_array.layout == "lenticular":
        # The foot of the axis, so that neighbours lie straight across from each other.
        lattice = display.lattice
        x, y = lattice.from_axes(lattice.across(x, y), 0 * i)
    return np.ascontiguousarray(np.stack([x, -y], axis=-1) / pitch)
