"""The bounding box of a scene in one frame after another, by the corners of its convex hull."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from lippmann.scene.extreme_points import used_positions
from lippmann.scene.matrices import Bounds, transform_points
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Matrix, SceneDescription

#: Vertices, those of all copies together, beyond which the hull takes longer than it saves.
_MOST_VERTICES = 2_000_000
#: Vertices below which a hull saves nothing.
_FEW = 64
#: Vertices of copies above which those copies are left out first that lie within the others.
_MANY = 100_000
#: Distances of copies from sides of a hull that are looked at together.
_DISTANCES_AT_A_TIME = 1 << 24


def bounds_by_hull(scene: Scene) -> Callable[[Matrix], Bounds]:
    """A faster :meth:`lippmann.scene.scene.Scene.bounds_in`, equal but for rounding.

    The box of points is that of the corners of their convex hull. Scenes without a list of vertices, and very large
    ones, keep their own.
    """
    description = scene.description
    if not isinstance(description, SceneDescription):
        return scene.bounds_in
    placed = [
        (used_positions(description.meshes[mesh]), places) for mesh, places in description.fitted_placements.items()
    ]
    placed = [
        (points, places[_may_lie_outside(points, places)] if len(points) * len(places) > _MANY else places)
        for points, places in placed
    ]
    if sum(len(points) * len(places) for points, places in placed) > _MOST_VERTICES:
        return scene.bounds_in
    corners = [_hull(points) for points, _ in placed]
    copies = [
        transform_points(place, points)
        for points, (_, places) in zip(corners, placed, strict=True)
        for place in places
        if len(points)
    ]
    hull = _hull(np.concatenate(copies))

    def bounds_in(frame: Matrix) -> Bounds:
        points = transform_points(frame, hull)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    return bounds_in


def _may_lie_outside(points: Bounds, places: Matrix) -> NDArray[np.bool_]:
    """Which of the copies of points ``(n, 3)`` at ``(k, 4, 4)`` may hold a corner of the hull of all.

    All points of a copy lie within its radius of its origin. Where the origin lies below all sides of the hull of the
    origins by more than twice the largest radius, some other copy lies farther out in every direction.
    """
    origins = places[:, :3, 3]
    radius = float(np.linalg.norm(places[:, :3, :3], axis=(1, 2)).max() * np.linalg.norm(points, axis=1).max())
    try:
        sides = ConvexHull(origins).equations  # normals outward, and distances
    except QhullError:
        return np.ones(len(places), bool)
    step = max(1, _DISTANCES_AT_A_TIME // len(sides))
    return np.concatenate(
        [
            (origins[start : start + step] @ sides[:, :3].T + sides[:, 3] >= -2.001 * radius).any(axis=1)
            for start in range(0, len(origins), step)
        ]
    )


def _hull(points: Bounds) -> Bounds:
    """Those of points ``(n, 3)`` that are corners of their convex hull; all where they lie in one plane."""
    if len(points) <= _FEW:
        return points
    try:
        return np.asarray(points[ConvexHull(points).vertices], np.float64)
    except QhullError:
        return points
