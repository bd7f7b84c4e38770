"""The extent of a scene: the box around it, and the points that lie farthest out, which stand for its convex hull."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
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
#: Exact bounds look at each vertex of each instance; beyond this many the corners of the mesh's own box stand in,
#: which can only be too large.
_EXACT_VERTICES = 20_000_000
#: Points of copies that are transformed at a time.
_POINTS_AT_A_TIME = 1 << 20
#: A scene is flat along an axis where it is thinner than this share of its other sides.
_FLAT = 0.05
#: A side below this share of another is no side: rounding gives one to a line, which has no face.
_LINE = 0.01
#: A box smaller than this share of its largest coordinate is a single point: a rotation's rounding, a few units in the
#: last place of double precision, leaves nothing of its extent.
_POINT = 2.0**-44


def bounds_of(description: SceneDescription, frame: Matrix | None = None) -> Bounds:
    """The box ``(2, 3)`` around all triangles of fitted meshes, most splats, and what is seen of a volume.

    Its sides run along the axes of the world, or of the frame that the 4x4 matrix ``frame`` (from world) leads to.

    Raises
    ------
    SceneError
        The description places no triangle.
    """
    used = {mesh: used_positions(description.meshes[mesh]) for mesh in description.fitted_placements}
    exact = (
        sum(len(used[mesh]) * len(places) for mesh, places in description.fitted_placements.items()) <= _EXACT_VERTICES
    )
    boxes = []
    for mesh, places in description.fitted_placements.items():
        points = used[mesh]
        if len(points) and len(places):
            points = points if exact else box_corners(np.stack([points.min(axis=0), points.max(axis=0)]))
            boxes.append(_box_of_copies(points, places, frame))
    if description.splats is not None:
        boxes.append(_box_of_copies(typical_points(description.splats), np.eye(4)[None], frame))
    if description.volume is not None:
        boxes.append(_box_of_copies(visible_corners(description.volume), np.eye(4)[None], frame))
    if not boxes:
        raise SceneError("the scene holds no triangles", where=description.name, rule="there must be something to see")
    return np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])


def _box_of_copies(points: Bounds, world_from_points: Matrix, frame: Matrix | None) -> Bounds:
    """The box ``(2, 3)`` of points ``(n, 3)`` at all of ``(k, 4, 4)`` places."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    step = max(1, _POINTS_AT_A_TIME // len(points))
    for start in range(0, len(world_from_points), step):
        matrices = world_from_points[start : start + step]
        matrices = matrices if frame is None else frame @ matrices
        copies = points @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]
        low, high = np.minimum(low, copies.min(axis=(0, 1))), np.maximum(high, copies.max(axis=(0, 1)))
    return np.stack([low, high])


def box(bounds: Bounds) -> tuple[Bounds, Bounds]:
    """Centre and size ``(3,)`` of a box ``(2, 3)``.

    Raises
    ------
    SceneError
        The box is empty, not finite, or a single point up to rounding.
    """
    low, high = np.asarray(bounds, np.float64)
    if not (np.isfinite(low).all() and np.isfinite(high).all()) or (high < low).any():
        raise SceneError("the scene has no extent that could be measured", rule="it needs some finite geometry")
    if not (high - low > _POINT * np.maximum(abs(low), abs(high)).max()).any():
        raise SceneError(
            f"the scene is a single point at ({low[0]:g}, {low[1]:g}, {low[2]:g})",
            rule="a scene needs some extent",
            fix="is it scaled to nothing?",
        )
    return (low + high) / 2.0, high - low


def box_corners(bounds: Bounds) -> Bounds:
    """Corners ``(8, 3)`` of a box ``(2, 3)``."""
    (x0, y0, z0), (x1, y1, z1) = np.asarray(bounds, np.float64)
    return np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)])


def thin_axis(bounds: Bounds) -> int | None:
    """The axis, 0 for x or 1 for y, along which a scene is flat, so that it is seen edge-on from +z; None if it is not.

    Flat is a box less than a twentieth as thick as it is wide along both other axes; a line is not.
    """
    _, size = box(bounds)
    axis = int(np.argmin(size))
    narrow, wide = sorted(np.delete(size, axis))
    return axis if axis != 2 and size[axis] < _FLAT * narrow and narrow > _LINE * wide else None


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
            points = box_corners(np.stack([points.min(axis=0), points.max(axis=0)]))
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
