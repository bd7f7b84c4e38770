"""HEIF photographs (``.heic``) with the depth that telephones keep beside them."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lippmann.codecs.icc import convert_codes, profile_of_cicp
from lippmann.codecs.photograph import Photograph
from lippmann.codecs.picture_notes import pictures_note
from lippmann.codecs.types import Pixels
from lippmann.errors import PictureError, SceneError
from lippmann.runtime.machine import check_input
from lippmann.runtime.optional_import import check_installed
from lippmann.scene.readers.depth_map import DepthMap, without_stairs
from lippmann.scene.values.description import Image

#: Bytes of a pixel while it is decoded: what the decoder holds of it, and its values.
BYTES_PER_PIXEL = 12
#: Depth representations that are linear in inverse depth (H.265, G.14.3.3): of inverse depth, and of disparity. Of
#: others, values would have to be told from near to far.
_INVERSE = (0, 1)


def read_heif_photo(data: bytes, where: str) -> tuple[Image, DepthMap | None]:
    """The first picture of a HEIF file, and its depth map; None where it has none.

    Returns
    -------
    Image, DepthMap | None
        8 bits a channel, sRGB, upright. Maps are linear in inverse depth; scale and shift do
        not matter.

    Raises
    ------
    SceneError
        ``pillow-heif`` is not installed; the file is damaged; its depth is of a representation that is not read.
    MemoryLimitError
        It takes more memory than is left.
    """
    check_installed("pillow_heif", "heif", "HEIF pictures need it", where)
    try:
        file = open_pictures(io.BytesIO(data))
        depths = file.info.get("depth_images", [])
        for each in (file, *depths):
            width, height = each.size
            check_input(BYTES_PER_PIXEL * width * height, f"a picture of {width} x {height} pixels", where=where)
        pixels = np.array(file)
        values = np.asarray(depths[0], np.float32) if depths else None
    except (ValueError, RuntimeError, EOFError, OSError, SyntaxError, KeyError, IndexError) as error:
        raise SceneError(f"cannot be decoded ({error})", where=where, rule="a HEIF picture") from None
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or pixels.dtype != np.uint8:
        raise SceneError(
            f"holds an array {pixels.shape} of {pixels.dtype}", where=where, rule="8 bits a channel are read"
        )
    colors = pixels[..., :3] if pixels.shape[2] >= 3 else pixels[..., :1]
    try:
        image = Image(where, np.ascontiguousarray(convert_codes(colors, profile_of(file.info))))
    except PictureError as error:
        raise SceneError(error.what, where=where, rule=error.rule, fix=error.fix) from None
    if values is None:
        return image, None
    kind = (depths[0].info.get("metadata") or {}).get("representation_type", _INVERSE[1])
    if kind not in _INVERSE or values.ndim != 2:
        rule = "inverse depth and disparity are read"
        raise SceneError(f"has depth of representation {kind}", where=where, rule=rule, fix="name a map: depth_map=...")
    return image, DepthMap(without_stairs(values))


def open_heif_photograph(path: Path) -> Photograph:
    """The first picture of a HEIF file, upright, not yet decoded.

    Raises
    ------
    SceneError
        ``pillow-heif`` is not installed.
    MemoryLimitError
        It takes more memory than is left.
    ValueError, RuntimeError, EOFError, OSError
        It is damaged, now or once it is decoded, or has more than 8 bits a channel.
    """
    check_installed("pillow_heif", "heif", "HEIF pictures need it", str(path))
    file = open_pictures(path)
    width, height = file.size
    check_input(BYTES_PER_PIXEL * width * height, f"a picture of {width} x {height} pixels", where=str(path))

    def decode() -> Pixels:
        codes = np.array(file)
        if codes.dtype != np.uint8:
            raise ValueError(f"it holds {codes.dtype}: 8 bits a channel are read")
        return codes if codes.ndim == 3 else codes[..., None]

    return Photograph((width, height), profile_of(file.info), 1, pictures_note(len(file)), decode)


def open_pictures(source: Path | io.BytesIO) -> Any:
    """The pictures of a HEIF file, at least one, not yet decoded.

    Raises
    ------
    ValueError
        Libheif opens none; it and pillow-heif raise other errors too.
    """
    import pillow_heif

    file = pillow_heif.open_heif(source)
    if not len(file):
        raise ValueError("libheif opens none of its pictures, such as uncompressed ones")
    return file


def profile_of(info: Mapping[str, Any]) -> bytes:
    """ICC profile of a picture's colours, its own or one made from its code points (ITU-T H.273); empty: sRGB."""
    code_points = info.get("nclx_profile") or {}
    own = info.get("icc_profile") or b""
    if own or not code_points:
        return bytes(own)
    return profile_of_cicp(int(code_points["color_primaries"]), int(code_points["transfer_characteristics"]))
