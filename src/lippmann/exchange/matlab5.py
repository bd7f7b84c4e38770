"""Arrays of numbers in MAT-files of version 5 to 7 (MathWorks, "MAT-File Format", 2023; "Level 5 MAT-File Format").

Read here: at files of which a few bytes are damaged the native reader of SciPy 1.17 (``scipy.io.loadmat``) ends the
process by a segmentation fault.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.machine import check_input

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
# Types of numbers as stored, and classes of arrays by number: what they hold, and their name.
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_NUMBERS = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_OTHERS = {1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse"}
_COMPLEX, _LOGICAL = 0x0800, 0x0200
_MOST_AXES, _MOST_NAME, _MOST_VARIABLES = 16, 256, 10_000
#: Bytes of an array's head: flags, sizes of its axes and its name.
_MOST_HEAD = 1024


class Matlab5Error(Exception):
    """A file that is damaged, or a variable that is no plain array of numbers."""


@dataclass(frozen=True)
class Variable:
    """A variable of a file: its name, the sizes of its axes, and its class, such as ``single``; where its head ends."""

    name: str
    shape: tuple[int, ...]
    kind: str
    _number: int
    _flags: int
    _content: bytes | memoryview
    _is_packed: bool
    _values_at: int
    _order: Literal["<", ">"]

    @property
    def is_numeric(self) -> bool:
        """Whether it is a plain array of real numbers."""
        return self._number in _NUMBERS and not self._flags & (_COMPLEX | _LOGICAL)

    def values(self, where: str) -> NDArray[np.generic]:
        """The numbers, in the type of their class.

        Raises
        ------
        Matlab5Error
            There are other than the variable has, or none.
        MemoryLimitError
            They take more than the memory that is left; ``where`` is the file.
        """
        if not self.is_numeric:
            raise Matlab5Error(f"{self.name} is of the class {self.kind}")
        dtype = np.dtype(_NUMBERS[self._number])
        count = int(np.prod([int(length) for length in self.shape], dtype=object))
        if count < 0 or count >= 1 << 40:
            raise Matlab5Error(f"{self.name} has the shape {self.shape}")
        # Unpacked, as stored in up to 8 bytes, and in its class.
        check_input(count * (8 + dtype.itemsize), f"variable {self.name}", where=where)
        content = self._content
        if self._is_packed:
            content = _unpack(content, self._values_at + 8 + 8 * count)
        kind, start, size = _tag(content, self._values_at, self._order)
        stored = _STORED.get(kind)
        if stored is None or size != count * np.dtype(stored).itemsize or start + size > len(content):
            raise Matlab5Error(f"the numbers of {self.name} are damaged")
        numbers = np.frombuffer(content, self._order + stored, count, start)
        return numbers.astype(dtype).reshape(self.shape, order="F")


def read_variables(content: bytes | memoryview) -> Iterator[Variable]:
    """The variables of a file, by their heads; numbers are read when they are asked for.

    Raises
    ------
    Matlab5Error
        The file is damaged.
    """
    if len(content) < _HEADER:
        raise Matlab5Error("it is cut short")
    order: Literal["<", ">"] = "<" if bytes(content[126:128]) == b"IM" else ">"
    at = _HEADER
    for _ in range(_MOST_VARIABLES):
        if at + 8 > len(content):
            return
        kind, start, size = _tag(content, at, order)
        if start + size > len(content):
            raise Matlab5Error("it is cut short")
        body = content[start : start + size]
        packed = kind == _COMPRESSED
        if packed:
            head = _unpack(body, _MOST_HEAD)
            kind, start, size = _tag(head, 0, order)
            if kind == _MATRIX:
                yield _variable(head, body, order, start, is_packed=True)
        elif kind == _MATRIX:
            yield _variable(body, body, order, 0, is_packed=False)
        # Compressed elements are not padded.
        at = (at + 8 + len(body)) if packed else -(-(at + 8 + len(body)) // 8) * 8


def _variable(
    head: bytes | memoryview, body: bytes | memoryview, order: Literal["<", ">"], at: int, *, is_packed: bool
) -> Variable:
    kind, start, size = _tag(head, at, order)
    if kind != 6 or size != 8 or start + 8 > len(head):
        raise Matlab5Error("an array has no flags")
    (flags,) = struct.unpack_from(f"{order}I", head, start)
    number = flags & 0xFF
    kind, start, size = _tag(head, _after(start, size), order)
    if kind != 5 or size % 4 or not 8 <= size <= 4 * _MOST_AXES or start + size > len(head):
        raise Matlab5Error("an array has no size")
    shape = struct.unpack_from(f"{order}{size // 4}i", head, start)
    if min(shape) < 0:
        raise Matlab5Error(f"an array has the shape {shape}")
    kind, start, size = _tag(head, _after(start, size), order)
    if kind not in (1, 2) or size > _MOST_NAME or start + size > len(head):
        raise Matlab5Error("an array has no name")
    name = bytes(head[start : start + size]).decode("latin-1")
    known = {code: np.dtype(text).name for code, text in _NUMBERS.items()} | {6: "double", 7: "single"} | _OTHERS
    text = known.get(number, f"number {number}")
    return Variable(name, shape, text, number, flags, body, is_packed, _after(start, size), order)


def _tag(content: bytes | memoryview, at: int, order: str) -> tuple[int, int, int]:
    """Type, start and size in bytes of the element at ``at``; of up to four bytes it may stand in the tag itself."""
    if at + 8 > len(content):
        raise Matlab5Error("it is cut short")
    kind, size = struct.unpack_from(f"{order}2I", content, at)
    if kind >> 16:
        return kind & 0xFFFF, at + 4, kind >> 16
    return kind, at + 8, size


def _after(start: int, size: int) -> int:
    """Offset of the next element: elements are padded to eight bytes."""
    return -(-(start + size) // 8) * 8


def _unpack(data: bytes | memoryview, most: int) -> bytes:
    try:
        return zlib.decompressobj().decompress(bytes(data), most)
    except zlib.error as error:
        raise Matlab5Error(f"it cannot be unpacked ({error})") from None
