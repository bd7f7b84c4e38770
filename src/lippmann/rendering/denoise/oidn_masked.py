"""Noise taken out where surfaces are seen: before sky and background there is none."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from lippmann.rendering.denoise.oidn import NETWORK_STEP, Effort, denoise

FloatArray = NDArray[np.float32]

#: Pixels around the surfaces, so that the network sees what they stand before; whole steps of the network.
MARGIN = NETWORK_STEP
#: Pixels around the surfaces that are cleaned, too: guides of a few samples miss edges that barely reach into one.
EDGE = 2


def denoise_seen(
    color: NDArray[np.generic],
    albedo: NDArray[np.generic],
    normal: NDArray[np.generic],
    *,
    exposure: float | None = None,
    effort: Effort = "high",
    turned: bool = False,
    threads: int | None = None,
) -> FloatArray:
    """The picture without its noise; arguments as those of :func:`~lippmann.rendering.denoise.oidn.denoise`.

    The network is shown the rectangle that holds all surfaces, those pixels whose normal is not 0. What is not near one
    is left as it is, so that nothing tells where that rectangle ends.
    """
    result = np.array(color, dtype=np.float32)
    is_surface = np.any(normal, axis=2)
    part = _rectangle(is_surface)
    if part is not None:
        # The guides follow mirrors and glass without chance, so what noise they have lies along edges alone.
        cleaned = denoise(
            color[part],
            albedo[part],
            normal[part],
            clean_guides=True,
            exposure=exposure,
            effort=effort,
            turned=turned,
            threads=threads,
        )
        near = _widened(is_surface[part])
        result[part][near] = cleaned[near]
    return result


def _widened(is_surface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """With the pixels up to ``EDGE`` beside and above each other."""
    for axis in (0, 1):
        wide = np.pad(is_surface, [(EDGE, EDGE) if axis == each else (0, 0) for each in (0, 1)])
        is_surface = np.asarray(np.any(sliding_window_view(wide, 2 * EDGE + 1, axis=axis), axis=-1))
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
