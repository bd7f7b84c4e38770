"""Polygons into triangles: fans of convex ones, ears of concave ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Points = NDArray[np.float64]
Flags = NDArray[np.bool_]


def triangulate(points: Points, corners: Integers, sizes: Integers) -> tuple[Integers, Integers]:
    """Cut simple polygons into triangles that keep their winding.

    Convex polygons become fans; the others are cut by ears (Meisters 1975) in the plane of their Newell normal.

    Parameters
    ----------
    points:
        ``(n, 3)`` positions.
    corners:
        ``(c,)`` indices into ``points``, polygon after polygon.
    sizes:
        ``(p,)`` numbers of corners, each 3 or more, that add up to ``c``.

    Returns
    -------
    triangles:
        ``(m, 3)`` places in ``corners``.
    owners:
        ``(m,)`` the polygon of each triangle, ascending.
    """
    starts = np.cumsum(sizes) - sizes
    pieces: list[Integers] = []
    owners: list[Integers] = []
    for size in np.unique(sizes):
        polygons = np.flatnonzero(sizes == size)
        places = starts[polygons, None] + np.arange(size)
        if size > 3:
            outline = points[corners[places]]
            normals = _newell_normals(outline)
            convex = _is_convex(outline, normals)
            concave = np.flatnonzero(~convex)
            if len(concave):
                flat = np.stack([_in_plane(outline[row], normals[row]) for row in concave])
                ears = places[concave[:, None, None], cut_ears(flat)]
                pieces.append(ears.reshape(-1, 3))
                owners.append(np.repeat(polygons[concave], size - 2))
            polygons, places = polygons[convex], places[convex]
        fan = np.stack([np.zeros(size - 2, int), np.arange(1, size - 1), np.arange(2, size)], axis=-1)
        pieces.append(places[:, fan].reshape(-1, 3))
        owners.append(np.repeat(polygons, size - 2))
    if not pieces:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(pieces)[order], owner[order]


def _newell_normals(outline: Points) -> Points:
    """Normals ``(p, 3)`` of outlines ``(p, k, 3)``; twice the area long."""
    relative = outline - outline[:, :1]
    normals: Points = np.cross(relative, np.roll(relative, -1, axis=1)).sum(axis=1)
    return normals


def _is_convex(outline: Points, normals: Points) -> Flags:
    before = outline - np.roll(outline, 1, axis=1)
    after = np.roll(outline, -1, axis=1) - outline
    turns = np.einsum("pki,pi->pk", np.cross(before, after), normals)
    tolerance = 1e-9 * np.einsum("pi,pi->p", normals, normals)
    convex: Flags = (turns >= -tolerance[:, None]).all(axis=1)
    return convex


def _in_plane(outline: Points, normal: Points) -> Points:
    """Coordinates ``(k, 2)`` in the coordinate plane nearest to the polygon's, counter-clockwise."""
    drop = int(np.argmax(np.abs(normal)))
    axes = [(1, 2), (2, 0), (0, 1)][drop]
    flat = outline[:, axes]
    if normal[drop] < 0.0:
        flat = flat * np.array([-1.0, 1.0])
    return np.asarray(flat, np.float64)


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
