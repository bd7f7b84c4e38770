"""Skins: where the joints stand that hold a mesh."""

from __future__ import annotations

import numpy as np

from lippmann.scene.gltf import accessors as storage
from lippmann.scene.gltf.accessors import Accessors
from lippmann.scene.gltf.document import Document
from lippmann.scene.gltf.nodes import Nodes
from lippmann.scene.gltf.primitives import Skin


def read_skin(index: int, document: Document, accessors: Accessors, nodes: Nodes) -> Skin:
    """The joint matrices of ``skins[index]`` with every joint as its node stands (glTF 2.0, section 3.7.3).

    Raises
    ------
    SceneError
        A skin without joints, or with fewer inverse bind matrices than joints.
    """
    fields = document.all("skins")[index]
    joints = document.references(fields, "joints", "nodes")
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
