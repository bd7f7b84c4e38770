"""Frames for Hololuminescent displays: a portrait picture on black, within the safe area, turned for the player.

The maker's "Media specs and encoding" (docs/reference/films.md) has these numbers.
"""

from __future__ import annotations

import numpy as np

from lippmann.codecs.types import Pixels

#: Width and height of the display in pixels; the file is turned to the left, so that it is as wide as this is high.
WIDTH, HEIGHT = 2160, 3840
#: Margins that stay black, in pixels: above, below, and on either side.
TOP, BOTTOM, SIDE = 355, 100, 108
#: Frames per second that the player takes.
RATES = (30.0, 60.0)


def for_hololuminescent(codes: Pixels) -> Pixels:
    """A frame ``(2160, 3840, 3)`` of a picture ``(h, w, 3)`` that fills the safe area and stands on its lower edge.

    The picture is matted with the background that it was rendered on: the display knows no alpha.
    """
    from PIL import Image

    room = WIDTH - 2 * SIDE, HEIGHT - TOP - BOTTOM
    height, width = codes.shape[:2]
    scale = min(room[0] / width, room[1] / height)
    size = round(width * scale), round(height * scale)
    picture = np.asarray(Image.fromarray(codes).resize(size, Image.Resampling.LANCZOS))
    frame = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    left, top = (WIDTH - size[0]) // 2, HEIGHT - BOTTOM - size[1]
    frame[top : top + size[1], left : left + size[0]] = picture
    return np.ascontiguousarray(np.rot90(frame))
