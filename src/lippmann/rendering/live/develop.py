"""From light to the codes that a page shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import quantize
from lippmann.rendering.live.seen_pixels import PixelSet
from lippmann.rendering.request.render_request import RenderRequest

Floats = NDArray[np.float32]


def develop(values: Floats, pixels: PixelSet, request: RenderRequest) -> NDArray[np.uint8]:
    """Codes ``(height, width, 3)`` of the picture of pixels whose linear radiance is ``values`` ``(n, 3)``."""
    if pixels.channels == 3:
        return develop_picture(arrange(values, pixels), pixels, request)
    codes = quantize(request.shown(values), 8, "srgb")
    with_black = np.concatenate([codes, np.zeros((1, 3), np.uint8)])
    return np.take(with_black, pixels.number[..., 0], axis=0, mode="wrap")


def develop_picture(picture: Floats, pixels: PixelSet, request: RenderRequest) -> NDArray[np.uint8]:
    """Codes of a linear picture ``(height, width, 3)``, black where no pixel is seen."""
    codes = np.asarray(quantize(request.shown(picture), 8, "srgb"), np.uint8)
    codes[pixels.number < 0 if pixels.channels == 3 else (pixels.number < 0)[..., 0]] = 0
    return codes


def arrange(values: Floats, pixels: PixelSet) -> Floats:
    """The picture ``(height, width, 3)`` of the values ``(n, 3)`` of pixels; 0 where none is seen."""
    with_black = np.concatenate([values, np.zeros((1, 3), np.float32)])
    return np.ascontiguousarray(with_black[pixels.number, np.arange(3)])
