"""Matrices ``(4, 4)`` that act on column vectors: what placements are made of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.description import Matrix

#: Points, or a box by its corners, ``(n, 3)``.
Bounds = NDArray[np.float64]
Vector = tuple[float, float, float]


def transform_points(matrix: Matrix, points: Bounds) -> Bounds:
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], np.float64)


def inverse(matrix: Matrix) -> Matrix:
    return np.asarray(np.linalg.inv(matrix), np.float64)


def translation(offset: Sequence[float] | Bounds) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def scaling(factor: float) -> Matrix:
    return np.diag([factor, factor, factor, 1.0])


def rotation(turn: Vector) -> Matrix:
    """Yaw about y, then pitch about x, then roll about z (degrees, right-handed)."""
    (cy, cx, cz), (sy, sx, sz) = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    yaw = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    pitch = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    roll = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    matrix = np.eye(4)
    matrix[:3, :3] = roll @ pitch @ yaw
    return matrix
