"""Environment maps: OpenEXR (``.exr``) and Radiance (``.hdr``)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.exr import SIGNATURE, read_exr, read_exr_header
from lippmann.errors import PictureError, SceneError
from lippmann.runtime.input_memory import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.values.description import Environment

_HDR_MAGICS = (b"#?RADIANCE", b"#?RGBE")
#: The size, after the header's first empty line.
_HDR_SIZE = re.compile(rb"[-+]Y +([0-9]{1,9}) +[-+]X +([0-9]{1,9})\s")

#: Channels of red, green and blue: luminance alone is grey.
_COLORS = (("R", "G", "B"), ("Y", "Y", "Y"))

#: A byte of an HDR file holds less than so many pixels: at best two bytes stand for 127 values of four channels.
_HDR_PIXELS_PER_BYTE = 16


def read_environment(path: Path) -> Environment:
    """Read an equirectangular picture, row 0 straight up.

    Raises
    ------
    SceneError
        The file is missing, damaged or neither EXR nor HDR; it has no three colours; a value is negative, not finite
        or beyond 32-bit floats; it is less than two pixels high or wide, or not about twice as wide as high.
    """
    data = read_bytes(path)
    where = path.name
    if data.startswith(SIGNATURE):
        pixels = _read_exr(path, where)
    elif data.startswith(_HDR_MAGICS):
        pixels = _read_hdr(data, where)
    else:
        raise SceneError("is no environment picture", where=where, rule="OpenEXR (.exr) and Radiance (.hdr) are read")
    _check(pixels, where)
    return Environment(pixels, name=path.name)


def _read_exr(path: Path, where: str) -> NDArray[np.float32]:
    try:
        header = read_exr_header(path)
        names = next((names for names in _COLORS if set(names) <= header.channels.keys()), None)
        if names is None:
            held = ", ".join(sorted(header.channels))
            raise SceneError(f"has the channels {held}", where=where, rule="R, G and B are needed")
        _check_size(header.height, header.width, where)
        channels = read_exr(path, header)
    except PictureError as error:
        raise _undecodable(error.what, where) from None
    return np.stack([np.asarray(channels[name], np.float32) for name in names], axis=-1)


def _read_hdr(data: bytes, where: str) -> NDArray[np.float32]:
    import imagecodecs

    size = _HDR_SIZE.match(data, data.find(b"\n\n") + 2)
    if size is None:
        raise _undecodable("it does not say its size", where)
    height, width = int(size[1]), int(size[2])
    _check_size(height, width, where)
    check_input(16 * height * width, "its picture", where=where)
    if height * width > _HDR_PIXELS_PER_BYTE * len(data):
        raise _undecodable(f"{len(data)} bytes hold no {width}x{height} pixels", where)
    try:
        return np.asarray(imagecodecs.rgbe_decode(data), np.float32)
    except (RuntimeError, ValueError) as error:
        raise _undecodable(str(error), where) from None


def _undecodable(why: str, where: str) -> SceneError:
    return SceneError(f"cannot be decoded ({why})", where=where, fix="is it cut short?")


def _check_size(height: int, width: int, where: str) -> None:
    if min(height, width) < 2 or not 1.8 < width / height < 2.2:
        raise SceneError(
            f"is {width}x{height} pixels",
            where=where,
            rule="an equirectangular picture is twice as wide as high",
            fix="convert cube maps and mirror balls first",
        )


def _check(pixels: NDArray[np.float32], where: str) -> None:
    _check_size(pixels.shape[0], pixels.shape[1], where)
    bad = ~np.isfinite(pixels).all(axis=-1) | (pixels < 0.0).any(axis=-1)
    if bad.any():
        row, column = (int(value) for value in np.argwhere(bad)[0])
        raise SceneError(
            f"pixel ({column}, {row}) is {pixels[row, column].tolist()}",
            where=where,
            rule="light is finite and not negative",
        )
