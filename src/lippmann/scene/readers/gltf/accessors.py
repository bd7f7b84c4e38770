"""Accessors: typed arrays in the bytes of a glTF file (glTF 2.0, section 3.6.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.engine_lock import cached_property
from lippmann.runtime.machine import check_input
from lippmann.scene.readers.gltf.buffers import Buffers
from lippmann.scene.readers.gltf.document import Document
from lippmann.scene.readers.gltf.draco import DracoMeshes
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.values.description import FloatArray

_BYTE, _UNSIGNED_BYTE, _SHORT, _UNSIGNED_SHORT, _UNSIGNED_INT, _FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
_DTYPES: dict[int, np.dtype[np.generic]] = {
    _BYTE: np.dtype("<i1"),
    _UNSIGNED_BYTE: np.dtype("<u1"),
    _SHORT: np.dtype("<i2"),
    _UNSIGNED_SHORT: np.dtype("<u2"),
    _UNSIGNED_INT: np.dtype("<u4"),
    _FLOAT: np.dtype("<f4"),
}
_COMPONENT_NAMES = {5120: "BYTE", 5121: "UNSIGNED_BYTE", 5122: "SHORT", 5123: "UNSIGNED_SHORT", 5125: "UNSIGNED_INT"}
_COMPONENT_NAMES[_FLOAT] = "FLOAT"
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}

# An accessor without bytes of its own stands for zeros; this many elements at most, so that a few characters of JSON
# cannot ask for all the memory there is.
_MOST_ZEROS = 1 << 22


@dataclass(frozen=True)
class Storage:
    """In which shapes and component types a kind of data may be stored.

    ``plain`` types hold the values themselves, ``normalized`` ones integers that stand for [0, 1] or [-1, 1];
    ``quantized`` are the further ones, normalised or not, that KHR_mesh_quantization allows.
    """

    shapes: tuple[str, ...]
    plain: frozenset[int] = frozenset({_FLOAT})
    normalized: frozenset[int] = frozenset()
    quantized_plain: frozenset[int] = frozenset()
    quantized_normalized: frozenset[int] = frozenset()
    always_normalized: bool = False


_UNSIGNED = frozenset({_UNSIGNED_BYTE, _UNSIGNED_SHORT})
_SIGNED = frozenset({_BYTE, _SHORT})

POSITION = Storage(("VEC3",), quantized_plain=_UNSIGNED | _SIGNED, quantized_normalized=_UNSIGNED | _SIGNED)
NORMAL = Storage(("VEC3",), quantized_normalized=_SIGNED)
TANGENT = Storage(("VEC4",), quantized_normalized=_SIGNED)
TEXCOORD = Storage(
    ("VEC2",), normalized=_UNSIGNED, quantized_plain=_UNSIGNED | _SIGNED, quantized_normalized=_UNSIGNED | _SIGNED
)
# Some writers forget to mark their integer colours and weights as normalised, which is what they must be.
COLOR = Storage(("VEC3", "VEC4"), normalized=_UNSIGNED, always_normalized=True)
WEIGHTS = Storage(("VEC4",), normalized=_UNSIGNED, always_normalized=True)
JOINTS = Storage(("VEC4",), plain=_UNSIGNED)
INDICES = Storage(("SCALAR",), plain=_UNSIGNED | {_UNSIGNED_INT})
INVERSE_BIND_MATRICES = Storage(("MAT4",))
POSITION_CHANGE = Storage(("VEC3",), quantized_plain=_SIGNED, quantized_normalized=_SIGNED)
NORMAL_CHANGE = Storage(("VEC3",), quantized_normalized=_SIGNED)
TEXCOORD_CHANGE = Storage(("VEC2",), normalized=_UNSIGNED | _SIGNED, quantized_plain=_SIGNED)
COLOR_CHANGE = Storage(("VEC3", "VEC4"), normalized=_UNSIGNED | _SIGNED, always_normalized=True)
TRANSLATION = Storage(("VEC3",))
ROTATION = Storage(("VEC4",), normalized=_SIGNED)
SCALE = Storage(("VEC3",))
# Of Gaussian splats, whose every number may be quantised (KHR_gaussian_splatting).
SPLAT_SCALE = Storage(("VEC3",), plain=frozenset({_FLOAT}) | _UNSIGNED | _SIGNED, normalized=_UNSIGNED | _SIGNED)
SPLAT_OPACITY = Storage(("SCALAR",), normalized=_UNSIGNED)
SPLAT_HARMONIC = Storage(("VEC3",), normalized=_UNSIGNED | _SIGNED)
# Of animations.
KEY_TIMES = Storage(("SCALAR",))
KEY_ROTATION = Storage(("VEC4",), normalized=_SIGNED | _UNSIGNED)
KEY_WEIGHTS = Storage(("SCALAR",), normalized=_SIGNED | _UNSIGNED)


@dataclass(frozen=True, eq=False)
class Accessors:
    """The accessors of a document; each is decoded once and its array shared."""

    document: Document
    buffers: Buffers
    decoded: Mapping[int, NDArray[np.generic]] = field(default_factory=dict)
    _floats: dict[tuple[int, Storage], FloatArray] = field(default_factory=dict)

    @cached_property
    def draco(self) -> DracoMeshes:
        """The document's compressed meshes."""
        return DracoMeshes(self.document, self.buffers)

    def with_decoded(self, decoded: Mapping[int, NDArray[np.generic]]) -> Accessors:
        """The same, but for accessors whose elements ``(count, width)`` were decoded elsewhere."""
        return Accessors(self.document, self.buffers, decoded)

    def count(self, index: int) -> int:
        """The number of elements."""
        decoded = self.decoded.get(index)
        return len(decoded) if decoded is not None else self.document.all("accessors")[index].integer("count")

    def floats(self, index: int, storage: Storage) -> FloatArray:
        """Elements as float32 ``(count, width)``; normalised integers become [0, 1] or [-1, 1].

        Raises
        ------
        SceneError
            The accessor is stored in another way than ``storage`` allows, or reaches beyond its buffer.
        """
        key = (index, storage)
        if key not in self._floats:
            fields = self.document.all("accessors")[index]
            normalized = self._check(fields, storage)
            raw = self._elements_of(index, fields)
            check_input(4 * raw.size, fields.place, where=self.document.file)
            self._floats[key] = _normalize(raw) if normalized else _canonicalize_nan(raw.astype(np.float32))
        return self._floats[key]

    def integers(self, index: int, storage: Storage) -> NDArray[np.uint32]:
        """Elements as uint32 ``(count, width)``; errors as for :meth:`floats`."""
        fields = self.document.all("accessors")[index]
        self._check(fields, storage)
        raw = self._elements_of(index, fields)
        check_input(4 * raw.size, fields.place, where=self.document.file)
        return raw.astype(np.uint32)

    def _elements_of(self, index: int, fields: Fields) -> NDArray[np.generic]:
        elements = self.decoded.get(index)
        if elements is None:
            return self._elements(fields)
        width, dtype = _WIDTHS[str(fields.text("type"))], _DTYPES[fields.integer("componentType")]
        if dtype.kind != "f" and elements.dtype.kind == "f":  # old encoders saved joints as floats, and quantised them
            elements = np.rint(elements)
        with np.errstate(invalid="ignore"):
            converted: NDArray[np.generic] = elements.astype(dtype)
        fits = elements.dtype.kind == "f" if dtype.kind == "f" else bool((converted == elements).all())
        if elements.shape[1] != width or not fits:
            raise fields.error("type", f"what was decoded for it is {elements.shape[1]} x {elements.dtype}")
        return converted

    def _check(self, fields: Fields, storage: Storage) -> bool:
        """Whether the (allowed) storage of an accessor is normalised."""
        if fields.text("type") not in storage.shapes:
            raise fields.error("type", f"{' or '.join(storage.shapes)} belongs here")
        component = fields.integer("componentType")
        is_normalized = fields.flag("normalized")
        plain, normalized = storage.plain, storage.normalized
        if self._is_quantized:
            plain, normalized = plain | storage.quantized_plain, normalized | storage.quantized_normalized
        # Marking floats as normalised is an error that changes nothing.
        if component in plain and (not is_normalized or component == _FLOAT):
            return False
        if component in normalized and (is_normalized or storage.always_normalized):
            return True
        allowed = [_COMPONENT_NAMES[code] for code in sorted(plain)]
        allowed += [f"normalised {_COMPONENT_NAMES[code]}" for code in sorted(normalized)]
        raise fields.error(
            "componentType", f"{', '.join(allowed)} belongs here (normalized is {str(is_normalized).lower()})"
        )

    @property
    def _is_quantized(self) -> bool:
        return "KHR_mesh_quantization" in self.document.root.texts("extensionsUsed")

    def _elements(self, fields: Fields) -> NDArray[np.generic]:
        """The elements ``(count, width)`` as stored, sparse replacements included."""
        count, width = fields.integer("count"), _WIDTHS[str(fields.text("type"))]
        dtype = _DTYPES[fields.integer("componentType")]
        view = self.document.reference(fields, "bufferView", "bufferViews")
        if view is not None:
            elements = self._view_strided(fields, view, count, width, dtype)
        elif count <= _MOST_ZEROS:
            elements = np.zeros((count, width), dtype)
        else:
            raise fields.error("count", f"an accessor without bufferView has at most {_MOST_ZEROS} elements")
        sparse = fields.child("sparse")
        return elements if sparse is None else self._apply_sparse(elements, sparse)

    def _apply_sparse(self, elements: NDArray[np.generic], sparse: Fields) -> NDArray[np.generic]:
        """A copy of ``elements`` with the sparse ones put in."""
        count = sparse.integer("count")
        if count > len(elements):
            raise sparse.error("count", f"the accessor has {len(elements)} elements")
        indices, values = sparse.child("indices"), sparse.child("values")
        if indices is None or values is None:
            raise sparse.error("indices" if indices is None else "values", "it is required")
        component = indices.integer("componentType")
        if component not in INDICES.plain:
            raise indices.error("componentType", "UNSIGNED_BYTE, UNSIGNED_SHORT or UNSIGNED_INT belongs here")
        index_view = self.document.required_reference(indices, "bufferView", "bufferViews")
        places = self._view_strided(indices, index_view, count, 1, _DTYPES[component])[:, 0].astype(np.int64)
        if count and places.max() >= len(elements):
            raise sparse.error("indices", f"{places.max()} points beyond the accessor's {len(elements)} elements")
        value_view = self.document.required_reference(values, "bufferView", "bufferViews")
        result = elements.copy()
        result[places] = self._view_strided(values, value_view, count, elements.shape[1], elements.dtype)
        return result

    def _view_strided(
        self, fields: Fields, view: int, count: int, width: int, dtype: np.dtype[np.generic]
    ) -> NDArray[np.generic]:
        """``count`` elements in a buffer view, without copying; the bounds are checked before anything is allocated."""
        data, stride = self.buffers.view(view)
        size = width * dtype.itemsize
        step = stride or size
        if step < size:
            raise self.document.all("bufferViews")[view].error("byteStride", f"its elements take {size} bytes each")
        offset = fields.optional_integer("byteOffset") or 0
        end = offset + (count - 1) * step + size if count else 0
        if end > len(data):
            raise self.document.error(
                f"{fields.place} ends at byte {end}", rule=f"its buffer view holds {len(data)} bytes"
            )
        if not count:
            return np.zeros((0, width), dtype)
        return np.ndarray((count, width), dtype, buffer=data, offset=offset, strides=(step, dtype.itemsize))


def _canonicalize_nan(values: FloatArray) -> FloatArray:
    """The same with quiet NaNs only: converting a signalling one raises a floating-point warning."""
    missing = np.isnan(values)
    return np.where(missing, np.float32(np.nan), values) if missing.any() else values


def _normalize(raw: NDArray[np.generic]) -> FloatArray:
    """Normalised integers as numbers; the most negative value is cut to -1 (glTF 2.0, section 3.6.2.2)."""
    bits = 8 * raw.dtype.itemsize - (raw.dtype.kind == "i")
    values: FloatArray = raw.astype(np.float32) / np.float32(2**bits - 1)
    return np.maximum(values, np.float32(-1.0))
