"""Bytes of a file in parts: a number that it names takes no memory that its bytes do not fill."""

from __future__ import annotations

from typing import Protocol

_PART = 1 << 24


class Readable(Protocol):
    """A file of bytes, whoever opened it."""

    def read(self, size: int, /) -> bytes:
        """The next bytes."""
        ...


def read_up_to(file: Readable, size: int) -> bytearray:
    """The next ``size`` bytes of a file, or all there are."""
    data = bytearray()
    while len(data) < size:
        part = file.read(min(size - len(data), _PART))
        if not part:
            break
        data += part
    return data
