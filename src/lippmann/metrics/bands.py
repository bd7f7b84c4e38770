"""Bands of panel rows with the neighbours of their pixels, so that a panel is compared some rows at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display, micro_image_shape, pixel_indices_under_lens, pixel_lenses

Scalar = TypeVar("Scalar", bound=np.generic)

#: Pixels of the panel in a band, about.
_BLOCK = 1 << 20


class Band:
    """Rows of a panel with their neighbours above and below, cut into the micro-images that they have part in.

    Attributes
    ----------
    display:
        The panel's display.
    first, last:
        The band's own rows of the panel: from ``first`` to before ``last``.
    top, bottom:
        The rows with all neighbours: from ``top`` to before ``bottom``.
    owner:
        ``(bottom - top, W)`` int64: flat index ``j * lens_cols + i`` of every pixel's lens.
    """

    def __init__(self, display: Display, first: int, last: int, margin: int) -> None:
        self.display = display
        self.first, self.last = first, last
        self.top, self.bottom = max(0, first - margin), min(display.panel.height, last + margin)
        rows = self.top, self.bottom
        i, j = (part.astype(np.int64) for part in pixel_lenses(display, rows))
        k_x, k_y = (part.astype(np.int64) for part in pixel_indices_under_lens(display, rows))
        columns = display.lens_grid.columns
        self.owner = j * columns + i
        ny, nx = micro_image_shape(display)
        if display.lens_array.layout == "lenticular":
            k_y, ny = k_y - self.top, self.bottom - self.top
        j = j - j.min()
        self._shape = int(j.max()) + 1, columns, ny, nx
        self._places = ((j * columns + i) * ny + k_y) * nx + k_x

    @property
    def inner(self) -> slice:
        """The band's own rows among those from ``top`` to ``bottom``."""
        return slice(self.first - self.top, self.last - self.top)

    def split(self, values: NDArray[Scalar]) -> NDArray[Scalar]:
        """Micro-images ``(lens_rows, lens_cols, ny, nx)`` of ``(bottom - top, W)`` values; empty places are zero."""
        micro_images = np.zeros(math.prod(self._shape), dtype=values.dtype)
        micro_images[self._places] = values
        return micro_images.reshape(self._shape)


def bands(display: Display) -> Iterator[Band]:
    """Bands that cover the panel from the top down; each holds all neighbours of its own pixels."""
    width, height = display.panel.width, display.panel.height
    # Neighbours lie in the next row, or at the same place of the next row of lenses.
    margin = 1 if display.lens_array.layout == "lenticular" else micro_image_shape(display)[0] + 1
    step = max(2 * margin, _BLOCK // width)
    return (Band(display, first, min(first + step, height), margin) for first in range(0, height, step))
