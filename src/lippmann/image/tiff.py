"""TIFF with 8 or 16 bits or 32-bit floats per channel, its description and its true resolution."""

from __future__ import annotations

import contextlib
import logging
import struct
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
    """
    import tifffile

    resolution = None if pixel_pitch is None else (_MM_PER_INCH / pixel_pitch,) * 2
    tifffile.imwrite(
        path,
        np.ascontiguousarray(values),
        photometric="rgb",
        compression="zlib",
        predictor=True,
        resolution=resolution,
        resolutionunit=None if resolution is None else "INCH",
        description=description,
        metadata=None,
        software="Lippmann",
    )


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
        values: NDArray[Any] = page.asarray()
    return values


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The first page; whatever the library raises about the file inside the ``with`` becomes a PictureError."""
    import tifffile

    # The library logs what it then raises or mends; the one line of the error is enough.
    log = logging.getLogger("tifffile")
    before, log.disabled = log.disabled, True
    try:
        with tifffile.TiffFile(path) as file:
            yield file.pages[0]
    except (tifffile.TiffFileError, *_LIBRARY_ERRORS) as error:
        raise PictureError(f"this TIFF is damaged: {error}", where=str(path), fix="make or fetch it anew") from error
    finally:
        log.disabled = before
