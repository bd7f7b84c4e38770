"""A writer of small glTF files, independent of the reader under test."""

from __future__ import annotations

import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

from lippmann.scene.readers.gltf import read_gltf

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


class Writer:
    """Collects JSON and bytes; ``json`` may be changed at will before the file is written."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}}
        self.data = bytearray()

    def add(self, kind: str, **values: Any) -> int:
        """Append to a top-level list; the index."""
        self.json.setdefault(kind, []).append(values)
        return len(self.json[kind]) - 1

    def view(self, data: bytes, **values: Any) -> int:
        self.data += bytes(-len(self.data) % 4)
        offset = len(self.data)
        self.data += data
        return self.add("bufferViews", buffer=0, byteOffset=offset, byteLength=len(data), **values)

    def accessor(self, values: Any, dtype: str = "f4", **more: Any) -> int:
        array = np.array(values, f"<{dtype}")
        width = 1 if array.ndim == 1 else array.shape[1]
        view = self.view(array.tobytes())
        return self.add(
            "accessors",
            bufferView=view,
            componentType=COMPONENTS[dtype],
            count=len(array),
            type=SHAPES[width],
            **more,
        )

    def mesh(self, positions: Any = TRIANGLE, **primitive: Any) -> int:
        """A mesh of one primitive; ``attributes`` are added to the positions."""
        attributes = {"POSITION": self.accessor(positions), **primitive.pop("attributes", {})}
        return self.add("meshes", primitives=[{"attributes": attributes, **primitive}])

    def node(self, **values: Any) -> int:
        return self.add("nodes", **values)

    def triangle(self, **primitive: Any) -> Writer:
        """One triangle on one node."""
        self.node(mesh=self.mesh(**primitive))
        return self

    def png(self, pixels: Any) -> bytes:
        stream = io.BytesIO()
        Pillow.fromarray(np.array(pixels, np.uint8)).save(stream, "PNG")
        return stream.getvalue()

    def texture(self, pixels: Any, **more: Any) -> int:
        view = self.view(self.png(pixels))
        image = self.add("images", bufferView=view, mimeType="image/png")
        return self.add("textures", source=image, **more)

    def _finished(self, **buffer: Any) -> bytes:
        if "nodes" in self.json:
            children = {child for node in self.json["nodes"] for child in node.get("children", [])}
            roots = [i for i in range(len(self.json["nodes"])) if i not in children]
            self.json.setdefault("scenes", [{"nodes": roots}])
        if self.data:
            self.json.setdefault("buffers", [{"byteLength": len(self.data), **buffer}])
        return json.dumps(self.json).encode()

    def glb(self) -> bytes:
        text = self._finished()
        text += b" " * (-len(text) % 4)
        data = bytes(self.data) + bytes(-len(self.data) % 4)
        body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body

    def gltf(self) -> bytes:
        return self._finished(uri="data:application/octet-stream;base64," + base64.b64encode(self.data).decode())

    def gltf_and_bin(self, folder: Path, name: str = "scene.bin") -> Path:
        (folder / name).write_bytes(self.data)
        path = folder / "scene.gltf"
        path.write_bytes(self._finished(uri=name.replace(" ", "%20")))
        return path


@pytest.fixture
def writer() -> Writer:
    return Writer()


@pytest.fixture
def read(tmp_path):
    """Reads what a writer, or some bytes, make up as a file."""

    def read_it(source, name="scene.glb"):
        path = tmp_path / name
        path.write_bytes(source if isinstance(source, bytes) else source.glb())
        return read_gltf(path)

    return read_it


def world_points(scene, instance=None):
    """Vertices of all placements, or of one, in the world."""
    placements = [(each.mesh, place) for each in scene.instances for place in each.world_from_mesh.reshape(-1, 4, 4)]
    if instance is not None:
        placements = [placements[instance]]
    return np.concatenate([scene.meshes[mesh].positions @ place[:3, :3].T + place[:3, 3] for mesh, place in placements])


@pytest.fixture(name="world_points")
def _world_points():
    return world_points
