"""Pictures that Pillow decodes: one allow list of formats, recognised by content, whatever the file's name says.

Pillow itself tries dozens of formats, among them ones whose decoder starts another program (EPS starts Ghostscript).
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from lippmann.codecs.types import Pixels
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input
from lippmann.runtime.regular_file import check_kind

if TYPE_CHECKING:
    from PIL import Image

#: Formats by Pillow's names, with our names for messages. TGA has no signature, so it is tried last.
FORMATS = {
    "PNG": "PNG",
    "JPEG": "JPEG",
    "GIF": "GIF",
    "BMP": "BMP",
    "TIFF": "TIFF",
    "WEBP": "WebP",
    "AVIF": "AVIF",
    "PPM": "PPM",
    "DDS": "DDS",
    "TGA": "TGA",
}

#: Pillow's name for a JPEG file with several pictures, of which the first is taken.
_SEVERAL = "MPO"

#: The tag of PhotometricInterpretation.
_PHOTOMETRIC = 262

# DDS files with an extended header: where that names its format (DXGI_FORMAT), and formats of sRGB-coded blocks with
# those of the same blocks without a curve, which Pillow reads alone (13.0).
_EXTENDED_DDS, _DXGI_AT = (b"DDS ", b"DX10"), 128
_PLAIN_BLOCKS = {72: 71, 75: 74, 78: 77}

#: Bytes of a pixel: four channels in Pillow's memory, and as much again in the array that is made of them.
BYTES_PER_PIXEL = 8

#: The rule that a refusal quotes.
RULE = f"{', '.join([*FORMATS.values()][:-1])} and {[*FORMATS.values()][-1]} are read"


#: Pillow's limit belongs to the whole process.
_limit_lock = threading.Lock()


@contextmanager
def open_picture(source: Path | BinaryIO, formats: tuple[str, ...] = (*FORMATS,)) -> Iterator[Image.Image]:
    """The picture of a file or stream, not yet decoded.

    Pillow's own limits on a picture's size do not hold: the memory that is left does.

    Parameters
    ----------
    source:
        The file, or a binary stream that can seek.
    formats:
        Names of :data:`FORMATS`; those that this Pillow lacks are passed over.

    Raises
    ------
    PIL.UnidentifiedImageError
        If it is of none of the formats.
    OSError, SyntaxError
        If it is missing or damaged; libraries below Pillow raise other errors too.
    PictureError
        If it is a pipe or a device.
    MemoryLimitError
        If its pixels take more than the memory that is left.
    """
    from PIL import Image

    if isinstance(source, Path):
        check_kind(source, PictureError)
    with _limit_lock:
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of damaged EXIF
                opened = _open_head(source, formats)
        finally:
            Image.MAX_IMAGE_PIXELS = limit
    with opened as picture:
        name = str(source) if isinstance(source, Path) else ""
        check_input(BYTES_PER_PIXEL * picture.width * picture.height, f"a picture of {_size(picture)}", where=name)
        yield picture


def _open_head(source: Path | BinaryIO, formats: tuple[str, ...]) -> Image.Image:
    """The picture, of which the head alone is read. The common decoders come first: to load all takes long."""
    from PIL import Image, UnidentifiedImageError

    Image.preinit()
    with suppress(UnidentifiedImageError):
        return Image.open(source, formats=[name for name in formats if name in Image.OPEN])
    Image.init()
    return Image.open(source, formats=[name for name in formats if name in Image.OPEN])


def _size(picture: Image.Image) -> str:
    return f"{picture.width} x {picture.height} pixels"


def with_plain_blocks(data: bytes) -> bytes:
    """The bytes of a picture; a DDS file's blocks that are named sRGB-coded (BC1 to BC3) go by their plain name."""
    if (data[:4], data[84:88]) != _EXTENDED_DDS:
        return data
    kind = int.from_bytes(data[_DXGI_AT : _DXGI_AT + 4], "little")
    return data[:_DXGI_AT] + _PLAIN_BLOCKS.get(kind, kind).to_bytes(4, "little") + data[_DXGI_AT + 4 :]


def codes_of(picture: Image.Image) -> Pixels:
    """Codes ``(h, w, 1 | 3 | 4)`` of an open picture: uint8, or uint16 or float32 where the file holds such greys.

    They may be read-only.
    """
    has_alpha = "A" in picture.getbands() or "transparency" in picture.info
    if picture.mode.startswith("I;16") or picture.mode == "I":
        codes = np.asarray(np.clip(np.asarray(picture), 0, 65535), np.uint16)[..., None]
        if has_alpha:  # the grey of a PNG that is transparent; Pillow makes alpha of 8 bits alone of it (13.0)
            alpha = np.where(codes == picture.info["transparency"], 0, 65535).astype(np.uint16)
            return np.concatenate([codes, codes, codes, alpha], axis=2)
        return ~codes if _is_white_zero(picture) else codes
    if picture.mode == "F":
        return np.asarray(picture, np.float32)[..., None]
    if picture.mode in ("1", "L") and not has_alpha:
        return np.array(picture.convert("L"))[..., None]
    mode = "RGBA" if has_alpha else "RGB"
    codes = np.asarray(picture if picture.mode == mode else picture.convert(mode))
    return _with_blue(codes) if getattr(picture, "pixel_format", "").startswith("BC5") else codes


def _with_blue(codes: Pixels) -> Pixels:
    """Unit normals' codes of their x and y alone, which BC5 blocks hold."""
    x, y = np.moveaxis(codes[..., :2] / np.float32(127.5) - np.float32(1.0), -1, 0)
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    return np.dstack([codes[..., :2], np.rint(127.5 + 127.5 * z).astype(np.uint8)])


def _is_white_zero(picture: Image.Image) -> bool:
    """Whether a TIFF holds greys of 16 bits whose 0 is white, which Pillow leaves as they are (13.0)."""
    return picture.format == "TIFF" and getattr(picture, "tag_v2", {}).get(_PHOTOMETRIC) == 0


def is_allowed(picture: Image.Image) -> bool:
    """Whether a picture in memory was made there, or opened from a file of one of :data:`FORMATS`.

    Pillow decodes late: converting a picture that a file was opened as runs the decoder of its format.
    """
    return picture.format is None or picture.format in (*FORMATS, _SEVERAL)
