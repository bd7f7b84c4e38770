"""SSIM and flicker of the views of two pictures of one display.

Some rows of all views are compared at a time, so that pictures need not fit in memory. Several threads compare views
side by side; the metrics do not depend on their number.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.image import Picture
from lippmann.image.stored_values import Values
from lippmann.image.views import lens_rows, panel_rows_of_view_rows, pixels_of_view_rows, view_grid
from lippmann.metrics.flicker import Flicker, FlickerSums
from lippmann.metrics.mse_psnr import coded_values
from lippmann.metrics.structural_similarity import WINDOW, ViewSimilarity, similarity_sum, window_weights
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.machine import usable_cores

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Pixels of the panel whose views are worked on at a time.
_BLOCK = 1 << 22


def view_similarity(reference: Picture, test: Picture, progress: ProgressCallback = silent) -> ViewSimilarity:
    """SSIM of the views of two pictures of one display, on coded values."""
    return view_figures(reference, test, progress)[0]


def view_flicker(reference: Picture, test: Picture) -> Flicker | None:
    """The flicker of ``test`` against a reference of the same display; None if there is one view only.

    Neighbours are views side by side and, where there are rows of views, one above the other. Where lenses do not cover
    whole pixels the views are resampled (nearest pixel).
    """
    return view_figures(reference, test)[1]


def view_figures(
    reference: Picture, test: Picture, progress: ProgressCallback = silent
) -> tuple[ViewSimilarity, Flicker | None]:
    """:func:`view_similarity` and :func:`view_flicker` together, for the time of one."""
    sums = ViewSums(reference, test)
    for row in sums.work():
        progress(Progress("compare", row, reference.display.panel.height))
    return sums.similarity, sums.flicker


@dataclass(frozen=True)
class _Lot:
    """Values as stored of the panel's rows from ``top`` on, which views show in their rows ``first`` to ``last``."""

    first: int
    last: int
    top: int
    values: tuple[Values, Values]


class ViewSums:
    """Sums over the views of two pictures of one display; they grow with :meth:`work`."""

    def __init__(self, reference: Picture, test: Picture) -> None:
        self._pictures = reference, test
        self._display = reference.display
        self._grid = view_grid(self._display)
        self._shape = len(self._grid.down), len(self._grid.right)
        self._rows, self._columns = lens_rows(self._display), self._display.lens_grid.columns
        self._windows = window_weights(self._rows), window_weights(self._columns)
        self._totals, self._counts = np.zeros(self._shape), np.zeros(self._shape, dtype=np.int64)
        self._flicker = FlickerSums(self._shape[1])

    @property
    def similarity(self) -> ViewSimilarity:
        """SSIM of every view."""
        with np.errstate(invalid="ignore"):
            return ViewSimilarity(self._totals / self._counts, self._grid.exact)

    @property
    def flicker(self) -> Flicker | None:
        """The flicker; None if there is one view only."""
        return self._flicker.flicker()

    def work(self) -> Iterator[int]:
        """Work through all rows of the views; yields the number of the panel's rows done, now and then."""
        high, height = len(self._windows[0]), self._display.panel.height
        places = self._rows - high + 1
        step = max(2 * WINDOW, _BLOCK // (self._shape[0] * self._shape[1] * self._columns))
        with ThreadPoolExecutor(usable_cores()) as pool:
            for first in range(0, places, step):
                last = min(first + step, places) + high - 1
                top, bottom = panel_rows_of_view_rows(self._display, first, last)
                rows = tuple(picture.held_rows(top, bottom) for picture in self._pictures)
                # Windows overlap from one lot of rows to the next, the rows that flicker is summed over do not.
                own = slice(0, last - first if last == self._rows else step)
                self._add(pool, _Lot(first, last, top, (rows[0], rows[1])), own)
                yield height if last == self._rows else top

    def _add(self, pool: ThreadPoolExecutor, lot: _Lot, own: slice) -> None:
        self._flicker.begin()
        for ky in range(self._shape[0]):
            views = [(ky, kx) for kx in range(self._shape[1])]
            outcomes = pool.map(lambda view: self._compare_view(lot, view), views)
            for view, (total, count, error, present) in zip(views, outcomes, strict=True):
                self._totals[view] += total
                self._counts[view] += count
                self._flicker.add(error[own], present[own])

    def _compare_view(self, lot: _Lot, view: tuple[int, int]) -> tuple[float, int, Real, Flags]:
        """SSIM of some rows of a view as a sum and a number of values, their errors ``(rows, W, 3)`` and their mask."""
        from lippmann.metrics import kernels

        shape = lot.last - lot.first, self._columns
        places = pixels_of_view_rows(self._display, self._grid, view, lot.first, lot.last)
        present = np.broadcast_to(places[0], shape)
        row, column = (np.broadcast_to(part, shape) for part in places[1:])
        colors = []
        for picture, values in zip(self._pictures, lot.values, strict=True):
            gathered = np.empty((*shape, 3), dtype=values.dtype)
            kernels.gather(values, row - lot.top, column, present, gathered)
            colors.append(coded_values(gathered, picture.provenance.transfer))
        a, b = colors
        total, count = similarity_sum(a, b, None if present.all() else present, self._windows)
        return total, count, a - b, present
