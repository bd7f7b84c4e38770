"""The same figures as :mod:`.comparison` for pictures that are never whole in memory: a few rows at a time.

Sums are taken in another order, so figures agree to rounding. Silhouettes are found by edges; there is no map of
errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display, micro_image_shape, pixel_indices_under_lens, pixel_lenses
from lippmann.image import IntegralImage
from lippmann.image.color import quantize
from lippmann.image.large import LargePicture
from lippmann.image.views import lens_rows, pixels_of_view, view_grid
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quality.comparison import Comparison, check_comparable
from lippmann.quality.flicker import Flicker
from lippmann.quality.metrics import coded, coded_values, psnr
from lippmann.quality.paper import PaperFigures
from lippmann.quality.silhouettes import Silhouettes, edges_between_neighbours
from lippmann.quality.similarity import WINDOW, ViewSimilarity, similarities, window_weights

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]
AnyPicture = IntegralImage | LargePicture
_Report = Callable[[float], None]

#: Pixels of the panel, and of each view, worked on at a time.
_BLOCK, _VIEW_BLOCK = 1 << 20, 1 << 18


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


def compare_large(reference: AnyPicture, test: AnyPicture, progress: ProgressCallback = silent) -> LargeComparison:
    """:func:`lippmann.quality.compare` for pictures that are read piece by piece."""
    check_comparable(reference, test)
    display = reference.display
    width, height = display.panel.width, display.panel.height
    grid = display.lens_grid
    lenses = grid.rows * grid.columns
    pixels = np.zeros(lenses, dtype=np.intp)
    sums, paper_sums = np.zeros(lenses), np.zeros(lenses)
    total = off_error = 0.0
    off_pixels = 0
    views = view_grid(display)
    stages = height + lens_rows(display) * len(views.right) * len(views.down)
    for band in _bands(display):
        rows = band.first, band.last
        seen = coded(reference, (band.top, band.bottom))
        own = seen[band.inner]
        errors = np.square(own - coded(test, rows)).mean(axis=2)
        codes = [quantize(picture.rows(*rows), 8, picture.provenance.transfer) for picture in (reference, test)]
        paper = np.square(codes[0].astype(np.float64) - codes[1]).mean(axis=2)
        owner = band.owner[band.inner].ravel()
        pixels += np.bincount(owner, minlength=lenses)
        sums += np.bincount(owner, weights=errors.ravel(), minlength=lenses)
        paper_sums += np.bincount(owner, weights=paper.ravel(), minlength=lenses)
        off = ~edges_between_neighbours(band, seen)[band.inner]
        total += float(errors.sum())
        off_error += float(errors[off].sum())
        off_pixels += int(off.sum())
        progress(Progress("compare", band.last, stages))
    means, paper_means = np.full(lenses, np.nan), np.full(lenses, np.nan)
    for summed, mean in ((sums, means), (paper_sums, paper_means)):
        np.divide(summed, pixels, out=mean, where=pixels > 0)
    shape = grid.rows, grid.columns
    similarity, flicker = _views_compared(
        reference, test, lambda done: progress(Progress("compare", height + done, stages))
    )
    share = 1 - off_pixels / (width * height)
    return LargeComparison(
        reference,
        test,
        np.empty((0, 0)),
        means.reshape(shape),
        pixels.reshape(shape),
        CountedSilhouettes(np.empty((0, 0), dtype=np.bool_), "edges", share),
        similarity,
        flicker,
        PaperFigures(paper_means.reshape(shape)),
        total_error=total,
        off_error=off_error,
        off_pixels=off_pixels,
    )


class _Band:
    """Some rows of a panel with their neighbours above and below, cut into the micro-images that they have part in.

    Offers what :class:`lippmann.image.permutation.Permutation` offers for a whole panel.
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
        self.mask: Flags = self.split(np.ones(self.owner.shape, dtype=np.bool_))

    @property
    def inner(self) -> slice:
        """The band's own rows among those that it looks at."""
        return slice(self.first - self.top, self.last - self.top)

    def split(self, values: NDArray[Any]) -> NDArray[Any]:
        """Micro-images of the rows looked at; places without a pixel are zero."""
        trailing = values.shape[2:]
        found = np.zeros((int(np.prod(self._shape)), *trailing), dtype=values.dtype)
        found[self._places] = values
        return found.reshape(*self._shape, *trailing)

    def join(self, micro_images: NDArray[Any]) -> NDArray[Any]:
        """The inverse of :meth:`split`."""
        joined: NDArray[Any] = micro_images.reshape(-1, *micro_images.shape[4:])[self._places]
        return joined


def _bands(display: Display) -> Iterator[_Band]:
    """Bands that cover the panel; each sees all neighbours of its pixels."""
    width, height = display.panel.width, display.panel.height
    # Neighbours lie in the next row, or at the same place of the next row of lenses.
    margin = 1 if display.lens_array.layout == "lenticular" else micro_image_shape(display)[0] + 1
    step = max(2 * margin, _BLOCK // width)
    return (_Band(display, first, min(first + step, height), margin) for first in range(0, height, step))


def _views_compared(
    reference: AnyPicture, test: AnyPicture, progress: _Report
) -> tuple[ViewSimilarity, Flicker | None]:
    """SSIM and flicker of the views, some rows of all views at a time."""
    display = reference.display
    grid = view_grid(display)
    rows, columns = lens_rows(display), display.lens_grid.columns
    windows = window_weights(rows), window_weights(columns)
    places = rows - len(windows[0]) + 1
    step = max(3 * WINDOW, _VIEW_BLOCK // columns)
    shape = len(grid.down), len(grid.right)
    totals, counts = np.zeros(shape), np.zeros(shape)
    flicker = _FlickerSums(shape[1])
    for first in range(0, places, step):
        last = min(first + step, places) + len(windows[0]) - 1
        row, i = np.indices((last - first, columns))
        # Windows overlap from one lot of rows to the next, the rows that flicker is summed over do not.
        once = slice(0, last - first if last == rows else step)
        flicker.begin()
        for view in np.ndindex(shape):
            found, at_row, at_column = pixels_of_view(display, grid, view, row + first, i)
            at = np.where(found, at_row, 0), np.where(found, at_column, 0)
            a, b = (
                np.where(found[..., None], coded_values(picture.take(*at), picture.provenance.transfer), 0.0)
                for picture in (reference, test)
            )
            values = similarities(a, b, None if found.all() else found, windows)
            totals[view] += float(values.sum())
            counts[view] += values.size
            flicker.add((a - b)[once], found[once])
            progress(first * totals.size + (last - first) * (view[0] * shape[1] + view[1] + 1))
    with np.errstate(invalid="ignore"):
        return ViewSimilarity(totals / counts, grid.exact), flicker.flicker()


class _FlickerSums:
    """Sums for :func:`lippmann.quality.flicker.view_flicker`, from views that come row by row, ``columns`` to a row."""

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._squared = self._own = 0.0
        self._pairs = 0
        self._last: list[tuple[Real, Flags]] = []
        self._count = 0

    def begin(self) -> None:
        """The views begin anew, at other places."""
        self._last, self._count = [], 0

    def add(self, error: Real, found: Flags) -> None:
        """The next view's errors ``(..., 3)`` and where there are any."""
        if self._last and self._count % self._columns:
            self._pair(self._last[-1], (error, found))
        if len(self._last) == self._columns:
            self._pair(self._last.pop(0), (error, found))
        self._last.append((error, found))
        self._count += 1

    def _pair(self, before: tuple[Real, Flags], after: tuple[Real, Flags]) -> None:
        both = before[1] & after[1]
        one, other = before[0][both], after[0][both]
        self._squared += float(np.square(other - one).sum())
        self._own += 0.5 * float(np.square(one).sum() + np.square(other).sum())
        self._pairs += one.size

    def flicker(self) -> Flicker | None:
        """The flicker; None without neighbours."""
        return Flicker(self._squared / self._pairs, self._own / self._pairs) if self._pairs else None
