"""Meshes: one copy of each, however many nodes show it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace

import numpy as np

from lippmann.scene.parsing import points_lines
from lippmann.scene.readers.gltf.document import VARIANTS, Document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.gltf.materials import Materials
from lippmann.scene.readers.gltf.primitives import Geometry, Primitives
from lippmann.scene.readers.gltf.skinning import Skin
from lippmann.scene.readers.gltf.splats import is_splats
from lippmann.scene.values.description import FloatArray, Material, Mesh, Texture

_Key = tuple[Hashable, ...]

#: Of an inward mesh, the area-weighted mean of what its normals have along the way from its middle is below minus this;
#: a closed box seen from inside has about 0.8, a sheet 0. Judged on twenty rooms, shells, bowls and terrains. Half: no
#: change, waves have 0.00; double: a room full of furniture (24 pieces: 0.35) counts as none.
_INWARD = 0.2


@dataclass(frozen=True, eq=False)
class Meshes:
    """The meshes of a document as they are asked for; a primitive becomes one mesh of one material.

    Primitives of the same data and material share a mesh; those of the same data share their arrays. Of lines, a mesh's
    ``faces`` are ``(m, 2)``, of points ``(m, 1)``.
    """

    document: Document
    primitives: Primitives
    materials: Materials
    read: list[Mesh] = field(default_factory=list)
    _places: dict[tuple[_Key, int], int] = field(default_factory=dict)
    _by_mesh: dict[_Key, list[int]] = field(default_factory=dict)
    _geometries: dict[_Key, Geometry | None] = field(default_factory=dict)
    _changed: dict[tuple[int, Callable[[Material], Material]], int] = field(default_factory=dict)

    def pose(self, document: Document, primitives: Primitives) -> Meshes:
        """Meshes of the same file as other nodes show them; geometry without skin or morph weights is shared."""
        unskinned = {key: geometry for key, geometry in self._geometries.items() if key[2:] == ((), None)}
        return Meshes(document, primitives, self.materials, _geometries=unskinned, _changed=self._changed)

    def places(self, index: int, node: Fields, skin: Skin | None) -> list[int]:
        """The places in :attr:`read` of the primitives of ``meshes[index]``, as ``node`` shows it.

        Raises
        ------
        SceneError
            As :meth:`Primitives.read` and :meth:`Materials.place`.
        """
        fields = self.document.all("meshes")[index]
        weights = _weights(node) or _weights(fields)
        key = (index, weights, None if skin is None else skin.index)
        if key not in self._by_mesh:
            self._by_mesh[key] = self._read(fields, weights, skin)
        return self._by_mesh[key]

    def _read(self, fields: Fields, weights: tuple[float, ...], skin: Skin | None) -> list[int]:
        primitives = fields.children("primitives")
        places: list[int] = []
        for primitive in primitives:
            if is_splats(primitive):
                continue
            key = _key(primitive, weights, skin)
            if key not in self._geometries:
                self._geometries[key] = self.primitives.read(primitive, weights, skin)
            geometry = self._geometries[key]
            if geometry is None:
                continue
            material = self.materials.place(self._material(primitive))
            if geometry.faces.shape[1] < 3 and not _has_normals(primitive):
                material = self._change(material, points_lines.as_material)
            if _is_culled(self.materials.read[material]) and _faces_inward(geometry):
                material = self._change(material, _front_only)
            if (key, material) not in self._places:
                self._places[key, material] = len(self.read)
                name = fields.text("name") or fields.place
                name = name if len(primitives) == 1 else f"{name}/{len(places)}"
                mesh = self._mesh(name, geometry, material, primitive)
                self.read.append(replace(mesh, fitted=_is_fitted(fields)))
            places.append(self._places[key, material])
        return places

    def _material(self, primitive: Fields) -> int | None:
        """The primitive's material in the variant that is shown."""
        mapped = primitive.extension(VARIANTS)
        if self.document.variant is not None and mapped is not None:
            for mapping in mapped.children("mappings"):
                if self.document.variant in mapping.integers("variants"):
                    return self.document.reference(mapping, "material", "materials")
        return self.document.reference(primitive, "material", "materials")

    def _change(self, material: int, change: Callable[[Material], Material]) -> int:
        """The index of a material after a change, made once."""
        if (material, change) not in self._changed:
            self._changed[material, change] = len(self.materials.read)
            self.materials.read.append(change(self.materials.read[material]))
        return self._changed[material, change]

    def _mesh(self, name: str, geometry: Geometry, material: int, primitive: Fields) -> Mesh:
        uv_sets = _uv_sets(self.materials.read[material])
        uvs = geometry.uvs
        if uv_sets > len(uvs):
            self.document.notes.add(
                "a texture wants coordinates that its mesh lacks; one texel covers all of it", primitive.place
            )
            missing: FloatArray = np.zeros((len(geometry.positions), 2), np.float32)
            uvs += (missing,) * (uv_sets - len(uvs))
        return Mesh(
            name,
            geometry.positions,
            geometry.faces,
            material,
            geometry.normals,
            uvs,
            geometry.colors,
            tangents=geometry.tangents,
        )


def _is_culled(material: Material) -> bool:
    """Whether glTF shows a material's front faces alone; glass has light on both sides of them."""
    return not (material.double_sided or material.transmission)


def _front_only(material: Material) -> Material:
    return replace(material, front_only=True)


def _faces_inward(geometry: Geometry) -> bool:
    """Whether triangles mostly face the middle of their mesh, as those of rooms seen from outside and of outlines do.

    Back faces of other meshes are drawn: they are seen where a shell is open.
    """
    if geometry.faces.shape[1] < 3:
        return False
    positions = geometry.positions - geometry.positions.min(axis=0)
    positions /= positions.max() or 1.0  # squares of squares of what is left are single-precision numbers
    first, second, third = (positions[geometry.faces[:, corner]] for corner in range(3))
    normals = np.cross(second - first, third - first)
    areas = np.linalg.norm(normals, axis=1)
    total = areas.sum()
    middles = (first + second + third) / 3.0
    outward = middles - areas @ middles / total if total else middles
    return bool(np.vdot(normals, outward) < -_INWARD * (areas @ np.linalg.norm(outward, axis=1)))


def _is_fitted(mesh: Fields) -> bool:
    # Extras may hold anything; only this value of this name means something.
    extras = mesh.values.get("extras")
    return not (isinstance(extras, dict) and extras.get("fitted") is False)


def _has_normals(primitive: Fields) -> bool:
    attributes = primitive.child("attributes")
    return attributes is not None and attributes.has("NORMAL")


def _weights(fields: Fields) -> tuple[float, ...]:
    values = fields.values.get("weights")
    return tuple(fields.numbers("weights", len(values) if isinstance(values, list) else 0) or ())


def _key(primitive: Fields, weights: tuple[float, ...], skin: Skin | None) -> _Key:
    """Equal for primitives of equal geometry: their data, their kind, morph weights, and the skin that holds them."""
    attributes = primitive.child("attributes")
    vertices = [attributes] if attributes is not None else []
    if any(weights):
        vertices += primitive.children("targets")
    sources = tuple(tuple(sorted((key, data.optional_integer(key)) for key in data.values)) for data in vertices)
    shape = (primitive.optional_integer("mode"), primitive.optional_integer("indices"))
    return sources, shape, weights if any(weights) else (), None if skin is None else skin.index


def _uv_sets(material: Material) -> int:
    """Number of texture coordinate sets that the textures of a material need."""
    textures = [value for value in vars(material).values() if isinstance(value, Texture)]
    return max((texture.uv_set + 1 for texture in textures), default=0)
