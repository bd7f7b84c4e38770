"""Skins: joint matrices, linear blend skinning of vertices and normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.readers.gltf import accessors as storage
from lippmann.scene.readers.gltf.accessors import Accessors
from lippmann.scene.readers.gltf.document import Document
from lippmann.scene.readers.gltf.nodes import Nodes, normal_matrices
from lippmann.scene.values.description import FloatArray, IndexArray


@dataclass(frozen=True, eq=False)
class Skin:
    """Matrices ``(j, 4, 4)`` float64 that bring a mesh, bound to joint j alone, from its own space into the world."""

    index: int
    matrices: NDArray[np.float64]


def read_skin(index: int, document: Document, accessors: Accessors, nodes: Nodes) -> Skin:
    """The joint matrices of ``skins[index]`` with every joint as its node stands (glTF 2.0, section 3.7.3).

    Raises
    ------
    SceneError
        A skin without joints, or with fewer inverse bind matrices than joints.
    """
    fields = document.all("skins")[index]
    joints = document.node_references(fields, "joints")
    if not joints:
        raise fields.error("joints", "a skin has at least one")
    worlds = np.array([nodes.world(joint) for joint in joints])
    bind = document.reference(fields, "inverseBindMatrices", "accessors")
    if bind is None:
        return Skin(index, worlds)
    columns = accessors.floats(bind, storage.INVERSE_BIND_MATRICES)
    if len(columns) < len(joints):
        raise fields.error("inverseBindMatrices", f"that accessor has {len(columns)} matrices for {len(joints)} joints")
    inverse = columns[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        matrices = worlds @ inverse
    if not np.isfinite(matrices).all():
        raise fields.error("inverseBindMatrices", "its matrices must be finite")
    return Skin(index, matrices)


def deform(
    positions: FloatArray,
    normals: FloatArray | None,
    tangents: FloatArray | None,
    joints: IndexArray,
    weights: FloatArray,
    matrices: NDArray[np.float64],
) -> tuple[FloatArray, FloatArray | None, FloatArray | None, bool]:
    """Linear blend skinning (glTF 2.0, section 3.7.3.3).

    Parameters
    ----------
    positions, normals:
        ``(n, 3)``.
    tangents:
        ``(n, 4)``.
    joints, weights:
        ``(n, k)``: which matrices hold a vertex, and how much; weights are brought to a sum of 1, and a vertex
        without any follows its first joint.
    matrices:
        ``(j, 4, 4)``.

    Returns
    -------
    positions, normals, tangents:
        As given; normals and tangents are not of unit length.
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
        skinned = np.einsum("nij,nj->ni", linear, positions) + blended[:, :, 3]
        turned = np.linalg.det(linear) < 0.0
        skinned_normals = skinned_tangents = None
        if normals is not None:
            skinned_normals = np.einsum("nij,nj->ni", normal_matrices(linear), normals).astype(np.float32)
        if tangents is not None:
            along, side = np.einsum("nij,nj->ni", linear, tangents[:, :3]), tangents[:, 3]
            skinned_tangents = np.column_stack([along, np.where(turned, -side, side)]).astype(np.float32)
        return skinned.astype(np.float32), skinned_normals, skinned_tangents, bool(turned.mean() > 0.5)
