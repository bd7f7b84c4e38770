"""Buffer views compressed by meshoptimizer, as EXT_meshopt_compression and KHR_meshopt_compression describe them
(appendices A and B of both): attributes of version 0, and of version 1, which the latter adds.

Libraries do less: imagecodecs decodes attributes alone, and not in its releases for Python 3.10; the package
``meshoptimizer`` is in alpha.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

_ATTRIBUTES, _ATTRIBUTES_1, _TRIANGLES, _INDICES = 0xA0, 0xA1, 0xE1, 0xD1
_GROUP = 16
#: At best two bits stand for a group of 16 bytes; in version 1 a byte for four columns of a block of 256 elements.
_MOST_EXPANSION, _MOST_EXPANSION_1 = 64, 1024

# The deltas that a byte holds, the first in its highest bits, for two and for four bits each; of one bit each, in its
# lowest.
_BITS = [bytes(byte >> place & 1 for place in range(8)) for byte in range(256)]
_PAIRS = [bytes((byte >> 6, byte >> 4 & 3, byte >> 2 & 3, byte & 3)) for byte in range(256)]
_NIBBLES = [bytes((byte >> 4, byte & 15)) for byte in range(256)]
#: Bits of a delta in the four kinds of groups, by the two control bits of a column: in version 0 they are those of 2.
_KINDS = ((0, 1, 2, 4), (1, 2, 4, 8), (0, 2, 4, 8))
#: Bytes of a group, its deltas, and the one that says that the byte follows, by the bits of a delta.
_PACKED = {1: (2, _BITS, 1), 2: (4, _PAIRS, 3), 4: (8, _NIBBLES, 15)}


class MeshoptError(Exception):
    """Compressed data that is damaged or of another version."""


def decompress(data: bytes, mode: str, filter_name: str, count: int, stride: int) -> bytes:
    """The ``count`` elements of ``stride`` bytes each that compressed ``data`` stands for.

    Parameters
    ----------
    mode:
        ``ATTRIBUTES``, ``TRIANGLES`` or ``INDICES``.
    filter_name:
        ``NONE``, ``OCTAHEDRAL``, ``QUATERNION``, ``EXPONENTIAL`` or ``COLOR``, which only attributes have.

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
    """Elements ``(count, stride)``, from the differences of each byte, or word, to that of the element before."""
    newer = data[:1] == bytes([_ATTRIBUTES_1])
    tail = stride + (stride // 4 if newer else 0)
    padded = max(tail, 24 if newer else 32)
    _check_header(data, _ATTRIBUTES_1 if newer else _ATTRIBUTES, padded)
    if count * stride > (_MOST_EXPANSION_1 if newer else _MOST_EXPANSION) * len(data) + _GROUP * stride:
        raise MeshoptError("it is cut short")
    elements = np.empty((count, stride), np.uint8)
    previous = np.frombuffer(data, np.uint8, stride, len(data) - tail)
    channels = data[len(data) - tail + stride :] or bytes(stride // 4)
    most = min((8192 // stride) & ~15, 256)
    position, end = 1, len(data) - padded
    for start in range(0, count, most):
        block = elements[start : start + most]
        control = data[position : position + stride // 4] if newer else b""
        position += len(control)
        codes = np.empty((stride, len(block)), np.uint8)
        for column in range(stride):
            how = control[column // 4] >> 2 * (column & 3) & 3 if newer else _OLD
            codes[column], position = _column(data, position, end, len(block), how)
        for first in range(0, stride, 4):
            block[:, first : first + 4] = _accumulate(
                codes[first : first + 4], previous[first : first + 4], channels[first // 4]
            )
        previous = block[-1]
    if position != end:
        raise MeshoptError(f"{end - position} bytes are left over")
    return elements


#: How a column of bytes is held, beside groups of the first two kinds: all are 0, the bytes themselves, as version 0.
_ZERO, _LITERAL, _OLD = 2, 3, 4


def _column(data: bytes, position: int, end: int, count: int, how: int) -> tuple[Bytes, int]:
    """The codes of one byte of the elements of a block, and where those of the next begin."""
    if how == _ZERO:
        return np.zeros(count, np.uint8), position
    if how == _LITERAL:
        if position + count > end:
            raise MeshoptError("it is cut short")
        return np.frombuffer(data, np.uint8, count, position), position + count
    deltas, position = _data_block(data, position, end, -(-count // _GROUP), _KINDS[min(how, 2)])
    return np.frombuffer(deltas, np.uint8, count), position


def _accumulate(codes: Bytes, previous: Bytes, channel: int) -> Bytes:
    """Four columns ``(count, 4)`` of their codes ``(4, count)``.

    These are zigzag-coded differences of bytes or of pairs of them, or words, rotated and combined by exclusive or.
    """
    kind = channel & 3
    if kind == 3:
        raise MeshoptError("a channel of kind 3 is none")
    width = 1 << kind
    words = np.ascontiguousarray(codes.reshape(4 // width, width, -1).transpose(0, 2, 1)).view(f"<u{width}")[..., 0]
    before = np.ascontiguousarray(previous).view(f"<u{width}")[:, None]
    if kind == 2:
        turn = channel >> 4
        turned = words if turn == 0 else (words >> np.uint32(turn)) | (words << np.uint32(32 - turn))
        sums = np.bitwise_xor.accumulate(np.concatenate([before, turned], axis=1), axis=1)[:, 1:]
    else:
        sums = before + np.cumsum((words >> 1) ^ -(words & 1), axis=1, dtype=words.dtype)
    return np.concatenate([np.ascontiguousarray(each).view(np.uint8).reshape(-1, width) for each in sums], axis=1)


def _data_block(data: bytes, position: int, end: int, groups: int, kinds: tuple[int, ...]) -> tuple[bytearray, int]:
    """The codes of one byte of the elements of a block, 16 a group, and where the next data block begins."""
    header = data[position : position + (groups + 3) // 4]
    position += len(header)
    deltas = bytearray()
    for group in range(groups):
        if position > end:
            raise MeshoptError("it is cut short")
        bits = kinds[header[group >> 2] >> 2 * (group & 3) & 3]
        if bits == 0:
            deltas += bytes(_GROUP)
        elif bits == 8:
            deltas += data[position : position + _GROUP]
            position += _GROUP
        else:
            size, table, sentinel = _PACKED[bits]
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


def _undo_zigzag(value: int) -> int:
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
                c = last = last + (_undo_zigzag(deltas.number()) if low == 15 else 2 * low - 27)
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
                    corner = last = last + _undo_zigzag(deltas.number())
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
        last[value & 1] += _undo_zigzag(value >> 1)
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
    if name == "COLOR" and stride in (4, 8):
        return _colors(elements.view("<u1" if stride == 4 else "<u2"))
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
    decoded[:, :3] = _round(vectors * np.iinfo(values.dtype).max)
    return decoded


def _quaternions(values: NDArray[np.signedinteger]) -> NDArray[np.signedinteger]:
    """Unit quaternions from three components each, without the largest.

    The two lowest bits of the fourth number name the largest; with them set, that number is the scale of 1.
    """
    whole = values.astype(np.int64)
    one = (whole[:, 3] | 3).astype(np.float64)
    parts = whole[:, :3] / one[:, None] * 0.5**0.5
    largest = np.sqrt(np.maximum(0.0, 1.0 - (parts * parts).sum(axis=1)))
    places = (whole[:, 3:] + np.arange(4)) % 4
    decoded = np.empty_like(values)
    bounded = np.clip(np.column_stack([largest, parts]), -1.0, 1.0)
    np.put_along_axis(decoded, places, _round(bounded * 32767.0).astype(values.dtype), axis=1)
    return decoded


def _colors(values: NDArray[np.unsignedinteger]) -> NDArray[np.unsignedinteger]:
    """RGBA from luma, two differences of colour and alpha, in as many bits as the highest one of alpha says."""
    most = np.iinfo(values.dtype).max
    alpha = values[:, 3].astype(np.int64)
    scale = alpha.copy()
    for shift in (1, 2, 4, 8):
        scale |= scale >> shift
    luma = values[:, 0].astype(np.int64)
    orange, green = (values[:, column].astype(f"i{values.dtype.itemsize}").astype(np.int64) for column in (1, 2))
    alpha = (alpha << 1 & scale) | (alpha & 1)
    whole = np.stack([luma + orange - green, luma + green, luma - orange - green, alpha], axis=1)
    scaled = np.trunc(whole * (np.float32(most) / np.maximum(scale, 1).astype(np.float32))[:, None] + 0.5)
    return np.asarray(scaled.astype(np.int64), values.dtype)


def _round(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Halves away from zero."""
    return np.trunc(values + np.copysign(0.5, values))
