"""Values and layers as picture files hold them, and the writing of such files.

Integer formats hold values in [0, 1], rounded to the nearest code and coded as the transfer says; brighter values are
clipped, nothing is dithered. Float formats hold the linear values themselves; half floats are clipped to their largest
finite value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs import exr, png, tiff, zarr_array
from lippmann.color.transfer import Transfer, dequantize, quantize
from lippmann.display.pixel_window import TileGrid
from lippmann.errors import PictureError
from lippmann.image.micro_images import row_blocks
from lippmann.image.stored_values import FloatArray, Stored, Values

FormatName = Literal["png", "exr", "tiff", "zarr"]

#: Makes the rows of a picture from the first up to the last: ``(last - first, W, 3)`` linear floats, or codes.
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


def stored_values(linear: FloatArray, stored: Stored, transfer: Transfer) -> Values:
    """Linear float32 values as files hold them; same shape."""
    if stored in ("uint8", "uint16"):
        return quantize(linear, 8 if stored == "uint8" else 16, transfer)
    if stored == "float16":
        return np.clip(linear, -_FLOAT16_MAX, _FLOAT16_MAX).astype(np.float16)
    return linear


def linear_values(values: Values, transfer: Transfer) -> FloatArray:
    """Linear float32 values of the values that files hold: the inverse of :func:`stored_values`, but for its rounding.

    Values that are such already are not copied.
    """
    if values.dtype.kind == "u":
        return dequantize(cast("NDArray[np.uint8]", values), transfer)
    return values.astype(np.float32, copy=False)


def converted_values(values: Values, stored: Stored, transfer: Transfer) -> Values:
    """Values as files of one type hold them as those of another, without all of them being linear at once."""
    if values.dtype.name == stored:
        return values
    converted: Values = np.empty(values.shape, dtype=stored)
    for first, last in row_blocks(*values.shape[:2]):
        converted[first:last] = stored_values(linear_values(values[first:last], transfer), stored, transfer)
    return converted


def is_tiled(name: FormatName, size: tuple[int, int]) -> bool:
    """Whether a file of this format and ``size`` (width, height) is written tile by tile, never whole in memory."""
    return name == "zarr" or (name == "tiff" and size[0] * size[1] >= tiff.TILED_FROM)


def encode_rows(
    path: Path,
    name: FormatName,
    rows: Rows,
    *,
    size: tuple[int, int],
    stored: Stored,
    transfer: Transfer,
    text: str = "",
    pixel_pitch: float | None = None,
    maps: Mapping[str, NDArray[Any]] | None = None,
    in_tiles: bool = False,
) -> None:
    """Write the picture that ``rows`` makes, from the top down and each row once.

    Parameters
    ----------
    rows:
        The values, finite, as they are held; converted to ``stored``. Formats that are not tiled ask for all at once.
    size:
        Width and height.
    text:
        Metadata that the file carries.
    pixel_pitch:
        Millimetres; becomes the resolution.
    maps:
        Further layers; OpenEXR alone keeps them.
    in_tiles:
        Whether TIFF is written in tiles even where it is small.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    width, height = size

    def converted(first: int, last: int) -> Values:
        return converted_values(rows(first, last), stored, transfer)

    if in_tiles or is_tiled(name, size):
        tiles = _tiles(converted, width, height)
        encode_tiles(path, name, tiles, size=size, dtype=np.dtype(stored), text=text, pixel_pitch=pixel_pitch)
        return
    layers = {"": converted(0, height), **(maps or {})}
    encode_values(path, name, layers, transfer=transfer, text=text, pixel_pitch=pixel_pitch)


def _tiles(rows: Rows, width: int, height: int) -> Iterator[Values]:
    for top in range(0, height, tiff.TILE):
        band = rows(top, min(top + tiff.TILE, height))
        yield from (band[:, left : left + tiff.TILE] for left in range(0, width, tiff.TILE))


def encode_tiles(
    path: Path,
    name: FormatName,
    tiles: Iterator[Values],
    *,
    size: tuple[int, int],
    dtype: np.dtype[Any],
    text: str = "",
    pixel_pitch: float | None = None,
) -> None:
    """Write values as stored, in tiles of ``tiff.TILE`` pixels a side, as TIFF or Zarr; an OSError if that fails.

    ``tiles`` come row by row from the top left, ``(rows, columns, 3)`` each. A Zarr "file" is a folder, which may exist
    if it is empty.
    """
    side = tiff.TILE
    if name == "zarr":
        places = (window.slices for window in TileGrid(*size, side))
        zarr_array.write_zarr(path, zip(places, tiles, strict=True), size=size, side=side, dtype=dtype, text=text)
    else:
        tiff.write_tiled_tiff(path, tiles, size=size, side=side, dtype=dtype, description=text, pixel_pitch=pixel_pitch)


def encode_values(
    path: Path,
    name: FormatName,
    layers: Mapping[str, NDArray[Any]],
    *,
    transfer: Transfer,
    text: str = "",
    pixel_pitch: float | None = None,
) -> None:
    """Write layers that are whole in memory; an OSError if the file cannot be written.

    The layer ``""`` holds the RGB, ``(H, W, 3)`` as stored; OpenEXR keeps the others too.
    """
    values = layers[""]
    size = values.shape[1], values.shape[0]
    texts = {TEXT_KEY: text} if text else {}
    if name == "png":
        path.write_bytes(png.encode_png(values, text=texts, pixel_pitch=pixel_pitch, srgb=transfer == "srgb"))
    elif is_tiled(name, size):
        tiles = _tiles(lambda first, last: values[first:last], *size)
        encode_tiles(path, name, tiles, size=size, dtype=values.dtype, text=text, pixel_pitch=pixel_pitch)
    elif name == "tiff":
        tiff.write_tiff(path, values, description=text, pixel_pitch=pixel_pitch)
    else:
        exr.write_exr(path, _channels(layers), text=texts, pixel_pitch=pixel_pitch)


def _channels(layers: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """EXR channels: R, G, B of the layer ``""``; ``name.V`` or ``name.X``, ``.Y`` ... of the others."""
    channels = {letter: layers[""][..., k] for k, letter in enumerate("RGB")}
    for name, values in layers.items():
        if name and values.ndim == 2:
            channels[f"{name}.{_SCALAR}"] = values
        elif name:
            channels |= {f"{name}.{_VECTOR[k]}": values[..., k] for k in range(values.shape[2])}
    return channels


def layers_of_channels(channels: Mapping[str, NDArray[Any]], path: Path) -> dict[str, NDArray[Any]]:
    """Layers of the channels of an OpenEXR file: the RGB or grey (Y) of the picture, with alpha (A), under ``""``.

    Channels that are no part of a layer of ours are passed over; a :class:`PictureError` if there is no picture.
    """
    main = "RGB" if "R" in channels else "Y"
    main += "A" if "A" in channels else ""
    planes = [channels[letter] for letter in main if letter in channels]
    if len(planes) < len(main) or len({plane.dtype for plane in planes}) != 1:
        raise PictureError(
            f"has the channels {', '.join(sorted(channels))}", where=str(path), rule="R, G and B of one type are needed"
        )
    layers = {"": np.stack(planes, axis=-1)}
    for layer in {name.rpartition(".")[0] for name in channels} - {""}:
        if f"{layer}.{_SCALAR}" in channels:
            layers[layer] = channels[f"{layer}.{_SCALAR}"]
            continue
        parts = [channels[f"{layer}.{end}"] for end in _VECTOR if f"{layer}.{end}" in channels]
        if len(parts) >= 2 and len({part.dtype for part in parts}) == 1:
            layers[layer] = np.stack(parts, axis=-1)
    return layers
