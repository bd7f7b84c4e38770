"""Tile files: one rendered tile as bytes, in a journal or on its way between machines.

A file has a mark, the length of the head (4 bytes, little endian), the length of the bodies (8 bytes), the head (JSON:
the tile's number, rays and notes; names, types, shapes and packed lengths of its arrays), the packed arrays, and the
SHA-256 of everything before. Length and check sum reveal files that were cut short or changed.
"""

from __future__ import annotations

import hashlib
import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from numpy.typing import NDArray

#: Beginning of every tile file; its last digit is the version.
MARK = b"LpTile2\n"

Array = NDArray[np.generic]

_SUM = hashlib.sha256
_SUM_BYTES = _SUM().digest_size

#: Zstandard packs a block of at most 128 KB into no less than 4 bytes.
_MOST_PER_BYTE = 1 << 15

#: Zstandard level; a journal is read once, so that speed counts more than size.
_LEVEL = 1


class DamagedTile(Exception):  # noqa: N818 - it is not an error of the user's: the tile is made anew
    """Bytes that are no complete tile."""


@dataclass(frozen=True, eq=False)
class TileResult:
    """One rendered tile.

    Parameters
    ----------
    index:
        Number in the grid of tiles.
    pixels:
        ``(rows, columns, 3)`` in the type of the picture's file.
    maps:
        Layers ``(rows, columns)`` float32 for the picture's file.
    sums:
        Arrays that the error estimate of the whole picture sums; empty without an estimate.
    rays:
        Rays by kind, and samples ``discarded`` because they were not finite.
    notes:
        Sentences for people, such as warnings.
    """

    index: int
    pixels: Array
    maps: Mapping[str, Array] = field(default_factory=dict)
    sums: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    rays: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def encode(result: TileResult) -> bytes:
    """Bytes of a tile, the same for equal tiles; :func:`decode` is the inverse."""
    import imagecodecs

    entries, bodies = [], []
    for kind, arrays in (("pixels", {"": result.pixels}), ("maps", result.maps), ("sums", result.sums)):
        for name in sorted(arrays):
            array = np.ascontiguousarray(arrays[name])
            body = bytes(imagecodecs.zstd_encode(array.tobytes(), level=_LEVEL))
            entries.append([kind, name, array.dtype.str, list(array.shape), len(body)])
            bodies.append(body)
    facts = {"index": result.index, "rays": dict(result.rays), "notes": list(result.notes), "arrays": entries}
    head = json.dumps(facts, sort_keys=True).encode()
    data = b"".join((MARK, struct.pack("<IQ", len(head), sum(map(len, bodies))), head, *bodies))
    return data + _SUM(data).digest()


def decode(data: bytes, most: int | None = None) -> TileResult:
    """The tile of the bytes of :func:`encode`.

    Parameters
    ----------
    data:
        The bytes.
    most:
        Largest total size of the arrays in bytes, for tiles of unknown origin; any by default.

    Raises
    ------
    DamagedTile
        If the bytes are no complete tile, or the arrays are larger.
    """
    if whole_length(data[: len(MARK) + 12]) != len(data):
        raise DamagedTile("its length is wrong")
    body, digest = data[:-_SUM_BYTES], data[-_SUM_BYTES:]
    if _SUM(body).digest() != digest:
        raise DamagedTile("its check sum is wrong")
    try:
        return _unpack(data, most)
    except (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
        raise DamagedTile("its sum agrees with a head that makes no sense") from error


def _unpack(data: bytes, most: int | None) -> TileResult:
    """The tile of undamaged bytes; any error if the head is not one of :func:`encode`."""
    import imagecodecs

    start = len(MARK) + 12
    (length,) = struct.unpack("<I", data[len(MARK) : len(MARK) + 4])
    head = json.loads(data[start : start + length])
    place = start + length
    arrays: dict[str, dict[str, Array]] = {"pixels": {}, "maps": {}, "sums": {}}
    total = 0
    for kind, name, dtype, shape, size in head["arrays"]:
        unpacked = math.prod(shape) * np.dtype(dtype).itemsize
        if not 0 <= unpacked <= _MOST_PER_BYTE * size:
            raise ValueError(f"{size} bytes cannot be {unpacked}")
        total += unpacked
        if most is not None and total > most:
            raise DamagedTile("it is larger than its pixels need")
        raw = imagecodecs.zstd_decode(data[place : place + size], out=unpacked)
        arrays[kind][name] = np.frombuffer(raw, dtype=dtype).reshape(shape)
        place += size
    notes = tuple(str(note) for note in head["notes"])
    sums = cast("dict[str, NDArray[np.float64]]", arrays["sums"])
    return TileResult(head["index"], arrays["pixels"][""], arrays["maps"], sums, head["rays"], notes)


def whole_length(beginning: bytes) -> int | None:
    """Length in bytes of the tile that begins with these 20 bytes; None if they begin no tile."""
    if len(beginning) < len(MARK) + 12 or not beginning.startswith(MARK):
        return None
    head, bodies = struct.unpack("<IQ", beginning[len(MARK) : len(MARK) + 12])
    return len(MARK) + 12 + int(head) + int(bodies) + _SUM_BYTES
