"""Polygons into triangles: fans of convex ones, ears of concave ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Points = NDArray[np.float64]
Flags = NDArray[np.bool_]


def triangulate(points: Points, corners: Integers, sizes: Integers) -> tuple[Integers, Integers]:
    """Cut simple polygons into triangles that keep their winding.

    Convex polygons become fans; the others are cut into ears by ``mapbox_earcut`` in the plane of their Newell normal.
    The result for a polygon that crosses itself is undefined; one without area may become nothing.

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
                cut = [_cut_ears(_in_plane(outline[row], normals[row])) for row in concave]
                pieces += [places[row][triangles] for row, triangles in zip(concave, cut, strict=True)]
                owners.append(np.repeat(polygons[concave], [len(triangles) for triangles in cut]))
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


def _cut_ears(outline: Points) -> Integers:
    """Triangles ``(m, 3)`` of a counter-clockwise outline ``(k, 2)``, counter-clockwise, as indices into 0 to k - 1."""
    import mapbox_earcut

    triangles = mapbox_earcut.triangulate_float64(np.ascontiguousarray(outline), np.array([len(outline)], np.uint32))
    return np.asarray(triangles, np.int64).reshape(-1, 3)
