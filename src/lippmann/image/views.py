"""Views: one pixel of every micro-image, seen from one direction.

Where a whole number of pixels lies from lens to lens (and from lens row to lens row), view ``(ky, kx)`` is the pixel
``(ky, kx)`` of every micro-image: an exact permutation. The place of that pixel behind its lens, and so the direction,
is the same for all lenses, except that slanted lenses and odd rows of hexagonal lenses may stand a part of a pixel
aside; :func:`view_grid` tells how much.

Elsewhere no pixel stands at the same place behind every lens. Then the views are as many as whole pixels fit a
lens, spread evenly over it, and every lens gives what it shows there: its own nearest pixel, or a value interpolated
linearly between its own pixels.

A lens shows the pixel at its right end to the left: a larger ``kx`` is seen from further left, a larger ``ky`` from
further up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display, micro_image_extent, micro_image_shape
from lippmann.display.lens_grid import BOUNDARY_TOLERANCE, WHOLE_TOLERANCE
from lippmann.errors import PictureError
from lippmann.image.micro_images import Permutation, lens_indices, row_blocks

FloatArray = NDArray[np.float32]
Real = NDArray[np.float64]
Resampling = Literal["nearest", "linear"]

#: Parts of a pixel below which two places behind a lens are the same direction.
_SAME_PLACE = 1e-6


@dataclass(frozen=True)
class ViewGrid:
    """The places behind a lens that the views of a display show.

    Parameters
    ----------
    right, down:
        Pixels from the micro-image's centre to the place of the views, one number per ``kx`` and per ``ky``. A
        lenticular sheet has one ``ky``, level with the pixel itself (0).
    exact:
        Whether the views are an exact permutation of the pixels.
    spread:
        By how many pixels at most a pixel stands beside the place of its view; 0 unless some lenses stand between
        pixels where others do not.
    """

    right: tuple[float, ...]
    down: tuple[float, ...]
    exact: bool
    spread: float

    @property
    def note(self) -> str:
        """What is not exact about the views, as a sentence; empty if nothing is."""
        if not self.exact:
            return "the lenses do not cover whole pixels, so the views are resampled"
        if self.spread > _SAME_PLACE:
            return (
                f"the lenses stand between pixels, so the directions within a view differ by ±{self.spread:.2g} pixels"
            )
        return ""


def view_grid(display: Display) -> ViewGrid:
    """The views of a display."""
    across, down = display.pixels_per_lens
    if _is_whole(across) and (down is None or _is_whole(down)):
        return _pixel_views(display)
    width, height = micro_image_extent(display)
    places_down = (0.0,) if down is None else _evenly(height)
    return ViewGrid(right=_evenly(width), down=places_down, exact=False, spread=0.0)


def exact_view_shape(display: Display) -> tuple[int, int, int, int]:
    """``(ny, nx, lens_rows, lens_cols)`` of the views where they are an exact permutation, see :class:`ViewGrid`.

    Raises
    ------
    PictureError
        If they are not.
    """
    if not view_grid(display).exact:
        raise PictureError(
            f"the lenses of the display {display.name} do not cover whole pixels",
            rule="its views are resampled and cannot be put together again",
            fix="use micro-images",
        )
    rows, columns, ny, nx = Permutation(display).shape
    return (1, nx, ny, columns) if display.lens_array.layout == "lenticular" else (ny, nx, rows, columns)


def resampled_views(
    pixels: FloatArray, display: Display, resampling: Resampling
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Views ``(ny, nx, lens_rows, lens_cols, 3)`` of a picture at the places of :func:`view_grid`, and their mask.

    The mask ``(ny, nx, lens_rows, lens_cols)`` is False, and the value zero, where the place is not the lens's own or
    the lens has no pixel next to it. The lens rows of a lenticular sheet are the panel's rows.
    """
    grid = view_grid(display)
    u_center, v_center, lens = micro_image_centers(display)
    owners = _owner_table(display)
    shape = (len(grid.down), len(grid.right), *u_center.shape)
    views, mask = np.zeros((*shape, 3), dtype=np.float32), np.zeros(shape, dtype=np.bool_)
    reach = (0,) if display.lens_array.layout == "lenticular" else (-1, 0, 1)
    for ky, down in enumerate(grid.down):
        for kx, right in enumerate(grid.right):
            u, v = u_center + right, v_center + down
            i, j = display.lens_of(*display.panel_point(u, v, NUMPY), NUMPY)
            own = j * display.lens_grid.columns + i == lens
            found, row, column = _nearest_own_pixel(owners, lens, u, v, reach)
            found &= own
            views[ky, kx][found] = pixels[row[found], column[found]]
            mask[ky, kx] = found
            if resampling == "linear":
                _interpolate(views[ky, kx], pixels, owners, lens, u, v, found, lenticular=len(reach) == 1)
    return views, mask


def micro_image_centers(display: Display, rows: tuple[int, int] | None = None) -> tuple[Real, Real, NDArray[np.int32]]:
    """Centres ``(u, v)`` of the micro-images in pixel coordinates, and the flat index of their lenses.

    All are ``(lens_rows, lens_cols)``, or only the lens ``rows`` from the first up to the last. The rows of a
    lenticular sheet are the panel's: the centre is where the lens's axis, seen from the viewing distance, crosses the
    middle of the row.
    """
    first, last = rows or (0, lens_rows(display))
    row, i = np.indices((last - first, display.lens_grid.columns))
    return centers_of_lenses(display, row + first, i)


def centers_of_lenses(display: Display, row: NDArray[Any], i: NDArray[Any]) -> tuple[Real, Real, NDArray[np.int32]]:
    """:func:`micro_image_centers` of single lenses, by their rows and columns."""
    row, i = row.astype(np.float64), i.astype(np.float64)
    grid, lattice = display.lens_grid, display.lattice
    if lattice.layout != "lenticular":
        x, y = lattice.center(i, row, 0.0 * i, 0.0 * row, NUMPY)
        u, v = display.pixel_coordinates(x * display.magnification, y * display.magnification, NUMPY)
        return u, v, (row * grid.columns + i).astype(np.int32)
    _, y = display.panel_point(0.0 * row, row + 0.5, NUMPY)
    slant = math.radians(lattice.slant)
    across = (lattice.origin_x + i * lattice.pitch) * display.magnification
    u, v = display.pixel_coordinates(across / math.cos(slant) + y * math.tan(slant), y, NUMPY)
    return u, v, i.astype(np.int32)


def lens_rows(display: Display) -> int:
    """Rows of a view: those of the lenses; of a lenticular sheet the panel's."""
    return display.panel.height if display.lens_array.layout == "lenticular" else display.lens_grid.rows


def pixels_of_view(
    display: Display, grid: ViewGrid, view: tuple[int, int], row: NDArray[Any], i: NDArray[Any]
) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.intp]]:
    """Which pixels a view shows at some of its places, without any table of the whole panel.

    Parameters
    ----------
    grid:
        :func:`view_grid` of the display.
    view:
        ``(ky, kx)``.
    row, i:
        Rows and columns in the view, alike in shape.

    Returns
    -------
    Whether there is such a pixel, its row and its column on the panel; those of :meth:`IntegralImage.views` with the
    nearest pixel where views are resampled.
    """
    ky, kx = view
    u, v, lens = centers_of_lenses(display, row, i)
    owners = _owner_by_geometry(display)
    is_lenticular = display.lens_array.layout == "lenticular"
    if not grid.exact:
        u, v = u + grid.right[kx], v + grid.down[ky]
        owner_i, owner_j = display.lens_of(*display.panel_point(u, v, NUMPY), NUMPY)
        own = owner_j * display.lens_grid.columns + owner_i == lens
        found, at_row, at_column = _nearest_own_pixel(owners, lens, u, v, (0,) if is_lenticular else (-1, 0, 1))
        return found & own, at_row, at_column
    # The inverse of :func:`lippmann.display.pixel_indices_under_lens`.
    width, height = micro_image_extent(display)
    at_column = np.ceil(u - 0.5 * width + kx - 0.5 - BOUNDARY_TOLERANCE).astype(np.intp)
    at_row = row.astype(np.intp)
    if not is_lenticular:
        at_row = np.ceil(v - 0.5 * height + ky - 0.5 - BOUNDARY_TOLERANCE).astype(np.intp)
    return _is_own(owners, lens, at_row, at_column), at_row, at_column


def pixels_of_view_rows(
    display: Display, grid: ViewGrid, view: tuple[int, int], first: int, last: int
) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.intp]]:
    """:func:`pixels_of_view` of the rows ``first`` to before ``last`` of a view.

    The three broadcast to ``(last - first, lens columns)``; under upright cylinders, where all rows are alike, they are
    single rows and columns.
    """
    columns = display.lens_grid.columns
    if display.lattice.rows_are_alike:
        row, i = np.indices((1, columns))
        found, _, at_column = pixels_of_view(display, grid, view, row + first, i)
        return found, np.arange(first, last)[:, None], at_column
    row, i = np.indices((last - first, columns))
    return pixels_of_view(display, grid, view, row + first, i)


def panel_rows_of_view_rows(display: Display, first: int, last: int) -> tuple[int, int]:
    """First and past-the-last row of the panel in which the views' rows ``first`` to before ``last`` have pixels."""
    if display.lens_array.layout == "lenticular":
        return first, last
    ny, _ = micro_image_shape(display)
    columns = np.zeros((2, 1))
    _, v, _ = centers_of_lenses(display, np.array([[first], [last - 1]]), columns)
    top, bottom = float(v.min() - 0.5 * ny) - 1, float(v.max() + 0.5 * ny) + 1
    return max(0, math.floor(top)), min(display.panel.height, math.ceil(bottom))


def _pixel_views(display: Display) -> ViewGrid:
    """The views of a display with whole pixels from lens to lens: one per place of a micro-image's box."""
    width, height = micro_image_extent(display)
    ny, nx = micro_image_shape(display)
    across, down = _Offsets(), _Offsets()
    # Some rows at a time: a slanted sheet a metre high has sixty million centres.
    different = 1 if display.lattice.rows_are_alike else lens_rows(display)
    for rows in row_blocks(different, display.lens_grid.columns):
        u, v, _ = micro_image_centers(display, rows)
        across.add(u, width)
        down.add(v, height)
    right = tuple(across.middle + k for k in range(nx))
    if display.lens_array.layout == "lenticular":
        return ViewGrid(right, (0.0,), exact=True, spread=across.spread)
    return ViewGrid(
        right=right,
        down=tuple(down.middle + k for k in range(ny)),
        exact=True,
        spread=max(across.spread, down.spread),
    )


class _Offsets:
    """Where the first pixel of boxes of some size stands from their centres."""

    def __init__(self) -> None:
        self._low, self._high = math.inf, -math.inf

    def add(self, center: Real, size: float) -> None:
        # Pixel centres lie at whole numbers and a half. A centre within rounding noise of the box's edge is inside.
        edge = center - 0.5 * size
        offset = np.ceil(edge - 0.5 - BOUNDARY_TOLERANCE) + 0.5 - center
        self._low, self._high = min(self._low, float(offset.min())), max(self._high, float(offset.max()))

    @property
    def middle(self) -> float:
        return 0.5 * (self._low + self._high)

    @property
    def spread(self) -> float:
        return 0.5 * (self._high - self._low)


def _evenly(size: float) -> tuple[float, ...]:
    """Places that share ``size`` pixels evenly, one for each whole pixel."""
    count = max(1, math.floor(size + WHOLE_TOLERANCE))
    return tuple((k + 0.5) * size / count - 0.5 * size for k in range(count))


def _is_whole(count: float) -> bool:
    return abs(count - round(count)) <= WHOLE_TOLERANCE


def _nearest_own_pixel(
    owners: _Owners, lens: NDArray[np.int32], u: Real, v: Real, reach: tuple[int, ...]
) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.intp]]:
    """Whether a lens has a pixel at or next to a place, and the row and column of the nearest one."""
    # A place on the line between two pixels goes to the right or lower one, whatever the rounding noise.
    row, column = (np.floor(place + _SAME_PLACE).astype(np.intp) for place in (v, u))
    found = _is_own(owners, lens, row, column)
    best_row, best_column = row.copy(), column.copy()
    open_ = ~found
    distance = np.full(int(open_.sum()), np.inf)
    u, v, lens, row, column = u[open_], v[open_], lens[open_], row[open_], column[open_]
    for dv in reach:
        for du in (-1, 0, 1):
            squared = (column + (du + 0.5) - u) ** 2 + (row + (dv + 0.5) - v) ** 2
            nearer = _is_own(owners, lens, row + dv, column + du) & (squared < distance)
            distance[nearer] = squared[nearer]
            best_row[open_] = np.where(nearer, row + dv, best_row[open_])
            best_column[open_] = np.where(nearer, column + du, best_column[open_])
    found[open_] = np.isfinite(distance)
    return found, best_row, best_column


def _is_own(
    owners: _Owners, lens: NDArray[np.int32], row: NDArray[np.intp], column: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Whether a pixel is on the panel and belongs to the lens."""
    height, width = owners.shape
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    own: NDArray[np.bool_] = inside & (owners.lens(row.clip(0, height - 1), column.clip(0, width - 1)) == lens)
    return own


@dataclass(frozen=True)
class _Owners:
    """The flat index of the lens of pixels by row and column, on a panel of ``shape``."""

    shape: tuple[int, int]
    lens: Callable[[NDArray[np.intp], NDArray[np.intp]], NDArray[Any]]


def _owner_table(display: Display) -> _Owners:
    """Looked up: quick where many are asked for, at four bytes for every pixel."""
    table = lens_indices(display)
    return _Owners(table.shape, lambda row, column: table[row, column])


def _owner_by_geometry(display: Display) -> _Owners:
    """Worked out anew each time."""

    def lens(row: NDArray[np.intp], column: NDArray[np.intp]) -> NDArray[Any]:
        i, j = display.lens_of(*display.panel_point(column + 0.5, row + 0.5, NUMPY), NUMPY)
        flat: NDArray[Any] = j * display.lens_grid.columns + i
        return flat

    return _Owners((display.panel.height, display.panel.width), lens)


def _interpolate(
    view: FloatArray,
    pixels: FloatArray,
    owners: _Owners,
    lens: NDArray[np.int32],
    u: Real,
    v: Real,
    found: NDArray[np.bool_],
    *,
    lenticular: bool,
) -> None:
    """Replace the found values of a view by bilinear ones between the lens's own pixels."""
    column, row = np.floor(u - 0.5).astype(np.intp), np.floor(v - 0.5).astype(np.intp)
    right, down = u - 0.5 - column, v - 0.5 - row
    total, weights = np.zeros((*u.shape, 3)), np.zeros(u.shape)
    height, width = owners.shape
    for dv in (0,) if lenticular else (0, 1):
        for du in (0, 1):
            weight = (right if du else 1 - right) * (1.0 if lenticular else (down if dv else 1 - down))
            weight = np.where(_is_own(owners, lens, row + dv, column + du), weight, 0.0)
            at = (row + dv).clip(0, height - 1), (column + du).clip(0, width - 1)
            total += weight[..., None] * pixels[at]
            weights += weight
    usable = found & (weights > _SAME_PLACE)
    view[usable] = total[usable] / weights[usable][..., None]
