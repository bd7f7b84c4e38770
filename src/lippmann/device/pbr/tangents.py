"""Tangents that meshes bring with them, carried so that they follow any placement of their mesh.

A surface point on the device knows how its place in the world changes with u and v, instances included. Tangents are
therefore stored by their coordinates along those two directions. As these differ from triangle to triangle, each
triangle has corners of its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lippmann.scene.values.description import FloatArray, Mesh


def with_own_corners(mesh: Mesh) -> Mesh:
    """The same triangles, none of which share a vertex."""

    def corners(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[mesh.faces.ravel()]

    return replace(
        mesh,
        positions=mesh.positions[mesh.faces.ravel()],
        faces=np.arange(mesh.faces.size, dtype=np.uint32).reshape(-1, 3),
        normals=corners(mesh.normals),
        uvs=tuple(uvs[mesh.faces.ravel()] for uvs in mesh.uvs),
        colors=corners(mesh.colors),
        tangents=corners(mesh.tangents),
    )


def tangents_in_uv(mesh: Mesh, uv_set: int) -> FloatArray:
    """Tangents of a mesh :func:`with_own_corners`, by the directions of a uv set.

    Returns
    -------
    ndarray
        ``(n, 3)``: coordinates along dp/du and dp/dv, and 1 where the bitangent lies on the side of -v, as it does
        without tangents, else -1. A corner whose tangent or uv set has no direction takes that of dp/du.
    """
    assert mesh.normals is not None
    assert mesh.tangents is not None
    places = mesh.positions.reshape(-1, 3, 3).astype(np.float64)
    uvs = mesh.uvs[uv_set] if uv_set < len(mesh.uvs) else np.zeros((len(mesh.positions), 2))
    uv = uvs.reshape(-1, 3, 2).astype(np.float64)
    (first, second), (du, dv) = (np.moveaxis(each[:, 1:] - each[:, :1], 1, 0) for each in (places, uv))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        area = (du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0])[:, None]
        along_u = np.repeat((first * dv[:, 1:] - second * du[:, 1:]) / area, 3, axis=0)
        along_v = np.repeat((second * du[:, :1] - first * dv[:, :1]) / area, 3, axis=0)
        across = np.cross(along_v, mesh.normals)
        volume = (along_u * across).sum(axis=1)
        tangents, side = mesh.tangents[:, :3], mesh.tangents[:, 3]
        in_uv = np.column_stack(
            [
                (tangents * across).sum(axis=1) / volume,
                (along_u * np.cross(tangents, mesh.normals)).sum(axis=1) / volume,
                -np.sign(volume) * side,
            ]
        )
        lost = ~np.isfinite(in_uv).all(axis=1) | ~in_uv[:, :2].any(axis=1)
        default = np.nan_to_num(1 / np.linalg.norm(along_u, axis=1), nan=1, posinf=1)
    in_uv[lost] = np.column_stack([default, np.zeros_like(default), np.ones_like(default)])[lost]
    return in_uv.astype(np.float32)
