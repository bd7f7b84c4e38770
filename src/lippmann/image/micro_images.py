"""Micro-images (elemental images): the permutation from a picture's pixels to boxes of pixels under each lens.

Every pixel belongs to one lens and has one place in that lens's box of ``ny x nx`` places. Where micro-images are whole
rectangles of pixels, every place holds a pixel. Elsewhere (hexagons, slant, a broken number of pixels per lens, lenses
cut by the panel's edge) some places are empty: zero, and False in the mask.

A lenticular sheet has one row of lenses, each with a box as high as the panel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display, covers_whole_pixels, micro_image_shape, pixel_indices_under_lens, pixel_lenses
from lippmann.display.micro_image_layout import row_blocks
from lippmann.errors import PictureError
from lippmann.runtime.engine_lock import cached_property

Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True)
class Permutation:
    """Bijection between the pixels of a display and the filled places of its micro-images.

    Parameters
    ----------
    display:
        The display.
    """

    display: Display

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Shape ``(lens_rows, lens_cols, ny, nx)`` of the micro-images."""
        grid = self.display.lens_grid
        return (grid.rows, grid.columns, *micro_image_shape(self.display))

    def split(self, values: NDArray[Scalar]) -> NDArray[Scalar]:
        """Micro-images ``(lens_rows, lens_cols, ny, nx, ...)`` of ``(H, W, ...)`` values; empty places are zero.

        The result shares its memory with ``values`` where micro-images are whole rectangles.

        Raises
        ------
        PictureError
            If the values do not have the panel's size.
        """
        panel = self.display.panel
        if values.shape[:2] != (panel.height, panel.width):
            raise PictureError(
                f"the picture has {values.shape[1]} x {values.shape[0]} pixels",
                rule=f"the display {self.display.name} has {panel.width} x {panel.height}",
            )
        rows, columns, ny, nx = self.shape
        trailing = values.shape[2:]
        if self._has_whole_rectangles:
            return values.reshape(rows, ny, columns, nx, *trailing).swapaxes(1, 2)
        micro_images = np.zeros((rows * columns * ny * nx, *trailing), dtype=values.dtype)
        micro_images[self._places] = values
        return micro_images.reshape(rows, columns, ny, nx, *trailing)

    def join(self, micro_images: NDArray[Scalar]) -> NDArray[Scalar]:
        """``(H, W, ...)`` values of micro-images, inverse of :meth:`split`; values in empty places are left out.

        Raises
        ------
        PictureError
            If the shape is not that of the display's micro-images.
        """
        if micro_images.shape[:4] != self.shape:
            raise PictureError(
                f"the micro-images have the shape {micro_images.shape[:4]}",
                rule=f"those of {self.display.name} have {self.shape} (lens rows and columns, pixel rows and columns)",
            )
        trailing, panel = micro_images.shape[4:], self.display.panel
        if self._has_whole_rectangles:
            return micro_images.swapaxes(1, 2).reshape(panel.height, panel.width, *trailing)
        return micro_images.reshape(-1, *trailing)[self._places]

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Mask ``(lens_rows, lens_cols, ny, nx)``: True for places that hold a pixel."""
        panel = self.display.panel
        return self.split(np.ones((panel.height, panel.width), dtype=np.bool_))

    @property
    def _has_whole_rectangles(self) -> bool:
        if self.display.lens_array.layout == "hexagonal" or not covers_whole_pixels(self.display):
            return False
        # A box can be larger than the whole number of pixels that the lenses nearly cover.
        rows, columns, ny, nx = self.shape
        return (rows * ny, columns * nx) == (self.display.panel.height, self.display.panel.width)

    @cached_property
    def _places(self) -> NDArray[np.int64]:
        """Flat index of every pixel's place in the micro-images, ``(H, W)``."""
        _, columns, ny, nx = self.shape
        panel = self.display.panel
        places = np.empty((panel.height, panel.width), dtype=np.int64)
        for first, last in row_blocks(panel.height, panel.width):
            i, j = pixel_lenses(self.display, (first, last))
            k_x, k_y = pixel_indices_under_lens(self.display, (first, last))
            places[first:last] = ((j.astype(np.int64) * columns + i) * ny + k_y) * nx + k_x
        return places


def micro_images_as_views(micro_images: NDArray[Scalar], display: Display) -> NDArray[Scalar]:
    """Views ``(ny, nx, lens_rows, lens_cols, ...)`` of micro-images ``(lens_rows, lens_cols, ny, nx, ...)``.

    The function is its own inverse. For a lenticular sheet ``(1, lens_cols, H, nx, ...)`` becomes ``(1, nx, H,
    lens_cols, ...)``: the panel's rows take the place of the lens rows.
    """
    if display.lens_array.layout == "lenticular":
        return micro_images.swapaxes(1, 3)
    return micro_images.swapaxes(0, 2).swapaxes(1, 3)
