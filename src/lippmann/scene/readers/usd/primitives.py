"""Shapes that are given by numbers (``Sphere``, ``Cylinder`` and so on) as polygons with smooth normals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.parsing.triangulation import triangulate
from lippmann.scene.values.description import Mesh

#: Sides around, and rings from pole to pole: a silhouette's error is 0.06 % of the radius.
_AROUND, _RINGS = 96, 48
# Columns of a shape along z that become x, y and z of one along another axis.
_AXES = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}


@dataclass(frozen=True, eq=False)
class Polygons:
    """Positions ``(n, 3)``, corners of each face, their points ``(c,)``, and unit normals ``(c, 3)`` at corners."""

    points: NDArray[np.float64]
    counts: NDArray[np.int64]
    indices: NDArray[np.int64]
    normals: NDArray[np.float64]


@lru_cache(maxsize=1)
def unit_ball() -> Mesh:
    """Triangles of the ball of radius 1 about the origin; all spheres share their arrays."""
    shape = primitive_polygons("Sphere", {"radius": 1.0})
    triangles, _ = triangulate(shape.points, shape.indices, shape.counts)
    points = shape.points.astype(np.float32)
    return Mesh("ball", points, shape.indices[triangles].astype(np.uint32), 0, points, stands_for="ball")


def primitive_polygons(kind: str, numbers: Mapping[str, float | str]) -> Polygons:
    """A shape as polygons; its size as the attributes of its schema say."""

    def number(name: str) -> float:
        return float(numbers[name])

    axis = str(numbers.get("axis", "Z"))
    if kind == "Cube":
        return _box(number("size"))
    if kind == "Plane":
        # Its width lies along x for the axes y and z, its length along y for x and z.
        sides = number("width"), number("length")
        return _along(_plane(*(sides if axis == "Z" else sides[::-1])), axis)
    if kind == "Sphere":
        angles = np.linspace(-np.pi / 2.0, np.pi / 2.0, _RINGS + 1)
        profile = number("radius") * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return _turn([profile], [np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    low = number("radiusBottom") if "radiusBottom" in numbers else number("radius")
    high = number("radiusTop") if "radiusTop" in numbers else 0.0 if kind == "Cone" else low
    half = number("height") / 2.0
    side = np.array([[low, -half], [high, half]])
    slope = np.array([2.0 * half, low - high])
    slope = slope / max(float(np.linalg.norm(slope)), 1e-30)
    if kind.startswith("Capsule"):
        angles = np.linspace(0.0, np.pi / 2.0, _RINGS // 2 + 1)
        arc = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        bottom, top = arc[::-1] * (1.0, -1.0), arc
        parts = [bottom * low - (0.0, half), side, top * high + (0.0, half)]
        return _along(_turn(parts, [bottom, np.repeat(slope[None], 2, axis=0), top]), axis)
    down, up = np.array([[0.0, -1.0]] * 2), np.array([[0.0, 1.0]] * 2)
    parts, normals = [np.array([[0.0, -half], [low, -half]]), side], [down, np.repeat(slope[None], 2, axis=0)]
    if kind != "Cone":
        parts.append(np.array([[high, half], [0.0, half]]))
        normals.append(up)
    return _along(_turn(parts, normals), axis)


def _turn(parts: list[NDArray[np.float64]], normals: list[NDArray[np.float64]]) -> Polygons:
    """Profiles ``(k, 2)`` of radius and z, from below, turned about z; normals likewise."""
    angles = np.arange(_AROUND) * (2.0 * np.pi / _AROUND)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points, indices, turned_normals, offset = [], [], [], 0
    for profile, normal in zip(parts, normals, strict=True):
        around = np.arange(_AROUND)
        beside = (around + 1) % _AROUND
        rows = np.arange(len(profile) - 1)[:, None] * _AROUND
        quads = np.stack([rows + around, rows + beside, rows + beside + _AROUND, rows + around + _AROUND], axis=-1)
        quads = quads.reshape(-1, 4)
        points.append(_swept(profile, ring))
        turned_normals.append(_swept(normal, ring)[quads.ravel()])
        indices.append(quads.ravel() + offset)
        offset += len(profile) * _AROUND
    corners = np.concatenate(indices)
    return Polygons(np.concatenate(points), np.full(len(corners) // 4, 4), corners, np.concatenate(turned_normals))


def _swept(profile: NDArray[np.float64], ring: NDArray[np.float64]) -> NDArray[np.float64]:
    flat = profile[:, None, :1] * ring[None]
    height = np.broadcast_to(profile[:, None, 1:], (*flat.shape[:2], 1))
    return np.concatenate([flat, height], axis=2).reshape(-1, 3)


def _box(size: float) -> Polygons:
    half = size / 2.0
    points, normals = [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            corners = np.zeros((4, 3))
            corners[:, axis] = side * half
            corners[:, u] = np.array([-half, half, half, -half]) * side
            corners[:, v] = [-half, -half, half, half]
            points.append(corners)
            normals.append(np.repeat(side * np.eye(3)[axis][None], 4, axis=0))
    return Polygons(np.concatenate(points), np.full(6, 4), np.arange(24), np.concatenate(normals))


def _plane(width: float, length: float) -> Polygons:
    x, y = width / 2.0, length / 2.0
    points = np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])
    return Polygons(points, np.array([4]), np.arange(4), np.repeat(np.array([[0.0, 0.0, 1.0]]), 4, axis=0))


def _along(shape: Polygons, axis: str) -> Polygons:
    order = _AXES.get(axis, _AXES["Z"])
    return Polygons(shape.points[:, order], shape.counts, shape.indices, shape.normals[:, order])
