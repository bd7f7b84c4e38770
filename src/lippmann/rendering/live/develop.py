"""From light to the codes that a page shows."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.live.develop_kernels import code_tables, encode_rows, gather_rows, spread_rows
from lippmann.rendering.live.seen_pixels import PixelSet
from lippmann.rendering.request.render_request import RenderRequest

Floats = NDArray[np.float32]
Codes = NDArray[np.uint8]

_tables = cache(code_tables)


def develop(values: Floats, pixels: PixelSet, request: RenderRequest) -> Codes:
    """Codes ``(height, width, 3)`` of the picture of pixels whose linear radiance is ``values`` ``(n, 3)``."""
    if pixels.channels == 3:
        return develop_picture(arrange(values, pixels), pixels, request)
    codes = codes_of(values, request)
    number = pixels.number.reshape(-1)
    picture = np.empty((number.size, 3), np.uint8)
    spread_rows(0, number.size, codes, number, picture)
    return picture.reshape(*pixels.number.shape[:2], 3)


def develop_picture(picture: Floats, pixels: PixelSet, request: RenderRequest) -> Codes:
    """Codes of a linear picture ``(height, width, 3)``, black where no pixel is seen."""
    codes = codes_of(picture.reshape(-1, 3), request).reshape(picture.shape)
    codes[pixels.number < 0 if pixels.channels == 3 else (pixels.number < 0)[..., 0]] = 0
    return codes


def arrange(values: Floats, pixels: PixelSet) -> Floats:
    """The picture ``(height, width, 3)`` of the values ``(n, 3)`` of pixels; 0 where none is seen."""
    number = pixels.number
    if pixels.channels == 1:
        with_black = np.concatenate([values, np.zeros((1, 3), np.float32)])
        return np.ascontiguousarray(with_black[number[..., 0]])
    flat = number.reshape(-1, 3)
    picture = np.empty(flat.shape, np.float32)
    gather_rows(0, len(flat), np.ascontiguousarray(values), flat, picture)
    return picture.reshape(number.shape)


def codes_of(values: Floats, request: RenderRequest) -> Codes:
    """Codes ``(n, 3)`` of linear radiance ``(n, 3)``."""
    codes = np.empty(values.shape, np.uint8)
    encode_rows(
        0, len(values), np.ascontiguousarray(values, np.float32), request.tone_map == "pbr-neutral", *_tables(), codes
    )
    return codes
