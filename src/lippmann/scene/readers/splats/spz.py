"""SPZ, Niantic's compressed splats: versions 1 to 3 (github.com/nianticlabs/spz).

A gzip stream of one section after the other: places as fixed-point numbers of 24 bits, opacities, colours, logarithms
of standard deviations, rotations and coefficients in bytes. Its axes are x right, y up, z toward the viewer.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from lippmann.errors import SceneError
from lippmann.runtime.input_memory import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.readers.splats.activation import MOST_SMALL, Bytes, activated, ask_memory, largest_left_out
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import COEFFICIENTS, FloatArray, Splats

_HEADER = struct.Struct("<4sIIBBBB")
_GZIP = b"\x1f\x8b"
_MAGIC = b"NGSP"
_VERSIONS = (1, 2, 3)
_MOST_FRACTION = 24
#: Colours are stored so that those somewhat beyond black and white find room, too.
_COLOR_SCALE = 0.15


def read_spz(path: Path, *, allow_outside: bool = False) -> SceneDescription:
    """Read an SPZ file. It names no other file.

    Raises
    ------
    SceneError, MemoryLimitError
        The file is missing, foreign, damaged, of another version, or takes more memory than is left.
    """
    del allow_outside
    splats, notes = decode_spz(read_bytes(path), where=path.name)
    return SceneDescription(path.stem, splats=splats, notes=notes)


def decode_spz(data: bytes | memoryview, *, where: str) -> tuple[Splats, tuple[str, ...]]:
    """The splats of the bytes of an SPZ file, and notes.

    Raises
    ------
    SceneError, MemoryLimitError
        As :func:`read_spz`.
    """
    if bytes(data[:4]) == _MAGIC:
        raise SceneError(
            "is SPZ of version 4 or later",
            where=where,
            rule="versions 1 to 3 are read",
            fix="save it as version 3, or as .ply",
        )
    if bytes(data[:2]) != _GZIP:
        raise SceneError("is no SPZ file", where=where, rule="one begins as gzip does")
    stream = zlib.decompressobj(16 + zlib.MAX_WBITS)
    head = _unpacked(stream, data, _HEADER.size, where)
    magic, version, count, degree, fraction, _, _ = _HEADER.unpack(head)
    if magic != _MAGIC:
        raise SceneError("is no SPZ file", where=where, rule="what it packs begins with 'NGSP'")
    if version not in _VERSIONS:
        raise SceneError(f"is SPZ of version {version}", where=where, rule="versions 1 to 3 are read")
    if degree >= len(COEFFICIENTS) or fraction > _MOST_FRACTION:
        raise SceneError(
            f"harmonics of degree {degree} and places with {fraction} fractional bits", where=where, rule="0 to 3, 24"
        )
    coefficients = COEFFICIENTS[degree]
    # Version 1 has places in half precision.
    sizes = [6 if version == 1 else 9, 1, 3, 3, 4 if version == 3 else 3, 3 * (coefficients - 1)]
    check_input(count * sum(sizes), f"{count} Gaussian splats", where=where)
    ask_memory(count, coefficients, where=where)
    body = np.frombuffer(_unpacked(stream, stream.unconsumed_tail, count * sum(sizes), where), np.uint8)
    sections = np.split(body, count * np.cumsum(sizes)[:-1])
    places, alphas, colors, scales, turns, rest = (
        part.reshape(count, size) for part, size in zip(sections, sizes, strict=True)
    )
    harmonics = np.empty((count, coefficients, 3), np.float32)
    harmonics[:, 0] = (colors.astype(np.float32) / 255.0 - 0.5) / _COLOR_SCALE
    harmonics[:, 1:] = (rest.astype(np.float32).reshape(count, coefficients - 1, 3) - 128.0) / 128.0
    return activated(
        _halves(places) if version == 1 else _fixed_point(places, fraction),
        scales.astype(np.float32) / 16.0 - 10.0,
        _smallest_three(turns) if version == 3 else _first_three(turns),
        alphas[:, 0].astype(np.float32) / np.float32(255.0),
        harmonics,
        where=where,
    )


def _unpacked(stream: zlib._Decompress, data: bytes | memoryview, size: int, where: str) -> bytes:
    """The next ``size`` bytes of a stream, and no more than those."""
    try:
        found = stream.decompress(data, size) if size else b""
    except zlib.error as error:
        raise SceneError(f"is damaged ({error})", where=where) from None
    if len(found) < size:
        raise SceneError(f"is cut short: {len(found)} of {size} bytes", where=where, fix="copy it anew")
    return found


def _fixed_point(places: Bytes, fraction: int) -> FloatArray:
    """``(n, 3)`` of three signed numbers of 24 bits each, so many of which are behind the point."""
    parts = places.reshape(-1, 3, 3).astype(np.int32)
    values = parts[..., 0] | parts[..., 1] << 8 | parts[..., 2] << 16
    values = np.where(values >= 1 << 23, values - (1 << 24), values)
    return values.astype(np.float32) / np.float32(2**fraction)


def _halves(places: Bytes) -> FloatArray:
    with np.errstate(invalid="ignore"):  # of damaged numbers, which are left out
        return np.ascontiguousarray(places).view("<f2").astype(np.float32)


def _first_three(turns: Bytes) -> FloatArray:
    """Quaternions whose x, y and z are stored; w is 0 or more."""
    return largest_left_out(turns.astype(np.float32) / np.float32(127.5) - 1.0, np.full(len(turns), 3))


def _smallest_three(turns: Bytes) -> FloatArray:
    """Quaternions in 32 bits: the place of the largest component, then signs and magnitudes of the others."""
    words = np.ascontiguousarray(turns).view("<u4")[:, 0]
    parts = np.stack([words >> np.uint32(20), words >> np.uint32(10), words], axis=1) & np.uint32(1023)
    magnitudes = (parts & np.uint32(511)).astype(np.float32) / np.float32(511.0) * MOST_SMALL
    return largest_left_out(np.where(parts >> np.uint32(9) == 1, -magnitudes, magnitudes), words >> np.uint32(30))
