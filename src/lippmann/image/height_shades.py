"""Heights as a picture for eyes: shades of grey, and a bar that says in millimetres what they mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Shade of the farthest surface; black is where there is none.
DARKEST = 0.15
#: Width of the legend's column and of its bar, in pixels, and its labels.
_COLUMN, _BAR, _LABELS = 96, 24, 6


def height_shades(
    heights: NDArray[np.floating], visible: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], tuple[float, float]]:
    """Display codes of heights, and the heights of the darkest shade and of white.

    Parameters
    ----------
    heights:
        In mm over the lens plane, of any shape.
    visible:
        Where a surface is seen, of the same shape; heights are finite there.

    Returns
    -------
    tuple
        Codes from 0.15 for the farthest surface to 1 for the nearest, 0 where nothing is seen; and the lowest and the
        highest height in mm, 0 and 0 where nothing is seen at all.
    """
    shades = np.zeros(heights.shape, np.float32)
    if not visible.any():
        return shades, (0.0, 0.0)
    visible_heights = heights[visible]
    low, high = float(visible_heights.min()), float(visible_heights.max())
    share = (visible_heights - low) / (high - low) if high > low else np.ones_like(visible_heights)
    shades[visible] = DARKEST + (1.0 - DARKEST) * share
    return shades, (low, high)


def height_legend(rows: int, heights: tuple[float, float]) -> NDArray[np.float32]:
    """A column ``rows`` high, ``(rows, columns, 3)``: a bar of the shades from white down, labelled in mm."""
    from PIL import Image, ImageDraw

    bar = Image.new("L", (_COLUMN, rows), 0)
    margin = min(12, rows // 8)
    ramp = np.linspace(1.0, DARKEST, max(1, rows - 2 * margin))
    bar.paste(Image.fromarray(np.uint8(255 * ramp[:, None] + np.zeros(_BAR))), (8, margin))
    draw = ImageDraw.Draw(bar)
    low, high = heights
    for share in np.linspace(0.0, 1.0, _LABELS):
        y = margin + (1.0 - share) * (len(ramp) - 1)
        draw.text((_BAR + 14, y - 6), f"{low + share * (high - low):.1f} mm", fill=255)
    return np.repeat(np.asarray(bar, np.float32)[..., None] / 255.0, 3, axis=2)
