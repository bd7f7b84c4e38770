"""Pictures larger than memory: values decoded in pieces, on demand."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.errors import PictureError
from lippmann.image.encoding import is_mirrored, linear_values, mirrored_in_file
from lippmann.image.integral_image import IntegralImage, Picture
from lippmann.image.metadata import Provenance
from lippmann.image.read import PictureFile, opaque_colors, open_file
from lippmann.image.stored_values import FloatArray, Indices, Layer, Matrix, Stored, Values

#: Pictures of more pixels are decoded piece by piece: as float32 they would take 400 MB and more.
LARGE = 1 << 25

#: Bytes of decoded pieces kept: two rows of tiles of a picture 40 000 pixels wide, at 8 bits. Two rows of pieces are
#: kept in any case, so that a reader of overlapping rows decodes each piece once.
CACHE_BYTES = 1 << 28


class ChunkedPixels:
    """Values ``(height, width, 3)`` as stored, decoded in rectangular pieces on demand; for one thread at a time.

    Parameters
    ----------
    size:
        Width and height in pixels.
    chunk:
        Rows and columns of a piece; pieces at the right and lower edge may be smaller.
    dtype:
        Type of the values.
    load:
        ``load(row, column)`` decodes the piece in that row and column of pieces.
    cache_bytes:
        Bytes of decoded pieces to keep; two rows of pieces and one piece are kept in any case.
    """

    def __init__(
        self,
        size: tuple[int, int],
        chunk: tuple[int, int],
        dtype: np.dtype[np.generic],
        load: Callable[[int, int], Values],
        cache_bytes: int = CACHE_BYTES,
    ) -> None:
        self.width, self.height = size
        self.chunk = chunk
        self.dtype = dtype
        self._load = load
        self._columns = -(-self.width // chunk[1])
        self._most = max(2 * self._columns + 1, cache_bytes // (chunk[0] * chunk[1] * 3 * dtype.itemsize))
        self._cache: OrderedDict[tuple[int, int], Values] = OrderedDict()

    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle."""
        values: Values = np.empty((*window.shape, 3), dtype=self.dtype)
        high, wide = self.chunk
        for row in range(window.top // high, -(-window.bottom // high)):
            for column in range(window.left // wide, -(-window.right // wide)):
                chunk = PixelWindow(column * wide, row * high, wide, high)
                part = chunk.intersection(window)
                if part is not None:
                    piece = self._piece(row, column)
                    values[part.relative_to(window).slices] = piece[part.relative_to(chunk).slices]
        return values

    def take(self, row: Indices, column: Indices) -> Values:
        """``(..., 3)`` values of single pixels; fastest where neighbours in the arrays are neighbours too."""
        shape = np.broadcast_shapes(row.shape, column.shape)
        rows, columns = (np.broadcast_to(part, shape).ravel() for part in (row, column))
        high, wide = self.chunk
        number = (rows // high) * self._columns + columns // wide
        values: Values = np.empty((rows.size, 3), dtype=self.dtype)
        order = np.argsort(number, kind="stable")
        ends = np.flatnonzero(np.diff(number[order])) + 1
        for places in np.split(order, ends) if rows.size else ():
            down, across = divmod(int(number[places[0]]), self._columns)
            piece = self._piece(down, across)
            values[places] = piece[rows[places] - down * high, columns[places] - across * wide]
        return values.reshape(*shape, 3)

    def _piece(self, row: int, column: int) -> Values:
        piece = self._cache.get((row, column))
        if piece is None:
            piece = self._cache[row, column] = self._load(row, column)
            if len(self._cache) > self._most:
                self._cache.popitem(last=False)
        self._cache.move_to_end((row, column))
        return piece


@dataclass(frozen=True, eq=False)
class LargePicture(Picture):
    """A picture whose values are held as stored and decoded on demand; for one thread at a time.

    Parameters
    ----------
    source:
        The values as stored.
    display:
        Display of the picture; its panel has the size of ``source``.
    world_from_display:
        ``(4, 4)`` similarity from the display frame (mm) to the scene.
    provenance:
        How the picture was made; its transfer function codes the values.
    stored:
        Type of the values.
    maps:
        Layers beside the RGB by name.
    """

    source: ChunkedPixels
    display: Display
    world_from_display: Matrix
    provenance: Provenance
    stored: Stored
    maps: Mapping[str, Layer] = field(default_factory=dict)

    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle as stored."""
        if is_mirrored(self.display):
            window = replace(window, left=self.source.width - window.right)
        return mirrored_in_file(self.source.window(window), self.display)

    def take(self, row: Indices, column: Indices, channels: slice = slice(0, 3)) -> FloatArray:
        """Linear RGB ``(..., channels)`` of single pixels; ``row`` and ``column`` broadcast to ``(...)``."""
        if is_mirrored(self.display):
            column = self.source.width - 1 - column
        return linear_values(self.source.take(row, column)[..., channels], self.provenance.transfer)


def open_picture(
    path: Path, *, display: Display | None = None, keeps_codes: bool = False
) -> IntegralImage | LargePicture:
    """Open an integral image, whole in memory or, if it has more than 2^25 pixels, piece by piece (TIFF, Zarr).

    Parameters
    ----------
    path:
        A PNG, OpenEXR, TIFF or Zarr file.
    display:
        Display of the picture, instead of the one in the file; required for files of other programs.
    keeps_codes:
        Whether codes of 8 or 16 bits stay codes in memory: a quarter or half of the bytes of linear values.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign or damaged, has no display, or a size other than the display's.
    """
    return picture_of_file(open_file(path), display, keeps_codes=keeps_codes)


def picture_of_file(
    file: PictureFile, display: Display | None = None, *, keeps_codes: bool = False
) -> IntegralImage | LargePicture:
    """The picture of an open file; ``display``, ``keeps_codes`` and errors as in :func:`open_picture`."""
    in_pieces = file.pieces is not None and file.width * file.height > LARGE
    if not in_pieces and not (keeps_codes and file.stored in ("uint8", "uint16")):
        return file.picture(display)
    metadata, stored = file.metadata_for(display), file.check_stored(file.stored)
    if in_pieces:
        source = pixels_of_file(file)
    else:
        values = file.decode()[0]
        size = file.width, file.height
        source = ChunkedPixels(size, size[::-1], values.dtype, lambda row, column: values)
    return LargePicture(source, metadata.display, metadata.world_from_display, metadata.provenance, stored)


def pixels_of_file(file: PictureFile) -> ChunkedPixels:
    """The values of an open TIFF or Zarr file, checked piece by piece as they are decoded.

    Raises
    ------
    PictureError
        If the file is damaged, holds no opaque colours of a known depth, or is of another format. Faults of a piece are
        raised when it is decoded.
    """
    pieces = file.pieces
    if pieces is None:
        rule = "only TIFF and Zarr can be read piece by piece"
        raise PictureError(f"is {file.format.upper()}", where=str(file.path), rule=rule)

    def load(row: int, column: int) -> Values:
        return opaque_colors(pieces.read_chunk(row, column), file.path)  # this reference keeps the file open

    dtype = np.dtype(file.check_stored(file.stored))
    return ChunkedPixels((file.width, file.height), pieces.chunk, dtype, load)
