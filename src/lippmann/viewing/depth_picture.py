"""Depth as a picture for eyes: heights over the lens plane as shades of grey, with a legend in millimetres.

A display's native pixels hold nothing but the picture, so the legend stands on one of its own: what the central eye
sees, beside a bar from the farthest height to the nearest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.image import IntegralImage
from lippmann.image.height_shades import height_legend, height_shades


def shades_of_depth(image: IntegralImage) -> tuple[IntegralImage, tuple[float, float]]:
    """A picture of depth (mm, 0 where nothing is seen) as shades, and the heights of the darkest and of white.

    Shades are display codes, from 0.15 for the farthest surface to 1 for the nearest; 0 where nothing is seen.
    """
    visible = image.pixels != 0.0
    if not visible.any():
        return image, (0.0, 0.0)
    shades, (low, high) = height_shades(image.pixels, visible)
    options = {**image.provenance.options, "depth_shades": [low, high]}
    provenance = replace(image.provenance, transfer="linear", options=options)
    return image.with_pixels(shades, provenance=provenance), (low, high)


def legend(shades: IntegralImage, heights: tuple[float, float]) -> NDArray[np.float32]:
    """The central eye's view of :func:`shades_of_depth`, ``(height, width, 3)``, beside a bar with heights in mm."""
    picture = shades.replay()
    return np.ascontiguousarray(np.concatenate([picture, height_legend(len(picture), heights)], axis=1))
