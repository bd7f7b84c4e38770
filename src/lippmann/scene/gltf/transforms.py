"""Matrices of placements, 4x4 float64 on column vectors; many at once as ``(k, 4, 4)``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.description import Matrix

# Singular values this much smaller than the largest count as none: a scale of zero after some rounding.
_FLAT = 1e-12


def compose(translations: Matrix, quaternions: Matrix, scales: Matrix) -> Matrix:
    """Matrices ``(k, 4, 4)`` that scale ``(k, 3)``, then rotate ``(k, 4)`` (x, y, z, w), then translate ``(k, 3)``.

    Quaternions need not have unit length, but none may be zero.
    """
    scaled = quaternions / np.abs(quaternions).max(axis=1, keepdims=True)  # squares of tiny numbers would vanish
    x, y, z, w = np.moveaxis(scaled / np.linalg.norm(scaled, axis=1, keepdims=True), 1, 0)
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    matrices = np.tile(np.eye(4), (len(scales), 1, 1))
    matrices[:, :3, :3] = np.moveaxis(np.array(rows), 2, 0) * scales[:, None, :]
    matrices[:, :3, 3] = translations
    return matrices


def ranks(matrices: Matrix) -> NDArray[np.int64]:
    """How many dimensions each of ``(k, 4, 4)`` finite matrices leaves of a solid: 3, or 2 when it flattens it."""
    values = np.linalg.svd(matrices[:, :3, :3], compute_uv=False)
    kept: NDArray[np.int64] = (values > _FLAT * values[:, :1]).sum(axis=1)
    return kept


def normal_matrices(linear: Matrix) -> Matrix:
    """What turns normals when points are turned by ``(..., 3, 3)`` matrices, singular or not; lengths are not kept.

    The matrix of cofactors is the inverse transpose times the determinant, whose sign must not count: a mirrored
    body keeps its outside.
    """
    first, second, third = linear[..., 0, :], linear[..., 1, :], linear[..., 2, :]
    cofactors = np.stack([np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=-2)
    determinants = (first * cofactors[..., 0, :]).sum(axis=-1)
    turned: Matrix = np.where(determinants < 0.0, -1.0, 1.0)[..., None, None] * cofactors
    return turned


def rigid(matrix: Matrix) -> Matrix:
    """Position and orientation of a finite ``(4, 4)`` matrix without its scale, shear and mirroring.

    The z axis keeps its direction and the y axis its side, as a camera and a lamp need; an axis scaled to nothing
    is replaced by one that fits.
    """
    z = _unit(matrix[:3, 2], np.array([0.0, 0.0, 1.0]))
    least = np.eye(3)[np.argmin(np.abs(z))]
    y = _unit(matrix[:3, 1] - z * (z @ matrix[:3, 1]), np.cross(z, least) / np.linalg.norm(np.cross(z, least)))
    result = np.eye(4)
    result[:3, :3] = np.column_stack([np.cross(y, z), y, z])
    result[:3, 3] = matrix[:3, 3]
    return result


def _unit(vector: Matrix, otherwise: Matrix) -> Matrix:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else otherwise
