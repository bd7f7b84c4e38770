"""Index maps of micro-images (elemental images) and views: the lens of each pixel, and its place under that lens.

Pure integers made from the display's geometry at pixel centres. The pair (lens, index) names a pixel uniquely, on any
display, so cutting a picture into micro-images and putting it together again loses nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from lippmann.display.array_ops import NUMPY
from lippmann.display.display import Display
from lippmann.display.lens_array import BOUNDARY_TOLERANCE, WHOLE_TOLERANCE
from lippmann.display.panel import PixelWindow

Indices = NDArray[np.int32]

#: Pixels whose geometry is computed at a time: its double-precision temporaries are far larger than the result.
_BLOCK = 1 << 20


def pixel_lenses(display: Display, row_range: tuple[int, int] | None = None) -> tuple[Indices, Indices]:
    """The lens ``(i, j)`` of every pixel, by the pixel's centre.

    ``row_range`` is (first, past the last) row, all rows by default. Both arrays are ``(rows, width)``, within the
    display's ``lens_grid``.
    """
    return _block_by_block(display, row_range, _lenses_of_block)


def row_blocks(height: int, width: int, first: int = 0) -> Iterator[tuple[int, int]]:
    """First and past-the-last of ``height`` rows from ``first`` on, in consecutive blocks of about a million pixels."""
    step, end = max(1, _BLOCK // width), first + height
    return ((start, min(start + step, end)) for start in range(first, end, step))


def lens_indices(display: Display, row_range: tuple[int, int] | None = None) -> Indices:
    """Flat index ``j * lens_cols + i`` of every pixel's lens, ``(rows, width)``; of all rows by default."""
    first, last = row_range or (0, display.panel.height)
    indices = np.empty((last - first, display.panel.width), dtype=np.int32)
    for start, stop in row_blocks(last - first, display.panel.width, first):
        i, j = pixel_lenses(display, (start, stop))
        indices[start - first : stop - first] = j * display.lens_grid.columns + i
    return indices


def lens_numbers(display: Display, window: PixelWindow | None = None, *, subpixels: bool = False) -> Indices:
    """``(1, H, W)`` :func:`lens_indices` of a window's pixels, or ``(3, H, W)`` of every sub-pixel."""
    panel, grid = display.panel, display.lens_grid
    window = window or PixelWindow(0, 0, panel.width, panel.height)
    if not subpixels:
        return lens_indices(display, (window.top, window.bottom))[None, :, window.columns]
    result = np.empty((3, *window.shape), dtype=np.int32)
    for first in range(0, window.height, 64):
        last = min(first + 64, window.height)
        band = slice(window.top + first, window.top + last)
        v, u = (index + 0.5 for index in np.mgrid[band, window.columns].astype(np.float64))
        for channel, part in enumerate(result):
            i, j = display.lens_of(*display.subpixel_point(u, v, np.full_like(u, channel)))
            i, j = np.clip(i, 0, grid.columns - 1), np.clip(j, 0, grid.rows - 1)
            part[first:last] = j * grid.columns + i
    return result


def lens_numbers_in_full_color(display: Display, window: PixelWindow | None = None) -> Indices:
    """``(1, H, 3 W)``: :func:`lens_numbers` of the sub-pixels, in their order from left to right."""
    numbers = lens_numbers(display, window, subpixels=True)[list(display.panel.subpixel_order)]
    return np.ascontiguousarray(np.moveaxis(numbers, 0, 2)).reshape(1, numbers.shape[1], -1)


def lens_centers(display: Display) -> NDArray[np.float64]:
    """``(rows, columns, 2)`` places of the lenses in the lens plane, in pixels to the right and downwards."""
    grid, pitch = display.lens_grid, display.panel.pixel_pitch
    j, i = (index.astype(np.float64) for index in np.indices((grid.rows, grid.columns)))
    x, y = display.lens_center(i, j, 0 * i, 0 * j)
    if display.lens_array.layout == "lenticular":
        # The foot of the axis, so that neighbours lie straight across from each other.
        lattice = display.lattice
        x, y = lattice.from_axes(lattice.across(x, y), 0 * i)
    return np.ascontiguousarray(np.stack([x, -y], axis=-1) / pitch)


def pixel_indices_under_lens(display: Display, row_range: tuple[int, int] | None = None) -> tuple[Indices, Indices]:
    """The place ``(k_x, k_y)`` of every pixel in its micro-image, both ``(rows, width)``.

    ``k_x = floor((x - x_lens) / d + N / 2)`` with the pixel's centre x, the place x_lens of the lens's centre on the
    panel (seen from the viewing distance; for a slanted lens where its axis crosses the pixel's row) and N pixels per
    lens; ``k_y`` counts downwards likewise. A lenticular micro-image is as high as the panel: ``k_y`` is the row.
    Both lie within :func:`micro_image_shape`.
    """
    return _block_by_block(display, row_range, _indices_of_block)


def micro_image_shape(display: Display) -> tuple[int, int]:
    """Rows and columns ``(n_y, n_x)`` of the smallest box that holds every micro-image.

    Where micro-images are not whole rectangles of pixels (hexagons, slant, broken numbers) a box has places without
    a pixel.
    """
    width, height = micro_image_extent(display)
    # Pixels on the box's edge belong to its neighbour, to the tolerance at either end; those inside it need a place.
    slack = 2 * BOUNDARY_TOLERANCE
    return math.ceil(height - slack), math.ceil(width - slack)


def covers_whole_pixels(display: Display) -> bool:
    """Whether the micro-images tile the panel in whole pixels.

    Lenticular: no slant, and every lens has the same whole number of pixel columns; square: the same in both
    directions. Hexagonal: pitch and row pitch of the micro-images are whole numbers of pixels, so that all lenses of
    a row, and of every second row, have the same pixels (lenses that the panel's edge cuts lack some).
    """
    across, down = display.pixels_per_lens
    grid, panel = display.lens_grid, display.panel
    if display.lens_array.layout == "hexagonal":
        return is_whole(across) and down is not None and is_whole(down)
    if display.lens_array.slant != 0.0 or not is_whole(across) or round(across) * grid.columns != panel.width:
        return False
    return down is None or (is_whole(down) and round(down) * grid.rows == panel.height)


def is_whole(count: float) -> bool:
    """Whether a number of pixels is whole, up to rounding."""
    return abs(count - round(count)) <= WHOLE_TOLERANCE


def micro_image_extent(display: Display) -> tuple[float, float]:
    """Width and height of the box around one micro-image in pixels, not rounded; for the pitches in effect."""
    lattice, pixel_pitch = display.lattice, display.panel.pixel_pitch
    across = lattice.pitch * display.magnification / (pixel_pitch * math.cos(math.radians(lattice.slant)))
    if lattice.layout == "lenticular":
        return across, float(display.panel.height)
    down = lattice.row_pitch * display.magnification / pixel_pitch
    if lattice.layout == "square":
        return across, down
    # The tips of a hexagonal cell lie where two neighbours of the next row are as near as its own centre.
    return across, down + across * across / (4 * down)


def _block_by_block(
    display: Display,
    row_range: tuple[int, int] | None,
    of_block: Callable[[Display, int, int], tuple[Indices, Indices]],
) -> tuple[Indices, Indices]:
    """Run ``of_block`` on a few rows at a time: its double-precision arrays would take gigabytes for a whole panel.

    It may return one row, or one column, that stands for all.
    """
    first, last = row_range or (0, display.panel.height)
    shape = (last - first, display.panel.width)
    whole = np.empty(shape, dtype=np.int32), np.empty(shape, dtype=np.int32)
    for start, stop in row_blocks(last - first, display.panel.width, first):
        for target, part in zip(whole, of_block(display, start, stop), strict=True):
            target[start - first : stop - first] = part
    return whole


def _lenses_of_block(display: Display, first: int, last: int) -> tuple[Indices, Indices]:
    x, y = _pixel_centers(display, first, last)
    i, j = display.lens_of(x, y, NUMPY)
    return i.astype(np.int32), j.astype(np.int32)


def _indices_of_block(display: Display, first: int, last: int) -> tuple[Indices, Indices]:
    x, y = _pixel_centers(display, first, last)
    i, j = display.lens_of(x, y, NUMPY)
    pixel_pitch, lattice, scale = display.panel.pixel_pitch, display.lattice, display.magnification
    width, height = micro_image_extent(display)
    if lattice.layout == "lenticular":
        center_x = lattice.axis_at(i, y / scale) * scale
        k_y = np.arange(first, last, dtype=np.int32)[:, None]
    else:
        center_x, center_y = (c * scale for c in lattice.center(i, j, x, y, NUMPY))
        k_y = np.floor((center_y - y) / pixel_pitch + (0.5 * height + BOUNDARY_TOLERANCE)).astype(np.int32)
    k_x = np.floor((x - center_x) / pixel_pitch + (0.5 * width + BOUNDARY_TOLERANCE)).astype(np.int32)
    return k_x, k_y


def _pixel_centers(display: Display, first: int, last: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Panel points of pixel centres of some rows; of the first row alone where all rows are alike."""
    if display.lattice.rows_are_alike:
        last = first + 1
    u, v = np.meshgrid(np.arange(display.panel.width) + 0.5, np.arange(first, last) + 0.5)
    x, y = display.panel_point(u, v)
    return x, y
