"""Structural similarity of micro-images, from sums that grow with every pixel.

A micro-image is a few pixels wide, smaller than the window by which SSIM judges pictures. It is therefore one window
itself, all its pixels weighing the same; under a cylindrical lens, which is as long as the panel is high, each run of
:data:`ROWS` panel rows is one. Constants are those of :mod:`lippmann.metrics.structural_similarity`, of the same paper
(Wang et al. 2004); colours count alike. The SSIM of a micro-image is the mean of its windows, by their pixels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.metrics.structural_similarity import similarity_of_moments

Real = NDArray[np.float64]

#: Panel rows of a window under a cylindrical lens.
ROWS = 16


class MicroImageSimilarity:
    """SSIM of every micro-image of a display; add all of its pixels first."""

    def __init__(self, display: Display) -> None:
        grid = display.lens_grid
        self._shape = grid.rows, grid.columns
        is_lenticular = display.lens_array.layout == "lenticular"
        self._rows = ROWS if is_lenticular else display.panel.height
        windows = -(-display.panel.height // self._rows)
        self._lenses = grid.rows * grid.columns
        self._counts = np.zeros(windows * self._lenses)
        #: Sums of a, b, a² + b² and a b, by window and channel.
        self._sums = np.zeros((4, windows * self._lenses, 3))

    def add(self, first: int, owner: NDArray[np.int64], reference: Real, test: Real) -> None:
        """Add rows of the panel.

        Parameters
        ----------
        first:
            The first of the rows.
        owner:
            ``(rows, W)``: flat index of every pixel's lens.
        reference, test:
            ``(rows, W, 3)``: coded values, 0 to 1.
        """
        window = (first + np.arange(len(owner))) // self._rows
        place = (window[:, None] * self._lenses + owner).ravel()
        low = int(place.min())
        place = place - low
        counts = np.bincount(place)
        part = slice(low, low + len(counts))
        self._counts[part] += counts
        a, b = (np.asarray(values, np.float64).reshape(-1, 3) for values in (reference, test))
        for sums, values in zip(self._sums, (a, b, a * a + b * b, a * b), strict=True):
            for channel in range(3):
                sums[part, channel] += np.bincount(place, weights=values[:, channel])

    def values(self) -> Real:
        """``(lens_rows, lens_cols)``: SSIM in [-1, 1], NaN where a lens has no pixel."""
        counts = np.maximum(self._counts, 1.0)[:, None]
        similarity = similarity_of_moments(*(self._sums / counts))
        weighted = (similarity.mean(axis=1) * self._counts).reshape(-1, self._lenses).sum(axis=0)
        pixels = self._counts.reshape(-1, self._lenses).sum(axis=0)
        by_lens = np.full(self._lenses, np.nan)
        np.divide(weighted, pixels, out=by_lens, where=pixels > 0)
        return by_lens.reshape(self._shape)
