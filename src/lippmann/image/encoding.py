"""Coding of values and layers in picture files.

Integer formats hold values in [0, 1], coded by the transfer function and rounded to the nearest code. Brighter values
are clipped; nothing is dithered. Float formats hold linear values. Half floats are clipped to their largest finite
value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Literal, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs import png, tiff
from lippmann.codecs.icc import srgb_profile
from lippmann.color.transfer import Transfer, dequantize, quantize
from lippmann.display import Display
from lippmann.display.micro_image_layout import row_blocks
from lippmann.display.panel import TileGrid
from lippmann.display.sheet import SRGB
from lippmann.errors import PictureError
from lippmann.image.stored_values import FloatArray, Layer, Stored, Values

FormatName = Literal["png", "exr", "tiff", "zarr"]

#: ``rows(first, last)`` gives rows of a picture, ``(last - first, W, 3)`` linear floats or codes.
Rows = Callable[[int, int], Values]

#: Formats by the endings of file names.
FORMATS: dict[str, FormatName] = {".png": "png", ".exr": "exr", ".tif": "tiff", ".tiff": "tiff", ".zarr": "zarr"}

#: Type of the stored values by format and bits per channel; each format's first is its default.
STORED: dict[FormatName, dict[int, Stored]] = {
    "png": {8: "uint8", 16: "uint16"},
    "exr": {32: "float32", 16: "float16"},
    "tiff": {8: "uint8", 16: "uint16", 32: "float32"},
    "zarr": {8: "uint8", 16: "uint16", 32: "float32"},
}

#: Keyword of the PNG text and name of the EXR attribute that carry a picture's metadata.
TEXT_KEY = "lippmann"

#: Ends of the channel names of a layer with one value per pixel and of layers with several.
_SCALAR, _VECTOR = "V", "XYZW"

_FLOAT16_MAX = 65504.0


def display_codes(linear: FloatArray, bits: int, transfer: Transfer) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Codes of linear RGB as integer formats hold them, of 8 or 16 bits; another number is a :class:`PictureError`."""
    if bits not in (8, 16):
        raise PictureError(f"codes of {bits} bits", rule="display codes have 8 or 16 bits")
    return quantize(linear, bits, transfer)


def stored_values(linear: FloatArray, stored: Stored, transfer: Transfer) -> Values:
    """Codes or floats of the type ``stored`` for linear float32 values; same shape."""
    if stored in ("uint8", "uint16"):
        return quantize(linear, 8 if stored == "uint8" else 16, transfer)
    if stored == "float16":
        return np.clip(linear, -_FLOAT16_MAX, _FLOAT16_MAX).astype(np.float16)
    return linear


def linear_values(values: Values, transfer: Transfer) -> FloatArray:
    """Linear float32 values for codes or floats, inverse of :func:`stored_values` up to rounding; float32 is shared."""
    if values.dtype.kind == "u":
        return dequantize(cast("NDArray[np.uint8]", values), transfer)
    return values.astype(np.float32, copy=False)


def converted_values(values: Values, stored: Stored, transfer: Transfer) -> Values:
    """``(H, W, 3)`` codes or floats converted to the type ``stored``, a block of rows at a time."""
    if values.dtype.name == stored:
        return values
    converted: Values = np.empty(values.shape, dtype=stored)
    for first, last in row_blocks(*values.shape[:2]):
        converted[first:last] = stored_values(linear_values(values[first:last], transfer), stored, transfer)
    return converted


def is_tiled(name: FormatName, size: tuple[int, int]) -> bool:
    """Whether a file of this format and ``size`` (width, height) is written tile by tile."""
    return name == "zarr" or (name == "tiff" and size[0] * size[1] >= tiff.TILED_FROM)


def tiles_of_rows(rows: Rows, size: tuple[int, int]) -> Iterator[Values]:
    """Tiles of ``tiff.TILE`` pixels a side, row by row from the top left, of a picture of ``size`` (width, height)."""
    width, height = size
    for top in range(0, height, tiff.TILE):
        band = rows(top, min(top + tiff.TILE, height))
        yield from (band[:, left : left + tiff.TILE] for left in range(0, width, tiff.TILE))


def encode_tiles(
    path: Path,
    name: FormatName,
    tiles: Iterator[Values],
    *,
    size: tuple[int, int],
    dtype: np.dtype[np.generic],
    text: str = "",
    pixel_pitch: float | None = None,
    icc: bytes = b"",
) -> None:
    """Write a TIFF or Zarr file from the tiles of :func:`tiles_of_rows`.

    Parameters
    ----------
    path:
        The file; for Zarr a folder, absent or empty.
    tiles:
        Values as stored, of the type ``dtype``.
    size:
        Width and height in pixels.
    text:
        JSON of the metadata; empty without.
    pixel_pitch:
        Millimetres; becomes the resolution of a TIFF.
    icc:
        ICC profile of integer values in a TIFF; empty without.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    side = tiff.TILE
    if name == "zarr":
        from lippmann.codecs import zarr_array

        places = (window.slices for window in TileGrid(*size, side))
        zarr_array.write_zarr(path, zip(places, tiles, strict=True), size=size, side=side, dtype=dtype, text=text)
        return
    tiff.write_tiled_tiff(
        path, tiles, size=size, side=side, dtype=dtype, description=text, pixel_pitch=pixel_pitch, icc=icc
    )


def encode_values(
    path: Path,
    name: FormatName,
    layers: Mapping[str, Layer],
    *,
    transfer: Transfer,
    text: str = "",
    pixel_pitch: float | None = None,
    icc: bytes = b"",
) -> None:
    """Write a picture file from layers in memory.

    Parameters
    ----------
    layers:
        Layer ``""`` is the RGB, ``(H, W, 3)`` as stored. OpenEXR alone keeps the others.
    transfer:
        Coding of integer values, marked in PNG files.
    path, text, pixel_pitch, icc:
        As of :func:`encode_tiles`, and its error; PNG has a resolution and a profile, too.
    """
    values = cast("Values", layers[""])
    size = values.shape[1], values.shape[0]
    texts = {TEXT_KEY: text} if text else {}
    if name == "png":
        encoded = png.encode_png(values, text=texts, pixel_pitch=pixel_pitch, srgb=transfer == "srgb", icc=icc)
        path.write_bytes(encoded)
    elif name == "exr":
        from lippmann.codecs import exr

        exr.write_exr(path, _channels(layers), text=texts, pixel_pitch=pixel_pitch)
    elif is_tiled(name, size):
        tiles = tiles_of_rows(lambda first, last: values[first:last], size)
        encode_tiles(path, name, tiles, size=size, dtype=values.dtype, text=text, pixel_pitch=pixel_pitch, icc=icc)
    else:
        tiff.write_tiff(path, values, description=text, pixel_pitch=pixel_pitch, icc=icc)


def _channels(layers: Mapping[str, Layer]) -> dict[str, Layer]:
    """EXR channels: R, G, B of the layer ``""``; ``name.V`` or ``name.X``, ``.Y`` ... of the others."""
    channels = {letter: layers[""][..., k] for k, letter in enumerate("RGB")}
    for name, values in layers.items():
        if name and values.ndim == 2:
            channels[f"{name}.{_SCALAR}"] = values
        elif name:
            channels |= {f"{name}.{_VECTOR[k]}": values[..., k] for k in range(values.shape[2])}
    return channels


def layers_of_channels(channels: Mapping[str, Layer], path: Path) -> dict[str, Layer]:
    """Layers of the channels of an OpenEXR file.

    Layer ``""`` is the picture, ``(H, W, channels)``: R, G, B or grey (Y), with alpha (A). Channels of unknown names
    are left out.

    Raises
    ------
    PictureError
        If there is no picture, or its channels differ in type; names ``path``.
    """
    main = "RGB" if "R" in channels else "Y"
    main += "A" if "A" in channels else ""
    planes = [channels[letter] for letter in main if letter in channels]
    if len(planes) < len(main) or len({plane.dtype for plane in planes}) != 1:
        rule = "R, G and B of one type are needed"
        raise PictureError(f"has the channels {', '.join(sorted(channels))}", where=str(path), rule=rule)
    layers: dict[str, Layer] = {"": np.stack(planes, axis=-1)}
    for layer in {name.rpartition(".")[0] for name in channels} - {""}:
        if f"{layer}.{_SCALAR}" in channels:
            layers[layer] = channels[f"{layer}.{_SCALAR}"]
            continue
        parts = [channels[f"{layer}.{end}"] for end in _VECTOR if f"{layer}.{end}" in channels]
        if len(parts) >= 2 and len({part.dtype for part in parts}) == 1:
            layers[layer] = np.stack(parts, axis=-1)
    return layers


Number = TypeVar("Number", bound=np.generic)


def is_mirrored(display: Display | None) -> bool:
    """Whether files of a display's pictures hold them mirrored."""
    return display is not None and display.sheet is not None and display.sheet.mirrored


def mirrored_in_file(rows: NDArray[Number], display: Display | None) -> NDArray[Number]:
    """``(H, W, ...)`` whole rows in memory as a file holds them; and those of a file as memory does."""
    return rows[:, ::-1] if is_mirrored(display) else rows


def profile_in_file(display: Display | None, stored: Stored, transfer: Transfer, icc: bytes = b"") -> bytes:
    """The ICC profile that a picture's file is given: ``icc``, else sRGB's if the sheet of a print says so.

    Empty for panels, whose players read pixels alone, and for values that are no display codes.
    """
    sheet = None if display is None else display.sheet
    if sheet is None or transfer != "srgb" or stored not in ("uint8", "uint16"):
        return b""
    return icc or (srgb_profile() if sheet.profile == SRGB else b"")
