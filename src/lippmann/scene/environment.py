"""Pictures of the surroundings as light: OpenEXR (``.exr``) and Radiance (``.hdr``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.description import Environment
from lippmann.scene.resources import read_bytes

_EXR_MAGIC = b"\x76\x2f\x31\x01"
_HDR_MAGICS = (b"#?RADIANCE", b"#?RGBE")


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
    if data.startswith(_EXR_MAGIC):
        pixels = _read_exr(path, where)
    elif data.startswith(_HDR_MAGICS):
        pixels = _read_hdr(data, where)
    else:
        raise SceneError("is no environment picture", where=where, rule="OpenEXR (.exr) and Radiance (.hdr) are read")
    _check(pixels, where)
    return Environment(pixels, name=path.name)


def _read_exr(path: Path, where: str) -> NDArray[np.float32]:
    import OpenEXR

    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {name: channel.pixels for name, channel in file.channels().items()}
    except (RuntimeError, ValueError, TypeError, OSError) as error:
        raise SceneError(f"cannot be decoded ({error})", where=where, fix="is it cut short?") from None
    names = next((names for names in (("R", "G", "B"), ("Y", "Y", "Y")) if set(names) <= channels.keys()), None)
    if names is None:
        raise SceneError(f"has the channels {', '.join(sorted(channels))}", where=where, rule="R, G and B are needed")
    return np.stack([np.asarray(channels[name], np.float32) for name in names], axis=-1)


def _read_hdr(data: bytes, where: str) -> NDArray[np.float32]:
    import imagecodecs

    try:
        return np.asarray(imagecodecs.rgbe_decode(data), np.float32)
    except (RuntimeError, ValueError) as error:
        raise SceneError(f"cannot be decoded ({error})", where=where, fix="is it cut short?") from None


def _check(pixels: NDArray[np.float32], where: str) -> None:
    height, width = pixels.shape[:2]
    if min(height, width) < 2 or not 1.8 < width / height < 2.2:
        raise SceneError(
            f"is {width}x{height} pixels",
            where=where,
            rule="an equirectangular picture is twice as wide as high",
            fix="convert cube maps and mirror balls first",
        )
    bad = ~np.isfinite(pixels).all(axis=-1) | (pixels < 0.0).any(axis=-1)
    if bad.any():
        row, column = (int(value) for value in np.argwhere(bad)[0])
        raise SceneError(
            f"pixel ({column}, {row}) is {pixels[row, column].tolist()}",
            where=where,
            rule="light is finite and not negative",
        )
