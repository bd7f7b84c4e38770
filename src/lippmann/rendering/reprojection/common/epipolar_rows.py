"""Where the micro-images of a straight lenticular display lie in its rows of pixels.

There a row of pixels is a world of its own (an epipolar plane): a point of disparity s that lens c shows at panel
position ``c + o`` appears under lens c' at ``c' + o + (c' - c) s``. All positions are in pixels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display


class Rows(NamedTuple):
    """The columns of the micro-images, lens by lens from the left.

    Attributes
    ----------
    first:
        ``(lenses + 1,)`` first column of each micro-image; its last one ends where the next begins.
    offset:
        ``(lenses,)`` where the centre of that column lies, counted from the lens's centre.
    center:
        ``(lenses,)`` the lens's centre, counted from the centre of column 0.
    """

    first: NDArray[np.int64]
    offset: NDArray[np.float64]
    center: NDArray[np.float64]

    @property
    def lenses(self) -> int:
        return len(self.center)

    @staticmethod
    def of(display: Display) -> Rows:
        """The columns of ``display``, which must be lenticular without slant."""
        columns = np.arange(display.panel.width)
        x, y = display.panel_point(columns + 0.5, np.full(columns.shape, 0.5))
        i, _ = display.lens_of(x, y, NUMPY)
        lenses = np.arange(display.lens_grid.columns + 1)
        first = np.searchsorted(i, lenses).astype(np.int64)
        level = np.zeros(len(lenses) - 1)
        center, _ = display.lens_center(lenses[:-1].astype(float), level, level, level, NUMPY)
        pitch = display.panel.pixel_pitch
        # A lens at the very edge may own points of the panel but no pixel's centre; its first column is the next one's.
        start = x[np.minimum(first[:-1], len(x) - 1)]
        return Rows(first, (start - center) / pitch, (np.asarray(center) - x[0]) / pitch)
