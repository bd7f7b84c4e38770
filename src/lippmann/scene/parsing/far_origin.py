"""Coordinates far from the origin, as surveys have them (UTM): single precision, that of scenes, rounds them.

At five million metres it tells half a metre.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: So many times its extent from the origin, a scene is moved there: 6e-6 of the extent is what single precision tells.
FAR = 100.0

#: Points that are looked at.
_SAMPLE = 1 << 16


def near_origin(positions: NDArray[np.float64], notes: list[str]) -> NDArray[np.float64]:
    """Positions ``(n, 3)``, moved to the origin where they lie far from it.

    The extent is that of nine in ten points, so that a few strays do not count. ``notes`` gets a line on the move.
    """
    sample = positions[:: len(positions) // _SAMPLE + 1]
    sample = sample[np.isfinite(sample).all(axis=1)]
    if not len(sample):
        return positions
    middle = np.median(sample, axis=0)
    extent = np.percentile(np.abs(sample - middle).max(axis=1), 90)
    if not 0 < FAR * extent < np.abs(middle).max():
        return positions
    offset = np.round(middle) if extent > 1 else middle
    x, y, z = -offset
    notes.append(f"moved by {x:.12g}, {y:.12g}, {z:.12g}: so far from the origin its shape would be rounded")
    return positions - offset
