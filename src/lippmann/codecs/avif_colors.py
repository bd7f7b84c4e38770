"""Code points of the colours of AVIF pictures (ISO/IEC 14496-12, 12.1.5), which Pillow does not tell."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import BinaryIO

_HEAD, _LONG = struct.Struct(">I4s"), struct.Struct(">Q")
_COLORS = struct.Struct(">4sHH")


def code_points(file: BinaryIO) -> tuple[int, int] | None:
    """Primaries and transfer function by ITU-T H.273 of an open file; None where it does not say them."""
    file.seek(0)
    body = dict(_boxes(memoryview(file.read()))).get(b"meta", memoryview(b""))[4:]  # after version and flags
    for name in (b"iprp", b"ipco"):
        body = dict(_boxes(body)).get(name, memoryview(b""))
    for kind, content in _boxes(body):
        if kind == b"colr" and len(content) >= _COLORS.size:
            form, primaries, transfer = _COLORS.unpack_from(content)
            if form == b"nclx":
                return primaries, transfer
    return None


def _boxes(data: memoryview) -> Iterator[tuple[bytes, memoryview]]:
    """Kinds and contents of boxes, one after the other; of damaged ones those that come before."""
    place = 0
    while place + _HEAD.size <= len(data):
        size, kind = _HEAD.unpack_from(data, place)
        begin = place + _HEAD.size
        if size == 1 and begin + _LONG.size <= len(data):
            (size,) = _LONG.unpack_from(data, begin)
            begin += _LONG.size
        elif size == 0:  # up to the end
            size = len(data) - place
        if size < begin - place:
            return
        yield kind, data[begin : place + size]
        place += size
