"""Bytes that a glTF file carries or names: buffers, views of them, data URIs, files beside it."""

from __future__ import annotations

import base64
import binascii
import re
from urllib.parse import unquote

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.readers.gltf.document import DECOMPRESS, MESHOPT, Document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.gltf.meshopt import MeshoptError, decompress

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")  # two letters or more: "C:" is a Windows drive


def read_uri(document: Document, uri: str, place: str, what: str) -> tuple[bytes, str]:
    """The bytes that a URI stands for, and a name for them.

    Parameters
    ----------
    place:
        Where in the file the URI stands.
    what:
        The kind of thing, such as "texture".

    Raises
    ------
    SceneError
        The URI is damaged, points to the network, to a file that is not found, or out of the scene's folder.
    """
    if uri[:5].lower() == "data:":
        return _decode_data_uri(document, uri, place), place
    if _SCHEME.match(uri) or uri.startswith("//"):
        raise document.error(
            f"{what} '{uri[:80]}' is not a file in the scene's folder",
            rule="nothing is fetched from the network",
            fix="save it beside the scene and name it there",
        )
    name = unquote(uri)
    path = document.named.find(name, where=document.file, what=what)
    return read_bytes(path), name


def _decode_data_uri(document: Document, uri: str, place: str) -> bytes:
    header, comma, payload = uri.partition(",")
    if not comma or not header.lower().endswith(";base64"):
        raise document.error(f"the data URI of {place} is damaged", rule="it must hold base64 data")
    try:
        return base64.b64decode(unquote(payload) if "%" in payload else payload, validate=True)
    except (binascii.Error, ValueError) as error:
        raise document.error(f"the data URI of {place} is damaged ({error})", rule="it must hold base64") from None


class Buffers:
    """The buffers of a document, each read when first used and kept once."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._loaded: dict[int, memoryview] = {}
        self._views: dict[int, memoryview] = {}

    def all(self) -> list[bytes]:
        """Every buffer that holds anything; raises as :meth:`view`."""
        buffers = self._document.all("buffers")
        return [bytes(self._buffer(index)) for index in range(len(buffers)) if not self._is_placeholder(index)]

    def view(self, index: int) -> tuple[memoryview, int | None]:
        """The bytes of ``bufferViews[index]``, decompressed, and its stride in bytes, if it has one.

        Raises
        ------
        SceneError
            The view reaches beyond its buffer, or the buffer cannot be read, or its compressed bytes are damaged.
        """
        fields = self._document.all("bufferViews")[index]
        if index not in self._views:
            compressed = next((how for name in MESHOPT if (how := fields.extension(name)) is not None), None)
            self._views[index] = self._slice(fields) if compressed is None else self._decompress(fields, compressed)
        return self._views[index], fields.optional_integer("byteStride")

    def _is_placeholder(self, index: int) -> bool:
        """Whether a buffer is there only because compressed views have to name one."""
        used = self._document.root.texts("extensionsUsed")
        has_chunk = index == 0 and self._document.binary_chunk is not None
        return any(name in used for name in MESHOPT) and not (
            has_chunk or self._document.all("buffers")[index].has("uri")
        )

    def _decompress(self, fields: Fields, compressed: Fields) -> memoryview:
        count, stride = compressed.integer("count"), compressed.integer("byteStride")
        mode = compressed.text("mode")
        if mode is None:
            raise compressed.error("mode", "it is required")
        if fields.integer("byteLength") != count * stride:
            raise fields.error("byteLength", f"{count} elements of {stride} bytes belong here")
        check_input(2 * count * stride, f"{fields.place}, decompressed,", where=self._document.file)
        data = bytes(self._slice(compressed))
        try:
            return memoryview(decompress(data, mode, compressed.text("filter") or "NONE", count, stride))
        except MeshoptError as error:
            if not self._is_placeholder(self._document.required_reference(fields, "buffer", "buffers")):
                return self._slice(fields)
            raise self._document.error(f"{fields.place} cannot be decompressed ({error})", fix=DECOMPRESS) from None

    def _slice(self, fields: Fields) -> memoryview:
        buffer = self._buffer(self._document.required_reference(fields, "buffer", "buffers"))
        offset = fields.optional_integer("byteOffset") or 0
        length = fields.integer("byteLength")
        if offset + length > len(buffer):
            raise self._document.error(
                f"{fields.place} ends at byte {offset + length}", rule=f"its buffer holds {len(buffer)} bytes"
            )
        return buffer[offset : offset + length]

    def _buffer(self, index: int) -> memoryview:
        if index not in self._loaded:
            self._loaded[index] = self._load(index)
        return self._loaded[index]

    def _load(self, index: int) -> memoryview:
        fields = self._document.all("buffers")[index]
        length = fields.integer("byteLength")
        uri = fields.text("uri")
        if uri is not None:
            data, name = read_uri(self._document, uri, fields.place, "buffer")
            content = memoryview(data)
        elif index == 0 and self._document.binary_chunk is not None:
            content, name = self._document.binary_chunk, "binary chunk"
        else:
            raise fields.error("uri", "only the first buffer of a .glb file does without one")
        if len(content) < length:
            raise SceneError(
                f"{fields.place} ({name}) holds {len(content)} of {length} bytes",
                where=self._document.file,
                fix="copy it anew",
            )
        return content[:length]
