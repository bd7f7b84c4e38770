"""Concave outlines into triangles, many outlines at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


def cut_ears(outlines: Points) -> Integers:
    """Triangles ``(p, k - 2, 3)`` of ``p`` simple counter-clockwise outlines ``(p, k, 2)``, as indices into 0 to k - 1.

    Ears are cut one after another (Meisters 1975), the same step for all outlines at once. An outline that crosses
    itself has no right answer; where it has no ear left, its first remaining corner is cut, so that every outline
    still gives ``k - 2`` triangles. Time grows with p k^2.
    """
    count, corners = outlines.shape[:2]
    rows = np.arange(count)
    x, y = outlines[..., 0].copy(), outlines[..., 1].copy()
    index = np.tile(np.arange(corners), (count, 1))  # of the remaining corners, in order
    ears = np.stack([_are_ears(x, y, np.full(count, corner)) for corner in range(corners)], axis=1)

    triangles = np.empty((count, corners - 2, 3), np.int64)
    for step in range(corners - 2):
        left = corners - step
        tip = ears.argmax(axis=1)  # 0 where there is none
        triangles[:, step] = index[rows[:, None], (tip[:, None] + [-1, 0, 1]) % left]
        kept = np.ones((count, left), np.bool_)
        kept[rows, tip] = False
        shape = (count, left - 1)
        x, y = x[kept].reshape(shape), y[kept].reshape(shape)
        index, ears = index[kept].reshape(shape), ears[kept].reshape(shape)
        for corner in ((tip - 1) % (left - 1), tip % (left - 1)):  # the only ones whose triangle has changed
            ears[rows, corner] = _are_ears(x, y, corner)
    return triangles


def _are_ears(x: Points, y: Points, corner: Integers) -> Flags:
    """Whether this ``corner`` of each outline is convex and the triangle with its neighbours holds no other corner."""
    rows = np.arange(len(x))[:, None]
    around = (corner[:, None] + [-1, 0, 1]) % x.shape[1]
    ax, bx, cx = x[rows, around].T[..., None]  # each (p, 1)
    ay, by, cy = y[rows, around].T[..., None]
    result: Flags = ((bx - ax) * (cy - ay) > (by - ay) * (cx - ax))[:, 0]
    convex = np.flatnonzero(result)
    x, y = x[convex], y[convex]
    ends = [(px[convex], py[convex]) for px, py in ((ax, ay), (bx, by), (cx, cy))]
    inside = np.ones(x.shape, np.bool_)
    for (x0, y0), (x1, y1) in zip(ends, (*ends[1:], ends[0]), strict=True):
        inside &= (x1 - x0) * (y - y0) >= (y1 - y0) * (x - x0)
    for x0, y0 in ends:  # another corner at the same point does not count as inside
        inside &= (x != x0) | (y != y0)
    result[convex] = ~inside.any(axis=1)
    return result
