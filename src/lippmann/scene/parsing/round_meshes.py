"""Triangles of spheres and of prisms, which readers of points, lines, molecules and classic primitives share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


def subdivide_sphere(points: Numbers, triangles: Indices, times: int) -> tuple[Numbers, Indices]:
    """Unit vectors ``(n, 3)`` and ``triangles (m, 3)`` of a sphere, each triangle cut into four ``times`` times."""
    for _ in range(times):
        ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, place = np.unique(ends, axis=0, return_inverse=True)
        middles = points[edges].sum(axis=1)
        ab, bc, ca = (len(points) + place.reshape(-1, 3)).T
        a, b, c = triangles.T
        points = np.concatenate([points, middles / np.linalg.norm(middles, axis=1, keepdims=True)])
        parts = (a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return points, triangles


def join_rings(sides: int) -> Indices:
    """``(2 sides, 3)``: triangles between two rings of ``sides`` points each, the first ring's points first."""
    here = np.arange(sides)
    ahead = (here + 1) % sides
    lower, upper = (here, ahead, ahead + sides), (here, ahead + sides, here + sides)
    return np.concatenate([np.stack(part, axis=1) for part in (lower, upper)])


def repeat_triangles(triangles: Indices, count: int, step: int) -> Indices:
    """``(count m, 3)``: the ``triangles (m, 3)`` of ``count`` copies of a mesh of ``step`` vertices each."""
    return np.asarray((triangles + step * np.arange(count)[:, None, None]).reshape(-1, 3), np.int64)
