"""Pictures of which only pieces are in memory: decoded as they are asked for, so that none is too large to look at."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import PictureError
from lippmann.image.encoding import linear_values
from lippmann.image.integral_image import IntegralImage
from lippmann.image.picture import Picture
from lippmann.image.provenance import Provenance
from lippmann.image.read import PictureFile, opaque_colors, open_file
from lippmann.image.stored_values import FloatArray, Matrix, Stored, Values

#: Pictures of more pixels are read piece by piece: as float32 they would take 400 MB and more.
LARGE = 1 << 25

#: Decoded pieces that are kept, in bytes: two rows of tiles of a picture 40 000 pixels wide, at 8 bits. Two rows of
#: pieces are kept in any case, so that what reads some rows after others decodes each piece once.
CACHE_BYTES = 1 << 28


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


def pixels_of_file(file: PictureFile) -> ChunkedPixels:
    """The values of a TIFF or Zarr picture, checked piece by piece as they are read.

    Raises
    ------
    PictureError
        If the file is damaged, holds no colours of a known depth, or its format has no pieces; also later, when a piece
        turns out so.
    """
    pieces = file.pieces
    if pieces is None:
        rule = "only TIFF and Zarr can be read piece by piece"
        raise PictureError(f"is {file.format.upper()}", where=str(file.path), rule=rule)
    dtype = np.dtype(file.check_stored(file.stored))
    # The file is named here, so that it stays open.
    return ChunkedPixels(
        (file.width, file.height),
        pieces.chunk,
        dtype,
        lambda row, column: opaque_colors(pieces.read_chunk(row, column), file.path),
    )


@dataclass(frozen=True, eq=False)
class LargePicture(Picture):
    """A picture whose values stay as its file stores them, and are decoded as they are asked for.

    For one thread at a time. The parameters but ``source`` are those of :class:`~lippmann.image.IntegralImage`.

    Parameters
    ----------
    source:
        The values as stored.
    """

    source: ChunkedPixels
    display: Display
    world_from_display: Matrix
    provenance: Provenance
    stored: Stored
    maps: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle as stored."""
        return self.source.window(window)

    def take(self, row: NDArray[Any], column: NDArray[Any], channels: slice = slice(0, 3)) -> FloatArray:
        """Linear RGB of single pixels, ``(..., channels)``; ``row`` and ``column`` broadcast to ``(...)``."""
        return linear_values(self.source.take(row, column)[..., channels], self.provenance.transfer)


def open_picture(
    path: Path, *, display: Display | None = None, keeps_codes: bool = False
) -> IntegralImage | LargePicture:
    """A picture from a file: piece by piece where it is larger than :data:`LARGE` and its format allows that (TIFF,
    Zarr), else whole.

    Parameters
    ----------
    path:
        The file: PNG, OpenEXR, TIFF or Zarr.
    display:
        The display that the picture is for, instead of the one that it carries; needed for files of other programs.
    keeps_codes:
        Whether a picture that holds codes of 8 or 16 bits keeps them, where it is read whole: quicker, and a quarter or
        half of the memory that linear values take.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign or damaged, has no display, or a size other than the display's.
    """
    return picture_of_file(open_file(path), display, keeps_codes=keeps_codes)


def picture_of_file(
    file: PictureFile, display: Display | None = None, *, keeps_codes: bool = False
) -> IntegralImage | LargePicture:
    """:func:`open_picture` of a file that is open."""
    in_pieces = file.pieces is not None and file.width * file.height > LARGE
    if not in_pieces and not (keeps_codes and file.stored in ("uint8", "uint16")):
        return file.picture(display)
    metadata = file.metadata_for(display)
    source = pixels_of_file(file) if in_pieces else _one_piece(file.decode()[""])
    stored = file.check_stored(file.stored)
    return LargePicture(source, metadata.display, metadata.world_from_display, metadata.provenance, stored)


def _one_piece(values: Values) -> ChunkedPixels:
    return ChunkedPixels(values.shape[1::-1], values.shape[:2], values.dtype, lambda row, column: values)
