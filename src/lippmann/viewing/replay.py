"""What an eye in front of the display sees.

The eye looks at a point of the lens plane; the lens there shows it one point of the panel
(:meth:`lippmann.display.Display.panel_point_seen_by`), so a round lens is filled with one colour, and a cylindrical
one with one colour across. Outside the display's field a lens shows a pixel of its neighbour's micro-image, as a real
display does.

Pictures replayed are perspective pictures of the panel's rectangle in the lens plane: the frame of the picture is the
rectangle itself, wherever the eye is.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display
from lippmann.errors import UsageError
from lippmann.image.picture import Picture
from lippmann.image.stored_values import FloatArray
from lippmann.image.views import view_grid

Eye = tuple[float, float, float]
Real = NDArray[np.float64]
Filter = Literal["nearest", "linear"]

#: Widest picture that is made where nothing is said, in pixels.
DEFAULT_WIDTH = 2048

#: An eye so far away (mm) counts as infinitely far: over a panel of a metre its lines are parallel to 1e-7 pixels.
FAR = 1e12

#: Parts of a pixel by which a point may miss a boundary between pixels and still count as lying on it; above what FAR
#: and rounding leave, far below what can be seen.
_ON_BOUNDARY = 1e-6

#: Points whose geometry is computed at a time: few enough for their arrays to stay in the processor's cache.
_BLOCK = 1 << 15


@dataclass(frozen=True, eq=False)
class LensSamples:
    """What one eye sees through every lens, at the lens's centre.

    All are ``(lens_rows, lens_cols, ...)``; the rows of a lenticular sheet are the panel's, and its points those of the
    lens's axis through which the eye sees the middle of the row.

    Parameters
    ----------
    points:
        ``(..., 2)`` places in the lens plane, mm.
    pixels:
        ``(..., 2)`` column and row of the pixel seen; may lie off the panel.
    offsets:
        ``(..., 2)`` how far right and down of that pixel's centre the eye looks, in pixels.
    colors:
        ``(..., 3)`` linear RGB of the pixel; zero off the panel.
    own:
        Whether the pixel is on the panel and belongs to the lens: else the eye is outside its field.
    """

    points: Real
    pixels: NDArray[np.int64]
    offsets: Real
    colors: FloatArray
    own: NDArray[np.bool_]


def replay(
    image: Picture,
    eye: Eye | None = None,
    *,
    size: tuple[int, int] | None = None,
    filter: Filter = "nearest",
    subpixels: bool | None = None,
) -> FloatArray:
    """The picture that an eye sees through the lenses.

    Parameters
    ----------
    image:
        What the panel shows.
    eye:
        ``(x, y, z)`` in the display frame, mm, z > 0; by default :func:`default_eye`.
    size:
        Width and height of the picture in pixels; by default the panel's, at most 2048 wide.
    filter:
        ``nearest`` takes the pixel at the panel point seen; ``linear`` interpolates between the pixels about it that
        belong to the same lens.
    subpixels:
        Whether red, green and blue lie at their own places of the pixel, as on the real panel; by default if the
        picture was rendered so.

    Returns
    -------
    ``(height, width, 3)`` float32 linear RGB; black where the eye looks past the panel.

    Raises
    ------
    UsageError
        If the eye is not in front of the lens plane, or the size or filter is impossible.
    """
    eye = _checked_eye(default_eye(image.display) if eye is None else eye)
    width, height = checked_size(default_size(image.display) if size is None else size)
    if filter not in get_args(Filter):
        raise UsageError(f"the filter {filter!r} is not known", rule=f"known are {', '.join(get_args(Filter))}")
    subpixels = image.provenance.subpixels if subpixels is None else subpixels
    seen = np.empty((height, width, 3), dtype=np.float32)
    for rows, x, y in lens_plane_points(image.display, width, height):
        panel_x, panel_y = image.display.panel_point_seen_by(*eye, x, y, NUMPY)
        seen[rows] = _panel_colors(image, panel_x, panel_y, filter, subpixels)
    return seen


def replay_at_lens_centers(image: Picture, eye: Eye) -> LensSamples:
    """One sample per lens, unfiltered: for measuring, and for comparing with a picture taken at the same points.

    Raises
    ------
    UsageError
        If the eye is not in front of the lens plane.
    """
    eye = _checked_eye(eye)
    display = image.display
    x, y, i, j = _lens_points(display, eye)
    panel_x, panel_y = display.panel_point_seen_by(*eye, x, y, NUMPY)
    u, v = display.pixel_coordinates(panel_x, panel_y, NUMPY)
    column, row = pixel_at(u), pixel_at(v)
    owner_i, owner_j = display.lens_of(*display.panel_point(column + 0.5, row + 0.5, NUMPY), NUMPY)
    inside = is_on_panel(display, column, row)
    colors = np.zeros((*x.shape, 3), dtype=np.float32)
    colors[inside] = image.take(row[inside], column[inside])
    return LensSamples(
        points=np.stack([x, y], axis=-1),
        pixels=np.stack([column, row], axis=-1),
        offsets=np.stack([u - (column + 0.5), v - (row + 0.5)], axis=-1),
        colors=colors,
        own=inside & (owner_i == i) & (owner_j == j),
    )


def sweep(
    image: Picture,
    start: Eye,
    stop: Eye,
    frames: int,
    *,
    size: tuple[int, int] | None = None,
    filter: Filter = "nearest",
    subpixels: bool | None = None,
) -> Iterator[FloatArray]:
    """The pictures of an eye that moves from ``start`` to ``stop`` in even steps; parameters as for :func:`replay`.

    Raises
    ------
    UsageError
        If there is less than one frame, or as :func:`replay`.
    """
    if frames < 1:
        raise UsageError(f"{frames} frames will not do", rule="at least 1 is needed")
    places = np.linspace(_checked_eye(start), _checked_eye(stop), frames)
    eyes: list[Eye] = [(float(x), float(y), float(z)) for x, y, z in places]
    return (replay(image, eye, size=size, filter=filter, subpixels=subpixels) for eye in eyes)


def default_eye(display: Display) -> Eye:
    """The middle of the place to look from: at the viewing distance, or, if that is infinite, well within the field.

    Parallel views overlap from the distance at which the field is as wide as the panel; the eye is half as far again.
    """
    if math.isfinite(display.viewing_distance):
        return 0.0, 0.0, display.viewing_distance
    half_field = math.radians(display.field_of_view / 2)
    across = 0 if display.lens_array.layout == "lenticular" else 1
    extent = max(display.size_mm[: across + 1])
    return 0.0, 0.0, 1.5 * extent / (2 * math.tan(half_field))


def eye_of_view(display: Display, ky: int, kx: int) -> Eye:
    """Where the eye is that sees view ``(ky, kx)`` of :meth:`IntegralImage.views` through all lenses at once.

    It is at the viewing distance; if that is infinite, at :data:`FAR`.

    Raises
    ------
    UsageError
        If there is no such view.
    """
    grid = view_grid(display)
    if not (0 <= ky < len(grid.down) and 0 <= kx < len(grid.right)):
        rule = f"the display {display.name} has {len(grid.down)} x {len(grid.right)} (down x right)"
        raise UsageError(f"there is no view ({ky}, {kx})", rule=rule)
    return eye_of_offset(display, grid.right[kx], grid.down[ky])


def eye_of_offset(display: Display, right: float, down: float) -> Eye:
    """Where the eye is that sees, through all lenses, the place so many pixels from the middle of the micro-image."""
    distance = display.viewing_distance if math.isfinite(display.viewing_distance) else FAR
    # From the panel through the lens's centre: what lies to the right of the middle is seen from the left.
    scale = -display.panel.pixel_pitch * distance / display.gap
    if display.lens_array.layout != "lenticular":
        return right * scale, -down * scale, distance
    lattice = display.lattice
    across = lattice.across(right * scale, 0.0)
    x, y = lattice.from_axes(across, 0.0)
    return float(x), float(y), distance


def default_size(display: Display, widest: int = DEFAULT_WIDTH) -> tuple[int, int]:
    """Width and height of the panel in pixels, shrunk in proportion to at most ``widest``."""
    panel = display.panel
    shrink = min(1.0, widest / panel.width)
    return max(1, round(panel.width * shrink)), max(1, round(panel.height * shrink))


def lens_plane_points(display: Display, width: int, height: int) -> Iterator[tuple[slice, Real, Real]]:
    """The points (mm) of the lens plane behind the pixels of a picture of the panel's rectangle, in blocks of rows."""
    step = max(1, _BLOCK // width)
    panel = display.panel
    u = (np.arange(width) + 0.5) * (panel.width / width)
    v = (np.arange(height) + 0.5) * (panel.height / height)
    for first in range(0, height, step):
        rows = slice(first, min(first + step, height))
        columns, lines = np.meshgrid(u, v[rows])
        x, y = display.panel_point(columns, lines, NUMPY)
        yield rows, x, y


def pixel_at(coordinate: Real) -> NDArray[np.int64]:
    """The column (row) that holds a continuous pixel coordinate; on a boundary the one to the right (below)."""
    # Far off the panel coordinates exceed all integers; there the exact number says nothing.
    return np.floor(np.clip(coordinate, -1e9, 1e9) + _ON_BOUNDARY).astype(np.int64)


def is_on_panel(display: Display, column: NDArray[np.int64], row: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether these are pixels of the panel."""
    inside: NDArray[np.bool_] = (column >= 0) & (column < display.panel.width)
    return inside & (row >= 0) & (row < display.panel.height)


def _panel_colors(image: Picture, x: Real, y: Real, filter_: Filter, subpixels: bool) -> FloatArray:
    """``(..., 3)`` colours of panel points (mm); zero off the panel."""
    colors = np.empty((*x.shape, 3), dtype=np.float32)
    take = _nearest if filter_ == "nearest" else _linear
    panel = image.display.panel
    if not subpixels:
        colors[...] = take(image, x, y, slice(0, 3), (0.0, 0.0))
        return colors
    for channel, offset in enumerate(panel.subpixel_offsets):
        part = slice(channel, channel + 1)
        if panel.subpixel_cells is not None:
            colors[..., part] = _of_cells(image, x, y, channel, filter_)
            continue
        colors[..., part] = take(image, x, y, part, offset)
    return colors


def _nearest(image: Picture, x: Real, y: Real, channels: slice, offset: tuple[float, float]) -> FloatArray:
    """Values of the (sub-)pixels that hold the points; ``offset`` is the sub-pixel's place, right and down."""
    u, v = image.display.pixel_coordinates(x, y, NUMPY)
    column, row = pixel_at(u - offset[0]), pixel_at(v - offset[1])
    inside = is_on_panel(image.display, column, row)
    values = image.take(np.where(inside, row, 0), np.where(inside, column, 0), channels)
    return np.where(inside[..., None], values, np.float32(0))


def _linear(image: Picture, x: Real, y: Real, channels: slice, offset: tuple[float, float]) -> FloatArray:
    """Values interpolated between those (sub-)pixels about the points that belong to the points' own lens."""
    display = image.display
    lens = display.lens_of(x, y, NUMPY)
    u, v = display.pixel_coordinates(x, y, NUMPY)
    u, v = u - offset[0] - 0.5, v - offset[1] - 0.5
    first_column, first_row = pixel_at(u), pixel_at(v)
    right, down = np.clip(u - first_column, 0, 1), np.clip(v - first_row, 0, 1)
    total, weights = np.zeros((*x.shape, channels.stop - channels.start)), np.zeros(x.shape)
    for dv, weight_v in ((0, 1 - down), (1, down)):
        for du, weight_u in ((0, 1 - right), (1, right)):
            column, row = first_column + du, first_row + dv
            place = display.panel_point(column + (0.5 + offset[0]), row + (0.5 + offset[1]), NUMPY)
            owner = display.lens_of(*place, NUMPY)
            usable = is_on_panel(display, column, row) & (owner[0] == lens[0]) & (owner[1] == lens[1])
            weight = np.where(usable, weight_u * weight_v, 0.0)
            values = image.take(np.where(usable, row, 0), np.where(usable, column, 0), channels)
            total += weight[..., None] * values
            weights += weight
    alone = _nearest(image, x, y, channels, offset)
    # Next to the edge of a micro-image all pixels about a point may belong to neighbours.
    usable = weights > _ON_BOUNDARY
    return np.where(usable[..., None], total / np.where(usable, weights, 1.0)[..., None], alone).astype(np.float32)


def _of_cells(image: Picture, x: Real, y: Real, channel: int, filter_: Filter) -> FloatArray:
    """Values of one colour's sub-pixels at the points, ``(..., 1)``, where pixels are of several kinds.

    The grid of such sub-pixels is uneven: ``nearest`` takes the one whose centre is nearest, ``linear`` weighs those
    less than a pixel away, right and down, by their distances.
    """
    display = image.display
    lens = display.lens_of(x, y, NUMPY)
    u, v = display.pixel_coordinates(x, y, NUMPY)
    middle_column, middle_row = pixel_at(u), pixel_at(v)
    nearest, best = np.zeros(x.shape, dtype=np.float32), np.full(x.shape, np.inf)
    total, weights = np.zeros(x.shape), np.zeros(x.shape)
    cells = display.panel.subpixel_cells or ()
    largest = max(abs(value) for row in cells for cell in row for pair in cell for value in pair)
    # The sub-pixels within a pixel of a point belong to its pixel or the next; to the next but one, if they lie outside
    # their own.
    reach = 1 if largest <= 0.5 else 2
    for dv in range(-reach, reach + 1):
        for du in range(-reach, reach + 1):
            column, row = middle_column + du, middle_row + dv
            center = column + 0.5, row + 0.5
            right, down = display.panel.subpixel_offset(*center, channel, NUMPY)
            right, down = np.abs(center[0] + right - u), np.abs(center[1] + down - v)
            inside = is_on_panel(display, column, row)
            part = slice(channel, channel + 1)
            values = image.take(np.where(inside, row, 0), np.where(inside, column, 0), part)[..., 0]
            values = np.where(inside, values, np.float32(0))
            distance = right * right + down * down
            is_nearer = distance < best
            nearest, best = np.where(is_nearer, values, nearest), np.where(is_nearer, distance, best)
            if filter_ == "linear":
                owner = display.lens_of(*display.subpixel_point(*center, channel, NUMPY), NUMPY)
                usable = inside & (owner[0] == lens[0]) & (owner[1] == lens[1])
                weight = np.where(usable, np.clip(1 - right, 0, 1) * np.clip(1 - down, 0, 1), 0.0)
                total += weight * values
                weights += weight
    usable = weights > _ON_BOUNDARY
    seen = np.where(usable, total / np.where(usable, weights, 1.0), nearest)
    return seen.astype(np.float32)[..., None]


def _lens_points(display: Display, eye: Eye) -> tuple[Real, Real, Real, Real]:
    """Points ``(x, y)`` of the lens plane to look at, one per lens, and the lenses ``(i, j)``."""
    grid, lattice = display.lens_grid, display.lattice
    if lattice.layout != "lenticular":
        j, i = np.indices((grid.rows, grid.columns)).astype(np.float64)
        x, y = lattice.center(i, j, 0.0 * i, 0.0 * j, NUMPY)
        return x, y, i, j
    row, i = np.indices((display.panel.height, grid.columns)).astype(np.float64)
    _, panel_y = display.panel_point(0.0 * row, row + 0.5, NUMPY)
    # The line from the eye meets the panel at y + (y - eye_y) g / eye_z.
    scale = display.gap / eye[2]
    y = (panel_y + eye[1] * scale) / (1 + scale)
    across = lattice.origin_x + i * lattice.pitch
    slant = math.radians(lattice.slant)
    return across / math.cos(slant) + y * math.tan(slant), y, i, 0.0 * i


def _checked_eye(eye: Eye) -> Eye:
    try:
        x, y, z = (float(value) for value in eye)
    except (TypeError, ValueError):
        raise UsageError(f"the eye is {eye!r}", rule="it must be three numbers X,Y,Z in mm") from None
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)) or z <= 0:
        rule = "it must be in front of the lens plane: X,Y,Z in mm with Z above 0"
        raise UsageError(f"the eye is at {x:g},{y:g},{z:g}", rule=rule)
    return x, y, z


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """``size`` if it is a width and a height that a picture can have, else a :class:`UsageError`."""
    width, height = size
    if not (isinstance(width, int) and isinstance(height, int) and 1 <= width <= 65535 and 1 <= height <= 65535):
        raise UsageError(f"the size is {size!r}", rule="it must be two whole numbers from 1 to 65535")
    return width, height
