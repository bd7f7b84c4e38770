"""One tile as bytes: what lies in a journal, and what travels between machines.

A file is the mark, the length of a head (4 bytes, little endian), the head (JSON: the tile's number, its rays, its
notes, names, types and shapes of its arrays and the lengths of what follows), the arrays one after the other, packed,
and the SHA-256 of all that. Whatever was cut short, mixed up or changed is found by length or by that sum.
"""

from __future__ import annotations

import hashlib
import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Begins every tile; its last letter is the version of the form.
MARK = b"LpTile2\n"

_SUM = hashlib.sha256
_SUM_BYTES = _SUM().digest_size

#: Zstandard packs a block of at most 128 KB into no less than 4 bytes.
_MOST_PER_BYTE = 1 << 15

#: Journals are read once: a quick packing (Zstandard, level 1) is the right one.
_LEVEL = 1


class DamagedTile(Exception):  # noqa: N818 - it is not an error of the user's: the tile is made anew
    """Bytes that are no whole tile."""


@dataclass(frozen=True, eq=False)
class TileResult:
    """What came of one tile.

    Parameters
    ----------
    index:
        Its number in the grid.
    pixels:
        ``(rows, columns, 3)`` in the type that the picture's file holds.
    maps:
        Layers ``(rows, columns)`` float32 that the file holds too.
    sums:
        Arrays from which the whole picture's estimate of its error is made; empty without one.
    rays:
        Rays by kind, and samples ``discarded`` for not being finite.
    notes:
        What is to be known of it, a sentence each.
    """

    index: int
    pixels: NDArray[Any]
    maps: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    sums: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    rays: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def encode(result: TileResult) -> bytes:
    """The tile as bytes: the same ones for the same tile."""
    import imagecodecs

    entries, bodies = [], []
    for kind, arrays in (("pixels", {"": result.pixels}), ("maps", result.maps), ("sums", result.sums)):
        for name in sorted(arrays):
            array = np.ascontiguousarray(arrays[name])
            body = bytes(imagecodecs.zstd_encode(array.tobytes(), level=_LEVEL))
            entries.append([kind, name, array.dtype.str, list(array.shape), len(body)])
            bodies.append(body)
    said = {"index": result.index, "rays": dict(result.rays), "notes": list(result.notes), "arrays": entries}
    head = json.dumps(said, sort_keys=True).encode()
    data = b"".join((MARK, struct.pack("<IQ", len(head), sum(map(len, bodies))), head, *bodies))
    return data + _SUM(data).digest()


def decode(data: bytes, most: int | None = None) -> TileResult:
    """The tile of :func:`encode`.

    Parameters
    ----------
    most:
        The most bytes that its arrays may take in memory, where the tile may be anybody's.

    Raises
    ------
    DamagedTile
        If these are not exactly such bytes, or the arrays are larger.
    """
    if whole_length(data[: len(MARK) + 12]) != len(data):
        raise DamagedTile("its length is wrong")
    body, found = data[:-_SUM_BYTES], data[-_SUM_BYTES:]
    if _SUM(body).digest() != found:
        raise DamagedTile("its check sum is wrong")
    try:
        return _taken_apart(data, most)
    except (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
        raise DamagedTile("its sum agrees with a head that makes no sense") from error


def _taken_apart(data: bytes, most: int | None) -> TileResult:
    """The tile; any error if the head is not one of :func:`encode`."""
    import imagecodecs

    start = len(MARK) + 12
    (length,) = struct.unpack("<I", data[len(MARK) : len(MARK) + 4])
    head = json.loads(data[start : start + length])
    place = start + length
    arrays: dict[str, dict[str, NDArray[Any]]] = {"pixels": {}, "maps": {}, "sums": {}}
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
    return TileResult(head["index"], arrays["pixels"][""], arrays["maps"], arrays["sums"], head["rays"], notes)


def whole_length(beginning: bytes) -> int | None:
    """How long the tile is that begins with these 20 bytes; None if none does."""
    if len(beginning) < len(MARK) + 12 or not beginning.startswith(MARK):
        return None
    head, bodies = struct.unpack("<IQ", beginning[len(MARK) : len(MARK) + 12])
    return len(MARK) + 12 + int(head) + int(bodies) + _SUM_BYTES
