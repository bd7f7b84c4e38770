"""OpenEXR: float layers and text attributes.

Pixels go through the OpenEXR library, headers are read here (openexr.com, "OpenEXR File Layout"). The library's Python
binding reads a header alone (``header_only``) without saying where the table of chunks begins, so that a file cut short
would pass for whole. It also reads attributes of gigabytes into memory, and version 3.3.0 returns no parts.
"""

from __future__ import annotations

import contextlib
import io
import struct
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from lippmann.codecs.picture_notes import aspect_note
from lippmann.codecs.types import Pixels
from lippmann.color.primaries import REC709, rec709_from_rgb, to_rec709
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input
from lippmann.runtime.quiet_stderr import silence_libraries

SIGNATURE = b"\x76\x2f\x31\x01"

#: The attribute pixelAspectRatio of square pixels.
_SQUARE = struct.pack("<f", 1.0)

#: Standard attributes that say how colours or views are meant, and do not count here.
_UNUSED = ("adoptedNeutral", "lookModTransform", "multiView", "renderingTransform", "whiteLuminance")

_DEEP, _MULTIPART = 0x800, 0x1000
_DTYPES = {0: "uint32", 1: "float16", 2: "float32"}
#: Rows per chunk by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
_ROWS_PER_CHUNK = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)
_LONGEST_ATTRIBUTE = 1 << 24
#: Pixels of a tile that may be larger than its picture.
_LARGEST_FREE_TILE = 1 << 20


@dataclass(frozen=True)
class ExrHeader:
    """The header of an EXR.

    Attributes
    ----------
    width, height:
        Size of its display window, which is the picture.
    channels:
        Name to NumPy type name.
    text:
        Its text attributes.
    window:
        First column and row of the stored pixels in the picture, and their number across and down. Beyond them the
        picture is 0, those beyond it are cropped.
    chromaticities:
        x and y of red, green, blue and white; None for those of Rec. 709.
    notes:
        What of it is not shown, each in one line.
    layer:
        The name, with its dot, of the layer whose channels have the names R, G, B and A here; empty where the file
        has a picture without a name.
    """

    width: int
    height: int
    channels: Mapping[str, str]
    text: Mapping[str, str]
    window: tuple[int, int, int, int]
    chromaticities: tuple[float, ...] | None
    notes: tuple[str, ...] = ()
    layer: str = ""
    part: int = 0
    other_bytes: int = 0

    def rec709(self, pixels: Pixels) -> Pixels:
        """Linear RGB ``(..., 3)`` of the file as that of Rec. 709; colours beyond it are clipped at 0.

        Raises
        ------
        PictureError
            The chromaticities mean nothing.
        """
        if self.chromaticities is None or np.allclose(self.chromaticities, REC709, atol=1e-3):
            return pixels
        try:
            return to_rec709(pixels, rec709_from_rgb(self.chromaticities))
        except ValueError as error:
            raise PictureError(str(error), where="chromaticities") from None


def write_exr(
    path: Path,
    channels: Mapping[str, Pixels],
    *,
    text: Mapping[str, str],
    pixel_pitch: float | None = None,
) -> None:
    """Write ``(H, W)`` channels (float16, float32 or uint32) with text attributes, losslessly compressed (ZIP).

    ``pixel_pitch`` (mm) becomes the standard attribute ``xDensity`` (pixels per inch).

    Raises
    ------
    OSError
        If the library cannot write the file.
    """
    import OpenEXR

    header: dict[str, Any] = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **text}
    if pixel_pitch is not None:
        header["xDensity"] = 25.4 / pixel_pitch
    # The library replaces the values of the mapping it is given, so it gets one of its own.
    planes = {name: np.ascontiguousarray(plane) for name, plane in channels.items()}
    try:
        OpenEXR.File(header, planes).write(str(path))
    except RuntimeError as error:
        raise OSError(str(error)) from error


def read_exr_header(path: Path, fits: Callable[[Collection[str]], bool] | None = None) -> ExrHeader:
    """Size, channels and texts of an EXR, and whether all of it is there, without decoding its pixels.

    Of several parts the first counts whose channels' names ``fits`` accepts (None: colours), else the first.

    Raises
    ------
    PictureError
        If the file is truncated, damaged, no EXR, or of a kind that holds no plain picture (deep).
    """
    with path.open("rb") as file:
        return exr_header(file, path, fits)


def exr_header(file: BinaryIO, path: Path, fits: Callable[[Collection[str]], bool] | None = None) -> ExrHeader:
    """:func:`read_exr_header` of a file that is open, at its beginning; ``path`` is its name, for errors."""
    if file.read(4) != SIGNATURE:
        raise PictureError("is no OpenEXR file", where=str(path))
    try:
        (version,) = struct.unpack("<I", _exactly(file, 4))
        if version & _DEEP:
            raise PictureError(
                "is a deep OpenEXR file",
                where=str(path),
                rule="flat ones are read",
                fix="flatten it, by oiiotool: oiiotool in.exr --flatten -o out.exr",
            )
        parts = [_attributes(file)]
        while version & _MULTIPART and (more := _attributes(file)):
            parts.append(more)
        names = (_channel_list(each["channels"][1])[0] for each in parts)
        part = next((number for number, held in enumerate(names) if (fits or _has_colors)(held)), 0)
        attributes = parts[part]
        x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
        channels, subsampled = _channel_list(attributes["channels"][1])
        layer = _picture_layer(channels)
        channels = {name.removeprefix(layer): kind for name, kind in channels.items()}
        if {"RY", "BY"} & {*channels, *subsampled}:
            what = "has luminance and chroma (Y, RY, BY)"
            raise PictureError(what, where=str(path), rule="R, G and B are read", fix="convert it to RGB")
        stored_width, stored_height = x1 - x0 + 1, y1 - y0 + 1
        left, top, right, bottom = struct.unpack("<4i", attributes["displayWindow"][1])
        width, height = right - left + 1, bottom - top + 1
        if min(width, height, stored_width, stored_height) < 1:
            raise _damaged(
                path, f"its size is {width} x {height}, of which {stored_width} x {stored_height} are stored"
            )
        window = (x0 - left, y0 - top, stored_width, stored_height)
        primaries = attributes.get("chromaticities", ("", b""))[1]
        chromaticities = struct.unpack("<8f", primaries) if primaries else None
        (aspect,) = struct.unpack("<f", attributes.get("pixelAspectRatio", ("", _SQUARE))[1])
        if "tiles" in attributes:
            _check_tiles(attributes["tiles"][1], stored_width * stored_height, path)
        else:
            file.seek(sum(8 * struct.unpack("<I", each["chunkCount"][1])[0] for each in parts[:part]), 1)
            part_number = 4 if version & _MULTIPART else 0
            _check_chunks(file, stored_height, attributes["compression"][1][0], part_number)
        other_bytes = sum(map(_bytes_of, parts)) - _bytes_of(attributes)
        text = {name: value.decode("utf-8") for name, (kind, value) in attributes.items() if kind == "string"}
    except (struct.error, KeyError, IndexError, EOFError, UnicodeDecodeError) as error:
        raise _damaged(path, "it is cut short or its header makes no sense") from error
    unused = tuple(f"its attribute {name} is not used" for name in _UNUSED if name in attributes)
    notes = (
        aspect_note(1.0, aspect)
        + unused
        + tuple(f"its channel {name} is subsampled: it is left out" for name in subsampled)
        + ((f"its layer {layer[:-1]} is taken for the picture",) if layer else ())
        + ((f"of its {len(parts)} parts '{text.get('name', part)}' is shown",) if len(parts) > 1 else ())
    )
    return ExrHeader(width, height, channels, text, window, chromaticities, notes, layer, part, other_bytes)


def read_exr(path: Path, header: ExrHeader) -> dict[str, Pixels]:
    """All channels of an EXR, ``(H, W)`` each, as stored; ``header`` is what :func:`read_exr_header` said of it.

    Raises
    ------
    PictureError
        If the pixels cannot be decoded.
    MemoryLimitError
        If they take more than the memory that is left.
    """
    import OpenEXR

    pixel = sum(np.dtype(kind).itemsize for kind in header.channels.values())
    # The library's own planes, and those that it is asked for.
    stored = header.window[2] * header.window[3]
    whole = 2 * pixel * max(header.width * header.height, stored) + header.other_bytes
    check_input(whole, "its picture", where=str(path))
    # The binding prints a warning where it should raise; what it read then has no parts.
    with contextlib.redirect_stdout(io.StringIO()), silence_libraries():
        try:
            file = OpenEXR.File(str(path), separate_channels=True)
        except (RuntimeError, ValueError) as error:
            raise _damaged(path, str(error)) from error
    if len(file.parts) <= header.part:
        raise _damaged(path, "its pixels cannot be decoded")
    return {
        name.removeprefix(header.layer): _in_display_window(np.asarray(channel.pixels), header)
        for name, channel in file.parts[header.part].channels.items()
    }


def _in_display_window(plane: Pixels, header: ExrHeader) -> Pixels:
    left, top, width, height = header.window
    if header.window == (0, 0, header.width, header.height) or plane.shape[:2] != (height, width):
        return plane
    whole = np.zeros((header.height, header.width, *plane.shape[2:]), plane.dtype)
    rows, stored_rows = _overlap(top, height, header.height)
    columns, stored_columns = _overlap(left, width, header.width)
    whole[rows, columns] = plane[stored_rows, stored_columns]
    return whole


def _overlap(first: int, count: int, size: int) -> tuple[slice, slice]:
    """Overlap of ``count`` stored places from number ``first`` on with 0 to ``size``: in the picture, and in store."""
    start = min(max(first, 0), size)
    stop = max(min(first + count, size), start)
    return slice(start, stop), slice(start - first, stop - first)


def _check_tiles(attribute: bytes, pixels: int, path: Path) -> None:
    """Refuse tiles that are absurd beside their picture: the library gives memory to whole ones."""
    wide, high = struct.unpack_from("<2I", attribute)
    if not wide or not high or wide * high > max(pixels, _LARGEST_FREE_TILE):
        raise _damaged(path, f"its tiles have {wide} x {high} pixels")


def _exactly(file: BinaryIO, count: int) -> bytes:
    data = file.read(count)
    if len(data) < count:
        raise EOFError
    return data


def _name(file: BinaryIO) -> str:
    """A null-terminated name of at most 255 bytes (the format's own limit)."""
    name = b""
    while (letter := _exactly(file, 1)) != b"\0":
        name += letter
        if len(name) > 255:
            raise EOFError
    return name.decode("utf-8")


def _attributes(file: BinaryIO) -> dict[str, tuple[str, bytes]]:
    """Type and raw value of every header attribute by name; the file is left at the chunk table."""
    attributes = {}
    while name := _name(file):
        kind = _name(file)
        (size,) = struct.unpack("<i", _exactly(file, 4))
        if not 0 <= size <= _LONGEST_ATTRIBUTE:
            raise EOFError
        attributes[name] = kind, _exactly(file, size)
    return attributes


def _channel_list(raw: bytes) -> tuple[dict[str, str], list[str]]:
    """NumPy type names of channels with a value for every pixel, and the names of the others."""
    file, channels, subsampled = io.BytesIO(raw), {}, []
    while name := _name(file):
        kind, _, x_step, y_step = struct.unpack("<iIii", _exactly(file, 16))
        if x_step == y_step == 1:
            channels[name] = _DTYPES[kind]
        else:
            subsampled.append(name)
    return channels, subsampled


def _has_colors(names: Collection[str]) -> bool:
    """Whether channels are the colours of a picture, of its own or of the layer that stands for it."""
    return {"R", "G", "B"} <= {*names} or bool(_picture_layer(names))


def _bytes_of(attributes: Mapping[str, tuple[str, bytes]]) -> int:
    """Bytes of a part's pixels."""
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
    channels, subsampled = _channel_list(attributes["channels"][1])
    return int(4 * (len(channels) + len(subsampled)) * max(x1 - x0 + 1, 0) * max(y1 - y0 + 1, 0))


def _picture_layer(names: Collection[str]) -> str:
    """The layer with colours that stands for the missing picture: the only one, or Blender's ``Combined``."""
    layers = [each[:-1] for each in names if each.endswith(".R") and {f"{each[:-1]}G", f"{each[:-1]}B"} <= {*names}]
    layers = [each for each in layers if each.endswith("Combined.")] or layers
    return layers[0] if len(layers) == 1 and not {"R", "Y"} & {*names} else ""


def _check_chunks(file: BinaryIO, height: int, compression: int, part_number: int) -> None:
    """EOFError if a chunk of rows lies (partly) beyond the file's end; later compressions are left to the library.

    A chunk begins with ``part_number`` bytes of that, and its first row.
    """
    if compression >= len(_ROWS_PER_CHUNK):
        return
    count = -(-height // _ROWS_PER_CHUNK[compression])
    table = file.tell()
    size = file.seek(0, 2)
    if table + 8 * count > size:
        raise EOFError
    file.seek(table)
    for (start,) in struct.iter_unpack("<Q", _exactly(file, 8 * count)):
        body = start + part_number + 8
        if body > size:
            raise EOFError
        file.seek(body - 4)
        (length,) = struct.unpack("<i", _exactly(file, 4))
        if length < 0 or body + length > size:
            raise EOFError


def _damaged(path: Path, what: str) -> PictureError:
    return PictureError(f"this OpenEXR file is damaged: {what}", where=str(path), fix="make or fetch it anew")
