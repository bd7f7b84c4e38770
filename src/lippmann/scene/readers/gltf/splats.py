"""Gaussian splats in glTF: the extension KHR_gaussian_splatting, and those that compress what it holds as SPZ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lippmann.scene.readers.gltf import accessors as storage
from lippmann.scene.readers.gltf.accessors import Accessors, Storage
from lippmann.scene.readers.gltf.document import SPLATS, SPLATS_DRAFT, SPLATS_IN_SPZ, Document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.splats.activation import ask_memory, clean
from lippmann.scene.readers.splats.spz import decode_spz
from lippmann.scene.splat_clouds import move
from lippmann.scene.values.description import FloatArray, Matrix
from lippmann.scene.values.splats import COEFFICIENTS, Splats, join

_COLOR_SPACES = {"srgb_rec709_display": False, "lin_rec709_display": True}
_POINTS = 0


def is_splats(primitive: Fields) -> bool:
    """Whether a primitive holds Gaussian splats."""
    return any(primitive.extension(name) is not None for name in (SPLATS, SPLATS_DRAFT))


@dataclass(frozen=True, eq=False)
class SplatClouds:
    """The splats of a document, where its nodes place them."""

    document: Document
    accessors: Accessors
    placed: list[tuple[Splats, Matrix]] = field(default_factory=list)

    def add(self, mesh: Fields, worlds: Matrix) -> None:
        """Take over the splats of a mesh at its places ``(k, 4, 4)``.

        Raises
        ------
        SceneError, MemoryLimitError
            Attributes are missing, damaged, or of different lengths; there is less memory.
        """
        for primitive in mesh.children("primitives"):
            if is_splats(primitive):
                splats = self._read(primitive)
                self.placed.extend((splats, world) for world in worlds)

    def join(self) -> Splats | None:
        """All of them in the world; None if there are none.

        Raises
        ------
        SceneError, MemoryLimitError
            They are in different colour spaces; there is less memory.
        """
        if not self.placed:
            return None
        if len({splats.linear for splats, _ in self.placed}) > 1:
            raise self.document.error("splats in several colour spaces", rule="they are composited in one")
        total = sum(splats.count for splats, _ in self.placed)
        ask_memory(total, max(splats.harmonics.shape[1] for splats, _ in self.placed), where=self.document.file)
        return join([move(splats, world) for splats, world in self.placed])

    def _read(self, primitive: Fields) -> Splats:
        if primitive.optional_integer("mode") != _POINTS:
            raise primitive.error("mode", "splats are points, 0")
        draft, extension = primitive.extension(SPLATS_DRAFT), primitive.extension(SPLATS)
        if draft is not None:
            return self._unpack(draft, primitive)
        assert extension is not None
        kernel, space = extension.text("kernel"), extension.text("colorSpace")
        if kernel not in (None, "ellipse"):
            self.document.notes.add(f"splats of the kernel {kernel[:40]} are drawn as Gaussians", primitive.place)
        if space is not None and space not in _COLOR_SPACES:
            self.document.notes.add(f"splats of the colour space {space[:40]} are taken as sRGB", primitive.place)
        is_linear = _COLOR_SPACES.get(space or "", False)
        for name in SPLATS_IN_SPZ:
            packed = extension.extension(name)
            if packed is not None:
                return self._unpack(packed, primitive)
        attributes = primitive.child("attributes")
        if attributes is None:
            raise primitive.error("attributes", "it is required")
        position = self.document.required_reference(attributes, "POSITION", "accessors")
        count = self.accessors.count(position)
        degree = self._degree(attributes)
        ask_memory(count, COEFFICIENTS[degree], where=self.document.file)
        scales = self._values(attributes, "SCALE", storage.SPLAT_SCALE, count)
        if (scales < 0.0).any():
            # Drafts of the extension had logarithms, as trainers do.
            with np.errstate(over="ignore"):
                scales = np.exp(scales)
        splats, notes = clean(
            self.accessors.floats(position, storage.POSITION),
            scales,
            self._values(attributes, "ROTATION", storage.ROTATION, count),
            self._values(attributes, "OPACITY", storage.SPLAT_OPACITY, count)[:, 0],
            self._harmonics(attributes, degree, count),
            linear=is_linear,
            where=self.document.file,
        )
        self._note(notes, primitive)
        return splats

    def _unpack(self, packed: Fields, primitive: Fields) -> Splats:
        view = self.document.required_reference(packed, "bufferView", "bufferViews")
        data, _ = self.accessors.buffers.view(view)
        decoded, notes, _ = decode_spz(data, where=self.document.file)
        self._note(notes, primitive)
        return decoded

    def _note(self, notes: Sequence[str], primitive: Fields) -> None:
        for note in notes:
            self.document.notes.add(note, primitive.place)

    def _degree(self, attributes: Fields) -> int:
        """The degree of the harmonics, which are there up to it."""
        return max(degree for degree in range(len(COEFFICIENTS)) if degree == 0 or attributes.has(_harmonic(degree, 0)))

    def _harmonics(self, attributes: Fields, degree: int, count: int) -> FloatArray:
        names = [(own, place) for own in range(degree + 1) for place in range(2 * own + 1)]
        harmonics = np.empty((count, len(names), 3), np.float32)
        for number, (own, place) in enumerate(names):
            name = _harmonic(own, place).removeprefix(f"{SPLATS}:")
            harmonics[:, number] = self._values(attributes, name, storage.SPLAT_HARMONIC, count)
        return harmonics

    def _values(self, attributes: Fields, name: str, kind: Storage, count: int) -> FloatArray:
        key = f"{SPLATS}:{name}"
        index = self.document.required_reference(attributes, key, "accessors")
        if self.accessors.count(index) != count:
            raise attributes.error(key, f"that accessor has {self.accessors.count(index)} elements for {count} splats")
        return self.accessors.floats(index, kind)


def _harmonic(degree: int, place: int) -> str:
    return f"{SPLATS}:SH_DEGREE_{degree}_COEF_{place}"
