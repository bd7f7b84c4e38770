"""TIFF with 8 or 16 bits or 32-bit floats per channel, its description and its true resolution."""

from __future__ import annotations

import contextlib
import logging
import struct
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import PictureError

#: Byte order and version of classic and of big TIFF.
SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

_MM_PER_INCH = 25.4

#: Pictures of so many pixels are written in tiles, in the form that has no limit of 4 GB; readers of large pictures
#: need not take in whole rows then.
TILED_FROM = 1 << 26
#: Height and width of tiles.
TILE = 1024
#: Compression of tiles: higher levels save a tenth of the space for three to twelve times the time.
_QUICK_LEVEL = 1
#: Bytes compressed at a time, shared out over the cores.
_BUFFER = 1 << 26

#: What the library stumbles with over damaged tags, beside its own error.
_LIBRARY_ERRORS = (
    ArithmeticError,
    AttributeError,
    LookupError,
    MemoryError,
    RuntimeError,
    TypeError,
    ValueError,
    struct.error,
)


@dataclass(frozen=True)
class TiffHeader:
    """What a TIFF says of its first page: size, channels, NumPy type name and description."""

    width: int
    height: int
    channels: int
    dtype: str
    description: str


def write_tiff(path: Path, values: NDArray[Any], *, description: str, pixel_pitch: float | None = None) -> None:
    """Write ``(H, W, 3)`` uint8, uint16 or float32 values, losslessly compressed (deflate with predictor).

    ``description`` (ASCII) becomes ``ImageDescription``; ``pixel_pitch`` (mm) becomes the resolution in dots per inch.
    Pictures of :data:`TILED_FROM` pixels and more are written as :func:`write_tiled_tiff` does.
    """
    import tifffile

    height, width = values.shape[:2]
    if height * width >= TILED_FROM:
        grid = [(row, column) for row in range(0, height, TILE) for column in range(0, width, TILE)]
        tiles = (values[row : row + TILE, column : column + TILE] for row, column in grid)
        write_tiled_tiff(
            path,
            tiles,
            size=(width, height),
            side=TILE,
            dtype=values.dtype,
            description=description,
            pixel_pitch=pixel_pitch,
        )
        return
    tifffile.imwrite(
        path,
        np.ascontiguousarray(values),
        photometric="rgb",
        compression="zlib",
        predictor=True,
        description=description,
        metadata=None,
        software="Lippmann",
        **_resolution(pixel_pitch),
    )


def write_tiled_tiff(
    path: Path,
    tiles: Iterator[NDArray[Any]],
    *,
    size: tuple[int, int],
    side: int,
    dtype: np.dtype[Any],
    description: str,
    pixel_pitch: float | None = None,
) -> None:
    """Write a BigTIFF tile by tile, so that the picture need never be in memory.

    Parameters
    ----------
    tiles:
        ``(rows, columns, 3)`` each, row by row from the top left; those at the right and lower edge may be smaller.
    size:
        Width and height of the picture.
    side:
        Height and width of a tile, a multiple of 16.
    """
    import tifffile

    def padded() -> Iterator[NDArray[Any]]:
        for tile in tiles:
            whole = np.zeros((side, side, 3), dtype=dtype)
            whole[: tile.shape[0], : tile.shape[1]] = tile
            yield whole

    tifffile.imwrite(
        path,
        padded(),
        shape=(size[1], size[0], 3),
        dtype=dtype,
        tile=(side, side),
        bigtiff=True,
        photometric="rgb",
        compression="zlib",
        compressionargs={"level": _QUICK_LEVEL},
        predictor=True,
        description=description,
        metadata=None,
        software="Lippmann",
        buffersize=_BUFFER,
        **_resolution(pixel_pitch),
    )


def _resolution(pixel_pitch: float | None) -> dict[str, Any]:
    if pixel_pitch is None:
        return {}
    return {"resolution": (_MM_PER_INCH / pixel_pitch,) * 2, "resolutionunit": "INCH"}


def read_tiff_header(path: Path) -> TiffHeader:
    """Size, type and description of the first page, without decoding its pixels.

    Raises
    ------
    PictureError
        If the file is damaged, no TIFF, or its pages hold no flat picture.
    """
    with _opened(path) as page:
        shape, dtype = page.shape, page.dtype
        description = page.tags.get("ImageDescription")
        text = description.value if description is not None else ""
        interleaved = page.planarconfig == 1
    if len(shape) == 2:
        shape = (*shape, 1)
    sizes = [size for size in shape if isinstance(size, int) and size >= 1]  # a damaged tag may be anything
    if len(shape) != 3 or len(sizes) != 3 or dtype is None or not (interleaved or shape[2] == 1):
        raise PictureError(
            f"holds an array of shape {shape}", where=str(path), rule="it must be one interleaved picture"
        )
    return TiffHeader(shape[1], shape[0], shape[2], np.dtype(dtype).name, text if isinstance(text, str) else "")


def read_tiff(path: Path) -> NDArray[Any]:
    """Values of the first page as stored, ``(H, W)`` or ``(H, W, channels)``.

    Raises
    ------
    PictureError
        If the pixels cannot be decoded.
    """
    with _opened(path) as page:
        _check_segments(page, path)
        values: NDArray[Any] = page.asarray()
    return values


def _check_segments(page: Any, path: Path) -> None:
    """A ValueError if a strip or tile is said to lie (partly) beyond the end: memory would be given to what is said."""
    size = path.stat().st_size
    if any(place + count > size for place, count in zip(page.dataoffsets, page.databytecounts, strict=True)):
        raise ValueError("it is cut short")


class TiffSegments:
    """The tiles or strips of a TIFF's first page, decoded one by one; the file stays open as long as they are used.

    Attributes
    ----------
    size:
        Width and height of the picture.
    chunk:
        Rows and columns of a segment; those at the right and lower edge are cut off.
    dtype:
        Type of the values.

    Raises
    ------
    PictureError
        If the file is damaged, no TIFF, or no flat interleaved picture.
    """

    def __init__(self, path: Path) -> None:
        import tifffile

        header = read_tiff_header(path)
        self.size = header.width, header.height
        self.dtype = np.dtype(header.dtype)
        self._path = path
        with _reported(path):
            self._file = tifffile.TiffFile(path)
            weakref.finalize(self, self._file.close)
            self._page = self._file.pages[0]
            _check_segments(self._page, path)
            if self._page.is_tiled:
                self.chunk = int(self._page.tilelength), int(self._page.tilewidth)
            else:
                self.chunk = min(int(self._page.rowsperstrip), header.height), header.width
            if min(self.chunk) < 1:
                raise ValueError(f"its pieces have {self.chunk[1]} x {self.chunk[0]} pixels")
        self._columns = -(-header.width // self.chunk[1])

    def read(self, row: int, column: int) -> NDArray[Any]:
        """``(rows, columns, channels)`` values of a segment.

        Raises
        ------
        PictureError
            If it cannot be decoded.
        """
        number = row * self._columns + column
        (height, width), (high, wide) = self.size[::-1], self.chunk
        shape = min(high, height - row * high), min(wide, width - column * wide)
        with _reported(self._path):
            page = self._page
            with self._path.open("rb") as file:
                file.seek(page.dataoffsets[number])
                data = file.read(page.databytecounts[number])
            segment = page.decode(data, number)[0]
            if segment is None:  # a segment without bytes is empty
                return np.zeros((*shape, page.samplesperpixel), dtype=self.dtype)
            values: NDArray[Any] = segment[0, : shape[0], : shape[1]]
            if values.shape[:2] != shape:
                raise ValueError(f"segment {number} is cut short")
        return values


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The first page; whatever the library raises about the file inside the ``with`` becomes a PictureError."""
    import tifffile

    with _reported(path), tifffile.TiffFile(path) as file:
        yield file.pages[0]


@contextlib.contextmanager
def _reported(path: Path) -> Iterator[None]:
    import tifffile

    # The library logs what it then raises or mends; the one line of the error is enough.
    log = logging.getLogger("tifffile")
    before, log.disabled = log.disabled, True
    try:
        yield
    except (tifffile.TiffFileError, *_LIBRARY_ERRORS) as error:
        raise PictureError(f"this TIFF is damaged: {error}", where=str(path), fix="make or fetch it anew") from error
    finally:
        log.disabled = before
