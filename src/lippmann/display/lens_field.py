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
from lippmann.display.micro_image_layout import lens_centers, pixel_lenses


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
            # Read-only and with a gap after each row: Numba has one type for this and for a row that stands for all,
            # so that kernels are compiled once.
            padded = np.empty((panel.height, panel.width + 1), np.int32)
            padded[:, :-1] = j * np.int32(grid.columns) + i
            lens = np.broadcast_to(padded[:, :-1], (panel.height, panel.width))
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
