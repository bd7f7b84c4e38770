"""The bounding box of a scene in one frame after another, by the corners of its convex hull."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from lippmann.scene.extent import used_positions
from lippmann.scene.matrices import Bounds, transform_points
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Matrix, SceneDescription

#: Vertices, those of all copies together, whose hull takes seconds; beyond it the scene's extreme points stand for it.
_MOST_VERTICES = 2_000_000


def bounds_by_hull(scene: Scene) -> Callable[[Matrix], Bounds]:
    """A faster :meth:`lippmann.scene.scene.Scene.bounds_in`.

    The box of points is that of the corners of their convex hull. That of very many vertices is up to a hundredth of
    the scene's radius short; scenes without a list of vertices keep their own.
    """
    description = scene.description
    if not isinstance(description, SceneDescription):
        return scene.bounds_in
    placed = [(used_positions(description.meshes[mesh]), at) for mesh, at in description.fitted_placements.items()]
    if not placed or sum(len(points) * len(places) for points, places in placed) > _MOST_VERTICES:
        corners = scene.extreme_points
    else:
        hulls = [(_hull(points), places) for points, places in placed]
        corners = _hull(np.concatenate([transform_points(at, points) for points, places in hulls for at in places]))

    def bounds_in(frame: Matrix) -> Bounds:
        points = transform_points(frame, corners)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    return bounds_in


def _hull(points: Bounds) -> Bounds:
    """Those of points ``(n, 3)`` that are corners of their convex hull; all where they lie in one plane."""
    try:
        return np.asarray(points[ConvexHull(points).vertices], np.float64)
    except (QhullError, ValueError):  # in one plane, or none
        return points
