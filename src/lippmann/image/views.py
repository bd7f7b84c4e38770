"""Views (sub-aperture views): one pixel of every micro-image, seen from one direction.

Where the distance from lens to lens (and from lens row to lens row) is a whole number of pixels, view ``(ky, kx)`` is
pixel ``(ky, kx)`` of every micro-image: an exact permutation. That pixel lies at the same place behind every lens, so
the view has one direction. Slanted lenses and odd rows of hexagonal lenses may be displaced by a part of a pixel;
:attr:`ViewGrid.spread` is the largest displacement.

Elsewhere no pixel lies at the same place behind every lens. The number of views is then the number of whole pixels
under a lens; their places are evenly spaced. Each lens contributes its own nearest pixel, or a linear interpolation
between its own pixels.

A lens shows the pixel at its right end to the left: a larger ``kx`` is seen from further left, a larger ``ky`` from
further up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display, micro_image_extent, micro_image_shape
from lippmann.display.lens_array import BOUNDARY_TOLERANCE, WHOLE_TOLERANCE
from lippmann.display.micro_image_layout import is_whole, lens_indices, row_blocks
from lippmann.errors import PictureError
from lippmann.image.micro_images import Permutation
from lippmann.image.stored_values import FloatArray, Indices

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: Whether each place shows a pixel, and the row and column of that pixel on the panel.
Pixels = tuple[Flags, NDArray[np.intp], NDArray[np.intp]]
Resampling = Literal["nearest", "linear"]

#: Distance in pixels below which two places behind a lens count as the same direction.
_SAME_PLACE = 1e-6


@dataclass(frozen=True)
class ViewGrid:
    """Places behind a lens that the views of a display show.

    Parameters
    ----------
    right, down:
        Offset of each ``kx`` and each ``ky`` from the micro-image's centre, in pixels. A lenticular sheet has one
        ``ky``, 0.
    exact:
        Whether the views are a permutation of the pixels.
    spread:
        Largest distance in pixels between a pixel and the place of its view; above 0 where some lenses are centred
        between pixels and others are not.
    """

    right: tuple[float, ...]
    down: tuple[float, ...]
    exact: bool
    spread: float

    @property
    def note(self) -> str:
        """A sentence on how the views deviate from exact ones; empty if they do not."""
        if not self.exact:
            return "the lenses do not cover whole pixels, so the views are resampled"
        if self.spread > _SAME_PLACE:
            return (
                f"the lenses stand between pixels, so the directions within a view differ by ±{self.spread:.2g} pixels"
            )
        return ""


def view_grid(display: Display) -> ViewGrid:
    """Views of a display: their places, and whether they are exact."""
    across, down = display.pixels_per_lens
    if is_whole(across) and (down is None or is_whole(down)):
        return _pixel_views(display)
    width, height = micro_image_extent(display)
    places_down = (0.0,) if down is None else _evenly(height)
    return ViewGrid(right=_evenly(width), down=places_down, exact=False, spread=0.0)


def exact_view_shape(display: Display) -> tuple[int, int, int, int]:
    """Shape ``(ny, nx, lens_rows, lens_cols)`` of exact views.

    Raises
    ------
    PictureError
        If the display's views are resampled.
    """
    if not view_grid(display).exact:
        raise PictureError(
            f"the lenses of the display {display.name} do not cover whole pixels",
            rule="its views are resampled and cannot be put together again",
            fix="use micro-images",
        )
    return view_shape(display)


def view_shape(display: Display) -> tuple[int, int, int, int]:
    """Shape ``(t, s, v, u)`` of the light field of a display's pictures, whose lenses cover whole pixels."""
    rows, columns, ny, nx = Permutation(display).shape
    return (1, nx, ny, columns) if display.lens_array.layout == "lenticular" else (ny, nx, rows, columns)


def resampled_views(pixels: FloatArray, display: Display, resampling: Resampling) -> tuple[FloatArray, Flags]:
    """Views of a picture at the places of :func:`view_grid`.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` values of the panel's size.
    display:
        Display of the picture.
    resampling:
        ``nearest`` takes the lens's own pixel next to the place; ``linear`` interpolates between its own pixels.

    Returns
    -------
    Views ``(ny, nx, lens_rows, lens_cols, 3)`` and their mask ``(ny, nx, lens_rows, lens_cols)``. The mask is False,
    and the value zero, where the place is another lens's or the lens has no pixel next to it. The lens rows of a
    lenticular sheet are the panel's rows.
    """
    grid = view_grid(display)
    u_center, v_center, lens = micro_image_centers(display)
    owners = _owner_table(display)
    shape = (len(grid.down), len(grid.right), *u_center.shape)
    views, mask = np.zeros((*shape, 3), dtype=np.float32), np.zeros(shape, dtype=np.bool_)
    for ky, kx in np.ndindex(shape[:2]):
        u, v = u_center + grid.right[kx], v_center + grid.down[ky]
        valid, row, column = _nearest_pixels(display, owners, lens, u, v)
        views[ky, kx][valid] = pixels[row[valid], column[valid]]
        mask[ky, kx] = valid
        if resampling == "linear":
            _interpolate(views[ky, kx], pixels, owners, lens, u, v, valid, lenticular=_is_lenticular(display))
    return views, mask


def micro_image_centers(display: Display, rows: tuple[int, int] | None = None) -> tuple[Real, Real, NDArray[np.int32]]:
    """Centres ``(u, v)`` of the micro-images in pixel coordinates, and the flat index of their lenses.

    Each is ``(lens_rows, lens_cols)``, or holds the lens ``rows`` from the first to before the last. The rows of a
    lenticular sheet are the panel's: there the centre is the point at which the lens's axis, seen from the viewing
    distance, crosses the middle of the row.
    """
    first, last = rows or (0, lens_rows(display))
    row, i = np.indices((last - first, display.lens_grid.columns))
    return centers_of_lenses(display, row + first, i)


def centers_of_lenses(display: Display, rows: Indices, columns: Indices) -> tuple[Real, Real, NDArray[np.int32]]:
    """Centres ``(u, v)`` in pixel coordinates and flat lens indices of the micro-images in these lens rows and columns.

    The three have the shape of ``rows`` and ``columns``; see :func:`micro_image_centers`.
    """
    row, i = rows.astype(np.float64), columns.astype(np.float64)
    grid, lattice = display.lens_grid, display.lattice
    if lattice.layout != "lenticular":
        x, y = lattice.center(i, row, 0.0 * i, 0.0 * row, NUMPY)
        u, v = display.pixel_coordinates(x * display.magnification, y * display.magnification)
        return u, v, (row * grid.columns + i).astype(np.int32)
    _, y = display.panel_point(0.0 * row, row + 0.5)
    scale = display.magnification
    u, v = display.pixel_coordinates(lattice.axis_at(i, y / scale) * scale, y)
    return u, v, i.astype(np.int32)


def lens_rows(display: Display) -> int:
    """Rows of a view: the rows of lenses, or the panel's rows for a lenticular sheet."""
    return display.panel.height if _is_lenticular(display) else display.lens_grid.rows


def pixels_of_view(display: Display, grid: ViewGrid, view: tuple[int, int], row: Indices, i: Indices) -> Pixels:
    """The panel's pixels that a view shows at some of its places; needs no table of the whole panel.

    Resampled views show their nearest pixel, as :meth:`lippmann.image.IntegralImage.views` does by default.

    Parameters
    ----------
    display:
        The display.
    grid:
        :func:`view_grid` of the display.
    view:
        ``(ky, kx)``.
    row, i:
        Rows and columns in the view, of one shape.

    Returns
    -------
    Whether there is such a pixel, its row and its column on the panel, all of the shape of ``row``.
    """
    ky, kx = view
    u, v, lens = centers_of_lenses(display, row, i)
    owners = _owner_by_geometry(display)
    if not grid.exact:
        return _nearest_pixels(display, owners, lens, u + grid.right[kx], v + grid.down[ky])
    # The inverse of :func:`lippmann.display.pixel_indices_under_lens`.
    width, height = micro_image_extent(display)
    at_column = np.ceil(u - 0.5 * width + kx - 0.5 - BOUNDARY_TOLERANCE).astype(np.intp)
    at_row = row.astype(np.intp)
    if not _is_lenticular(display):
        at_row = np.ceil(v - 0.5 * height + ky - 0.5 - BOUNDARY_TOLERANCE).astype(np.intp)
    return _is_own(owners, lens, at_row, at_column), at_row, at_column


def pixels_of_view_rows(display: Display, grid: ViewGrid, view: tuple[int, int], first: int, last: int) -> Pixels:
    """The panel's pixels that a view shows in its rows from ``first`` to before ``last``; see :func:`pixels_of_view`.

    The three arrays broadcast to ``(last - first, lens columns)``; under upright cylinders, where all rows are alike,
    they are single rows and columns.
    """
    alike = display.lattice.rows_are_alike
    row, i = np.indices((1 if alike else last - first, display.lens_grid.columns))
    valid, at_row, at_column = pixels_of_view(display, grid, view, row + first, i)
    return valid, np.arange(first, last)[:, None] if alike else at_row, at_column


def panel_rows_of_view_rows(display: Display, first: int, last: int) -> tuple[int, int]:
    """First and past-the-last row of the panel that hold all pixels of the views' rows ``first`` to before ``last``."""
    if _is_lenticular(display):
        return first, last
    ny, _ = micro_image_shape(display)
    _, v, _ = centers_of_lenses(display, np.array([first, last - 1]), np.zeros(2, dtype=np.intp))
    top, bottom = float(v.min() - 0.5 * ny) - 1, float(v.max() + 0.5 * ny) + 1
    return max(0, math.floor(top)), min(display.panel.height, math.ceil(bottom))


def _pixel_views(display: Display) -> ViewGrid:
    """Exact views: one per place of a micro-image's box."""
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
    if _is_lenticular(display):
        return ViewGrid(right, (0.0,), exact=True, spread=across.spread)
    places_down = tuple(down.middle + k for k in range(ny))
    return ViewGrid(right, places_down, exact=True, spread=max(across.spread, down.spread))


class _Offsets:
    """Offsets of the first pixel of boxes from the boxes' centres: their middle, and half their range."""

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
    """Centres of equal parts of ``size`` pixels about 0, one part for each whole pixel."""
    count = max(1, math.floor(size + WHOLE_TOLERANCE))
    return tuple((k + 0.5) * size / count - 0.5 * size for k in range(count))


def _is_lenticular(display: Display) -> bool:
    return display.lens_array.layout == "lenticular"


@dataclass(frozen=True)
class _Owners:
    """Flat index of the lens that owns a pixel, by row and column, on a panel of ``shape``."""

    shape: tuple[int, int]
    lens: Callable[[Indices, Indices], Indices]


def _owner_table(display: Display) -> _Owners:
    """Owners from a table: fast where many are looked up, at four bytes for every pixel of the panel."""
    table = lens_indices(display)
    return _Owners((display.panel.height, display.panel.width), lambda row, column: table[row, column])


def _owner_by_geometry(display: Display) -> _Owners:
    """Owners computed for each look-up."""

    def lens(row: Indices, column: Indices) -> Indices:
        i, j = display.lens_of(*display.panel_point(column + 0.5, row + 0.5), NUMPY)
        flat: Indices = j * display.lens_grid.columns + i
        return flat

    return _Owners((display.panel.height, display.panel.width), lens)


def _is_own(owners: _Owners, lens: Indices, row: Indices, column: Indices) -> Flags:
    """Whether a pixel is on the panel and belongs to the lens."""
    height, width = owners.shape
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    own: Flags = inside & (owners.lens(row.clip(0, height - 1), column.clip(0, width - 1)) == lens)
    return own


def _nearest_pixels(display: Display, owners: _Owners, lens: NDArray[np.int32], u: Real, v: Real) -> Pixels:
    """Nearest pixel of each lens, at or next to the place ``(u, v)``; none where the place belongs to another lens."""
    i, j = display.lens_of(*display.panel_point(u, v), NUMPY)
    own_place = j * display.lens_grid.columns + i == lens
    # A place on the line between two pixels goes to the right or lower one, whatever the rounding noise.
    row, column = (np.floor(place + _SAME_PLACE).astype(np.intp) for place in (v, u))
    valid = _is_own(owners, lens, row, column)
    best_row, best_column = row.copy(), column.copy()
    open_ = ~valid
    distance = np.full(int(open_.sum()), np.inf)
    u, v, lens, row, column = u[open_], v[open_], lens[open_], row[open_], column[open_]
    for dv in (0,) if _is_lenticular(display) else (-1, 0, 1):
        for du in (-1, 0, 1):
            squared = (column + (du + 0.5) - u) ** 2 + (row + (dv + 0.5) - v) ** 2
            nearer = _is_own(owners, lens, row + dv, column + du) & (squared < distance)
            distance[nearer] = squared[nearer]
            best_row[open_] = np.where(nearer, row + dv, best_row[open_])
            best_column[open_] = np.where(nearer, column + du, best_column[open_])
    valid[open_] = np.isfinite(distance)
    return valid & own_place, best_row, best_column


def _interpolate(
    view: FloatArray,
    pixels: FloatArray,
    owners: _Owners,
    lens: NDArray[np.int32],
    u: Real,
    v: Real,
    valid: Flags,
    *,
    lenticular: bool,
) -> None:
    """Replace the values of a view where ``valid`` by bilinear ones between the lens's own pixels."""
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
    usable = valid & (weights > _SAME_PLACE)
    view[usable] = total[usable] / weights[usable][..., None]
