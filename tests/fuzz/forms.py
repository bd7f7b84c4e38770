"""Inputs of the fuzzed formats taken apart into their JSON trees, and mended where damage would end at a check sum."""

from __future__ import annotations

import hashlib
import json
import struct
import zlib
from collections.abc import Callable
from typing import Any


def png_repaired(data: bytes) -> bytes:
    """Every chunk with its own length, as far as there are bytes, and check sum."""
    place, parts = 8, [data[:8]]
    while place + 12 <= len(data):
        length = min(struct.unpack(">I", data[place : place + 4])[0], len(data) - place - 12)
        body = data[place + 4 : place + 8 + length]
        parts.append(struct.pack(">I", length) + body + struct.pack(">I", zlib.crc32(body)))
        place += 12 + length
    return b"".join(parts)


def tile_repaired(data: bytes) -> bytes:
    """A tile whose lengths and check sum are right."""
    (length,) = struct.unpack("<I", data[8:12].ljust(4, b"\0"))
    length = min(length, max(0, len(data) - 20 - 32))
    body = data[:8] + struct.pack("<IQ", length, max(0, len(data) - 32 - 20 - length)) + data[20:-32]
    return body + hashlib.sha256(body).digest()


def tile_tree(data: bytes) -> tuple[Any, Callable[[bytes], bytes]]:
    (length,) = struct.unpack("<I", data[8:12].ljust(4, b"\0"))
    after = data[20 + length :]
    return json.loads(
        data[20 : 20 + length]
    ), lambda head: data[:8] + struct.pack("<I", len(head)) + data[12:20] + head + after


def glb_tree(data: bytes) -> tuple[Any, Callable[[bytes], bytes]]:
    (length,) = struct.unpack("<I", data[12:16].ljust(4, b"\0"))
    after = data[20 + length :]

    def rebuilt(text: bytes) -> bytes:
        text += b" " * (-len(text) % 4)
        return data[:12] + struct.pack("<I", len(text)) + data[16:20] + text + after

    return json.loads(data[20 : 20 + length]), rebuilt


def glb_repaired(data: bytes) -> bytes:
    return data[:8] + struct.pack("<I", len(data)) + data[12:]


def part_tree(name: bytes) -> Callable[[bytes], Any]:
    """The JSON tree of a file of a packed folder."""
    head = b"=== " + name + b"\n"

    def tree(data: bytes) -> tuple[Any, Callable[[bytes], bytes]]:
        before, _, rest = data.partition(head)
        text, mark, after = rest.partition(b"\n=== ")
        return json.loads(text), lambda changed: before + head + changed + mark + after

    return tree


def body_tree(data: bytes) -> tuple[Any, Callable[[bytes], bytes]]:
    """The JSON tree that a request carries."""
    head, mark, body = data.partition(b"\r\n\r\n")
    return json.loads(body), lambda changed: head + mark + changed
