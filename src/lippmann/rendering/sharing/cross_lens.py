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
from lippmann.display.pixel_window import PixelWindow
from lippmann.rendering.sharing.cross_lens_kernel import share

if TYPE_CHECKING:
    from lippmann.rendering.film.feature_buffers import Guides

Floats = NDArray[np.float32]

#: How far light is fetched, in lenses to either side: of a lenticular sheet, and of an array in each direction.
REACH, REACH_OF_ARRAYS = 4, 3


def share_light(
    pixels: Floats,
    display: Display,
    guides: Guides,
    *,
    stop: float,
    lenses: NDArray[np.int32] | None = None,
    columns: int = 1,
) -> Floats:
    """A denoised picture whose micro-images have shared their light.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` linear RGB >= 0 of the panel, or of a window of it, without noise; or ``(H, 3 W, 3)`` of its
        sub-pixels in full colour, see :class:`~lippmann.rendering.transport.ray_source.SubpixelRays`.
    guides:
        Albedo, normal and height of the same pixels.
    stop:
        Weight of a squared relative difference of light: the less noise is left, the larger it may be.
    lenses:
        From :func:`lens_numbers`: of a window, or of sub-pixels that show one colour each; those of sub-pixels in full
        colour from :func:`lens_numbers_in_full_color`. None for whole pixels of the whole panel.
    columns:
        How many make a pixel: 3 of sub-pixels in full colour.

    Returns
    -------
    float32 of the same shape.
    """
    assert guides.height is not None
    albedo = guides.reflected()
    light = np.ascontiguousarray(pixels / albedo, dtype=np.float32)
    shared = np.empty_like(light)
    is_lenticular = display.lens_array.layout == "lenticular"
    reach = (REACH, 0) if is_lenticular else (REACH_OF_ARRAYS, REACH_OF_ARRAYS)
    centers = _lens_centers(display) * (columns, 1)
    if lenses is None:
        lenses = lens_numbers(display)
    groups = [slice(0, 3)] if len(lenses) == 1 else [slice(c, c + 1) for c in range(3)]
    for lens, group in zip(lenses, groups, strict=True):
        surface = (guides.normal, guides.height, lens, centers)
        shared[..., group] = share(light[..., group], *surface, display.gap, reach, is_lenticular, stop)
    return np.asarray(shared * albedo, dtype=np.float32)


def lens_numbers(display: Display, window: PixelWindow | None = None, *, subpixels: bool = False) -> NDArray[np.int32]:
    """``(1, H, W)`` number of the lens of every pixel, lenses counted row by row; ``(3, H, W)`` of every sub-pixel."""
    panel, grid = display.panel, display.lens_grid
    window = window or PixelWindow(0, 0, panel.width, panel.height)
    result = np.empty((3 if subpixels else 1, *window.shape), dtype=np.int32)
    for first in range(0, window.height, 64):
        last = min(first + 64, window.height)
        band = slice(window.top + first, window.top + last)
        v, u = (index + 0.5 for index in np.mgrid[band, window.columns].astype(np.float64))
        for channel, part in enumerate(result):
            x, y = display.subpixel_point(u, v, np.full_like(u, channel)) if subpixels else display.panel_point(u, v)
            i, j = display.lens_of(x, y)
            i, j = np.clip(i, 0, grid.columns - 1), np.clip(j, 0, grid.rows - 1)
            part[first:last] = j * grid.columns + i
    return result


def lens_numbers_in_full_color(display: Display, window: PixelWindow | None = None) -> NDArray[np.int32]:
    """``(1, H, 3 W)``: :func:`lens_numbers` of the sub-pixels, in their order from left to right."""
    numbers = lens_numbers(display, window, subpixels=True)[list(display.panel.subpixel_order)]
    return np.ascontiguousarray(np.moveaxis(numbers, 0, 2)).reshape(1, numbers.shape[1], -1)


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
