"""Environment maps: OpenEXR (``.exr``) and Radiance (``.hdr``)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs import radiance
from lippmann.codecs.exr import SIGNATURE, read_exr, read_exr_header
from lippmann.errors import PictureError, SceneError
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.values.description import Environment

#: Endings of pictures of linear light, whose values are not bounded.
LINEAR_SUFFIXES = (".exr", ".hdr")
_LARGEST_HALF = 65504.0

#: Channels of red, green and blue: luminance or red alone is grey.
_COLORS = (("R", "G", "B"), ("Y", "Y", "Y"), ("R", "R", "R"))


def read_environment(path: Path) -> Environment:
    """Read an equirectangular picture, row 0 straight up; a single pixel is light alike from everywhere.

    Raises
    ------
    SceneError
        The file is missing, damaged or neither EXR nor HDR; it has no three colours; it is not about twice as wide as
        high.
    """
    pixels, notes = read_linear(path, check_size=lambda height, width: _check_size(height, width, path.name))
    light = possible_light(pixels)
    if changed := int((light != pixels).any(axis=-1).sum()):
        what = "negative light or none that is a finite number, which counts as 0, infinite light as 65504"
        notes = (*notes, f"{path.name}: {changed} pixels hold {what}")
    return Environment(panorama(light), name=path.name, notes=notes)


def panorama(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Pixels ``(h, w, 3)`` of the surroundings: a single one repeated, as Blender writes a world of one colour."""
    return np.tile(pixels, (2, 4, 1)) if pixels.shape[:2] == (1, 1) else pixels


def possible_light(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Radiance ``(h, w, 3)`` without negative values, which lossy coding and sharpening leave behind, and NaN.

    Infinite values, suns that overflowed a half float, become the largest such number.
    """
    return np.clip(np.nan_to_num(pixels, posinf=_LARGEST_HALF), 0.0, None)


def read_linear(
    path: Path, *, check_size: Callable[[int, int], None] = lambda height, width: None
) -> tuple[NDArray[np.float32], tuple[str, ...]]:
    """Linear pixels ``(h, w, 3)`` of an OpenEXR or Radiance picture in the primaries of Rec. 709, and notes.

    Parameters
    ----------
    check_size:
        Is given height and width before the pixels are decoded, and may raise.

    Raises
    ------
    SceneError
        The file is missing, damaged or neither EXR nor HDR, or has no three colours.
    """
    if path.is_dir():
        raise SceneError("is a folder, no picture", where=str(path), rule="OpenEXR (.exr) and Radiance (.hdr) are read")
    data, where = read_bytes(path), path.name
    if data.startswith(SIGNATURE):
        return _read_exr(path, where, check_size)
    if data.startswith(radiance.MAGICS):
        return _read_hdr(data, where, check_size), ()
    raise SceneError("is no picture in linear light", where=where, rule="OpenEXR (.exr) and Radiance (.hdr) are read")


def _read_exr(
    path: Path, where: str, check_size: Callable[[int, int], None]
) -> tuple[NDArray[np.float32], tuple[str, ...]]:
    try:
        header = read_exr_header(path)
        names = next((names for names in _COLORS if set(names) <= header.channels.keys()), None)
        if names is None:
            held = ", ".join(sorted(header.channels))
            raise SceneError(f"has the channels {held}", where=where, rule="R, G and B are needed")
        check_size(header.height, header.width)
        channels = read_exr(path, header)
        pixels = np.stack([np.asarray(channels[name], np.float32) for name in names], axis=-1)
        notes = tuple(f"{where}: {note}" for note in header.notes)
        return pixels if len(set(names)) == 1 else header.rec709(pixels), notes
    except PictureError as error:
        fix = error.fix or "is it cut short?"
        raise SceneError(f"cannot be decoded ({error.what})", where=where, rule=error.rule, fix=fix) from None


def _read_hdr(data: bytes, where: str, check_size: Callable[[int, int], None]) -> NDArray[np.float32]:
    try:
        header = radiance.read_header(data, where)
        check_size(header.height, header.width)
        return radiance.read_radiance(data, header, where)
    except PictureError as error:
        raise SceneError(error.what, where=where, fix=error.fix) from None


def _check_size(height: int, width: int, where: str) -> None:
    if (height, width) != (1, 1) and (min(height, width) < 2 or not 1.8 < width / height < 2.2):
        raise SceneError(
            f"is {width}x{height} pixels",
            where=where,
            rule="an equirectangular picture is twice as wide as high",
            fix="convert cube maps and mirror balls first",
        )
