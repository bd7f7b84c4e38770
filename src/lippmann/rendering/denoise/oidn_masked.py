"""Noise taken out where surfaces are seen: sky and background behind them have none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.denoise.oidn import NETWORK_STEP, Effort, denoise

FloatArray = NDArray[np.float32]

#: Pixels around the surfaces, so that the network sees what they stand before; whole steps of the network.
MARGIN = NETWORK_STEP
#: Pixels around the surfaces that are cleaned, too: guides of a few samples miss edges that barely reach into one.
EDGE = 2


@dataclass(frozen=True, eq=False)
class SurfacePart:
    """The rectangle of a picture that holds all surfaces, and a margin.

    Attributes
    ----------
    place:
        Its rows and columns.
    near:
        ``(h, w, 1)`` bool: pixels of it that show surfaces or are close to one.
    """

    place: tuple[slice, slice]
    near: NDArray[np.bool_]

    @staticmethod
    def of(normal: NDArray[np.generic]) -> SurfacePart | None:
        """By a guide ``(H, W, 3)``, which is 0 where there is no surface; None where there is none at all."""
        is_surface = (normal[..., 0] != 0) | (normal[..., 1] != 0) | (normal[..., 2] != 0)
        place = _rectangle(is_surface)
        return None if place is None else SurfacePart(place, _widened(is_surface[place])[..., None])


def denoise_seen(
    color: NDArray[np.generic],
    albedo: NDArray[np.generic],
    normal: NDArray[np.generic],
    surfaces: SurfacePart | None,
    *,
    exposure: float | None = None,
    effort: Effort = "high",
    turned: bool = False,
    threads: int | None = None,
) -> FloatArray:
    """The picture without its noise; arguments as those of :func:`~lippmann.rendering.denoise.oidn.denoise`.

    The network is shown the rectangle of the ``surfaces``, those of ``normal``. What is not near one is left as it is,
    so that nothing tells where that rectangle ends.
    """
    result = np.array(color, dtype=np.float32)
    if surfaces is not None:
        place = surfaces.place
        # The guides follow mirrors and glass without chance, so what noise they have lies along edges alone.
        cleaned = denoise(
            color[place],
            albedo[place],
            normal[place],
            clean_guides=True,
            exposure=exposure,
            effort=effort,
            turned=turned,
            threads=threads,
        )
        np.copyto(result[place], cleaned, where=surfaces.near)
    return result


def _widened(is_surface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """With the pixels up to ``EDGE`` beside and above each other."""
    for axis in (0, 1):
        lines = np.swapaxes(is_surface, 0, axis)
        wide = lines.copy()
        for step in range(1, EDGE + 1):
            wide[step:] |= lines[:-step]
            wide[:-step] |= lines[step:]
        is_surface = np.swapaxes(wide, 0, axis)
    return is_surface


def _rectangle(is_surface: NDArray[np.bool_]) -> tuple[slice, slice] | None:
    """Rows and columns with all surfaces, and a margin; None if there is none."""
    spans = []
    for axis in (1, 0):
        there = np.flatnonzero(np.any(is_surface, axis=axis))
        if not len(there):
            return None
        first = max(0, (int(there[0]) // MARGIN - 1) * MARGIN)
        spans.append(slice(first, min(is_surface.shape[1 - axis], int(there[-1]) + 1 + MARGIN)))
    return spans[0], spans[1]
