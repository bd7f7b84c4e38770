"""Layers of values to picture files and back, whatever the format.

Integer formats hold values in [0, 1], rounded to the nearest code and coded as the transfer says; brighter values are
clipped, nothing is dithered. Float formats hold the linear values themselves; half floats are clipped to their largest
finite value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs import exr, png, tiff, zarr_array
from lippmann.color.transfer import Transfer, dequantize, quantize
from lippmann.display.pixel_window import TileGrid
from lippmann.errors import PictureError
from lippmann.image.micro_images import row_blocks
from lippmann.image.stored_values import Stored

FormatName = Literal["png", "exr", "tiff", "zarr"]

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

#: More pixels than are read at once; a file that claims more is damaged, or meant to fill the memory.
MOST_PIXELS = 1 << 29
#: The same for formats that are read piece by piece: more than any panel or print has.
MOST_IN_PIECES = 1 << 32

#: Deflate, the tightest packing of all formats here, makes at most 1032 bytes of one: as many grey pixels of 8 bits.
_MOST_PIXELS_PER_BYTE = 1100

#: Ends of the channel names of a layer with one value per pixel and of layers with several.
_SCALAR, _VECTOR = "V", "XYZW"

_FLOAT16_MAX = 65504.0


@dataclass(frozen=True)
class FileHeader:
    """What a picture file says before its pixels: ``stored`` is a NumPy type name, ``text`` its metadata or empty."""

    format: FormatName
    width: int
    height: int
    stored: str
    layers: tuple[str, ...]
    text: str


def encode_file(
    path: Path,
    name: FormatName,
    layers: Mapping[str, NDArray[Any]],
    *,
    stored: Stored,
    transfer: Transfer,
    text: str = "",
    pixel_pitch: float | None = None,
) -> None:
    """Write the layer ``""`` (linear RGB, finite), and in OpenEXR the others; an OSError if the file cannot be.

    A Zarr "file" is a folder, which may exist if it is empty.
    """
    values = stored_values(np.asarray(layers[""], dtype=np.float32), stored, transfer)
    encode_values(path, name, {**layers, "": values}, transfer=transfer, text=text, pixel_pitch=pixel_pitch)


def encode_values(
    path: Path,
    name: FormatName,
    layers: Mapping[str, NDArray[Any]],
    *,
    transfer: Transfer,
    text: str = "",
    pixel_pitch: float | None = None,
) -> None:
    """:func:`encode_file` of a layer ``""`` that is made of :func:`stored_values` already."""
    values = layers[""]
    texts = {TEXT_KEY: text} if text else {}
    if name == "png":
        path.write_bytes(png.encode_png(values, text=texts, pixel_pitch=pixel_pitch, srgb=transfer == "srgb"))
    elif name == "tiff":
        tiff.write_tiff(path, values, description=text, pixel_pitch=pixel_pitch)
    elif name == "zarr":
        height, width = values.shape[:2]
        cuts = [window.slices for window in TileGrid(width, height, tiff.TILE)]
        tiles = ((place, values[place]) for place in cuts)
        zarr_array.write_zarr(path, tiles, size=(width, height), side=tiff.TILE, dtype=values.dtype, text=text)
    else:
        exr.write_exr(path, _channels(layers), text=texts, pixel_pitch=pixel_pitch)


def stored_values(linear: NDArray[np.float32], stored: Stored, transfer: Transfer) -> NDArray[Any]:
    """Linear float32 values as files hold them; same shape."""
    if stored in ("uint8", "uint16"):
        return quantize(linear, 8 if stored == "uint8" else 16, transfer)
    if stored == "float16":
        return np.clip(linear, -_FLOAT16_MAX, _FLOAT16_MAX).astype(np.float16)
    return linear


def linear_values(values: NDArray[Any], transfer: Transfer) -> NDArray[np.float32]:
    """Linear float32 values of what files hold: the inverse of :func:`stored_values`, but for its rounding.

    Values that are such already are not copied.
    """
    return dequantize(values, transfer) if values.dtype.kind == "u" else values.astype(np.float32, copy=False)


def converted_values(values: NDArray[Any], stored: Stored, transfer: Transfer) -> NDArray[Any]:
    """Values as files of one type hold them as those of another, without all of them being linear at once."""
    if values.dtype.name == stored:
        return values
    converted = np.empty(values.shape, dtype=stored)
    for first, last in row_blocks(*values.shape[:2]):
        converted[first:last] = stored_values(linear_values(values[first:last], transfer), stored, transfer)
    return converted


def decode_file(path: Path, name: FormatName, transfer: Transfer) -> tuple[dict[str, NDArray[Any]], Stored]:
    """Layers of a file, with linear RGB under ``""``, and the type in which that was stored.

    Raises
    ------
    PictureError
        If the pixels cannot be decoded or are no opaque colours of a known depth.
    """
    layers, stored = decode_stored(path, name)
    layers[""] = linear_values(layers[""], transfer)
    return layers, stored


def decode_stored(path: Path, name: FormatName) -> tuple[dict[str, NDArray[Any]], Stored]:
    """As :func:`decode_file`, but with the RGB as stored."""
    layers: dict[str, NDArray[Any]] = {}
    if name in ("tiff", "zarr"):
        _check_not_too_large(path)
    if name == "exr":
        layers = _layers(exr.read_exr(path), path)
        values = layers[""]
    elif name == "zarr":
        values = zarr_array.read_part(zarr_array.open_zarr(path), (slice(None), slice(None)), path)
    else:
        values = png.read_png(path) if name == "png" else tiff.read_tiff(path)
    stored = values.dtype.name
    check_stored(stored, name, path)
    layers[""] = opaque_colors(values, path)
    return layers, cast(Stored, stored)


def _check_not_too_large(path: Path) -> None:
    header = read_header(path)
    if header.width * header.height > MOST_PIXELS:
        raise PictureError(
            f"has {header.width} x {header.height} pixels",
            where=str(path),
            rule=f"at most {MOST_PIXELS} are read at once",
            fix="use what reads it piece by piece: info, replay, views, refocus, compare, view",
        )


def check_stored(stored: str, name: FormatName, path: Path) -> None:
    """Raise :class:`PictureError` if a format's values of this type are not read."""
    if stored not in STORED[name].values():
        rule = f"{name} is read with {', '.join(STORED[name].values())}"
        raise PictureError(f"holds values of the type {stored}", where=str(path), rule=rule)


def read_header(path: Path) -> FileHeader:
    """Format, size and text of a picture file, without decoding its pixels.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign, cut short, or claims a size that it cannot hold.
    """
    name = _recognized(path)
    layers: tuple[str, ...] = ()
    if name == "png":
        png_header = png.read_png_header(path)
        width, height, text = png_header.width, png_header.height, png_header.text.get(TEXT_KEY, "")
        stored = f"uint{max(8, png_header.bits)}"
    elif name == "exr":
        exr_header = exr.read_exr_header(path)
        width, height, text = exr_header.width, exr_header.height, exr_header.text.get(TEXT_KEY, "")
        stored = exr_header.channels.get("R", "none")
        layers = tuple(sorted({layer for layer, dot, _ in (c.rpartition(".") for c in exr_header.channels) if dot}))
    elif name == "zarr":
        array = zarr_array.open_zarr(path)
        (height, width), text, stored = array.shape[:2], zarr_array.zarr_text(path), array.dtype.name
    else:
        tiff_header = tiff.read_tiff_header(path)
        width, height, text = tiff_header.width, tiff_header.height, tiff_header.description
        stored = tiff_header.dtype
    _check_plausible(path, name, width, height)
    return FileHeader(name, width, height, stored, layers, text)


def _recognized(path: Path) -> FormatName:
    if zarr_array.is_zarr(path):
        return "zarr"
    try:
        with path.open("rb") as file:
            start = file.read(8)
    except FileNotFoundError:
        raise PictureError("is not there", where=str(path)) from None
    except ValueError:
        raise PictureError("is no name of a file", where=repr(str(path))) from None
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(path)) from error
    if not start:
        raise PictureError("is empty", where=str(path), fix="make or fetch it anew")
    if start == png.SIGNATURE:
        return "png"
    if start.startswith(exr.SIGNATURE):
        return "exr"
    if start.startswith(tiff.SIGNATURES):
        return "tiff"
    raise PictureError("is no picture that is known here", where=str(path), rule="PNG, OpenEXR, TIFF and Zarr are read")


def _check_plausible(path: Path, name: FormatName, width: int, height: int) -> None:
    """Refuse sizes that the file cannot hold before memory is given to them."""
    most = MOST_IN_PIECES if name in ("tiff", "zarr") else MOST_PIXELS
    if width * height > most:
        rule = f"at most {most} pixels are read"
        raise PictureError(f"claims {width} x {height} pixels", where=str(path), rule=rule)
    if path.is_dir():  # chunks that hold nothing need no files
        return
    size = path.stat().st_size
    if width * height > size * _MOST_PIXELS_PER_BYTE:
        what = f"claims {width} x {height} pixels but has only {size} bytes"
        raise PictureError(what, where=str(path), fix="make or fetch it anew")


def opaque_colors(values: NDArray[Any], path: Path) -> NDArray[Any]:
    """``(H, W, 3)`` values as stored, of grey, grey and alpha, RGB, or RGB and alpha, where alpha hides nothing."""
    if values.ndim == 2:
        values = values[..., None]
    channels = values.shape[2] if values.ndim == 3 else 0
    if not 1 <= channels <= 4:
        raise PictureError(f"holds an array of shape {values.shape}", where=str(path), rule="it must be grey or RGB")
    if channels in (2, 4):
        opaque = 1.0 if values.dtype.kind == "f" else np.iinfo(values.dtype).max
        if (values[..., -1] != opaque).any():
            raise PictureError("is partly transparent", where=str(path), rule="a panel is not", fix="flatten it")
        values = values[..., :-1]
    return np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values


def _channels(layers: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """EXR channels: R, G, B of the layer ``""``; ``name.V`` or ``name.X``, ``.Y`` ... of the others."""
    channels = {letter: layers[""][..., k] for k, letter in enumerate("RGB")}
    for name, values in layers.items():
        if not name:
            continue
        if values.ndim == 2:
            channels[f"{name}.{_SCALAR}"] = values
        else:
            channels |= {f"{name}.{_VECTOR[k]}": values[..., k] for k in range(values.shape[2])}
    return channels


def _layers(channels: Mapping[str, NDArray[Any]], path: Path) -> dict[str, NDArray[Any]]:
    """The inverse of :func:`_channels`; also takes a grey picture (Y) and alpha (A). Other channels are passed over."""
    main = "RGB" if "R" in channels else "Y"
    main += "A" if "A" in channels else ""
    planes = [channels.get(letter) for letter in main]
    if any(plane is None for plane in planes) or len({plane.dtype for plane in planes if plane is not None}) != 1:
        raise PictureError(
            f"has the channels {', '.join(sorted(channels))}", where=str(path), rule="R, G and B of one type are needed"
        )
    layers = {"": np.stack(cast("list[NDArray[Any]]", planes), axis=-1)}
    for layer in {name.rpartition(".")[0] for name in channels} - {""}:
        if f"{layer}.{_SCALAR}" in channels:
            layers[layer] = channels[f"{layer}.{_SCALAR}"]
            continue
        parts = [channels[f"{layer}.{end}"] for end in _VECTOR if f"{layer}.{end}" in channels]
        if len(parts) >= 2 and len({part.dtype for part in parts}) == 1:
            layers[layer] = np.stack(parts, axis=-1)
    return layers
