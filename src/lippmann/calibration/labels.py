"""Words on test pictures: painted flat, in all views alike, so that they are read through the lenses and without."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display.pixel_window import PixelWindow

Mask = NDArray[np.bool_]

#: Letters smaller than this cannot be told apart, in pixels; no label is painted then.
_SMALLEST = 7

#: Border about the letters, as a part of their height.
_BORDER = 0.25

#: How much bolder than the font letters are, as a part of its size: a lens shows only one column of pixels at a time.
_STROKE = 0.025

#: Size at which text is measured.
_MEASURE = 100


def label_window(text: str, inside: PixelWindow, height: int, *, at: str = "left") -> PixelWindow | None:
    """The box of a label: ``height`` high at most, in the middle of the ``left`` or the ``bottom`` edge of a window.

    A label that would be wider than the window is made smaller; None if it could not be read.
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
    pixels: NDArray[Any],
    window: PixelWindow,
    text: str,
    box: PixelWindow | None,
    *,
    ink: float = 1.0,
    paper: float = 0.0,
) -> None:
    """Paint ``text`` into the part of ``pixels``, ``(h, w, ...)`` of ``window``, that lies in its box."""
    part = None if box is None else box.intersection(window)
    if part is None or box is None:
        return
    mask = _mask(text, box.width, box.height)
    mask = mask[part.relative_to(box).slices]
    target = pixels[part.relative_to(window).slices]
    target[...] = np.where(mask.reshape(*mask.shape, *(1,) * (pixels.ndim - 2)), ink, paper)


@lru_cache(maxsize=256)
def _mask(text: str, width: int, height: int) -> Mask:
    """Where a box of that size has ink: the text in its middle, as large as its border leaves room."""
    from PIL import Image, ImageDraw

    size = _MEASURE * height / ((1 + 2 * _BORDER) * _extent(text)[1][1])
    (left, top), (text_width, text_height) = _extent(text, size)
    picture = Image.new("L", (width, height))
    place = (width - text_width) / 2 - left, (height - text_height) / 2 - top
    ImageDraw.Draw(picture).text(place, text, fill=255, font=_font(size), stroke_width=_STROKE * size)
    mask: Mask = np.asarray(picture) >= 128
    return mask


def _extent(text: str, size: float = _MEASURE) -> tuple[tuple[float, float], tuple[float, float]]:
    """Left and top of the ink, and its width and height; that of a line with digits, whatever the letters are."""
    left, _, right, _ = _font(size).getbbox(text)
    _, top, _, bottom = _font(size).getbbox("0123456789")
    return (left, top), (max(1.0, right - left), max(1.0, bottom - top))


@lru_cache(maxsize=64)
def _font(size: float) -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(size)
