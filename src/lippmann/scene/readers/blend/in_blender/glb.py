"""GLB files: the JSON and the bytes that they hold."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_MAGIC, _VERSION = b"glTF", 2
_JSON, _BIN = b"JSON", b"BIN\0"
_HEAD = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")


@dataclass
class Glb:
    """A glTF document and the bytes of its one buffer."""

    root: dict[str, Any]
    data: bytearray

    @classmethod
    def read(cls, path: Path) -> Glb:
        """The content of a file that Blender's exporter wrote."""
        content = path.read_bytes()
        size, _ = _CHUNK.unpack_from(content, _HEAD.size)
        begin = _HEAD.size + _CHUNK.size
        root = json.loads(content[begin : begin + size])
        return cls(root, bytearray(content[begin + size + _CHUNK.size :]))

    def write(self, path: Path) -> None:
        """Write the file."""
        self.data.extend(bytes(-len(self.data) % 4))
        if self.data:
            self.root.setdefault("buffers", [{}])[0]["byteLength"] = len(self.data)
        text = json.dumps(self.root, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = _CHUNK.pack(len(text), _JSON) + text
        if self.data:
            chunks += _CHUNK.pack(len(self.data), _BIN) + self.data
        path.write_bytes(_HEAD.pack(_MAGIC, _VERSION, _HEAD.size + len(chunks)) + chunks)

    def append(self, kind: str, value: dict[str, Any]) -> int:
        """Add an element to a list of the document, and give its index."""
        elements = self.root.setdefault(kind, [])
        elements.append(value)
        return len(elements) - 1

    def add_view(self, data: bytes) -> int:
        """Add bytes to the buffer, and give the index of their buffer view."""
        self.data.extend(bytes(-len(self.data) % 4))
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.data.extend(data)
        return self.append("bufferViews", view)

    def use_extension(self, name: str) -> None:
        """Say that the document uses an extension."""
        used = self.root.setdefault("extensionsUsed", [])
        if name not in used:
            used.append(name)
