"""Image maps: all pictures of a scene with their reduced copies in one table, looked up as Tachyon does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.scene.classic import ClassicImage

Texels = NDArray[np.uint8]


def pyramid(texels: Texels) -> list[Texels]:
    """A picture ``(1, h, w, 3)`` and its halved copies down to one texel; a volume alone.

    A texel of a copy is the mean of 2 x 2 texels, rounded down; odd last rows and columns count no more.
    """
    levels = [texels]
    while texels.shape[0] == 1 and max(texels.shape[1:3]) > 1:
        height, width = (max(size // 2, 1) for size in texels.shape[1:3])
        rows, columns = min(texels.shape[1], 2 * height), min(texels.shape[2], 2 * width)
        blocks = (
            texels[0, :rows, :columns].astype(np.uint16).reshape(height, rows // height, width, columns // width, 3)
        )
        texels = (blocks.sum(axis=(1, 3)) // ((rows // height) * (columns // width))).astype(np.uint8)[None]
        levels.append(texels)
    return levels


class ImageTable:
    """The pictures of a scene on the device."""

    def __init__(self, images: Sequence[ClassicImage]) -> None:
        parts: list[NDArray[np.uint32]] = []
        levels: list[tuple[int, int, int, int]] = []
        firsts, counts = [], []
        start = 0
        for image in images:
            copies = pyramid(image.texels)
            firsts.append(len(levels))
            counts.append(len(copies))
            for copy in copies:
                packed = copy.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32)
                parts.append(packed.ravel().astype(np.uint32))
                depth, height, width = copy.shape[:3]
                levels.append((start, width, height, depth))
                start += len(parts[-1])
        self._texels = mi.UInt32(np.concatenate(parts))
        self._levels = mi.UInt32(np.array(levels, np.uint32).ravel())
        self._first = mi.UInt32(np.array(firsts, np.uint32))
        self._count = mi.UInt32(np.array(counts, np.uint32))
        self._volumes = any(image.texels.shape[0] > 1 for image in images)

    def lookup(self, image: Any, u: Any, v: Any, w: Any, reduction: Any, active: Any) -> Any:
        """Colour of ``image`` (number) at u, v, w in [0, 1]; ``reduction`` 0 takes the picture, 1 its smallest copy."""
        first = dr.gather(mi.UInt32, self._first, image, active)
        count = dr.gather(mi.UInt32, self._count, image, active)
        level = dr.clip(reduction, 0, 1) * (mi.Float(count) - 0.9999)
        lower = mi.UInt32(level)
        blends = mi.Int32(lower) < mi.Int32(count) - 2
        lower = dr.select(blends, lower, count - 1)
        upper = dr.select(blends, lower + 1, lower)
        share = dr.select(blends, level - mi.Float(lower), 0)
        a = self._sample(first + lower, u, v, w, active)
        b = self._sample(first + upper, u, v, w, active)
        return a + (b - a) * share

    def _sample(self, level: Any, u: Any, v: Any, w: Any, active: Any) -> Any:
        """Between the nearest texels of one copy."""
        start, width, height, depth = (dr.gather(mi.UInt32, self._levels, 4 * level + k, active) for k in range(4))
        (x, fx), (y, fy), (z, fz) = (_place(c, size) for c, size in ((u, width), (v, height), (w, depth)))
        next_x = dr.minimum(x + 1, width - 1)
        next_y = dr.minimum(y + 1, height - 1)
        next_z = dr.minimum(z + 1, depth - 1)

        def texel(column: Any, row: Any, layer: Any) -> Any:
            packed = dr.gather(mi.UInt32, self._texels, start + (layer * height + row) * width + column, active)
            return mi.Color3f(packed & 255, (packed >> 8) & 255, packed >> 16)

        def layer_color(layer: Any) -> Any:
            lower = _between(texel(x, y, layer), texel(next_x, y, layer), fx)
            upper = _between(texel(x, next_y, layer), texel(next_x, next_y, layer), fx)
            return _between(lower, upper, fy)

        color = layer_color(z)
        if self._volumes:
            color = _between(color, layer_color(next_z), fz)
        return color * (1 / 255)


def _place(coordinate: Any, size: Any) -> tuple[Any, Any]:
    """Texel below a coordinate in [0, 1], and the way to the next one."""
    place = coordinate * (mi.Float(size) - 1)
    below = dr.minimum(mi.UInt32(place), size - 1)
    return below, place - mi.Float(below)


def _between(a: Any, b: Any, share: Any) -> Any:
    return a + (b - a) * share
