"""The points of a scene that lie farthest out, which stand for its convex hull."""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.matrices import Bounds
from lippmann.scene.splat_clouds import typical_points
from lippmann.scene.values.description import Matrix, Mesh, SceneDescription
from lippmann.scene.volumes.grid import visible_corners

#: Directions in which the farthest points are looked for, on a Fibonacci lattice: the hull of those points is at most
#: 0.6 % of the scene's radius short of the scene's. Of large meshes fewer are, for time: 3 % short.
_DIRECTIONS = 256
_DIRECTIONS_OF_LARGE = 48
_LARGE = 1_000_000
#: Vertices that are looked at together.
_VERTICES_AT_A_TIME = 1 << 14
#: Of more points of copies than this a box stands for them.
_COPIED_POINTS = 5_000_000
#: Of more points of copies those copies are left out first that lie within the others.
_MANY = 100_000


def extreme_points_of(description: SceneDescription) -> Bounds:
    """Points ``(n, 3)`` in world units, between which all triangles lie up to a hundredth of the scene's radius.

    Of splats those between which all lie but floaters, of a volume the corners of what is seen.

    Empty for a description that places none of these.
    """
    outermost = []
    farthest: dict[tuple[int, int], Bounds] = {}  # of arrays that many meshes share
    for number, places in description.fitted_placements.items():
        mesh = description.meshes[number]
        key = id(mesh.positions), id(mesh.faces)
        if key not in farthest:
            farthest[key] = farthest_points(used_positions(mesh))
        points = farthest[key]
        if not len(points) or not len(places):
            continue
        if len(points) * len(places) > _MANY:
            places = places[_may_lie_outside(points, places)]
        if len(points) * len(places) > _COPIED_POINTS:
            points = np.array(list(itertools.product(*zip(points.min(axis=0), points.max(axis=0), strict=True))))
        outermost.append(farthest_points(_copies(points, places)))
    if description.splats is not None:
        outermost.append(typical_points(description.splats))
    if description.volume is not None:
        outermost.append(visible_corners(description.volume))
    return farthest_points(np.concatenate(outermost)) if outermost else np.zeros((0, 3))


def farthest_points(points: Bounds) -> Bounds:
    """Those of points ``(n, 3)`` that lie farthest in one of many directions."""
    directions = _directions(_DIRECTIONS if len(points) <= _LARGE else _DIRECTIONS_OF_LARGE)
    if len(points) <= len(directions):
        return points
    # About their middle, so that single precision tells those apart that lie far from the origin.
    centered = points - (points.min(axis=0) + points.max(axis=0)) / 2.0
    size = float(np.abs(centered).max()) or 1.0
    centered = (centered / size).astype(np.float32)
    best = np.full(len(directions), -np.inf, np.float32)
    index = np.zeros(len(directions), np.intp)
    for start in range(0, len(points), _VERTICES_AT_A_TIME):
        reach = directions @ centered[start : start + _VERTICES_AT_A_TIME].T  # along rows, where argmax is fast
        first = reach.argmax(axis=1)
        farthest = reach[np.arange(len(directions)), first]
        index = np.where(farthest > best, start + first, index)
        best = np.maximum(farthest, best)
    return points[np.flatnonzero(np.bincount(index))]


def _may_lie_outside(points: Bounds, places: Matrix) -> NDArray[np.bool_]:
    """Which of the copies of points ``(n, 3)`` at ``(k, 4, 4)`` may hold a point that lies farthest in a direction.

    All points of a copy lie within its radius of its origin. So nothing of it lies farthest where another's origin lies
    farther by both radii.
    """
    centers = places[:, :3, 3] - (places[:, :3, 3].min(axis=0) + places[:, :3, 3].max(axis=0)) / 2.0
    radius = np.linalg.norm(places[:, :3, :3], axis=(1, 2)) * np.linalg.norm(points, axis=1).max()
    directions = _directions(_DIRECTIONS)
    least = np.full(len(directions), -np.inf, np.float32)
    parts = [slice(start, start + _VERTICES_AT_A_TIME) for start in range(0, len(places), _VERTICES_AT_A_TIME)]
    for part in parts:
        reach = centers[part].astype(np.float32) @ directions.T - radius[part, None].astype(np.float32)
        least = np.maximum(least, reach.max(axis=0))
    slack = np.float32(1e-5) * np.float32(np.abs(centers).max() + radius.max())
    may_be_outer = [
        (centers[part].astype(np.float32) @ directions.T + radius[part, None].astype(np.float32) >= least - slack).any(
            axis=1
        )
        for part in parts
    ]
    return np.concatenate(may_be_outer)


def used_positions(mesh: Mesh) -> Bounds:
    """Positions ``(n, 3)`` of the vertices that some triangle uses."""
    used = np.zeros(len(mesh.positions), bool)
    used[mesh.faces.ravel()] = True
    return np.asarray(mesh.positions[used], np.float64)


def _copies(points: Bounds, places: Matrix) -> Bounds:
    """Points ``(n, 3)`` at all of ``(k, 4, 4)`` places."""
    linear, offset = places[:, :3, :3], places[:, None, :3, 3]
    return np.asarray((points @ linear.transpose(0, 2, 1) + offset).reshape(-1, 3), np.float64)


@lru_cache(maxsize=2)
def _directions(count: int) -> Bounds:
    """Unit vectors ``(6 + count, 3)``, float32: both ways along each axis, and evenly over the sphere."""
    number = np.arange(count)
    z = 1.0 - (2.0 * number + 1.0) / count
    azimuth = number * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - z * z)
    even = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1)
    return np.concatenate([np.eye(3), -np.eye(3), even]).astype(np.float32)
