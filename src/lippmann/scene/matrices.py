"""Matrices ``(4, 4)`` that act on column vectors: what placements are made of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import PictureError
from lippmann.scene.values.description import Matrix

#: Points, or a box by its corners, ``(n, 3)``.
Bounds = NDArray[np.float64]
Vector = tuple[float, float, float]

#: Sine of the angle to the vertical below which a direction is vertical.
_UPRIGHT = 1e-9

#: Deviation of ``world_from_display`` from a rotation and scales that rounding may leave.
_TOLERANCE = 1e-6


def transform_points(matrix: Matrix, points: NDArray[np.floating]) -> Bounds:
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], np.float64)


def inverse(matrix: Matrix) -> Matrix:
    return np.asarray(np.linalg.inv(matrix), np.float64)


def translation(offset: Sequence[float] | Bounds) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def scaling(factor: float) -> Matrix:
    return np.diag([factor, factor, factor, 1.0])


def depth_scaling(factor: float) -> Matrix:
    """Along z alone, about the lens plane."""
    return np.diag([1.0, 1.0, factor, 1.0])


def rotation_of(world_from_display: Matrix) -> Matrix:
    """The rotation alone, ``(4, 4)``, of a display's place: its axes in the world, z at a right angle to the panel."""
    matrix = np.eye(4)
    linear = np.asarray(world_from_display, np.float64)[:3, :3]
    matrix[:3, :2] = linear[:, :2] / np.linalg.norm(linear[:, :2], axis=0)
    matrix[:3, 2] = np.cross(matrix[:3, 0], matrix[:3, 1])
    return matrix


def check_placement(matrix: object) -> Matrix:
    """``matrix`` as a read-only ``(4, 4)`` float64 array; a :class:`PictureError` if it places no display.

    Columns 0 to 2 are the display's axes in the world: right-handed, x and y at a right angle and equally long. That of
    z may be longer, where the display shows the scene's depth compressed, and lean, where a camera's lens is shifted.
    """
    rule = "it must be 4 x 4: a rotation times a scale (z may differ and lean), a translation, and (0, 0, 0, 1) below"
    try:
        values: Matrix = np.array(matrix, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PictureError("world_from_display is no matrix", rule=rule) from None
    if values.shape != (4, 4) or not np.isfinite(values).all() or list(values[3]) != [0, 0, 0, 1]:
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    linear = values[:3, :3]
    with np.errstate(all="ignore"):  # what overflows places nothing either: NaN is within no tolerance
        lengths = np.linalg.norm(linear, axis=0)
        axes = linear / lengths
        is_regular = np.linalg.det(axes) > 0.0 and abs(lengths[0] / lengths[1] - 1.0) <= _TOLERANCE
        is_square = abs(axes[:, 0] @ axes[:, 1]) <= _TOLERANCE
    if not (is_regular and is_square):
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    values.flags.writeable = False
    return values


def normal_matrix(matrix: Matrix) -> Matrix:
    """``(3, 3)`` that carries normals, up to their length, as ``matrix`` carries points: its inverse, transposed."""
    return np.asarray(np.linalg.inv(np.asarray(matrix, np.float64)[:3, :3]).T, np.float64)


def rotation(turn: Vector) -> Matrix:
    """Yaw about y, then pitch about x, then roll about z (degrees, right-handed)."""
    (cy, cx, cz), (sy, sx, sz) = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    yaw = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    pitch = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    roll = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    matrix = np.eye(4)
    matrix[:3, :3] = roll @ pitch @ yaw
    return matrix


def turn_of(matrix: Matrix) -> tuple[float, float, float]:
    """Yaw, pitch and roll in degrees of a rotation ``(3, 3)``, as :func:`rotation` takes them."""
    across = float(np.hypot(matrix[2, 0], matrix[2, 2]))
    pitch = np.arctan2(matrix[2, 1], across)
    if across < _UPRIGHT:  # seen from above or below, yaw and roll are one
        yaw, roll = np.arctan2(matrix[0, 2], matrix[0, 0]), 0.0
    else:
        yaw, roll = np.arctan2(-matrix[2, 0], matrix[2, 2]), np.arctan2(-matrix[0, 1], matrix[1, 1])
    yaw, pitch, roll = np.degrees([yaw, pitch, roll]).tolist()
    return yaw, pitch, roll
