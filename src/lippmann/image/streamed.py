"""Pictures of which only pieces are in memory: decoded as they are asked for, so that none is too large to look at."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs import tiff, zarr_array
from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import PictureError
from lippmann.image.encoding import FormatName, check_stored, linear_values, opaque_colors
from lippmann.image.integral_image import IntegralImage
from lippmann.image.provenance import Provenance
from lippmann.image.read import metadata_for, read_info, read_picture
from lippmann.image.stored_values import FloatArray, Stored
from lippmann.image.views import view_grid

#: Pictures of more pixels are read piece by piece: as float32 they would take 400 MB and more.
LARGE = 1 << 25

#: Decoded pieces that are kept, in bytes: two rows of tiles of a picture 40 000 pixels wide, at 8 bits. Two rows of
#: pieces are kept in any case, so that what reads some rows after others decodes each piece once.
CACHE_BYTES = 1 << 28

Values = NDArray[Any]


class ChunkedPixels:
    """Values ``(height, width, 3)`` as stored, decoded in rectangular pieces as they are asked for.

    Parameters
    ----------
    size:
        Width and height.
    chunk:
        Rows and columns of a piece; those at the right and lower edge may be smaller.
    dtype:
        Type of the values.
    load:
        ``load(row, column)`` decodes the piece in that row and column of pieces.
    cache_bytes:
        What may be kept of them; at least two rows of pieces and one piece are.
    """

    def __init__(
        self,
        size: tuple[int, int],
        chunk: tuple[int, int],
        dtype: np.dtype[Any],
        load: Callable[[int, int], Values],
        cache_bytes: int = CACHE_BYTES,
    ) -> None:
        self.width, self.height = size
        self.chunk = chunk
        self.dtype = dtype
        self._load = load
        self._columns = -(-self.width // chunk[1])
        self._most = max(2 * self._columns + 1, cache_bytes // (chunk[0] * chunk[1] * 3 * dtype.itemsize))
        self._kept: OrderedDict[tuple[int, int], Values] = OrderedDict()

    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle."""
        values = np.empty((*window.shape, 3), dtype=self.dtype)
        high, wide = self.chunk
        for row in range(window.top // high, -(-window.bottom // high)):
            for column in range(window.left // wide, -(-window.right // wide)):
                chunk = PixelWindow(column * wide, row * high, wide, high)
                part = chunk.intersection(window)
                if part is not None:
                    piece = self._piece(row, column)
                    values[part.relative_to(window).slices] = piece[part.relative_to(chunk).slices]
        return values

    def take(self, row: NDArray[Any], column: NDArray[Any]) -> Values:
        """``(..., 3)`` values of single pixels; quickest where those near in the arrays are near in the picture."""
        shape = np.broadcast_shapes(row.shape, column.shape)
        rows, columns = (np.broadcast_to(part, shape).ravel() for part in (row, column))
        high, wide = self.chunk
        number = (rows // high) * self._columns + columns // wide
        values = np.empty((rows.size, 3), dtype=self.dtype)
        order = np.argsort(number, kind="stable")
        ends = np.flatnonzero(np.diff(number[order])) + 1
        for places in np.split(order, ends) if rows.size else ():
            down, across = divmod(int(number[places[0]]), self._columns)
            piece = self._piece(down, across)
            values[places] = piece[rows[places] - down * high, columns[places] - across * wide]
        return values.reshape(*shape, 3)

    def _piece(self, row: int, column: int) -> Values:
        found = self._kept.get((row, column))
        if found is None:
            found = self._load(row, column)
            self._kept[row, column] = found
            if len(self._kept) > self._most:
                self._kept.popitem(last=False)
        self._kept.move_to_end((row, column))
        return found


def open_pixels(path: Path, name: FormatName) -> ChunkedPixels:
    """The values of a TIFF or Zarr picture, checked piece by piece as they are read.

    Raises
    ------
    PictureError
        If the file is damaged, or holds no colours of a known depth; also later, when a piece turns out so.
    """
    if name == "zarr":
        return _zarr_pixels(path)
    if name == "tiff":
        return _tiff_pixels(path)
    raise PictureError(f"is {name.upper()}", where=str(path), rule="only TIFF and Zarr can be read piece by piece")


def _tiff_pixels(path: Path) -> ChunkedPixels:
    segments = tiff.TiffSegments(path)

    def load(row: int, column: int) -> Values:
        return opaque_colors(segments.read(row, column), path)

    return ChunkedPixels(segments.size, segments.chunk, segments.dtype, load)


def _zarr_pixels(path: Path) -> ChunkedPixels:
    array = zarr_array.open_zarr(path)
    height, width = array.shape[:2]
    high, wide = (int(length) for length in array.chunks[:2])

    def load(row: int, column: int) -> Values:
        place = slice(row * high, (row + 1) * high), slice(column * wide, (column + 1) * wide)
        return np.asarray(zarr_array.read_part(array, place, path))

    return ChunkedPixels((width, height), (high, wide), np.dtype(array.dtype), load)


class Picture(Protocol):
    """What an :class:`IntegralImage` and a :class:`LargePicture` have in common."""

    @property
    def display(self) -> Display:
        """The display that the picture is for."""
        ...

    @property
    def provenance(self) -> Provenance:
        """How the picture was made."""
        ...

    def take(self, row: NDArray[Any], column: NDArray[Any], channels: slice = ...) -> FloatArray:
        """Linear values of single pixels, ``(..., channels)``."""
        ...


@dataclass(frozen=True, eq=False)
class LargePicture:
    """A picture in a file, read as it is asked for. Fields as those of :class:`IntegralImage`.

    Attributes
    ----------
    source:
        The values as stored.
    """

    source: ChunkedPixels
    display: Display
    world_from_display: NDArray[np.float64]
    provenance: Provenance
    stored: Stored
    maps: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def take(self, row: NDArray[Any], column: NDArray[Any], channels: slice = slice(0, 3)) -> FloatArray:
        """Linear values of single pixels, ``(..., channels)``."""
        return linear_values(self.source.take(row, column)[..., channels], self.provenance.transfer)

    def rows(self, first: int, last: int) -> FloatArray:
        """``(last - first, W, 3)`` linear values of whole rows."""
        values = self.source.window(PixelWindow(0, first, self.source.width, last - first))
        return linear_values(values, self.provenance.transfer)

    @property
    def views_are_exact(self) -> bool:
        """As :attr:`IntegralImage.views_are_exact`."""
        return view_grid(self.display).exact

    @property
    def views_note(self) -> str:
        """As :attr:`IntegralImage.views_note`."""
        return view_grid(self.display).note


def open_picture(path: Path, *, display: Display | None = None) -> IntegralImage | LargePicture:
    """A picture from a file: whole, or piece by piece where it is large and its format allows that.

    Parameters and errors as for :func:`lippmann.image.read.read_picture`.
    """
    info = read_info(path)
    if info.width * info.height <= LARGE or info.format not in ("tiff", "zarr"):
        return read_picture(path, display=display)
    metadata = metadata_for(info, path, display)
    name = cast(FormatName, info.format)
    check_stored(info.stored, name, path)
    return LargePicture(
        open_pixels(path, name),
        metadata.display,
        metadata.world_from_display,
        metadata.provenance,
        cast(Stored, info.stored),
    )
