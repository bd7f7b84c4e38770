"""TIFF with 8 or 16 bits or 32-bit floats per channel, its description and its true resolution."""

from __future__ import annotations

import contextlib
import logging
import math
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from lippmann.codecs import orientation as orientations
from lippmann.codecs.icc import rgb_profile
from lippmann.codecs.picture_notes import aspect_note, pictures_note
from lippmann.codecs.tiff_colors import UnreadColorsError, check_colors, gray_or_rgb, is_cmyk, is_stored_so, stored_type
from lippmann.codecs.types import Pixels, StoredType
from lippmann.errors import PictureError
from lippmann.runtime.engine_lock import cached_property
from lippmann.runtime.machine import check_input

#: Byte order and version of classic and of big TIFF.
SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

_MM_PER_INCH = 25.4

#: Values of a pixel: colours, alpha and what painting programs add; more is a stack of layers, or damage.
_MOST_SAMPLES = 32

_TAGS = ("ImageDescription", "Orientation", "PrimaryChromaticities", "WhitePoint")

#: Pictures of so many pixels are written in tiles, in the form that has no limit of 4 GB; readers of large pictures
#: need not take in whole rows then.
TILED_FROM = 1 << 26
#: Height and width of tiles.
TILE = 1024
#: Compression of tiles: higher levels save a tenth of the space for three to twelve times the time.
_QUICK_LEVEL = 1
#: Bytes compressed at a time, shared out over the cores.
_BUFFER = 1 << 26

#: Exceptions of the library for damaged tags, beside its own.
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


def write_tiff(
    path: Path, values: Pixels, *, description: str, pixel_pitch: float | None = None, icc: bytes = b""
) -> None:
    """Write ``(H, W, 3)`` or grey ``(H, W)`` uint8, uint16 or float32 values, losslessly (deflate with predictor).

    ``description`` (ASCII) becomes ``ImageDescription``; ``pixel_pitch`` (mm) becomes the resolution in dots per inch;
    ``icc`` is the profile of the values, empty without.
    Pictures of :data:`TILED_FROM` pixels and more are for :func:`write_tiled_tiff`.
    """
    import tifffile

    tifffile.imwrite(
        path,
        np.ascontiguousarray(values),
        photometric="rgb" if values.ndim == 3 else "minisblack",
        compression="zlib",
        predictor=True,
        description=description,
        metadata=None,
        software="Lippmann",
        iccprofile=icc or None,
        **_resolution(pixel_pitch),
    )


def write_tiff_pages(path: Path, pages: Iterable[Pixels]) -> None:
    """Write ``(H, W, 3)`` uint8, uint16 or float32 pictures as the pages of one BigTIFF, losslessly compressed."""
    import tifffile

    with tifffile.TiffWriter(path, bigtiff=True) as file:
        for values in pages:
            file.write(
                np.ascontiguousarray(values),
                photometric="rgb",
                compression="zlib",
                predictor=True,
                metadata=None,
                software="Lippmann",
            )


def write_tiled_tiff(
    path: Path,
    tiles: Iterator[Pixels],
    *,
    size: tuple[int, int],
    side: int,
    dtype: StoredType,
    description: str,
    pixel_pitch: float | None = None,
    icc: bytes = b"",
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
    icc:
        ICC profile of the values; empty without.
    """
    import tifffile

    def padded() -> Iterator[Pixels]:
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
        iccprofile=icc or None,
        buffersize=_BUFFER,
        **_resolution(pixel_pitch),
    )


def _notes(page: Any, pages: int) -> tuple[str, ...]:
    density = [page.tags.valueof(name) for name in ("XResolution", "YResolution")]
    notes = aspect_note(*(top / bottom for top, bottom in density)) if all(density) else ()
    if "TransferFunction" in page.tags and not page.iccprofile:
        notes += ("it has a transfer function of its own: its codes are read as sRGB",)
    return notes + pictures_note(pages)


def _described_profile(tags: dict[str, Any]) -> bytes:
    """ICC profile of ``PrimaryChromaticities`` and ``WhitePoint`` (pairs of whole numbers); empty without both."""
    numbers = [*tags.get("PrimaryChromaticities", ()), *tags.get("WhitePoint", ())]
    if len(numbers) != 16 or not all(numbers[1::2]):
        return b""
    return rgb_profile([top / bottom for top, bottom in zip(numbers[::2], numbers[1::2], strict=True)])


def _resolution(pixel_pitch: float | None) -> dict[str, Any]:
    if pixel_pitch is None:
        return {}
    return {"resolution": (_MM_PER_INCH / pixel_pitch,) * 2, "resolutionunit": "INCH"}


class TiffPicture:
    """The first page of an open TIFF: its header, read once, and its values, whole or by tiles or strips.

    For one thread at a time. The file has to stay open as long as values are read.

    Parameters
    ----------
    file:
        The open file; where it stands does not matter.
    path:
        Its name, for errors.

    Attributes
    ----------
    width, height, channels:
        Size in pixels as shown, and values per pixel.
    dtype:
        NumPy type name of the values.
    bits:
        Bits of a pixel in the file.
    orientation:
        The tag's value, 1 to 8.
    in_pieces:
        Whether tiles or strips can be read one by one: they are stored as shown.
    description:
        The text of ``ImageDescription``; empty without.
    icc:
        ICC profile of the values; empty without, and of CMYK, which is read as sRGB.
    notes:
        What of it is not shown, each in one line.

    Raises
    ------
    PictureError
        If the file is damaged, no TIFF, no flat picture, or its colours are of a kind that is not read.
    """

    def __init__(self, file: BinaryIO, path: Path) -> None:
        import tifffile

        self._path, self._file = path, file
        file.seek(0)
        with _report_damage(path):
            pages = tifffile.TiffFile(file).pages
            page: Any = pages[0]
            self.notes = _notes(page, len(pages))
            shape, dtype = page.shape, page.dtype
            tags = {name: tag.value for name in _TAGS if (tag := page.tags.get(name)) is not None}
            check_colors(page)
            separate = page.planarconfig == 2 and page.samplesperpixel > 1
            self.dtype: str = stored_type(page)
            self.bits = int(page.bitspersample) * int(page.samplesperpixel)
            has_plain_tiles = is_stored_so(page)
            profile = page.iccprofile or _described_profile(tags)
        if separate and len(shape) == 3:
            shape = (*shape[1:], shape[0])
        if len(shape) == 2:
            shape = (*shape, 1)
        sizes = [size for size in shape if isinstance(size, int) and size >= 1]  # a damaged tag may be anything
        if len(shape) != 3 or len(sizes) != 3 or sizes[2] > _MOST_SAMPLES or dtype is None:
            raise PictureError(f"holds an array of shape {shape}", where=str(path), rule="it must be one flat picture")
        self._page = page
        orientation, text = tags.get("Orientation"), tags.get("ImageDescription")
        self.orientation = int(orientation) if isinstance(orientation, int) else 1
        self.height, self.width, self.channels = sizes
        if orientations.lies(self.orientation):
            self.height, self.width = self.width, self.height
        self.in_pieces = has_plain_tiles and self.orientation <= 1
        self.description = text if isinstance(text, str) else ""
        self.icc = profile if isinstance(profile, bytes) and not is_cmyk(page) else b""

    def read(self) -> Pixels:
        """All values, ``(H, W, 1 to 4)``, upright: codes of 8 or 16 bits, or floats.

        Raises
        ------
        PictureError
            If they cannot be decoded.
        MemoryLimitError
            If they take more memory than is left.
        """
        page = self._page
        check_input(2 * int(page.size) * np.dtype(page.dtype).itemsize, "its picture", where=str(self._path))
        with _report_damage(self._path):
            self._check_segments()
            values = gray_or_rgb(page, page.asarray())
        return orientations.upright(values, self.orientation)

    @cached_property
    def chunk(self) -> tuple[int, int]:
        """Rows and columns of a tile or strip; those at the right and lower edge are cut off.

        Raises
        ------
        PictureError
            If the file is too short for its tiles or strips, or they have no size.
        """
        with _report_damage(self._path):
            self._check_segments()
            if self._page.is_tiled:
                chunk = int(self._page.tilelength), int(self._page.tilewidth)
            else:
                chunk = min(int(self._page.rowsperstrip), self.height), self.width
            if min(chunk) < 1:
                raise ValueError(f"its pieces have {chunk[1]} x {chunk[0]} pixels")
        return chunk

    def read_chunk(self, row: int, column: int) -> Pixels:
        """``(rows, columns, channels)`` values of the tile or strip in that row and column of them.

        Raises
        ------
        PictureError
            If it cannot be decoded.
        """
        high, wide = self.chunk
        number = row * -(-self.width // wide) + column
        shape = min(high, self.height - row * high), min(wide, self.width - column * wide)
        with _report_damage(self._path):
            page = self._page
            self._file.seek(page.dataoffsets[number])
            segment = page.decode(self._file.read(page.databytecounts[number]), number)[0]
            if segment is None:  # a segment without bytes is empty
                return np.zeros((*shape, self.channels), dtype=self.dtype)
            values: Pixels = segment[0, : shape[0], : shape[1]]
            if values.shape[:2] != shape:
                raise ValueError(f"segment {number} is cut short")
        return values

    def _check_segments(self) -> None:
        """A ValueError if a strip or tile lies (partly) beyond the end: memory would be given to what is claimed."""
        size, page = self._file.seek(0, 2), self._page
        spans = zip(page.dataoffsets, page.databytecounts, strict=True)
        # The library would fill in each of those that are missing.
        if not page.is_contiguous and len(page.dataoffsets) < math.prod(page.chunked):
            raise ValueError(f"it names {len(page.dataoffsets)} of {math.prod(page.chunked)} strips or tiles")
        # Older versions of the library read some numbers as negative ones.
        if any(not 0 <= place <= place + count <= size for place, count in spans):
            raise ValueError("it is cut short")


@contextlib.contextmanager
def _report_damage(path: Path) -> Iterator[None]:
    import tifffile

    # The library logs what it then raises or mends; the one line of the error is enough.
    log = logging.getLogger("tifffile")
    before, log.disabled = log.disabled, True
    try:
        yield
    except UnreadColorsError as error:
        rule = "grey, RGB, CMYK, palettes, L*a*b* and YCbCr are read"
        raise PictureError(str(error), where=str(path), rule=rule, fix="convert it to RGB") from None
    except (tifffile.TiffFileError, *_LIBRARY_ERRORS) as error:
        raise PictureError(f"this TIFF is damaged: {error}", where=str(path), fix="make or fetch it anew") from error
    finally:
        log.disabled = before
