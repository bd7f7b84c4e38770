"""The same figures as :mod:`.comparison` for pictures that are never whole in memory: a few rows at a time.

Sums are taken in another order, so figures agree to rounding. Silhouettes are found by edges; there is no map of
errors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display, micro_image_shape, pixel_indices_under_lens, pixel_lenses
from lippmann.image import Picture
from lippmann.metrics.comparison import Comparison, check_comparable
from lippmann.metrics.mse_psnr import coded_values, psnr, squared_differences
from lippmann.metrics.paper import PaperFigures, paper_codes
from lippmann.metrics.silhouettes import Silhouettes, edges_between_neighbours
from lippmann.metrics.view_metrics import ViewSums
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.cached_property import cached_property

Real = NDArray[np.float64]

#: Pixels of the panel that are worked on at a time.
_BLOCK = 1 << 20


@dataclass(frozen=True, eq=False)
class CountedSilhouettes(Silhouettes):
    """Silhouettes of which only the number is known: ``mask`` is empty."""

    counted_share: float = 0.0

    @property
    def share(self) -> float:
        """The part of the pixels that lies on silhouettes."""
        return self.counted_share


@dataclass(frozen=True, eq=False)
class LargeComparison(Comparison):
    """A :class:`Comparison` whose ``errors`` are empty, for they would not fit into the memory.

    Parameters
    ----------
    total_error, off_error:
        Sums of the squared errors of all pixels and of those on no silhouette.
    off_pixels:
        How many the latter are.
    """

    total_error: float = 0.0
    off_error: float = 0.0
    off_pixels: int = 0

    @cached_property
    def mean_squared_error(self) -> float:
        """Of all pixels and channels, coded values."""
        panel = self.reference.display.panel
        return self.total_error / (panel.width * panel.height)

    @cached_property
    def psnr_off_silhouettes(self) -> float | None:
        """PSNR in dB over the pixels that lie on no silhouette; None if there are none."""
        return psnr(self.off_error / self.off_pixels) if self.off_pixels else None


def compare_large(reference: Picture, test: Picture, progress: ProgressCallback = silent) -> LargeComparison:
    """:func:`lippmann.metrics.compare` for pictures that are read piece by piece."""
    check_comparable(reference, test)
    panel, grid = reference.display.panel, reference.display.lens_grid
    sums, views = _PanelSums(reference, test), ViewSums(reference, test)
    for rows in _in_step(sums.work(), views.work()):
        progress(Progress("compare", rows, 2 * panel.height))
    shape = grid.rows, grid.columns
    means, paper_means = (
        np.divide(summed, sums.pixels, out=np.full(summed.shape, np.nan), where=sums.pixels > 0).reshape(shape)
        for summed in (sums.errors, sums.paper_errors)
    )
    share = 1 - sums.off_pixels / (panel.width * panel.height)
    return LargeComparison(
        reference,
        test,
        np.empty((0, 0)),
        means,
        sums.pixels.reshape(shape),
        CountedSilhouettes(np.empty((0, 0), dtype=np.bool_), "edges", share),
        views.similarity,
        views.flicker,
        PaperFigures(paper_means),
        total_error=float(sums.errors.sum()),
        off_error=sums.off_error,
        off_pixels=sums.off_pixels,
    )


def _in_step(*parts: Iterator[int]) -> Iterator[int]:
    """Lets the part go on that is furthest behind, so that pieces of a file which all need are decoded once.

    Parts say up to which row they are; so does this, as the sum of all.
    """
    reached = dict.fromkeys(parts, 0)
    going = set(parts)
    while going:
        part = min(going, key=lambda one: reached[one])
        row = next(part, None)
        if row is None:
            going.remove(part)
        else:
            reached[part] = row
            yield sum(reached.values())


class _PanelSums:
    """Sums over the pixels of two pictures of one display, by lens and off silhouettes, which grow with :meth:`work`.

    Attributes
    ----------
    pixels, errors, paper_errors:
        By lens: its pixels, and their squared errors, of coded values and of the paper's 8-bit codes.
    off_error, off_pixels:
        Squared errors of the pixels that lie on no silhouette, and how many these are.
    """

    def __init__(self, reference: Picture, test: Picture) -> None:
        self._reference, self._test = reference, test
        grid = reference.display.lens_grid
        lenses = grid.rows * grid.columns
        self.pixels = np.zeros(lenses, dtype=np.intp)
        self.errors, self.paper_errors = np.zeros(lenses), np.zeros(lenses)
        self.off_error, self.off_pixels = 0.0, 0

    def work(self) -> Iterator[int]:
        """Work through all rows of the panel; says now and then up to which that was."""
        for band in _bands(self._reference.display):
            self._add(band)
            yield band.last

    def _add(self, band: _Band) -> None:
        transfers = self._reference.provenance.transfer, self._test.provenance.transfer
        around = self._reference.held_rows(band.top, band.bottom)
        own = around[band.inner], self._test.held_rows(band.first, band.last)
        seen = coded_values(around, transfers[0])
        errors = squared_differences(seen[band.inner], coded_values(own[1], transfers[1]))
        codes = (paper_codes(values, transfer) for values, transfer in zip(own, transfers, strict=True))
        self._add_to_lenses(band.owner[band.inner].ravel(), errors.ravel(), squared_differences(*codes).ravel())
        off = ~edges_between_neighbours(band, seen)[band.inner]
        self.off_error += float(errors[off].sum())
        self.off_pixels += int(off.sum())

    def _add_to_lenses(self, owner: NDArray[np.int64], errors: Real, paper_errors: Real) -> None:
        low = int(owner.min())
        owner = owner - low
        counts = np.bincount(owner)
        lenses = slice(low, low + len(counts))
        self.pixels[lenses] += counts
        self.errors[lenses] += np.bincount(owner, weights=errors)
        self.paper_errors[lenses] += np.bincount(owner, weights=paper_errors)


class _Band:
    """Some rows of a panel with their neighbours above and below, cut into the micro-images that they have part in.

    Offers what :class:`lippmann.image.micro_images.Permutation` offers for a whole panel.
    """

    def __init__(self, display: Display, first: int, last: int, margin: int) -> None:
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
        """The band's own rows among those that it looks at."""
        return slice(self.first - self.top, self.last - self.top)

    def split(self, values: NDArray[Any]) -> NDArray[Any]:
        """Micro-images of the rows looked at; places without a pixel are zero."""
        trailing = values.shape[2:]
        found = np.zeros((math.prod(self._shape), *trailing), dtype=values.dtype)
        found[self._places] = values
        return found.reshape(*self._shape, *trailing)


def _bands(display: Display) -> Iterator[_Band]:
    """Bands that cover the panel; each sees all neighbours of its pixels."""
    width, height = display.panel.width, display.panel.height
    # Neighbours lie in the next row, or at the same place of the next row of lenses.
    margin = 1 if display.lens_array.layout == "lenticular" else micro_image_shape(display)[0] + 1
    step = max(2 * margin, _BLOCK // width)
    return (_Band(display, first, min(first + step, height), margin) for first in range(0, height, step))
