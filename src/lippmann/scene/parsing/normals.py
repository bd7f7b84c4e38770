"""Normals of triangles and of their vertices, and repair of the normals that files give."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.description import FloatArray, IndexArray

Numbers = NDArray[np.float64]

_SHORT = 1e-12  # a normal shorter than this has no direction


def unit_normals(normals: FloatArray, positions: FloatArray, faces: IndexArray) -> tuple[FloatArray, bool]:
    """Normals ``(n, 3)`` brought to unit length, and whether some had no direction.

    Those take the mean of the triangles about them, weighted by area.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        good = np.isfinite(lengths) & (lengths > _SHORT)
        if good.all():
            return normals / lengths, False
        sums = sum_face_normals(positions, faces)
        sizes = np.linalg.norm(sums, axis=1, keepdims=True)
        around = np.where(sizes > 0.0, sums / sizes, np.array([0.0, 0.0, 1.0]))
        return np.where(good, normals / lengths, around).astype(np.float32), True


def sum_face_normals(positions: FloatArray, faces: IndexArray) -> Numbers:
    """``(n, 3)``: sum of the normals of the triangles about each vertex, each as long as twice its area."""
    sums = np.zeros((len(positions), 3))
    normals = _cross_edges(positions[faces].astype(np.float64))
    for corner in range(3):
        np.add.at(sums, faces[:, corner], normals)
    return sums


def unit_face_normals(corners: Numbers) -> Numbers:
    """Unit normals ``(n, 3)`` of triangles ``(n, 3, 3)``; zero for those without an area."""
    normals = _cross_edges(corners)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    units: Numbers = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    return units


def _cross_edges(corners: Numbers) -> Numbers:
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
