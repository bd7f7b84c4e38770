"""Meshes that are compressed by Draco (KHR_draco_mesh_compression), decoded by the library ``DracoPy``.

All of a file's are decoded at once, in a process of its own: the decoder is native code, and damaged data must not end
more than that.
"""

from __future__ import annotations

import io
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.child_python import python_command
from lippmann.runtime.machine import input_memory_left
from lippmann.scene.readers.gltf.buffers import Buffers
from lippmann.scene.readers.gltf.document import DECOMPRESS, DRACO, Document
from lippmann.scene.readers.gltf.draco_child import HEADER
from lippmann.scene.readers.gltf.json_fields import Fields

_CODE = "from lippmann.scene.readers.gltf.draco_child import main; main()"
#: Seconds that decoding a file may take.
_MOST_SECONDS = 300


@dataclass(frozen=True, eq=False)
class DracoMeshes:
    """The compressed meshes of a document; decoded when the first is asked for."""

    document: Document
    buffers: Buffers
    _decoded: dict[str, NDArray[np.generic]] = field(default_factory=dict)

    def decode(self, primitive: Fields) -> Mapping[int, NDArray[np.generic]]:
        """The elements ``(count, width)`` of a compressed primitive's accessors, by their index.

        There may be other counts than the accessors say, as encoders of before 2019 wrote them: the extension lets
        what was decompressed be rendered as it is.

        Raises
        ------
        SceneError
            The data is damaged, or lacks an attribute.
        """
        draco = primitive.extension(DRACO)
        assert draco is not None
        view = self.document.required_reference(draco, "bufferView", "bufferViews")
        if not self._decoded:
            self._decoded.update(self._decode_all())
        if f"{view}/error" in self._decoded or f"{view}/faces" not in self._decoded:
            why = self._decoded.get(f"{view}/error", "it holds no mesh")
            raise self._error(primitive, f"is no mesh that Draco decodes: {why}")
        elements: dict[int, NDArray[np.generic]] = {}
        index = self.document.reference(primitive, "indices", "accessors")
        if index is not None:
            elements[index] = self._decoded[f"{view}/faces"].reshape(-1, 1)
        attributes, numbers = primitive.child("attributes"), draco.child("attributes")
        if attributes is None or numbers is None:
            raise self._error(primitive, "names no attributes")
        for name in numbers.names():
            accessor = self.document.reference(attributes, name, "accessors")
            values = self._decoded.get(f"{view}/{numbers.integer(name)}")
            if accessor is None or values is None:
                raise self._error(primitive, f"has no attribute {name}")
            elements[accessor] = values
        return elements

    def _decode_all(self) -> dict[str, NDArray[np.generic]]:
        views = {
            self.document.required_reference(draco, "bufferView", "bufferViews")
            for mesh in self.document.all("meshes")
            for primitive in mesh.children("primitives")
            if (draco := primitive.extension(DRACO)) is not None
        }
        blocks = {view: bytes(self.buffers.view(view)[0]) for view in sorted(views)}
        given = b"".join(HEADER.pack(view, len(data)) + data for view, data in blocks.items())
        command, environment = python_command(_CODE, str(input_memory_left()))
        try:
            done = subprocess.run(command, input=given, capture_output=True, env=environment, timeout=_MOST_SECONDS)
        except subprocess.TimeoutExpired:
            raise self._failure(f"takes more than {_MOST_SECONDS} s") from None
        if done.returncode != 0:
            raise self._failure(f"ended with the exit status {done.returncode}")
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as arrays:
            return dict(arrays)

    def _failure(self, what: str) -> SceneError:
        return self.document.error(f"the decoder of Draco {what}", rule="the data may be damaged", fix=DECOMPRESS)

    def _error(self, primitive: Fields, what: str) -> SceneError:
        return self.document.error(f"{primitive.place}.extensions.{DRACO} {what}", fix=DECOMPRESS)
