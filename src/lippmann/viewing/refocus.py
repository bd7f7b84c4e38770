"""Synthetic refocusing: the picture of a camera whose aperture is as wide as the display's field of view.

Each view is the picture of one point of the aperture. The picture at a point P of the focus plane is the mean over all
views: the line of sight from the view's eye to P meets one display lens and, through it, one pixel. On a display of
parallel views with whole pixels under every lens this is shift and sum,
``I(v, u) = mean over t, s of L(t, s, v + alpha (t - t0), u + alpha (s - s0))`` with ``alpha = z d / (g p)`` for the
plane at z, in units of lenses (R. Ng et al., Light field photography with a hand-held plenoptic camera, 2005). In the
lens plane, z = 0, it is the mean of each micro-image.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display
from lippmann.errors import UsageError
from lippmann.image.integral_image import IntegralImage
from lippmann.image.stored_values import FloatArray
from lippmann.image.streamed import LargePicture
from lippmann.image.views import pixels_of_view, view_grid
from lippmann.options.option import checked
from lippmann.runtime.machine import usable_cores
from lippmann.runtime.row_threads import Bands
from lippmann.viewing.replay import FAR, Eye, Real, check_size, default_size, eye_of_offset, lens_plane_points, pixel_at

Index = NDArray[np.intp]
Flags = NDArray[np.bool_]
View = tuple[int, int]

#: Default limit on the width of the picture, in pixels: every pixel takes a look-up in every view.
DEFAULT_WIDTH = 1024


@checked
def refocus(image: IntegralImage | LargePicture, plane: float, *, size: tuple[int, int] | None = None) -> FloatArray:
    """Picture focused on the plane at z = ``plane``.

    Parameters
    ----------
    image:
        The native picture.
    plane:
        Height of the plane over the lens plane in mm, positive toward the viewer, below the viewing distance.
    size:
        Width and height of the result in pixels, 1 to 65535. None: the panel's, at most 1024 wide.

    Returns
    -------
    ``(height, width, 3)`` float32 linear RGB of the part of the plane in front of (or behind) the panel's rectangle;
    black where no line of sight meets the panel.

    Raises
    ------
    UsageError
        If the plane is not finite or not below the viewing distance, or the size is out of range.
    """
    return next(focal_planes(image, [plane], size=size))


def check_planes(planes: Sequence[float], display: Display) -> None:
    """Refuse a plane that is no finite height in mm below the viewing distance."""
    for plane in planes:
        # Parallel views are taken from FAR away.
        if not -FAR < plane < min(display.viewing_distance, FAR):
            is_far = display.viewing_distance > FAR
            most = f"{FAR:g} mm" if is_far else f"the viewing distance of {display.viewing_distance:g} mm"
            rule = f"must be above -{FAR:g} mm and below {most}"
            raise UsageError(f"{plane!r}", parameter="plane", rule=rule)


def focal_planes(
    image: IntegralImage | LargePicture, planes: Sequence[float], *, size: tuple[int, int] | None = None
) -> Iterator[FloatArray]:
    """Pictures focused on several planes, one after the other; the views are found once for all.

    Parameters
    ----------
    image, size:
        As for :func:`refocus`.
    planes:
        Heights of the planes over the lens plane in mm.

    Returns
    -------
    Iterator of ``(height, width, 3)`` float32 linear RGB; errors are those of :func:`refocus`, raised at once.
    """
    display = image.display
    check_planes(planes, display)
    width, height = check_size(default_size(display, DEFAULT_WIDTH) if size is None else size)
    if isinstance(image, IntegralImage) and display.lens_array.layout != "lenticular":
        return _refocus_compiled(image, planes, width, height)
    return _refocus_interpreted(image, planes, width, height)


def _refocus_interpreted(
    image: IntegralImage | LargePicture, planes: Sequence[float], width: int, height: int
) -> Iterator[FloatArray]:
    """:func:`focal_planes` for all pictures and lenses."""
    look_up, display = _view_lookup(image), image.display
    eyes = _eyes(display)
    for plane in planes:
        picture = np.zeros((height, width, 3), dtype=np.float32)
        for rows, x, y in lens_plane_points(display, width, height):
            total, count = np.zeros((*x.shape, 3), dtype=np.float32), np.zeros(x.shape, dtype=np.float32)
            for view, eye in eyes.items():
                row, column, inside = _line_of_sight(display, eye, (x, y, plane))
                colors, exists = look_up(view, row, column)
                inside &= exists
                total += colors * inside[..., None]
                count += inside
            picture[rows] = total / np.maximum(count, 1)[..., None]
        yield picture


def _refocus_compiled(image: IntegralImage, planes: Sequence[float], width: int, height: int) -> Iterator[FloatArray]:
    """:func:`focal_planes` of a picture in memory behind square or hexagonal lenses, compiled and on all cores."""
    from lippmann.viewing.refocus_kernel import add_views

    display, lattice = image.display, image.display.lattice
    # In one order whatever the lenses: the kernel is compiled for each.
    views, masks = (np.ascontiguousarray(values.reshape(-1, *values.shape[2:])) for values in image.views_and_mask())
    eyes = np.array(list(_eyes(display).values()))
    numbers = [lattice.pitch, lattice.row_pitch, lattice.origin_x, lattice.origin_y, lattice.tolerance]
    numbers.append(display.magnification)
    x, _ = display.panel_point((np.arange(width) + 0.5) * (display.panel.width / width), np.zeros(width))
    _, y = display.panel_point(np.zeros(height), (np.arange(height) + 0.5) * (display.panel.height / height))
    for plane in planes:
        total = np.zeros((height, width, 3), dtype=np.float32)
        steps = np.zeros((height, width + 1), dtype=np.int32)
        place = x, y, float(plane), lattice.layout == "hexagonal", np.array(numbers)
        bands = Bands(usable_cores())
        bands.lines(add_views, height, views, masks, eyes, *place, total, steps)
        count = np.cumsum(steps[:, :-1], axis=1, dtype=np.int32).astype(np.float32)
        total /= np.maximum(count, 1)[..., None]
        yield total


def _eyes(display: Display) -> dict[View, Eye]:
    """Eyes of all views, by ``(ky, kx)``."""
    grid = view_grid(display)
    return {
        (ky, kx): eye_of_offset(display, right, down)
        for ky, down in enumerate(grid.down)
        for kx, right in enumerate(grid.right)
    }


def _view_lookup(image: IntegralImage | LargePicture) -> Callable[[View, Index, Index], tuple[FloatArray, Flags]]:
    """A function of view, rows and columns that returns values ``(..., 3)`` and whether there are such pixels."""
    if isinstance(image, IntegralImage):
        views, masks = image.views_and_mask()
        return lambda view, row, column: (views[view][row, column], masks[view][row, column])
    display, grid = image.display, view_grid(image.display)

    def from_pixels(view: View, row: Index, column: Index) -> tuple[FloatArray, Flags]:
        exists, pixel_row, pixel_column = pixels_of_view(display, grid, view, row, column)
        return image.take(np.where(exists, pixel_row, 0), np.where(exists, pixel_column, 0)), exists

    return from_pixels


def _line_of_sight(
    display: Display, eye: Eye, point: tuple[Real, Real, float]
) -> tuple[Index, Index, NDArray[np.bool_]]:
    """Row and column of the eye's view at which it sees the points, and whether there is a lens (and row)."""
    x, y, z = point
    # From the eye through the point to the lens plane.
    stretch = z / (eye[2] - z)
    lens_x, lens_y = x + (x - eye[0]) * stretch, y + (y - eye[1]) * stretch
    i, j = display.lens_of(lens_x * display.magnification, lens_y * display.magnification, NUMPY)
    column, row = i.astype(np.intp), j.astype(np.intp)
    rows = display.lens_grid.rows
    if display.lens_array.layout == "lenticular":
        panel_point = display.visible_panel_point(*eye, lens_x, lens_y, NUMPY)
        row, rows = pixel_at(display.pixel_coordinates(*panel_point)[1]), display.panel.height
    inside = (column >= 0) & (column < display.lens_grid.columns) & (row >= 0) & (row < rows)
    return np.where(inside, row, 0), np.where(inside, column, 0), inside
