"""The native (sub-)pixels that an eye sees, found in milliseconds for one eye after the other.

Which lens covers a place of the picture does not depend on the eye. It is found once; for each eye there remains a
line through the lens's centre, see :meth:`lippmann.display.Display.visible_panel_point`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lippmann.display.array_ops import NUMPY
from lippmann.display.display import Display
from lippmann.display.panel import PixelWindow

Vector = tuple[float, float, float]
Indices = NDArray[np.uint32]
Floats = NDArray[np.float32]
Reals = NDArray[np.float64]

#: Lenses wider than this many pixels of the picture are seen as blocks, each of one colour.
_BLOCK_WIDTH = 1.5
#: Tolerance in pixels for points on a boundary between pixels: that of :mod:`lippmann.viewing.replay`.
_ON_BOUNDARY = 1e-6
#: Beyond this many pixels the exact place does not matter.
_FAR = 1e9


@dataclass(frozen=True, eq=False)
class PixelSet:
    """The (sub-)pixels of a panel behind a picture.

    Attributes
    ----------
    column, row, channel:
        ``(n,)`` uint32, each pixel once, at least two; ``channel`` is 0 where the colours of a pixel share their rays.
    number:
        ``(height, width, channels)`` int32: which of them each value of the picture shows; -1 past the panel.
    places:
        ``(rows, columns)`` int32: the picture for denoisers as numbers of pixels; -1 where none is seen. Lenses that
        are blocks have one value each (and panel row); else it is ``number``, sub-pixels side by side.
    across:
        Each pixel of the picture is the mean of ``across`` x ``across`` points, which ``number`` and ``places`` have in
        its place; each value for denoisers too, where lenses are no blocks.
    """

    column: Indices
    row: Indices
    channel: Indices
    number: NDArray[np.int32]
    places: NDArray[np.int32]
    across: int = 1

    #: Whether values of the picture are sums over several pixels, of which ``number`` is the brightest.
    is_mixed: ClassVar[bool] = False

    @property
    def channels(self) -> int:
        """3 where sub-pixels have rays of their own, else 1."""
        return int(self.number.shape[2])

    def arrange(self, values: Floats) -> Floats:
        """The picture ``(height, width, 3)`` of the pixels' values ``(n, 3)``; 0 where none is seen."""
        with_black = _with_black(values)
        points = with_black[self.number[..., 0]] if self.channels == 1 else with_black[self.number, np.arange(3)]
        return mean_of_points(points, self.across)

    @property
    def points(self) -> int:
        """Of how many points a value for denoisers is the mean."""
        return self.across**2 if self.places.size == self.number.size else 1

    def arrange_for_denoiser(self, values: Floats) -> Floats:
        """The picture ``(rows, columns, 3)`` for denoisers, of ``places``: with all colours of each sub-pixel, as noise
        that differs from colour to colour looks like texture.
        """
        picture = _with_black(values)[self.places]
        if self.points == 1:
            return picture
        points = picture.reshape(*self.number.shape[:2], -1)
        return mean_of_points(points, self.across).reshape(len(points) // self.across, -1, 3)

    def arrange_denoised(self, picture: Floats) -> Floats:
        """The picture ``(height, width, 3)`` from a denoised one of :meth:`arrange_for_denoiser`."""
        if self.points > 1:
            colors = picture.reshape(len(picture), -1, self.channels, 3)
            return colors[..., 0, :] if self.channels == 1 else colors[..., np.arange(3), np.arange(3)]
        values, is_visible = np.zeros((len(self.column), 3), np.float32), self.places >= 0
        values[self.places[is_visible]] = picture[is_visible]
        return self.arrange(values)


def lens_plane_places(display: Display, size: tuple[int, int]) -> tuple[Reals, Reals, Reals, Reals]:
    """Points (x, y) of the lens plane (mm) at the pixels of a picture of this size, and their lenses (i, j).

    All ``(height, width)``; the picture is the panel's rectangle.
    """
    width, height = size
    u = (np.arange(width) + 0.5) * (display.panel.width / width)
    v = (np.arange(height) + 0.5) * (display.panel.height / height)
    x, y = display.panel_point(*np.meshgrid(u, v))
    return x, y, *display.lattice.lens_at(x, y, NUMPY)


class EyeMap:
    """Finds the pixels behind pictures of one size of one display.

    Parameters
    ----------
    display:
        The display.
    size:
        Width and height of the pictures in pixels.
    subpixels:
        Whether sub-pixels have rays of their own.
    """

    def __init__(self, display: Display, size: tuple[int, int], *, subpixels: bool) -> None:
        self.display, self.size, self.subpixels = display, size, subpixels
        panel = display.panel
        x, y, i, j = lens_plane_places(display, size)
        self._center_x, self._center_y = display.lattice.center(i, j, x, y, NUMPY)
        self._lens = (np.rint(j - j.min()).astype(np.int64), np.rint(i - i.min()).astype(np.int64))
        channels = 3 if subpixels else 1
        #: The first place of the picture that shows each (sub-)pixel of the panel; the last stands for what is past it.
        self._first = np.empty(panel.width * panel.height * channels + 1, np.int32)
        offsets = np.array(panel.subpixel_offsets if subpixels else [(0.0, 0.0)], np.float64)
        cells = panel.subpixel_cells if subpixels else None
        self._cells = np.array(offsets[None, None] if cells is None else cells, np.float64)

    def pixels_for_eye(self, eye: Vector) -> PixelSet:
        """The pixels seen by an eye at ``eye`` (mm in the display's frame, z > 0)."""
        panel = self.display.panel
        scale = self.display.gap / float(eye[2])
        dx, dy = self.display.panel_offset((self._center_x - eye[0]) * scale, (self._center_y - eye[1]) * scale)
        u = (self._center_x + dx) / panel.pixel_pitch + 0.5 * panel.width
        v = 0.5 * panel.height - (self._center_y + dy) / panel.pixel_pitch
        if self.display.stereo is not None:
            # Such a monitor shows each eye a whole picture: past the last pair of columns that pair is seen.
            past = np.where(u < 0.0, 0.0, panel.width - 2.0)
            u = np.where((u < 0.0) | (u >= panel.width), past + (u - past) % 2.0, u)
        u, v = (np.clip(part, -_FAR, _FAR)[..., None] for part in (u, v))
        if len(self._cells) * len(self._cells[0]) > 1:
            column, row = self._nearest(u, v)
        else:
            right, down = np.moveaxis(self._cells[0, 0], -1, 0)
            column = np.floor(u - right + _ON_BOUNDARY).astype(np.int64)
            row = np.floor(v - down + _ON_BOUNDARY).astype(np.int64)
        channels = self._cells.shape[2]
        is_visible = (column >= 0) & (column < panel.width) & (row >= 0) & (row < panel.height)
        keys = np.where(is_visible, (row * panel.width + column) * channels + np.arange(channels), -1).ravel()
        place = np.arange(len(keys), dtype=np.int32)
        # Of several places that show one pixel the first is written last.
        self._first[keys[::-1]] = place[::-1]
        first = self._first[keys]
        is_first = (first == place) & is_visible.ravel()
        number = (np.cumsum(is_first, dtype=np.int32) - 1)[first].reshape(is_visible.shape)
        number[~is_visible] = -1
        visible = keys[is_first]
        if len(visible) < 2:
            visible = np.append(visible, np.zeros(2 - len(visible), np.int64))
        return _pixel_set(visible, number, panel.width, self._blocks(number))

    def _nearest(self, u: NDArray[np.float64], v: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Columns and rows of the pixels whose sub-pixels have the nearest centres, on the panel or past it."""
        cells = self._cells
        middle_column, middle_row = (np.floor(part + _ON_BOUNDARY).astype(np.int64) for part in (u, v))
        shape = (*u.shape[:2], cells.shape[2])
        best = np.full(shape, np.inf)
        best_column, best_row = np.empty((2, *shape), np.int64)
        for down, right in product(range(-2, 3), repeat=2):
            column, row = middle_column + right, middle_row + down
            offset = cells[row % cells.shape[0], column % cells.shape[1]][:, :, 0]
            distance = np.square(column + 0.5 + offset[..., 0] - u) + np.square(row + 0.5 + offset[..., 1] - v)
            is_nearer = distance < best
            best = np.where(is_nearer, distance, best)
            best_column, best_row = np.where(is_nearer, column, best_column), np.where(is_nearer, row, best_row)
        return best_column, best_row

    def _blocks(self, number: NDArray[np.int32]) -> NDArray[np.int32] | None:
        display = self.display
        scale = self.size[0] / display.size_mm[0]
        if self.subpixels or display.lens_array.slant or display.lens_array.pitch * scale < _BLOCK_WIDTH:
            return None
        lens_row, lens_column = self._lens
        rows = lens_row
        if display.lens_array.layout == "lenticular":
            rows = np.broadcast_to(np.arange(self.size[1])[:, None], lens_row.shape)
        blocks = np.full((int(rows.max()) + 1, int(lens_column.max()) + 1), -1, np.int32)
        blocks[rows, lens_column] = number[..., 0]
        return blocks


def points_of_pixel(display: Display, size: tuple[int, int]) -> int:
    """Points across a pixel of a picture of ``size`` (width, height) whose mean it is: 2 if it is smaller than the
    panel, else 1. Single points alias: they show bits of lenses and colour fringes that no eye resolves.
    """
    return 2 if size[0] < display.panel.width or size[1] < display.panel.height else 1


def mean_of_points(picture: Floats, across: int) -> Floats:
    """The picture ``(height, width, n)`` of one with ``across`` x ``across`` points in place of each pixel."""
    if across == 1:
        return picture
    height, width = (side // across for side in picture.shape[:2])
    means: Floats = picture.reshape(height, across, width, across, -1).mean(axis=(1, 3), dtype=np.float32)
    return means


def window_pixels(display: Display, window: PixelWindow | None, *, subpixels: bool, row_step: int = 1) -> PixelSet:
    """All (sub-)pixels of a window of the panel, or of the whole panel; the middle one of every ``row_step`` rows."""
    panel = display.panel
    window = window or PixelWindow(0, 0, panel.width, panel.height)
    channels = 3 if subpixels else 1
    traced = np.minimum(np.arange(window.top, window.bottom, row_step) + row_step // 2, window.bottom - 1)
    rows, columns, colors = np.meshgrid(
        traced, np.arange(window.left, window.right), np.arange(channels), indexing="ij"
    )
    keys = ((rows * panel.width + columns) * channels + colors).ravel()
    number = np.arange(keys.size, dtype=np.int32).reshape(len(traced), window.width, channels)
    return _pixel_set(np.resize(keys, max(keys.size, 2)), number, panel.width, None)


def _with_black(values: Floats) -> Floats:
    """``(n + 1, 3)``: the last entry, of number -1, is black."""
    return np.concatenate([values, np.zeros((1, 3), np.float32)])


def _pixel_set(
    keys: NDArray[np.int64], number: NDArray[np.int32], width: int, blocks: NDArray[np.int32] | None
) -> PixelSet:
    channels = number.shape[2]
    pixel = keys // channels
    column, row, channel = ((part).astype(np.uint32) for part in (pixel % width, pixel // width, keys % channels))
    places = number.reshape(len(number), -1) if blocks is None else blocks
    return PixelSet(column, row, channel, number, places)
