"""Depth as a picture for eyes: heights over the lens plane as shades of grey, with a legend in millimetres.

A display's native pixels hold nothing but the picture, so the legend stands on one of its own: what the central eye
sees, beside a bar from the farthest height to the nearest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.image import IntegralImage

#: Shade of the farthest surface; black is where there is none.
_DARKEST = 0.15
#: Width of the legend's column and of its bar, in pixels, and its labels.
_COLUMN, _BAR, _LABELS = 96, 24, 6


def shades_of_depth(image: IntegralImage) -> tuple[IntegralImage, tuple[float, float]]:
    """A picture of depth (mm, 0 where nothing is seen) as shades, and the heights of the darkest and of white.

    Shades are display codes, from 0.15 for the farthest surface to 1 for the nearest; 0 where nothing is seen.
    """
    depth = image.pixels
    seen = depth != 0.0
    if not seen.any():
        return image, (0.0, 0.0)
    low, high = float(depth[seen].min()), float(depth[seen].max())
    share = (depth - low) / (high - low) if high > low else np.ones_like(depth)
    shades = np.where(seen, _DARKEST + (1.0 - _DARKEST) * share, 0.0).astype(np.float32)
    options = {**image.provenance.options, "depth_shades": [low, high]}
    provenance = replace(image.provenance, transfer="linear", options=options)
    return image.with_pixels(shades, provenance=provenance), (low, high)


def legend(shades: IntegralImage, heights: tuple[float, float]) -> NDArray[np.float32]:
    """What the central eye sees of :func:`shades_of_depth`, ``(height, width, 3)``, beside a bar with heights in mm."""
    from PIL import Image, ImageDraw

    seen = shades.replay()
    height = len(seen)
    bar = Image.new("L", (_COLUMN, height), 0)
    margin = min(12, height // 8)
    ramp = np.linspace(1.0, _DARKEST, max(1, height - 2 * margin))
    bar.paste(Image.fromarray(np.uint8(255 * ramp[:, None] + np.zeros(_BAR))), (8, margin))
    draw = ImageDraw.Draw(bar)
    low, high = heights
    for share in np.linspace(0.0, 1.0, _LABELS):
        y = margin + (1.0 - share) * (len(ramp) - 1)
        draw.text((_BAR + 14, y - 6), f"{low + share * (high - low):.1f} mm", fill=255)
    column = np.repeat(np.asarray(bar, np.float32)[..., None] / 255.0, 3, axis=2)
    return np.ascontiguousarray(np.concatenate([seen, column], axis=1))
