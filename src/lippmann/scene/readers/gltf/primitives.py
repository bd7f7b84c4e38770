"""Mesh primitives: accessors into triangles, lines and points, morphed and skinned as the file stands at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lippmann.scene.parsing.normals import unit_normals
from lippmann.scene.readers.gltf import accessors as storage
from lippmann.scene.readers.gltf.accessors import Accessors, Storage
from lippmann.scene.readers.gltf.document import DRACO, Document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.gltf.skinning import Skin, deform
from lippmann.scene.values.description import FloatArray, IndexArray

_POINTS, _LINES, _LINE_LOOP, _LINE_STRIP, _TRIANGLES, _TRIANGLE_STRIP, _TRIANGLE_FAN = range(7)


@dataclass(frozen=True, eq=False)
class Geometry:
    """Triangles without a material; arrays as in :class:`lippmann.scene.values.description.Mesh`.

    Of lines, ``faces`` is ``(m, 2)``, of points ``(m, 1)``; those have no ``normals``.
    """

    positions: FloatArray
    faces: IndexArray
    normals: FloatArray | None
    uvs: tuple[FloatArray, ...]
    colors: FloatArray | None
    tangents: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Primitives:
    """Reads the primitives of a document's meshes."""

    document: Document
    accessors: Accessors

    def read(self, primitive: Fields, weights: tuple[float, ...], skin: Skin | None) -> Geometry | None:
        """The triangles, lines or points of a primitive, or None if it has none.

        Parameters
        ----------
        weights:
            One for each morph target; empty for zeros.
        skin:
            Joints that place the vertices in the world; None leaves them in the mesh's space.

        Raises
        ------
        SceneError
            A reference leads nowhere, attributes differ in length, or a vertex is not finite.
        """
        attributes = primitive.child("attributes")
        mode = primitive.optional_integer("mode")
        mode = _TRIANGLES if mode is None else mode
        if mode > _TRIANGLE_FAN:
            raise primitive.error("mode", "0 to 6 belongs here")
        position = None if attributes is None else self.document.reference(attributes, "POSITION", "accessors")
        if attributes is None or position is None:
            self.document.notes.add("a primitive without vertex positions is left out", primitive.place)
            return None
        if self._is_compressed(primitive, position):
            decoded = self.accessors.with_decoded(self.accessors.draco.decode(primitive))
            return replace(self, accessors=decoded)._read(primitive, _TRIANGLES, position, weights, skin)
        return self._read(primitive, mode, position, weights, skin)

    def _read(
        self, primitive: Fields, mode: int, position: int, weights: tuple[float, ...], skin: Skin | None
    ) -> Geometry | None:
        attributes = primitive.child("attributes")
        assert attributes is not None
        positions = self.accessors.floats(position, storage.POSITION)
        faces = self._faces(primitive, mode, len(positions))
        if not len(faces):
            return None
        normals = tangents = None
        if mode >= _TRIANGLES:
            normals = self._vertex_data(attributes, "NORMAL", storage.NORMAL, len(positions))
        if normals is not None:  # without them tangents do not count (section 3.7.2.1)
            tangents = self._vertex_data(attributes, "TANGENT", storage.TANGENT, len(positions))
        uvs = self._uvs(attributes, len(positions))
        colors = self._vertex_data(attributes, "COLOR_0", storage.COLOR, len(positions))
        vertices = Geometry(positions, faces, normals, uvs, colors, tangents)
        if any(weights):
            vertices = self._morph(vertices, primitive, weights)
        if skin is not None:
            vertices = self._skin(vertices, attributes, skin)
        return self._clean(vertices, primitive)

    def _faces(self, primitive: Fields, mode: int, count: int) -> IndexArray:
        """Triangles ``(m, 3)``, lines ``(m, 2)`` or points ``(m, 1)``; those that name a vertex twice are left out."""
        index = self.document.reference(primitive, "indices", "accessors")
        if index is None:
            corners = np.arange(count, dtype=np.uint32)
        else:
            corners = self.accessors.integers(index, storage.INDICES)[:, 0]
            if len(corners) and corners.max() >= count:
                raise self.document.error(
                    f"{primitive.place}.indices name vertex {corners.max()}",
                    rule=f"there are {count}, counted from 0",
                )
        if mode in (_POINTS, _LINES, _TRIANGLES):
            size, what = {_POINTS: (1, "points"), _LINES: (2, "lines"), _TRIANGLES: (3, "triangles")}[mode]
            if len(corners) % size:
                raise self.document.error(
                    f"{primitive.place} has {len(corners)} corners", rule=f"{what} have {size} each"
                )
            faces = corners.reshape(-1, size)
        elif mode == _LINE_STRIP:
            faces = np.column_stack([corners[:-1], corners[1:]])
        elif mode == _LINE_LOOP:
            faces = np.column_stack([corners, np.roll(corners, -1)])
        elif mode == _TRIANGLE_STRIP:
            faces = np.column_stack([corners[:-2], corners[1:-1], corners[2:]])
            faces[1::2] = faces[1::2, [0, 2, 1]]  # every second triangle of a strip turns the other way round
        else:
            faces = np.column_stack([corners[1:-1], corners[2:], np.broadcast_to(corners[:1], corners[2:].shape)])
        if faces.shape[1] == 1:
            return faces
        proper = (faces != np.roll(faces, -1, axis=1)).all(axis=1)
        return faces if proper.all() else faces[proper]

    def _is_compressed(self, primitive: Fields, position: int) -> bool:
        """Whether the vertices of a primitive are compressed, and given in no other way."""
        accessor = self.document.all("accessors")[position]
        return primitive.extension(DRACO) is not None and not accessor.has("bufferView") and not accessor.has("sparse")

    def _uvs(self, attributes: Fields, count: int) -> tuple[FloatArray, ...]:
        sets: list[FloatArray] = []
        while (uvs := self._vertex_data(attributes, f"TEXCOORD_{len(sets)}", storage.TEXCOORD, count)) is not None:
            sets.append(uvs)
        return tuple(sets)

    def _vertex_data(self, attributes: Fields, key: str, kind: Storage, count: int) -> FloatArray | None:
        """One attribute as float32, with as many elements as there are vertices; None where absent."""
        index = self._vertex_reference(attributes, key, count)
        return None if index is None else self.accessors.floats(index, kind)

    def _vertex_reference(self, attributes: Fields, key: str, count: int) -> int | None:
        index = self.document.reference(attributes, key, "accessors")
        if index is not None and self.accessors.count(index) != count:
            raise attributes.error(
                key, f"that accessor has {self.accessors.count(index)} elements for {count} vertices"
            )
        return index

    def _morph(self, vertices: Geometry, primitive: Fields, weights: tuple[float, ...]) -> Geometry:
        """Vertices with the weighted changes of the morph targets added."""
        targets = primitive.children("targets")
        if len(targets) != len(weights):
            raise self.document.error(
                f"{primitive.place} has {len(targets)} morph targets", rule=f"its mesh has {len(weights)} weights"
            )
        count = len(vertices.positions)

        def apply_targets(values: FloatArray, key: str, kind: Storage) -> FloatArray:
            total = values.copy()
            width = 3 if key == "TANGENT" else values.shape[1]  # of tangents, the side of the bitangent stays
            for target, weight in zip(targets, weights, strict=True):
                change = self._vertex_data(target, key, kind, count) if weight else None
                if change is not None:
                    if change.shape[1] != width:
                        raise target.error(key, f"it must have {width} components, as what it changes")
                    total[:, :width] += np.float32(weight) * change
            return total

        with np.errstate(over="ignore", invalid="ignore"):  # positions are checked to be finite in the end
            return Geometry(
                apply_targets(vertices.positions, "POSITION", storage.POSITION_CHANGE),
                vertices.faces,
                None if vertices.normals is None else apply_targets(vertices.normals, "NORMAL", storage.NORMAL_CHANGE),
                tuple(
                    apply_targets(uvs, f"TEXCOORD_{i}", storage.TEXCOORD_CHANGE) for i, uvs in enumerate(vertices.uvs)
                ),
                None if vertices.colors is None else apply_targets(vertices.colors, "COLOR_0", storage.COLOR_CHANGE),
                None
                if vertices.tangents is None
                else apply_targets(vertices.tangents, "TANGENT", storage.NORMAL_CHANGE),
            )

    def _skin(self, vertices: Geometry, attributes: Fields, skin: Skin) -> Geometry:
        """Vertices in the world, each placed by the joints that hold it."""
        count = len(vertices.positions)
        joint_sets: list[IndexArray] = []
        weight_sets: list[FloatArray] = []
        while (index := self._vertex_reference(attributes, f"JOINTS_{len(joint_sets)}", count)) is not None:
            key = f"WEIGHTS_{len(joint_sets)}"
            weights = self._vertex_data(attributes, key, storage.WEIGHTS, count)
            if weights is None:
                raise attributes.error(key, "joints need weights")
            joint_sets.append(self.accessors.integers(index, storage.JOINTS))
            weight_sets.append(weights)
        if not joint_sets:
            raise attributes.error("JOINTS_0", "a mesh with a skin needs it")
        joints, all_weights = np.hstack(joint_sets), np.hstack(weight_sets)
        beyond = joints >= len(skin.matrices)
        if (all_weights[beyond] != 0.0).any():
            raise attributes.error("JOINTS_0", f"it names joint {joints[beyond].max()} of {len(skin.matrices)}")
        joints[beyond] = 0
        positions, normals, tangents, mirrored = deform(
            vertices.positions, vertices.normals, vertices.tangents, joints, all_weights, skin.matrices
        )
        faces = np.ascontiguousarray(vertices.faces[:, ::-1] if mirrored else vertices.faces)
        return replace(vertices, positions=positions, faces=faces, normals=normals, tangents=tangents)

    def _clean(self, vertices: Geometry, primitive: Fields) -> Geometry:
        """Only vertices that a triangle uses, all of them finite, with normals of unit length."""
        used = np.zeros(len(vertices.positions), bool)
        used[vertices.faces] = True
        if not used.all():
            places = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
            vertices = Geometry(
                vertices.positions[used],
                places[vertices.faces],
                None if vertices.normals is None else vertices.normals[used],
                tuple(uvs[used] for uvs in vertices.uvs),
                None if vertices.colors is None else vertices.colors[used],
                None if vertices.tangents is None else vertices.tangents[used],
            )
        finite = np.isfinite(vertices.positions).all(axis=1)
        if not finite.all():
            vertex = int(np.flatnonzero(used)[np.flatnonzero(~finite)[0]])
            raise self.document.error(f"vertex {vertex} of {primitive.place} is not finite", rule="positions must be")
        normals = vertices.normals
        if normals is not None:
            normals, repaired = unit_normals(normals, vertices.positions, vertices.faces)
            if repaired:
                self.document.notes.add("normals without a direction were taken from the triangles", primitive.place)
        tangents = None if vertices.tangents is None else _unit_tangents(vertices.tangents)
        uvs = tuple(self._zero_nonfinite(values, "texture coordinates", primitive) for values in vertices.uvs)
        colors = vertices.colors
        if colors is not None:
            colors = np.clip(self._zero_nonfinite(colors, "colours", primitive), 0.0, 1.0)
        return Geometry(vertices.positions, vertices.faces, normals, uvs, colors, tangents)

    def _zero_nonfinite(self, values: FloatArray, what: str, primitive: Fields) -> FloatArray:
        finite = np.isfinite(values)
        if finite.all():
            return values
        self.document.notes.add(f"{what} that are not finite were set to 0", primitive.place)
        return np.where(finite, values, np.float32(0.0))


def _unit_tangents(tangents: FloatArray) -> FloatArray:
    """Tangents ``(n, 4)`` brought to unit length; zeros for those without a direction."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        along = tangents[:, :3] / np.linalg.norm(tangents[:, :3], axis=1, keepdims=True)
    good = np.isfinite(along).all(axis=1, keepdims=True)
    side = np.where(tangents[:, 3:] < 0.0, np.float32(-1.0), np.float32(1.0))
    return np.where(good, np.hstack([along, side]), np.float32(0.0))
