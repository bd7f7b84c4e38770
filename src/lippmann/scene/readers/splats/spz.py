"""SPZ, Niantic's compressed splats: versions 1 to 4 (github.com/nianticlabs/spz).

One section after the other: places as fixed-point numbers of 24 bits, opacities, colours, logarithms of standard
deviations, rotations and coefficients in bytes. Up to version 3 a gzip stream holds head and sections. In version 4 the
head stands in plain, then extensions, a table of sizes, and each section that is not empty as a Zstandard stream.

The axes are x right, y up, z toward the viewer, unless the extension SPZ_ADOBE_coordinate_system names others.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.readers.splats.activation import MOST_SMALL, Bytes, activate, ask_memory, largest_left_out
from lippmann.scene.splat_clouds import move
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import COEFFICIENTS, FloatArray, Splats

_HEADER = struct.Struct("<4sIIBBBB")
_GZIP = b"\x1f\x8b"
_MAGIC = b"NGSP"
_LATEST = 4
_SMALLEST_THREE = 3
_MOST_FRACTION = 24
#: Colours are stored so that those somewhat beyond black and white find room, too.
_COLOR_SCALE = 0.15

#: Version 4: where the table of sizes begins, 12 bytes that are 0; and the two sizes of a stream, packed and unpacked.
_HEADER_4 = struct.Struct("<I12x")
_SIZES = struct.Struct("<QQ")

_HAS_EXTENSIONS = 2
#: Most bytes of extensions; those known have 4 to 12 each.
_MOST_EXTENSIONS = 1 << 16
_RECORD = struct.Struct("<II")
_COORDINATES, _SAFE_ORBIT = 0xADBE0003, 0xADBE0002
#: The axes of the systems of coordinates, by their numbers from 1.
_SYSTEMS = ["LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF"]
_SYSTEMS += ["LFD", "RFD", "LFU", "RFU", "LBD", "RBD", "LBU", "RBU"]
_AXES = {"L": (-1, 0, 0), "R": (1, 0, 0), "D": (0, -1, 0), "U": (0, 1, 0), "F": (0, 0, -1), "B": (0, 0, 1)}


@dataclass(frozen=True)
class _Head:
    version: int
    count: int
    degree: int
    fraction: int
    has_extensions: bool

    @property
    def sizes(self) -> list[int]:
        """Bytes of a splat in each section; version 1 has places in half precision."""
        turn = 4 if self.version >= _SMALLEST_THREE else 3
        return [6 if self.version == 1 else 9, 1, 3, 3, turn, 3 * (COEFFICIENTS[self.degree] - 1)]


def read_spz(path: Path) -> SceneDescription:
    """Read an SPZ file. It names no other file.

    Raises
    ------
    SceneError, MemoryLimitError
        The file is missing, foreign, damaged, of another version, or takes more memory than is left.
    """
    splats, notes, says_axes = decode_spz(read_bytes(path), where=path.name)
    return SceneDescription(path.stem, splats=splats, notes=notes, up=(0.0, 1.0, 0.0) if says_axes else None)


def decode_spz(data: bytes | memoryview, *, where: str) -> tuple[Splats, tuple[str, ...], bool]:
    """The splats of the bytes of an SPZ file, notes, and whether the file says what its axes are.

    Raises
    ------
    SceneError, MemoryLimitError
        As :func:`read_spz`.
    """
    if bytes(data[:4]) == _MAGIC:
        head, sections, records = _read_4(data, where)
    elif bytes(data[:2]) == _GZIP:
        head, sections, records = _read_gzip(data, where)
    else:
        raise SceneError("is no SPZ file", where=where, rule="one begins as gzip does, or with 'NGSP'")
    places, alphas, colors, scales, turns, rest = (
        section.reshape(head.count, -1 if head.count else size)
        for section, size in zip(sections, head.sizes, strict=True)
    )
    coefficients = COEFFICIENTS[head.degree]
    harmonics = np.empty((head.count, coefficients, 3), np.float32)
    harmonics[:, 0] = (colors.astype(np.float32) / 255.0 - 0.5) / _COLOR_SCALE
    harmonics[:, 1:] = (rest.astype(np.float32).reshape(head.count, coefficients - 1, 3) - 128.0) / 128.0
    splats, notes = activate(
        _halves(places) if head.version == 1 else _fixed_point(places, head.fraction),
        scales.astype(np.float32) / 16.0 - 10.0,
        _smallest_three(turns) if head.version >= _SMALLEST_THREE else _first_three(turns),
        alphas[:, 0].astype(np.float32) / np.float32(255.0),
        harmonics,
        where=where,
    )
    axes, remarks = _extensions(records, where)
    return (splats if axes is None else move(splats, axes)), (*notes, *remarks), axes is not None


def _read_gzip(data: bytes | memoryview, where: str) -> tuple[_Head, list[Bytes], bytes]:
    stream = zlib.decompressobj(16 + zlib.MAX_WBITS)
    head = _read_head(_inflate(stream, data, _HEADER.size, where), where)
    _ask_memory(head, where)
    body = np.frombuffer(_inflate(stream, stream.unconsumed_tail, head.count * sum(head.sizes), where), np.uint8)
    records = b""
    if head.has_extensions:
        try:
            records = stream.decompress(stream.unconsumed_tail, _MOST_EXTENSIONS)
        except zlib.error as error:
            raise SceneError(f"is damaged ({error})", where=where) from None
    return head, np.split(body, head.count * np.cumsum(head.sizes)[:-1]), records


def _read_4(data: bytes | memoryview, where: str) -> tuple[_Head, list[Bytes], bytes]:
    from imagecodecs import ZstdError, zstd_decode

    start = _HEADER.size + _HEADER_4.size
    if len(data) < start:
        raise SceneError(f"is cut short: {len(data)} of {start} bytes", where=where, fix="copy it anew")
    head = _read_head(bytes(data[: _HEADER.size]), where)
    streams = data[_HEADER.size - 1]
    (table,) = _HEADER_4.unpack_from(data, _HEADER.size)
    place = table + streams * _SIZES.size
    if table < start or place > len(data):
        raise SceneError(f"has its table of sizes at byte {table} of {len(data)}", where=where, fix="is it cut short?")
    _ask_memory(head, where)
    wholes = [head.count * size for size in head.sizes]
    full = [whole for whole in wholes if whole]
    if streams not in (len(full), len(wholes)):
        raise SceneError(f"has {streams} streams", where=where, rule=f"{len(full)}, one for each section")
    stored = [_SIZES.unpack_from(data, table + number * _SIZES.size) for number in range(streams)]
    sections: list[Bytes] = []
    for whole in wholes:
        if not whole and streams < len(wholes):
            sections.append(np.empty(0, np.uint8))
            continue
        packed, unpacked = stored.pop(0)
        if unpacked != whole or packed > len(data) - place:
            what = f"section {len(sections)} holds {packed} bytes for {unpacked} of {whole}"
            raise SceneError(what, where=where, fix="is it cut short?")
        try:
            section = zstd_decode(data[place : place + packed], out=whole) if whole else b""
        except ZstdError as error:
            raise SceneError(f"is damaged ({error})", where=where) from None
        if len(section) < whole:
            raise SceneError(f"section {len(sections)} unpacks to {len(section)} of {whole} bytes", where=where)
        sections.append(np.frombuffer(section, np.uint8))
        place += packed
    return head, sections, bytes(data[start:table]) if head.has_extensions else b""


def _read_head(data: bytes, where: str) -> _Head:
    magic, version, count, degree, fraction, flags, _ = _HEADER.unpack(data)
    if magic != _MAGIC:
        raise SceneError("is no SPZ file", where=where, rule="what it packs begins with 'NGSP'")
    if not 1 <= version <= _LATEST:
        raise SceneError(f"is SPZ of version {version}", where=where, rule=f"versions 1 to {_LATEST} are read")
    if degree >= len(COEFFICIENTS) or fraction > _MOST_FRACTION:
        raise SceneError(
            f"harmonics of degree {degree} and places with {fraction} fractional bits", where=where, rule="0 to 4, 24"
        )
    return _Head(version, count, degree, fraction, bool(flags & _HAS_EXTENSIONS))


def _ask_memory(head: _Head, where: str) -> None:
    check_input(head.count * sum(head.sizes), f"{head.count} Gaussian splats", where=where)
    ask_memory(head.count, COEFFICIENTS[head.degree], where=where)


def _extensions(records: bytes, where: str) -> tuple[NDArray[np.float64] | None, Sequence[str]]:
    """The turn, or mirroring, from the file's axes to ours if it says what they are, and notes on what is not read."""
    axes: NDArray[np.float64] | None = None
    notes: list[str] = []
    place = 0
    while place + _RECORD.size <= len(records):
        kind, size = _RECORD.unpack_from(records, place)
        place += _RECORD.size + size
        content = records[place - size : place]
        if kind == _COORDINATES and len(content) == size == 4:
            system = int.from_bytes(content, "little")
            if not 1 <= system <= len(_SYSTEMS):
                notes.append(f"the extension for its axes names system {system}, which is none, and is passed over")
                continue
            axes = np.eye(4)
            axes[:3, :3] = np.array([_AXES[letter] for letter in _SYSTEMS[system - 1]], np.float64).T
        elif kind != _SAFE_ORBIT:
            notes.append(f"the extension {kind:#010x} is not read")
    return axes, notes


def _inflate(stream: zlib._Decompress, data: bytes | memoryview, size: int, where: str) -> bytes:
    """The next ``size`` bytes of a stream, and no more than those."""
    try:
        unpacked = stream.decompress(data, size) if size else b""
    except zlib.error as error:
        raise SceneError(f"is damaged ({error})", where=where) from None
    if len(unpacked) < size:
        raise SceneError(f"is cut short: {len(unpacked)} of {size} bytes", where=where, fix="copy it anew")
    return unpacked


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
