"""Long plain renderings of single pixels, which pictures are judged by."""

from __future__ import annotations

from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.rendering.film.wavefront import trace_frame
from lippmann.rendering.transport.ray_source import DisplayRays

try:
    from lippmann.rendering.film.memory_model import cut_wavefronts
except ImportError:  # of the earlier checkouts that defaults.py judges
    from lippmann.rendering.film.wavefront_plan import make_plan as cut_wavefronts


class PixelRays:
    """Rays of single pixels of a display, as a picture one pixel high."""

    def __init__(self, source: DisplayRays, columns: np.ndarray, rows: np.ndarray) -> None:
        self.width, self.height, self.channels = len(columns), 1, source.channels
        self._source = source
        self._columns, self._rows = mi.UInt32(columns.astype(np.uint32)), mi.UInt32(rows.astype(np.uint32))

    def tiles(self) -> Iterator[tuple[slice, slice]]:
        yield slice(0, 1), slice(0, self.width)

    def rays(self, column, row, channel, jitter):
        del row
        place = mi.UInt32(column)
        at = (dr.gather(mi.UInt32, table, place) for table in (self._columns, self._rows))
        return self._source.rays(*at, channel, jitter)

    def number(self, column, row):
        del row
        return mi.UInt32(column)


def trace_pixels(session, source, integrator, columns, rows, spp, seed=991):
    """Linear radiance of pixels, ``(N, 3)``."""
    rays = PixelRays(source, columns, rows)
    plan = cut_wavefronts(rays.width, 1, spp, channels=rays.channels, memory=session.memory)
    return trace_frame(integrator, rays, plan, seed=seed, box_filter=True).pixels[0]
