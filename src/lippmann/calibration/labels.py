"""Labels on test pictures: the same in all views, so that they are legible through the lenses and without them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.display.panel import PixelWindow

Mask = NDArray[np.bool_]

#: Smallest legible height of letters in pixels; smaller labels are not painted.
_SMALLEST = 7

#: Border around the letters over their height.
_BORDER = 0.25

#: Stroke added to the font over its size: a lens shows one column of pixels at a time, so thin strokes would vanish.
_STROKE = 0.025

#: Font size at which text is measured, in pixels.
_MEASURE = 100


def label_window(
    text: str, inside: PixelWindow, height: int, *, at: Literal["left", "bottom"] = "left"
) -> PixelWindow | None:
    """The box of a label at the middle of an edge of a window.

    Parameters
    ----------
    text:
        The label.
    inside:
        The window that holds the box.
    height:
        Height of the box in pixels, at most; reduced if the box would be wider than the window.
    at:
        ``left`` or ``bottom``: the edge of the window.

    Returns
    -------
    The box, or None if the letters would be too small to read.
    """
    _, (width_at, height_at) = _extent(text)
    border = _BORDER * height_at
    aspect = (width_at + 2 * border) / (height_at + 2 * border)
    height = min(height, inside.height, int(inside.width / aspect))
    if height / (1 + 2 * _BORDER) < _SMALLEST:
        return None
    width = min(inside.width, max(1, round(height * aspect)))
    if at == "left":
        return PixelWindow(inside.left, inside.top + (inside.height - height) // 2, width, height)
    return PixelWindow(inside.left + (inside.width - width) // 2, inside.top + inside.height - height, width, height)


def paint_label(
    pixels: NDArray[np.float32] | NDArray[np.uint8],
    window: PixelWindow,
    text: str,
    box: PixelWindow | None,
    *,
    ink: float = 1.0,
    paper: float = 0.0,
) -> None:
    """Paint a label into the pixels of a window, in place.

    Parameters
    ----------
    pixels:
        ``(height, width, ...)`` of ``window``, of any number type.
    window:
        The part of the picture that ``pixels`` holds.
    text:
        The label.
    box:
        The label's box in the picture, from :func:`label_window`; None paints nothing.
    ink, paper:
        Values of letters and background.
    """
    part = None if box is None else box.intersection(window)
    if part is None or box is None:
        return
    mask = _mask(text, box.width, box.height)
    mask = mask[part.relative_to(box).slices]
    target = pixels[part.relative_to(window).slices]
    target[...] = np.where(mask.reshape(*mask.shape, *(1,) * (pixels.ndim - 2)), ink, paper)


@lru_cache(maxsize=256)
def _mask(text: str, width: int, height: int) -> Mask:
    """``(height, width)``, True in the letters of a label, centred in a box of this size."""
    from PIL import Image, ImageDraw

    size = _MEASURE * height / ((1 + 2 * _BORDER) * _extent(text)[1][1])
    (left, top), (text_width, text_height) = _extent(text, size)
    picture = Image.new("L", (width, height))
    corner = (width - text_width) / 2 - left, (height - text_height) / 2 - top
    ImageDraw.Draw(picture).text(corner, text, fill=255, font=_font(size), stroke_width=_STROKE * size)
    mask: Mask = np.asarray(picture) >= 128
    return mask


def _extent(text: str, size: float = _MEASURE) -> tuple[tuple[float, float], tuple[float, float]]:
    """Left and top of the ink, and its width and height in pixels; the height is that of digits for every text."""
    left, _, right, _ = _font(size).getbbox(text)
    _, top, _, bottom = _font(size).getbbox("0123456789")
    return (left, top), (max(1.0, right - left), max(1.0, bottom - top))


@lru_cache(maxsize=64)
def _font(size: float) -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(size)
