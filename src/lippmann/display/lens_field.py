"""Which lens every pixel has, and where the lenses are: all that reuse must know of a layout.

Positions are in pixels, x to the right and y downwards, pixel centres at whole numbers. With the lens's centre c, a
pixel at q sees along the line through q and c; a point of it with disparity s is seen by another lens, of centre c', at

    q' = q + (c' - c) (1 + s),

for a cylindrical lens with the points of the axes that are level with each other: along its axis nothing moves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.display.array_ops import NUMPY
from lippmann.display.display import Display
from lippmann.display.micro_image_layout import pixel_lenses
from lippmann.display.pixel_window import PixelWindow


class LensField(NamedTuple):
    """Pixels and lenses of a display of any layout.

    Lens ``(i, j)`` of the display's ``lens_grid`` has the number ``j * columns + i``.

    Attributes
    ----------
    lens:
        ``(H, W)`` number of each pixel's lens.
    center:
        ``(lenses, 2)`` their centres (x, y); of cylindrical lenses the foot of a perpendicular on the axis.
    columns:
        Lenses in a row.
    """

    lens: NDArray[np.int32]
    center: NDArray[np.float64]
    columns: int

    @property
    def rows(self) -> int:
        """Rows of lenses."""
        return len(self.center) // self.columns

    @property
    def reach(self) -> int:
        """Columns of the widest micro-image."""
        begins = np.flatnonzero(np.diff(self.lens, axis=1, prepend=-1))
        return int(np.diff(begins, append=self.lens.size).max())

    @staticmethod
    def of(display: Display) -> LensField:
        """The field of ``display``."""
        grid, panel = display.lens_grid, display.panel
        if display.lattice.rows_are_alike:
            across = np.arange(panel.width) + 0.5
            i, _ = display.lens_of(*display.panel_point(across, np.full(panel.width, 0.5)), NUMPY)
            lens = np.broadcast_to(i.astype(np.int32), (panel.height, panel.width))
        else:
            i, j = pixel_lenses(display)
            lens = (j * np.int32(grid.columns) + i).astype(np.int32)
        middle = np.array([panel.width - 1, panel.height - 1]) / 2
        return LensField(lens, lens_centers(display).reshape(-1, 2) + middle, grid.columns)

    def lens_beside(self, down: int, right: int) -> NDArray[np.int64]:
        """``(lenses,)``: the lens so many rows down and columns to the right of each; -1 for none."""
        j, i = np.divmod(np.arange(len(self.center)), self.columns)
        exists = (i + right >= 0) & (i + right < self.columns) & (j + down >= 0) & (j + down < self.rows)
        return np.where(exists, (j + down) * self.columns + i + right, -1)

    def corresponding_beside(self, numbers: NDArray[np.uint32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """:meth:`corresponding` under the lenses to the left and to the right."""
        place = numbers.astype(np.int64)
        lens = self.lens[np.divmod(place, self.lens.shape[1])]
        left, right = (self.corresponding(place, self.lens_beside(0, side)[lens]) for side in (-1, 1))
        return left, right

    def corresponding(self, numbers: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int64]:
        """The pixels of the lenses ``other`` (-1: none) whose light lines are nearest to parallel to those of pixels.

        Pixels by linear number, row * width + column; -1 where that micro-image has no pixel there.
        """
        height, width = self.lens.shape
        row, column = np.divmod(numbers, width)
        moved = self.center[other] - self.center[self.lens[row, column]]
        x = np.floor(column + moved[:, 0] + 0.5).astype(np.int64)
        y = np.floor(row + moved[:, 1] + 0.5).astype(np.int64)
        exists = (other >= 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
        x, y = np.where(exists, x, 0), np.where(exists, y, 0)
        exists &= self.lens[y, x] == other
        return np.where(exists, y * width + x, -1)


def lens_numbers(display: Display, window: PixelWindow | None = None, *, subpixels: bool = False) -> NDArray[np.int32]:
    """``(1, H, W)`` number of the lens of every pixel, lenses counted row by row; ``(3, H, W)`` of every sub-pixel."""
    panel, grid = display.panel, display.lens_grid
    window = window or PixelWindow(0, 0, panel.width, panel.height)
    if not subpixels:
        i, j = pixel_lenses(display, (window.top, window.bottom))
        return (j * np.int32(grid.columns) + i)[None, :, window.columns]
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


def lens_numbers_in_full_color(display: Display, window: PixelWindow | None = None) -> NDArray[np.int32]:
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
