"""What skins do to vertices and normals, and normals mended."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.description import FloatArray, IndexArray
from lippmann.scene.gltf.transforms import normal_matrices

_SHORT = 1e-12  # a normal shorter than this has no direction


def deform(
    positions: FloatArray,
    normals: FloatArray | None,
    joints: IndexArray,
    weights: FloatArray,
    matrices: NDArray[np.float64],
) -> tuple[FloatArray, FloatArray | None, bool]:
    """Linear blend skinning (glTF 2.0, section 3.7.3.3).

    Parameters
    ----------
    positions, normals:
        ``(n, 3)``.
    joints, weights:
        ``(n, k)``: which matrices hold a vertex, and how much; weights are brought to a sum of 1, and a vertex
        without any follows its first joint.
    matrices:
        ``(j, 4, 4)``.

    Returns
    -------
    positions, normals:
        ``(n, 3)``; normals are not of unit length.
    mirrored:
        Whether most vertices were mirrored, which turns triangles round.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # the caller looks for what is not finite
        total = weights.sum(axis=1, keepdims=True)
        shares = np.where(total > 0.0, weights / total, np.eye(1, weights.shape[1], dtype=np.float32))
        blended = np.zeros((len(positions), 3, 4))
        for k in range(joints.shape[1]):
            blended += shares[:, k, None, None] * matrices[joints[:, k], :3]
        linear = blended[:, :, :3]
        moved = np.einsum("nij,nj->ni", linear, positions) + blended[:, :, 3]
        mirrored = bool((np.linalg.det(linear) < 0.0).mean() > 0.5)
        turned = None
        if normals is not None:
            turned = np.einsum("nij,nj->ni", normal_matrices(linear), normals).astype(np.float32)
        return moved.astype(np.float32), turned, mirrored


def unit_normals(normals: FloatArray, positions: FloatArray, faces: IndexArray) -> tuple[FloatArray, bool]:
    """Normals ``(n, 3)`` brought to unit length, and whether some had no direction.

    Those take the mean of the triangles about them, weighted by area.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        good = np.isfinite(lengths) & (lengths > _SHORT)
        if good.all():
            return normals / lengths, False
        corners = positions[faces].astype(np.float64)
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sums = np.zeros((len(positions), 3))
        for corner in range(3):
            np.add.at(sums, faces[:, corner], areas)
        sizes = np.linalg.norm(sums, axis=1, keepdims=True)
        around = np.where(sizes > 0.0, sums / sizes, np.array([0.0, 0.0, 1.0]))
        return np.where(good, normals / lengths, around).astype(np.float32), True
