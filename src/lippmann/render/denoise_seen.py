"""Noise taken out where surfaces are seen: before sky and background there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.render.denoise import Effort, denoise

FloatArray = NDArray[np.float32]

#: Pixels around the surfaces, so that the network sees what they stand before, and those edges that guides missed; also
#: the pixels that it sees together, see :data:`lippmann.render.surroundings.NETWORK_STEP`.
MARGIN = 16


def denoise_seen(
    color: NDArray[Any],
    albedo: NDArray[Any],
    normal: NDArray[Any],
    *,
    exposure: float | None = None,
    effort: Effort = "high",
    threads: int | None = None,
) -> FloatArray:
    """The picture without its noise; arguments as those of :func:`~lippmann.render.denoise.denoise`.

    The network is shown the rectangle that holds all surfaces, those pixels whose normal is not 0. What lies outside is
    left as it is.
    """
    result = np.array(color, dtype=np.float32)
    part = _seen(normal)
    if part is not None:
        # The guides follow mirrors and glass without chance, so what noise they have lies along edges alone.
        result[part] = denoise(
            color[part],
            albedo[part],
            normal[part],
            clean_guides=True,
            exposure=exposure,
            effort=effort,
            threads=threads,
        )
    return result


def _seen(normal: NDArray[Any]) -> tuple[slice, slice] | None:
    """Rows and columns with all surfaces, and a margin; None if there is none."""
    is_surface = np.any(normal, axis=2)
    spans = []
    for axis in (1, 0):
        there = np.flatnonzero(np.any(is_surface, axis=axis))
        if not len(there):
            return None
        first = max(0, (int(there[0]) // MARGIN - 1) * MARGIN)
        spans.append(slice(first, min(is_surface.shape[1 - axis], int(there[-1]) + 1 + MARGIN)))
    return spans[0], spans[1]
