"""Replay: the picture that an eye in front of the display sees.

Through a point of the lens plane the eye sees one point of the panel
(:meth:`lippmann.display.Display.visible_panel_point`). A round lens is filled with one colour, a cylindrical one has
one colour across. Outside the display's field of view a lens shows a pixel of its neighbour's micro-image, as on a real
display.

The frame of the picture is the panel's rectangle in the lens plane for every position of the eye.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display
from lippmann.display.visible_pixels import mean_of_points, points_of_pixel
from lippmann.errors import UsageError
from lippmann.image.integral_image import Picture
from lippmann.image.stored_values import FloatArray
from lippmann.options.option import checked

Eye = tuple[float, float, float]
Real = NDArray[np.float64]
Filter = Literal["nearest", "linear"]

#: Default limit on the width of the picture, in pixels.
DEFAULT_WIDTH = 2048

#: Frames of a sweep at most: an hour of film.
MOST_FRAMES = 100_000

#: Distance in mm of an eye at infinity: over a panel of a metre its lines of sight are parallel to 1e-7 pixels.
FAR = 1e12

#: Tolerance in pixels for points on a boundary between pixels: above the rounding error with FAR, far below visibility.
_ON_BOUNDARY = 1e-6

#: Points per block, so that their arrays stay in the processor's cache.
_BLOCK = 1 << 15


@checked
def replay(
    image: Picture,
    eye: Eye | None = None,
    *,
    size: tuple[int, int] | None = None,
    filter: Filter = "nearest",
    subpixels: bool | None = None,
) -> FloatArray:
    """Picture that an eye sees through the lenses.

    Parameters
    ----------
    image:
        The native picture.
    eye:
        Position ``(x, y, z)`` in the display frame in mm, z > 0. None: central, at the viewing distance, or within the
        field of view if that distance is infinite.
    size:
        Width and height of the result in pixels, 1 to 65535. None: the panel's, at most 2048 wide. Each pixel of a
        result smaller than the panel is the mean of 2 x 2 points.
    filter:
        ``nearest`` takes the pixel at the panel point seen; ``linear`` interpolates between the surrounding pixels of
        the same lens.
    subpixels:
        Whether red, green and blue have their own positions in the pixel, as on the real panel. None: as the picture
        was rendered.

    Returns
    -------
    ``(height, width, 3)`` float32 linear RGB; black where the line of sight misses the panel.

    Raises
    ------
    UsageError
        If the eye is not in front of the lens plane, the size is out of range, or the filter is unknown.
    """
    eye = eye_before(image.display, eye)
    width, height = check_size(default_size(image.display) if size is None else size)
    if filter not in get_args(Filter):
        raise UsageError.unknown("filter", filter, get_args(Filter))
    across = points_of_pixel(image.display, (width, height))
    picture = np.empty((height, width, 3), dtype=np.float32)
    for rows, points in _replay_rows(image, eye, (width * across, height * across), filter, subpixels):
        picture[rows.start // across : rows.stop // across] = mean_of_points(points, across)
    return picture


def replay_points(
    image: Picture, eye: Eye, size: tuple[int, int], *, filter: Filter = "nearest", subpixels: bool | None = None
) -> FloatArray:
    """As :func:`replay`, but each pixel is seen at its middle alone, for values whose mean says nothing."""
    return np.concatenate([points for _, points in _replay_rows(image, eye, size, filter, subpixels)])


def _replay_rows(
    image: Picture, eye: Eye, size: tuple[int, int], filter_: Filter, subpixels: bool | None
) -> Iterator[tuple[slice, FloatArray]]:
    subpixels = image.provenance.subpixels if subpixels is None else subpixels
    for rows, x, y in lens_plane_points(image.display, *size):
        panel_x, panel_y = image.display.visible_panel_point(*eye, x, y, NUMPY)
        yield rows, _panel_colors(image, panel_x, panel_y, filter_, subpixels)


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
    """Pictures of an eye that moves from ``start`` to ``stop`` in equal steps.

    Parameters
    ----------
    image:
        The native picture.
    start, stop:
        First and last position ``(x, y, z)`` of the eye in the display frame in mm, z > 0.
    frames:
        Number of pictures, at least 1.
    size, filter, subpixels:
        As of :func:`replay`.

    Yields
    ------
    ``(height, width, 3)`` float32 linear RGB.

    Raises
    ------
    UsageError
        If ``frames`` is below 1, an eye is not in front of the lens plane, the size is out of range, or the filter is
        unknown.
    """
    eyes = path_of_eye(start, stop, frames)
    return (replay(image, eye, size=size, filter=filter, subpixels=subpixels) for eye in eyes)


def path_of_eye(start: Eye, stop: Eye, frames: int) -> list[Eye]:
    """Positions of an eye that moves from ``start`` to ``stop`` in equal steps; errors are those of :func:`sweep`."""
    if not 1 <= frames <= MOST_FRAMES:
        raise UsageError(f"{frames} is out of range", parameter="frames", rule=f"it must be from 1 to {MOST_FRAMES}")
    places = np.linspace(check_eye(start), check_eye(stop), frames)
    return [(float(x), float(y), float(z)) for x, y, z in places]


def default_eye(display: Display) -> Eye:
    """Centre ``(x, y, z)`` of the viewing zone in mm: at the viewing distance, if that is finite.

    For parallel views the eye is at 1.5 times the distance at which the field of view is as wide as the panel. Of an
    eye-tracked monitor it is the left eye: its two views meet at the centre.
    """
    if math.isfinite(display.viewing_distance):
        return -0.5 * display.stereo.eyes if display.stereo else 0.0, 0.0, display.viewing_distance
    half_field = math.radians(display.field_of_view / 2)
    across = 0 if display.lens_array.layout == "lenticular" else 1
    extent = max(display.size_mm[: across + 1])
    return 0.0, 0.0, 1.5 * extent / (2 * math.tan(half_field))


def eye_before(display: Display, eye: Eye | None) -> Eye:
    """``eye`` before a display, checked as by :func:`check_eye`; by default :func:`default_eye`."""
    return check_eye(default_eye(display) if eye is None else eye)


def eye_of_offset(display: Display, right: float, down: float) -> Eye:
    """Position in mm of the eye that sees, through all lenses, the point ``(right, down)`` pixels from the centre."""
    distance = display.viewing_distance if math.isfinite(display.viewing_distance) else FAR
    # From the panel through the lens's centre: a point right of the centre is seen from the left.
    scale = -display.panel.pixel_pitch * distance / display.gap
    if display.distortion is not None:
        pixel = display.panel.pixel_pitch
        x, y = display.pinhole_offset(right * pixel, -down * pixel)
        right, down = float(x) / pixel, -float(y) / pixel
    if display.lens_array.layout != "lenticular":
        return right * scale, -down * scale, distance
    lattice = display.lattice
    across = lattice.across(right * scale, -down * scale)
    x, y = lattice.from_axes(across, 0.0)
    return float(x), float(y), distance


def default_size(display: Display, widest: int = DEFAULT_WIDTH) -> tuple[int, int]:
    """Width and height of the panel in pixels, reduced in proportion to a width of at most ``widest``."""
    panel = display.panel
    shrink = min(1.0, widest / panel.width)
    return max(1, round(panel.width * shrink)), max(1, round(panel.height * shrink))


def in_middle(picture: FloatArray, size: tuple[int, int]) -> FloatArray:
    """A picture in the middle of a black one of ``size`` (width, height), which is no smaller."""
    height, width = picture.shape[:2]
    if (width, height) == size:
        return picture
    left, top = (size[0] - width) // 2, (size[1] - height) // 2
    framed = np.zeros((size[1], size[0], 3), dtype=np.float32)
    framed[top : top + height, left : left + width] = picture
    return framed


def lens_plane_points(display: Display, width: int, height: int) -> Iterator[tuple[slice, Real, Real]]:
    """Rows, x and y in mm of the lens-plane points at the pixels of a ``width`` x ``height`` picture, in blocks.

    A block begins at an even row.
    """
    step = 2 * max(1, _BLOCK // (2 * width))
    panel = display.panel
    u = (np.arange(width) + 0.5) * (panel.width / width)
    v = (np.arange(height) + 0.5) * (panel.height / height)
    for first in range(0, height, step):
        rows = slice(first, min(first + step, height))
        columns, lines = np.meshgrid(u, v[rows])
        x, y = display.panel_point(columns, lines)
        yield rows, x, y


def pixel_at(coordinate: Real) -> NDArray[np.int64]:
    """Column (row) that holds a continuous pixel coordinate; on a boundary the one to the right (below)."""
    # Coordinates far off the panel exceed all integers; their exact value does not matter.
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
            colors[..., part] = _cell_values(image, x, y, channel, filter_)
            continue
        colors[..., part] = take(image, x, y, part, offset)
    return colors


def _nearest(image: Picture, x: Real, y: Real, channels: slice, offset: tuple[float, float]) -> FloatArray:
    """Values of the (sub-)pixels that hold the points; ``offset`` is the sub-pixel's place, right and down."""
    u, v = image.display.pixel_coordinates(x, y)
    column, row = pixel_at(u - offset[0]), pixel_at(v - offset[1])
    inside = is_on_panel(image.display, column, row)
    values = image.take(np.where(inside, row, 0), np.where(inside, column, 0), channels)
    return np.where(inside[..., None], values, np.float32(0))


def _linear(image: Picture, x: Real, y: Real, channels: slice, offset: tuple[float, float]) -> FloatArray:
    """Values interpolated between those (sub-)pixels about the points that belong to the points' own lens."""
    display = image.display
    lens = display.lens_of(x, y, NUMPY)
    u, v = display.pixel_coordinates(x, y)
    u, v = u - offset[0] - 0.5, v - offset[1] - 0.5
    first_column, first_row = pixel_at(u), pixel_at(v)
    right, down = np.clip(u - first_column, 0, 1), np.clip(v - first_row, 0, 1)
    total, weights = np.zeros((*x.shape, channels.stop - channels.start)), np.zeros(x.shape)
    for dv, weight_v in ((0, 1 - down), (1, down)):
        for du, weight_u in ((0, 1 - right), (1, right)):
            column, row = first_column + du, first_row + dv
            place = display.panel_point(column + (0.5 + offset[0]), row + (0.5 + offset[1]))
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


def _cell_values(image: Picture, x: Real, y: Real, channel: int, filter_: Filter) -> FloatArray:
    """Values of one colour's sub-pixels at the points, ``(..., 1)``, on a panel with several kinds of pixels.

    Their grid is uneven: ``nearest`` takes the sub-pixel with the nearest centre, ``linear`` weights those less than a
    pixel away, right and down, by their distances.
    """
    display = image.display
    lens = display.lens_of(x, y, NUMPY)
    u, v = display.pixel_coordinates(x, y)
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
    values = np.where(usable, total / np.where(usable, weights, 1.0), nearest)
    return values.astype(np.float32)[..., None]


def check_eye(eye: Eye) -> Eye:
    """``eye`` as floats; :class:`UsageError` unless it is finite and in front of the lens plane."""
    try:
        x, y, z = (float(value) for value in eye)
    except (TypeError, ValueError):
        raise UsageError(f"{eye!r}", parameter="eye", rule="must be three numbers x, y, z in mm") from None
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)) or z <= 0:
        rule = "must be in front of the lens plane: x, y, z in mm with z above 0"
        raise UsageError(f"{x:g},{y:g},{z:g}", parameter="eye", rule=rule)
    return x, y, z


def check_size(size: tuple[int, int], parameter: str = "size") -> tuple[int, int]:
    """``size`` itself; :class:`UsageError` unless both sides are 1 to 65535."""
    width, height = size
    if not (1 <= width <= 65535 and 1 <= height <= 65535):
        raise UsageError(f"{width}x{height}", parameter=parameter, rule="both sides must be 1 to 65535 pixels")
    return width, height
