"""Ray sources: world-space rays through the pixels of a picture, one class for each kind of picture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import DEVICE, divide, upload_display
from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream
from lippmann.device.types import Float64, Point2f, Ray3f, UInt32
from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.display.view_cone import cone_tangent
from lippmann.scene.values.description import Camera

Matrix = NDArray[np.float64]
Triple = tuple[Float64, Float64, Float64]


class RaySource(Protocol):
    """Rays through the pixels of a picture.

    ``channels`` is 1 where a pixel's colours share their rays, 3 where each sub-pixel has its own.
    """

    width: int
    height: int
    channels: int

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        """World-space rays through pixels or sub-pixels.

        Parameters
        ----------
        column, row:
            The pixels; row 0 is on top.
        channel:
            0, 1 or 2 for the sub-pixel R, G or B. Not read where ``channels`` is 1.
        jitter:
            Point in [0, 1)^2 of each (sub-)pixel that its ray passes through.
        """
        ...

    def number(self, column: UInt32, row: UInt32) -> UInt32:
        """Pixel index that seeds the random numbers: row by row over the whole picture, also for a window of it.

        So a pixel has the same samples whichever part of the picture is rendered.
        """
        return row * dr.opaque(mi.UInt32, self.width) + column


class PixelRays:
    """Rays through the pixels or sub-pixels of a wavefront's lanes, see :meth:`RaySource.rays`.

    Parameters
    ----------
    box_filter:
        Samples are spread over the pixel; else all go through its centre.
    """

    def __init__(
        self, source: RaySource, column: UInt32, row: UInt32, channel: UInt32, box_filter: bool = True
    ) -> None:
        self._source = source
        self._at = column, row, channel
        self._box_filter = box_filter

    def ray(self, stream: SampleStream) -> Ray3f:
        """The ray of each lane's sample."""
        return self.through(stream.next_2d(PIXEL_DIMENSION))

    def through(self, point: Point2f) -> Ray3f:
        """The ray through a point in [0, 1)^2 of each lane's pixel, or through its centre where all samples are."""
        return self._source.rays(*self._at, point if self._box_filter else mi.Point2f(0.5))


class OnePicture(RaySource):
    """A ray source with a single view."""

    def tiles(self) -> Iterator[tuple[slice, slice]]:
        """Rows and columns of each view; here a single one, the whole picture."""
        yield slice(0, self.height), slice(0, self.width)


class DisplayRays(OnePicture):
    """Rays along the light lines of the pixels or sub-pixels of a display, or of a window of them.

    The samples of a pixel fill its square. Those of a sub-pixel fill a third of its width about the sub-pixel's own
    place. Before lenses with a profile they also fill the aperture of the lens, in parallel.

    Parameters
    ----------
    display:
        The display.
    world_from_display:
        ``(4, 4)``, an affine map from the display's frame (mm) to the world.
    subpixels:
        Whether each colour has its own rays.
    window:
        The pixels, all by default. They have the random numbers of the whole picture.
    """

    def __init__(
        self,
        display: Display,
        world_from_display: Matrix,
        subpixels: bool = False,
        window: PixelWindow | None = None,
    ) -> None:
        self.display = display
        self.window = window or PixelWindow(0, 0, display.panel.width, display.panel.height)
        #: The display on the device, for whatever reads its numbers in kernels.
        self.uploaded = upload_display(display)
        self.width, self.height = self.window.width, self.window.height
        self._left, self._top = (dr.opaque(mi.UInt32, first) for first in (self.window.left, self.window.top))
        self.channels = 3 if subpixels else 1
        self.world_from_display = np.asarray(world_from_display, dtype=np.float64)

    def of_window(self, window: PixelWindow) -> DisplayRays:
        """The rays of a window of the display's pixels."""
        return DisplayRays(self.display, self.world_from_display, self.channels == 3, window)

    def number(self, column: UInt32, row: UInt32) -> UInt32:
        """Index of pixels in the whole picture, row by row."""
        return (row + self._top) * mi.UInt32(self.uploaded.panel.width) + (column + self._left)

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        lines = self.light_rays(column + self._left, row + self._top, channel, jitter)
        return world_ray(self.world_from_display, *lines)

    def light_rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> tuple[Triple, Triple]:
        """Origins and unit directions of :meth:`rays` in the display's frame, mm, by the panel's columns and rows."""
        display = self.uploaded
        u = mi.Float64(column) + (0.5 if display.stereo else mi.Float64(jitter.x))
        v = mi.Float64(row) + mi.Float64(jitter.y)
        if self.channels == 3:
            u = mi.Float64(column) + 0.5 + (mi.Float64(jitter.x) - 0.5) / 3
            x, y = display.subpixel_point(u, v, mi.Float64(channel), DEVICE)
        else:
            x, y = display.panel_point(u, v)
        (ox, oy, oz), direction = display.light_ray(x, y, DEVICE)
        aside_x, aside_y = display.aperture_point(mi.Float64(jitter.x), mi.Float64(jitter.y), DEVICE)
        return (ox + aside_x, oy + aside_y, oz), direction


class ChosenRays(OnePicture):
    """Rays of chosen pixels of a picture, as a picture of their own with its own random numbers.

    Parameters
    ----------
    source:
        The whole picture.
    columns, rows:
        ``(height, width)``: which pixel stands at each place.
    """

    def __init__(self, source: RaySource, columns: NDArray[np.integer], rows: NDArray[np.integer]) -> None:
        self.height, self.width = columns.shape
        self.channels = source.channels
        self._source = source
        # Opaque to the compiler, so that any number of pixels shares a kernel.
        self._width = dr.opaque(mi.UInt32, self.width)
        self._columns, self._rows = (mi.UInt32(np.asarray(values.ravel(), np.uint32)) for values in (columns, rows))

    def in_picture(self, column: UInt32, row: UInt32) -> tuple[UInt32, UInt32]:
        """Column and row of pixels in the whole picture."""
        place = row * self._width + column
        return dr.gather(mi.UInt32, self._columns, place), dr.gather(mi.UInt32, self._rows, place)

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        return self._source.rays(*self.in_picture(column, row), channel, jitter)


class SinglePixelRays(ChosenRays):
    """Rays of single (sub-)pixels, one beside the other, with the random numbers of the whole picture.

    Parameters
    ----------
    source:
        The whole picture.
    columns, rows, channels:
        ``(n,)``: which pixels; ``channels`` are 0 where sub-pixels have no rays of their own.
    """

    def __init__(
        self,
        source: RaySource,
        columns: NDArray[np.integer],
        rows: NDArray[np.integer],
        channels: NDArray[np.integer],
    ) -> None:
        super().__init__(source, columns[None], rows[None])
        self.channels = 1
        self._own = mi.UInt32(np.asarray(channels, np.uint32))

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        return super().rays(column, row, dr.gather(mi.UInt32, self._own, column), jitter)

    def number(self, column: UInt32, row: UInt32) -> UInt32:
        """Index of the (sub-)pixels in the whole picture."""
        number = self._source.number(*self.in_picture(column, row)) * self._source.channels
        return number + dr.gather(mi.UInt32, self._own, column)


class SubpixelRays(OnePicture):
    """Rays of the sub-pixels of a display or of a window, as the pixels of a picture three times as wide.

    A sub-pixel has the rays and the random numbers that it has in ``source``, but all three colours are kept; the
    display shows one of them. Columns ``3 x`` to ``3 x + 2`` are the sub-pixels of the pixel in column x, from left to
    right on the panel.
    """

    channels = 1

    def __init__(self, source: DisplayRays) -> None:
        self.display = source.display
        self.window = source.window
        self.width, self.height = 3 * source.width, source.height
        self._source = source
        #: Colours of the sub-pixels from left to right.
        self._colors = self.display.panel.subpixel_order

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        del channel
        pixel, color = self._subpixel(column)
        return self._source.rays(pixel, row, color, jitter)

    def number(self, column: UInt32, row: UInt32) -> UInt32:
        """Index of sub-pixels in the whole picture, R, G and B of each pixel in turn."""
        pixel, color = self._subpixel(column)
        return self._source.number(pixel, row) * 3 + color

    def own_colors(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Pixels of the display, ``(..., H, W, 3)``, from ``(..., H, 3 W, 3)``: each sub-pixel keeps its own colour."""
        subpixels = values.reshape(*values.shape[:-2], values.shape[-2] // 3, 3, 3)
        return np.stack([subpixels[..., self._colors.index(c), c] for c in range(3)], axis=-1)

    def _subpixel(self, column: UInt32) -> tuple[UInt32, UInt32]:
        """Column of the pixel, and colour of the sub-pixel."""
        pixel = column // 3
        place = column - 3 * pixel
        color = dr.select(place == 0, self._colors[0], dr.select(place == 1, self._colors[1], self._colors[2]))
        return pixel, mi.UInt32(color)


class QuiltRays(RaySource):
    """Rays of a quilt: views of cameras side by side in front of a lenticular display, each in a tile of the picture.

    Camera k of N = ``columns * rows`` stands at the viewing distance D, level with the centre of the display, at
    ``D tan(cone / 2) (2 (k + 0.5) / N - 1)`` to the right of it: in equal steps over the whole view cone. Cameras are
    off-axis, not turned, and see the panel's rectangle in the lens plane. Where the viewing distance is infinite they
    are parallel cameras. Tile 0 is at the bottom left; tiles follow to the right, then upwards. Rays start at the
    display's aperture distance.

    Parameters
    ----------
    display:
        A lenticular display.
    world_from_display:
        ``(4, 4)``, an affine map from the display's frame (mm) to the world.
    columns, rows:
        Tiles across and up.
    view_size:
        Width and height of a view in pixels.
    window:
        Part of each view that is traced; all of it by default.
    """

    channels = 1

    def __init__(
        self,
        display: Display,
        world_from_display: Matrix,
        columns: int,
        rows: int,
        view_size: tuple[int, int],
        window: PixelWindow | None = None,
    ) -> None:
        self.display = display
        self.columns = columns
        self.rows = rows
        self.view_size = view_size
        self.window = window or PixelWindow(0, 0, *view_size)
        self.width = columns * self.window.width
        self.height = rows * self.window.height
        self.world_from_display = np.asarray(world_from_display, dtype=np.float64)

    @property
    def views(self) -> int:
        """Number of cameras."""
        return self.columns * self.rows

    def tiles(self) -> Iterator[tuple[slice, slice]]:
        """Rows and columns of the views, in the order of the cameras from the left."""
        width, height = self.window.width, self.window.height
        for number in range(self.views):
            below, right = divmod(number, self.columns)
            top = (self.rows - 1 - below) * height
            yield slice(top, top + height), slice(right * width, (right + 1) * width)

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        del channel
        display, window = self.display, self.window
        right, column = divide(column, dr.opaque(mi.UInt32, window.width))
        below, row = divide(row, dr.opaque(mi.UInt32, window.height))
        (columns, rows), (left, top) = opaque(self.columns, self.rows), opaque(window.left, window.top)
        view = (rows - 1 - mi.Float64(below)) * columns + mi.Float64(right)
        u, v = mi.Float64(column) + mi.Float64(jitter.x), mi.Float64(row) + mi.Float64(jitter.y)
        (view_width, view_height), (width, height) = opaque(*self.view_size), opaque(*display.size_mm)
        x, y = ((left + u) / view_width - 0.5) * width, (0.5 - (top + v) / view_height) * height
        convergence, aperture = opaque(1 / display.viewing_distance, display.aperture_distance)
        side = ((2 * view + 1) / (columns * rows) - 1) * dr.opaque(mi.Float64, cone_tangent(display))
        slope_x, slope_y = x * convergence - side, y * convergence
        origin = x - slope_x * aperture, y - slope_y * aperture, aperture
        return world_ray(self.world_from_display, origin, (slope_x, slope_y, dr.full(mi.Float64, -1, dr.width(x))))


class CameraRays(OnePicture):
    """Rays of a perspective or orthographic camera; pixel (0, 0) is at the top left."""

    def __init__(self, camera: Camera, width: int, height: int) -> None:
        self.camera = camera
        self.width = width
        self.height = height
        self.channels = 1

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        del channel
        camera = self.camera
        half_size = np.tan(camera.fov_y / 2) if camera.fov_y is not None else (camera.height or 2.0) / 2
        step, aspect, right, up, half = opaque(2 / self.height, self.width / self.height, *camera.shift, half_size)
        x = (mi.Float64(column) + mi.Float64(jitter.x)) * step - aspect
        y = 1 - (mi.Float64(row) + mi.Float64(jitter.y)) * step
        zero = dr.zeros(mi.Float64, dr.width(x))
        place = x * half + right, y * half + up
        if camera.fov_y is not None:
            origin, direction = (zero, zero, zero), (*place, zero - 1)
        else:
            origin, direction = (*place, zero), (zero, zero, zero - 1)
        return world_ray(_without_scale(self.camera.world_from_camera), origin, direction)


def _without_scale(world_from_camera: Matrix) -> Matrix:
    """The camera frame without the scales of a file's nodes: its field of view is in world units."""
    matrix = np.array(world_from_camera, dtype=np.float64)
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    return matrix


def world_ray(matrix: Matrix, origin: Triple, direction: Triple) -> Ray3f:
    """World-space ray with unit direction, from an origin and a direction of any length in another frame.

    ``matrix`` is ``(4, 4)``, an affine map from that frame to the world.
    """
    return world_ray_by(opaque_rows(matrix), origin, direction)


def opaque(*values: float) -> list[Float64]:
    """Numbers on the device, opaque to the compiler: kernels do not hold them as literals."""
    return [dr.opaque(mi.Float64, value) for value in values]


def opaque_rows(matrix: Matrix) -> list[list[Float64]]:
    """The first three rows of a matrix ``(4, 4)`` on the device.

    Opaque to the compiler, so that a display that moves from frame to frame keeps its kernel.
    """
    return [opaque(*row) for row in np.asarray(matrix)[:3].tolist()]


def world_ray_by(rows: list[list[Float64]], origin: Triple, direction: Triple) -> Ray3f:
    """:func:`world_ray` by the rows of its matrix on the device."""
    o = [sum((m * a for m, a in zip(row[:3], origin, strict=True)), row[3]) for row in rows]
    d = [sum((m * a for m, a in zip(row[:3], direction, strict=True)), mi.Float64(0)) for row in rows]
    length = dr.rsqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    return mi.Ray3f(mi.Point3f(*(mi.Float(a) for a in o)), mi.Vector3f(*(mi.Float(a * length) for a in d)))
