"""Sums of squared errors over the pixels of two pictures, some rows at a time: the pictures need not fit in memory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lippmann.image import Picture
from lippmann.metrics.bands import Band, bands
from lippmann.metrics.micro_image_similarity import MicroImageSimilarity
from lippmann.metrics.mse_psnr import coded_values, squared_differences
from lippmann.metrics.paper import paper_codes
from lippmann.metrics.silhouettes import depth_of, mark_silhouettes

Real = NDArray[np.float64]


class PanelSums:
    """Sums over the pixels of two pictures of one display, by lens and off silhouettes; they grow with :meth:`work`.

    Attributes
    ----------
    pixels:
        ``(lens_rows, lens_cols)``: pixels of every micro-image.
    errors, paper_errors:
        ``(lens_rows, lens_cols)``: sums of their squared errors, of coded values and of the paper's 8-bit codes.
    off_error, off_pixels:
        Sum of the squared errors of the pixels that lie on no silhouette, and their number.
    similarity:
        SSIM of every micro-image.
    """

    def __init__(self, reference: Picture, test: Picture) -> None:
        self._reference, self._test = reference, test
        self._depth = depth_of(reference)
        grid = reference.display.lens_grid
        shape = grid.rows, grid.columns
        self.pixels = np.zeros(shape, dtype=np.intp)
        self.errors, self.paper_errors = np.zeros(shape), np.zeros(shape)
        self.off_error, self.off_pixels = 0.0, 0
        self.similarity = MicroImageSimilarity(reference.display)

    def work(self) -> Iterator[int]:
        """Work through all rows of the panel; yields the number of rows done, now and then."""
        for band in bands(self._reference.display):
            self._add(band)
            yield band.last

    def means(self, sums: Real) -> Real:
        """``(lens_rows, lens_cols)``: ``sums`` divided by :attr:`pixels`, NaN where a lens has no pixel."""
        means = np.full(sums.shape, np.nan)
        np.divide(sums, self.pixels, out=means, where=self.pixels > 0)
        return means

    def _add(self, band: Band) -> None:
        transfers = self._reference.provenance.transfer, self._test.provenance.transfer
        around = self._reference.held_rows(band.top, band.bottom)
        own = around[band.inner], self._test.held_rows(band.first, band.last)
        colors = coded_values(around, transfers[0])
        tested = coded_values(own[1], transfers[1])
        errors = squared_differences(colors[band.inner], tested)
        self.similarity.add(band.first, band.owner[band.inner], colors[band.inner], tested)
        codes = (paper_codes(values, transfer) for values, transfer in zip(own, transfers, strict=True))
        self._add_to_lenses(band.owner[band.inner].ravel(), errors.ravel(), squared_differences(*codes).ravel())
        off = ~mark_silhouettes(band, colors, self._depth)
        self.off_error += float(errors[off].sum())
        self.off_pixels += int(off.sum())

    def _add_to_lenses(self, owner: NDArray[np.int64], errors: Real, paper_errors: Real) -> None:
        low = int(owner.min())
        owner = owner - low
        counts = np.bincount(owner)
        lenses = slice(low, low + len(counts))
        self.pixels.reshape(-1)[lenses] += counts
        self.errors.reshape(-1)[lenses] += np.bincount(owner, weights=errors)
        self.paper_errors.reshape(-1)[lenses] += np.bincount(owner, weights=paper_errors)
