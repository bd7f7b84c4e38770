"""Tone mapping and 8-bit sRGB coding of live pictures."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import quantize
from lippmann.display.visible_pixels import PixelSet
from lippmann.rendering.request.render_request import RenderRequest

Floats = NDArray[np.float32]
Codes = NDArray[np.uint8]


def develop(values: Floats, pixels: PixelSet, request: RenderRequest) -> Codes:
    """Codes ``(height, width, 3)`` of the picture of pixels whose linear radiance is ``values`` ``(n, 3)``."""
    if pixels.channels == 3 or pixels.is_mixed:
        return develop_picture(pixels.arrange(values), pixels, request)
    # Each pixel is coded once, and its three codes are copied as one 32-bit number; the last entry is black.
    codes = np.zeros((len(values) + 1, 4), np.uint8)
    codes[:-1, :3] = encode_light(values, request)
    picture = codes.view(np.uint32)[:, 0][pixels.number[..., 0]]
    return np.ascontiguousarray(picture[..., None].view(np.uint8)[..., :3])


def develop_picture(picture: Floats, pixels: PixelSet, request: RenderRequest) -> Codes:
    """Codes of a linear picture ``(height, width, 3)``, black where no pixel is visible."""
    codes = encode_light(picture, request)
    codes[pixels.number < 0 if pixels.channels == 3 else (pixels.number < 0)[..., 0]] = 0
    return codes


def encode_light(values: Floats, request: RenderRequest) -> Codes:
    """Codes of linear radiance ``(..., 3)``; same shape. Of the darkest values one in 100 is off by one code."""
    table = _code_table()
    place = np.clip(request.tone_mapped(values), 0, 1) * np.float32(len(table) - 1)
    return table[(place + np.float32(0.5)).astype(np.int32)]


@cache
def _code_table() -> Codes:
    """The sRGB codes of many evenly spaced values in [0, 1]."""
    return np.asarray(quantize(np.linspace(0, 1, 1 << 18, dtype=np.float32), 8, "srgb"), np.uint8)
