"""The node hierarchy: traversal of the default scene, and world matrices (4x4 float64)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf import accessors as storage
from lippmann.scene.readers.gltf.accessors import Accessors
from lippmann.scene.readers.gltf.document import Document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.values.description import Matrix

_FARTHEST = 1e30  # matrices of larger entries lead out of single precision
# Singular values this much smaller than the largest count as none: a scale of zero after some rounding.
_FLAT = 1e-12

# Members of a node that say where it lies.
_TRANSFORMS = frozenset({"matrix", "translation", "rotation", "scale"})

_ONE = np.eye(4)[None]
_ONE.setflags(write=False)


class Nodes:
    """The nodes of a document.

    Raises
    ------
    SceneError
        A child that does not exist or has two parents, or a transformation that is no affine one.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self._parents: dict[int, int] = {}
        self._locals = _local_matrices(document.all("nodes"))
        self._is_near = np.abs(self._locals).max(axis=(1, 2), initial=0.0) < _FARTHEST
        self._worlds: dict[int, Matrix] = {}
        for index, fields in enumerate(document.all("nodes")):
            for child in document.node_references(fields, "children"):
                if child in self._parents:
                    raise document.error(
                        f"nodes[{child}] is a child of nodes[{self._parents[child]}] and of nodes[{index}]",
                        rule="a node has one parent",
                    )
                self._parents[child] = index
        if document.root.extension("VRM") is not None:
            document.notes.add("turned by 180 degrees: avatars of VRM 0 stand with their backs to the viewer")
            roots = [index for index in range(len(self._locals)) if index not in self._parents]
            self._locals[roots] = np.diag([-1.0, 1.0, -1.0, 1.0]) @ self._locals[roots]

    def traverse(self) -> Iterator[tuple[int, bool]]:
        """The nodes of the default scene, parents first, and whether each is visible.

        Without a default scene it is the first one; without any scene, all nodes.
        """
        nodes = self._document.all("nodes")
        stack = [(index, True) for index in reversed(self._roots())]
        visited: set[int] = set()
        while stack:
            index, visible = stack.pop()
            if index in visited:  # a scene may list a node beside its parent
                continue
            visited.add(index)
            visibility = nodes[index].extension("KHR_node_visibility")
            visible = visible and (visibility is None or visibility.flag("visible", default=True))
            yield index, visible
            stack += [(child, visible) for child in reversed(nodes[index].integers("children"))]

    def _roots(self) -> list[int]:
        document = self._document
        scenes = document.all("scenes")
        if not scenes:
            if document.all("nodes"):
                document.notes.add("the file has no scene; all its nodes are shown")
            return [index for index in range(len(document.all("nodes"))) if index not in self._parents]
        scene = scenes[document.reference(document.root, "scene", "scenes") or 0]
        if len(scenes) > 1:
            document.notes.add(f"of {len(scenes)} scenes '{scene.text('name') or scene.place}' is shown")
        return document.node_references(scene, "nodes")

    def world(self, index: int) -> Matrix:
        """``world_from_node`` of a node, 4x4 float64.

        Raises
        ------
        SceneError
            The node is its own ancestor, or numbers overflow.
        """
        if index not in self._parents and self._is_near[index]:
            root: Matrix = self._locals[index]
            return root
        chain: list[int] = []
        on_chain: set[int] = set()
        at: int | None = index
        while at is not None and at not in self._worlds:
            if at in on_chain:
                raise self._document.error(f"nodes[{at}] is its own ancestor", rule="nodes form a tree")
            chain.append(at)
            on_chain.add(at)
            at = self._parents.get(at)
        world: Matrix = np.eye(4) if at is None else self._worlds[at]
        for step in reversed(chain):
            world = world @ self._locals[step]
            if not np.abs(world).max() < _FARTHEST:
                raise self._document.error(
                    f"the transformation of nodes[{step}] overflows", rule=f"entries up to {_FARTHEST:g} are understood"
                )
            self._worlds[step] = world
        return world


def _local_matrices(nodes: list[Fields]) -> Matrix:
    """``parent_from_node`` ``(n, 4, 4)``: each node's matrix, or its scale, then rotation, then translation."""
    translations, rotations, scales = np.zeros((len(nodes), 3)), np.zeros((len(nodes), 4)), np.ones((len(nodes), 3))
    rotations[:, 3] = 1.0
    explicit: dict[int, Matrix] = {}
    for index, fields in enumerate(nodes):
        if not fields.values.keys() & _TRANSFORMS:
            continue
        columns = fields.numbers("matrix", 16)
        if columns is not None:
            explicit[index] = np.array(columns).reshape(4, 4).T
            if not np.allclose(explicit[index][3], (0.0, 0.0, 0.0, 1.0), rtol=0.0, atol=1e-6):
                raise fields.error("matrix", "its last row must be 0, 0, 0, 1")
            explicit[index][3] = (0.0, 0.0, 0.0, 1.0)
            continue
        for key, values in (("translation", translations), ("rotation", rotations), ("scale", scales)):
            numbers = fields.numbers(key, values.shape[1])
            if numbers is not None:
                values[index] = numbers
    for turned in np.flatnonzero(~rotations.any(axis=1)):
        raise _no_rotation(nodes[turned], "rotation")
    matrices = compose(translations, rotations, scales)
    for index, matrix in explicit.items():
        matrices[index] = matrix
    return matrices


def _no_rotation(fields: Fields, key: str) -> SceneError:
    return fields.error(key, "a quaternion of length 0 is no rotation")


def instance_matrices(node: Fields, document: Document, accessors: Accessors) -> Matrix:
    """``node_from_mesh`` ``(k, 4, 4)`` of every copy that a node shows; one identity without EXT_mesh_gpu_instancing.

    Raises
    ------
    SceneError
        The extension's attributes differ in length, or hold what is no translation, rotation or scale.
    """
    instancing = node.extension("EXT_mesh_gpu_instancing")
    attributes = None if instancing is None else instancing.child("attributes")
    if attributes is None:
        return _ONE
    values_of: dict[str, Matrix] = {}
    if any(name.lstrip("_").startswith("COLOR") for name in attributes.names()):
        document.notes.add("colours of copies are left out", attributes.place)
    for key, kind in (
        ("TRANSLATION", storage.TRANSLATION),
        ("ROTATION", storage.ROTATION),
        ("SCALE", storage.SCALE),
    ):
        index = document.reference(attributes, key, "accessors")
        if index is not None:
            values_of[key] = accessors.floats(index, kind).astype(np.float64)
            if not np.isfinite(values_of[key]).all():
                raise attributes.error(key, "its values must be finite")
    counts = {len(values) for values in values_of.values()}
    if len(counts) > 1:
        raise document.error(f"the accessors of {attributes.place} differ in length", rule="one element per copy")
    count = counts.pop() if counts else 1
    rotations = values_of.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)))
    if not rotations.any(axis=1).all():
        raise _no_rotation(attributes, "ROTATION")
    return compose(
        values_of.get("TRANSLATION", np.zeros((count, 3))), rotations, values_of.get("SCALE", np.ones((count, 3)))
    )


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
    """Ranks of the linear parts of finite matrices ``(k, 4, 4)``: 3, or 2 for one that flattens solids."""
    values = np.linalg.svd(matrices[:, :3, :3], compute_uv=False)
    rank: NDArray[np.int64] = (values > _FLAT * values[:, :1]).sum(axis=1)
    return rank


def normal_matrices(linear: Matrix) -> Matrix:
    """Matrices that transform normals where ``linear`` ``(..., 3, 3)`` transforms points; lengths are not kept.

    The matrix of cofactors is the inverse transpose times the determinant, and exists for singular matrices, too. The
    determinant's sign is removed: a mirrored body keeps its outside.
    """
    first, second, third = linear[..., 0, :], linear[..., 1, :], linear[..., 2, :]
    cofactors = np.stack([np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=-2)
    determinants = (first * cofactors[..., 0, :]).sum(axis=-1)
    matrices: Matrix = np.where(determinants < 0.0, -1.0, 1.0)[..., None, None] * cofactors
    return matrices


def rigid(matrix: Matrix) -> Matrix:
    """Position and orientation of a finite ``(4, 4)`` matrix without its scale, shear and mirroring.

    The z axis keeps its direction and the y axis its side, as cameras and light sources need; an axis scaled to nothing
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
