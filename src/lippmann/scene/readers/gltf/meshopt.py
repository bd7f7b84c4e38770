"""Buffer views compressed by meshoptimizer, as EXT_meshopt_compression describes them (its appendices A and B)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

_ATTRIBUTES, _TRIANGLES, _INDICES = 0xA0, 0xE1, 0xD1
_GROUP = 16
# No group of 16 bytes is encoded in fewer than two bits.
_MOST_EXPANSION = 64

# The deltas that a byte holds, the first in its highest bits, for two and for four bits each.
_PAIRS = [bytes((byte >> 6, byte >> 4 & 3, byte >> 2 & 3, byte & 3)) for byte in range(256)]
_NIBBLES = [bytes((byte >> 4, byte & 15)) for byte in range(256)]


class MeshoptError(Exception):
    """Compressed data that is damaged or of another version."""


def decompress(data: bytes, mode: str, filter_name: str, count: int, stride: int) -> bytes:
    """The ``count`` elements of ``stride`` bytes each that compressed ``data`` stands for.

    Parameters
    ----------
    mode:
        ``ATTRIBUTES``, ``TRIANGLES`` or ``INDICES``.
    filter_name:
        ``NONE``, ``OCTAHEDRAL``, ``QUATERNION`` or ``EXPONENTIAL``, which only attributes have.

    Raises
    ------
    MeshoptError
        The data is damaged, or of a mode, a filter or a version that the extension does not describe.
    """
    if mode == "ATTRIBUTES":
        if stride % 4 or not 4 <= stride <= 256:
            raise MeshoptError(f"a stride of {stride} bytes is no multiple of 4 up to 256")
        return _apply_filter(_attributes(data, count, stride), filter_name).tobytes()
    if mode not in ("TRIANGLES", "INDICES") or filter_name != "NONE" or stride not in (2, 4):
        raise MeshoptError(f"mode {mode[:20]} with filter {filter_name[:20]} and stride {stride} is none")
    indices = _triangles(data, count) if mode == "TRIANGLES" else _indices(data, count)
    return (np.array(indices, np.uint64) & 0xFFFFFFFF).astype("<u4").astype(f"<u{stride}").tobytes()


def _check_header(data: bytes, header: int, tail: int) -> None:
    if len(data) < 1 + tail:
        raise MeshoptError("it is cut short")
    if data[0] != header:
        raise MeshoptError(f"it begins with {data[0]:#04x}, and {header:#04x} is understood")


def _attributes(data: bytes, count: int, stride: int) -> Bytes:
    """Elements ``(count, stride)``, from zigzag-coded deltas of each byte to that of the element before."""
    tail = max(stride, 32)
    _check_header(data, _ATTRIBUTES, tail)
    if count * stride > _MOST_EXPANSION * len(data) + _GROUP * stride:
        raise MeshoptError("it is cut short")
    elements = np.empty((count, stride), np.uint8)
    previous = np.frombuffer(data, np.uint8, stride, len(data) - stride)
    most = min((8192 // stride) & ~15, 256)
    position, end = 1, len(data) - tail
    for start in range(0, count, most):
        block = elements[start : start + most]
        for column in range(stride):
            deltas, position = _data_block(data, position, end, -(-len(block) // _GROUP))
            codes = np.frombuffer(deltas, np.uint8, len(block))
            steps = (codes >> 1) ^ -(codes & 1)
            block[:, column] = previous[column] + np.cumsum(steps, dtype=np.uint8)
        previous = block[-1]
    if position != end:
        raise MeshoptError(f"{end - position} bytes are left over")
    return elements


def _data_block(data: bytes, position: int, end: int, groups: int) -> tuple[bytearray, int]:
    """The deltas of one byte of the elements of a block, 16 a group, and where the next data block begins."""
    header = data[position : position + (groups + 3) // 4]
    position += len(header)
    deltas = bytearray()
    for group in range(groups):
        if position > end:
            raise MeshoptError("it is cut short")
        kind = header[group >> 2] >> 2 * (group & 3) & 3
        if kind == 0:
            deltas += bytes(_GROUP)
        elif kind == 3:
            deltas += data[position : position + _GROUP]
            position += _GROUP
        else:
            size, table, sentinel = (4, _PAIRS, 3) if kind == 1 else (8, _NIBBLES, 15)
            values = b"".join([table[byte] for byte in data[position : position + size]])
            position += size
            if sentinel in values:
                given = iter(data[position : position + _GROUP])
                position += values.count(sentinel)
                values = bytes([next(given, 0) if value == sentinel else value for value in values])
            deltas += values
    if position > end:
        raise MeshoptError("it is cut short")
    return deltas, position


class _Deltas:
    """Whole numbers of seven bits a byte (LEB128), read one after the other."""

    def __init__(self, data: bytes, position: int, end: int) -> None:
        self._data, self._end = data, end
        self.position = position

    def byte(self) -> int:
        if self.position >= self._end:
            raise MeshoptError("it is cut short")
        self.position += 1
        return self._data[self.position - 1]

    def number(self) -> int:
        value = 0
        for shift in range(0, 35, 7):
            byte = self.byte()
            value |= (byte & 127) << shift
            if byte < 128:
                break
        return value

    def finish(self) -> None:
        if self.position != self._end:
            raise MeshoptError(f"{self._end - self.position} bytes are left over")


def _signed(value: int) -> int:
    return ~(value >> 1) if value & 1 else value >> 1


def _triangles(data: bytes, count: int) -> list[int]:
    """Indices of a list of triangles: a byte each, most of which name an edge and a vertex that were met lately."""
    _check_header(data, _TRIANGLES, 16)
    if count % 3 or 1 + count // 3 + 16 > len(data):
        raise MeshoptError("it is cut short")
    codes, auxiliary = data[1 : 1 + count // 3], data[-16:]
    deltas = _Deltas(data, 1 + count // 3, len(data) - 16)
    edges, vertices = [(0, 0)] * 16, [0] * 16
    edge_count = vertex_count = 0
    following = last = 0
    indices: list[int] = []
    for code in codes:
        high, low = code >> 4, code & 15
        fresh: tuple[int, ...]
        new_edges: tuple[tuple[int, int], ...]
        if high < 15:
            a, b = edges[edge_count - 1 - high & 15]
            if low == 0:
                c, following = following, following + 1
            elif low < 13:
                c = vertices[vertex_count - 1 - low & 15]
            else:
                c = last = last + (_signed(deltas.number()) if low == 15 else 2 * low - 27)
            fresh = (c,) if low == 0 or low >= 13 else ()
            new_edges = ((c, b), (a, c))
        else:
            explicit = low >= 14
            pair = deltas.byte() if explicit else auxiliary[low]
            if explicit and pair == 0:
                following = 0
            corners: list[int] = []
            fresh = ()
            for place in (15 if code == 0xFF else 0, pair >> 4, pair & 15):
                if place == 0:
                    corner, following = following, following + 1
                elif place == 15 and explicit:
                    corner = last = last + _signed(deltas.number())
                else:
                    corner = vertices[vertex_count - place & 15]
                if place == 0 or (place == 15 and explicit):
                    fresh += (corner,)
                corners.append(corner)
            a, b, c = corners
            new_edges = ((b, a), (c, b), (a, c))
        for edge in new_edges:
            edges[edge_count & 15] = edge
            edge_count += 1
        for vertex in fresh:
            vertices[vertex_count & 15] = vertex
            vertex_count += 1
        indices += (a & 0xFFFFFFFF, b & 0xFFFFFFFF, c & 0xFFFFFFFF)
    deltas.finish()
    return indices


def _indices(data: bytes, count: int) -> list[int]:
    """Indices as deltas to the last one on either of two tracks."""
    _check_header(data, _INDICES, 4)
    if 1 + count + 4 > len(data):
        raise MeshoptError("it is cut short")
    deltas = _Deltas(data, 1, len(data) - 4)
    last = [0, 0]
    indices = []
    for _ in range(count):
        value = deltas.number()
        last[value & 1] += _signed(value >> 1)
        indices.append(last[value & 1] & 0xFFFFFFFF)
    deltas.finish()
    return indices


def _apply_filter(elements: Bytes, name: str) -> NDArray[np.generic]:
    stride = elements.shape[1]
    if name == "NONE":
        return elements
    if name == "OCTAHEDRAL" and stride in (4, 8):
        return _octahedral(elements.view("<i1" if stride == 4 else "<i2"))
    if name == "QUATERNION" and stride == 8:
        return _quaternions(elements.view("<i2"))
    if name == "EXPONENTIAL":
        whole = elements.view("<i4")
        with np.errstate(over="ignore"):  # infinite numbers are refused where they are used
            numbers: NDArray[np.float32] = np.ldexp(((whole << 8) >> 8).astype(np.float32), whole >> 24).astype("<f4")
        return numbers
    raise MeshoptError(f"filter {name[:20]} with a stride of {stride} is none")


def _octahedral(values: NDArray[np.signedinteger]) -> NDArray[np.signedinteger]:
    """Unit vectors from their places on an octahedron; the third number stands for 1, the fourth is kept."""
    whole = values.astype(np.float64)
    one = np.where(whole[:, 2] == 0.0, 1.0, whole[:, 2])
    x, y = whole[:, 0] / one, whole[:, 1] / one
    z = 1.0 - np.abs(x) - np.abs(y)
    fold = np.minimum(z, 0.0)
    x, y = x - np.copysign(fold, x), y - np.copysign(fold, y)
    vectors = np.stack([x, y, z], axis=1)
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    decoded = values.copy()
    decoded[:, :3] = _rounded(vectors * np.iinfo(values.dtype).max)
    return decoded


def _quaternions(values: NDArray[np.signedinteger]) -> NDArray[np.signedinteger]:
    """Unit quaternions without their largest component, which the last two bits name; the rest of that number is 1."""
    whole = values.astype(np.int64)
    one = (whole[:, 3] | 3).astype(np.float64)
    parts = whole[:, :3] / one[:, None] * 0.5**0.5
    largest = np.sqrt(np.maximum(0.0, 1.0 - (parts * parts).sum(axis=1)))
    places = (whole[:, 3:] + np.arange(4)) % 4
    decoded = np.empty_like(values)
    bounded = np.clip(np.column_stack([largest, parts]), -1.0, 1.0)
    np.put_along_axis(decoded, places, _rounded(bounded * 32767.0).astype(values.dtype), axis=1)
    return decoded


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Halves away from zero."""
    return np.trunc(values + np.copysign(0.5, values))
