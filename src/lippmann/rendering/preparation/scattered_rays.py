"""Pixels spread evenly over a picture, as a picture of their own: for a first look at the whole."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.types import Point2f, Ray3f, UInt32
from lippmann.rendering.transport.ray_source import RaySource


class ScatteredRays:
    """At most ``side`` pixels along each side of the picture that ``source`` has rays for."""

    def __init__(self, source: RaySource, side: int) -> None:
        self._source = source
        self.channels = source.channels
        self.width, self.height = min(side, source.width), min(side, source.height)
        self._columns, self._rows = (
            mi.UInt32((2 * np.arange(count) + 1) * length // (2 * count))
            for count, length in ((self.width, source.width), (self.height, source.height))
        )

    def in_picture(self, column: UInt32, row: UInt32) -> tuple[UInt32, UInt32]:
        """Column and row of pixels in the whole picture."""
        return dr.gather(mi.UInt32, self._columns, column), dr.gather(mi.UInt32, self._rows, row)

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        return self._source.rays(*self.in_picture(column, row), channel, jitter)
