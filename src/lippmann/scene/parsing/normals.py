"""Repair of the normals that files give."""

from __future__ import annotations

import numpy as np

from lippmann.scene.values.description import FloatArray, IndexArray

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
        corners = positions[faces].astype(np.float64)
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sums = np.zeros((len(positions), 3))
        for corner in range(3):
            np.add.at(sums, faces[:, corner], areas)
        sizes = np.linalg.norm(sums, axis=1, keepdims=True)
        around = np.where(sizes > 0.0, sums / sizes, np.array([0.0, 0.0, 1.0]))
        return np.where(good, normals / lengths, around).astype(np.float32), True
