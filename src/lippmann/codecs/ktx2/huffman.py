"""Numbers and prefix codes in a stream of bits, least significant bit first, as BasisLZ has them.

Khronos Data Format Specification 1.3, sections 22.2 and 22.3 (Huffman codes of lengths up to 16, canonical).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import compiled

Bytes = NDArray[np.uint8]

#: Table over 16 bits of the stream: length of the code with which they begin above bit 16, its symbol below; 0: none.
Code = NDArray[np.uint32]

# Symbols of code lengths beyond 16: runs of zeros and of the last length, with bits that tell how long, and the least.
_RUNS = {17: (3, 3), 18: (7, 11), 19: (2, 3), 20: (7, 7)}
_FIRST_REPEAT = 19
_ORDER = (17, 18, 19, 20, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 16)
_MOST_SYMBOLS_BITS, _LONGEST = 14, 16


class DamagedError(Exception):
    """Bits that follow no rule of the format."""


@compiled
def take(data: Bytes, at: NDArray[np.int64], bits: int) -> int:
    """Read the next ``bits`` bits, 0 to 25, of ``data`` and advance ``at[0]``, the bit; zeros after the end."""
    position = at[0]
    byte = position >> 3
    value = 0
    for k in range(5):
        if byte + k < len(data):
            value |= int(data[byte + k]) << (8 * k)
    at[0] = position + bits
    taken: int = (value >> (position & 7)) & ((1 << bits) - 1)
    return taken


@compiled
def take_symbol(data: Bytes, at: NDArray[np.int64], code: Code) -> int:
    """The next symbol of a code; -1 where the bits are none."""
    entry: int = np.int64(code[take(data, at, 16)])  # type: ignore[assignment]  # an int once it is compiled
    at[0] += (entry >> 16) - 16
    return (entry & 0xFFFF) if entry else -1


@compiled
def take_long(data: Bytes, at: NDArray[np.int64], bits: int) -> int:
    """A number in groups of ``bits`` bits, the lowest first, each followed by a bit that says whether more follow."""
    value = 0
    for k in range(32 // bits + 1):
        group = take(data, at, bits + 1)
        value |= (group & ((1 << bits) - 1)) << (k * bits)
        if not group >> bits:
            break
    return value


class BitReader:
    """Bits of a part of a file, read one after another."""

    def __init__(self, data: bytes) -> None:
        self.data = np.frombuffer(data, np.uint8)
        self.at = np.zeros(1, np.int64)

    def take(self, bits: int) -> int:
        """The next number of so many bits."""
        return int(take(self.data, self.at, bits))

    def take_code(self) -> Code:
        """The next Huffman code.

        Raises
        ------
        DamagedError
            The code has no symbols, or its lengths are those of no code.
        """
        count = self.take(_MOST_SYMBOLS_BITS)
        written = self.take(5)
        if not count or not 1 <= written <= len(_ORDER):
            raise DamagedError("a Huffman code has no symbols")
        lengths = np.zeros(len(_ORDER), np.int64)
        for symbol in _ORDER[:written]:
            lengths[symbol] = self.take(3)
        code_of_lengths = _canonical(lengths)
        lengths = np.zeros(count, np.int64)
        done = 0
        while done < count:
            symbol = int(take_symbol(self.data, self.at, code_of_lengths))
            run = 1
            if symbol in _RUNS:
                bits, least = _RUNS[symbol]
                run = least + self.take(bits)
            value = symbol if symbol <= _LONGEST else 0
            if symbol >= _FIRST_REPEAT and done:
                value = int(lengths[done - 1])
            if symbol < 0 or done + run > count or (symbol >= _FIRST_REPEAT and not value):
                raise DamagedError("the lengths of a Huffman code are damaged")
            lengths[done : done + run] = value
            done += run
        return _canonical(lengths)

    def check_end(self) -> None:
        """Refuse a part that was read beyond its end.

        Raises
        ------
        DamagedError
            There were fewer bits than were read.
        """
        if self.at[0] > 8 * len(self.data):
            raise DamagedError("it is cut short")


def _canonical(lengths: NDArray[np.int64]) -> Code:
    """The canonical code whose symbols have these lengths in bits, 0 for those that do not occur."""
    table = np.zeros(1 << _LONGEST, np.uint32)
    counts = np.bincount(lengths, minlength=_LONGEST + 1)
    counts[0] = 0
    room = int((counts << (_LONGEST - np.arange(_LONGEST + 1))).sum())
    if room != 1 << _LONGEST and counts.sum() != 1:
        raise DamagedError("the lengths of a Huffman code are those of none")
    following = 0
    for length in range(1, _LONGEST + 1):
        following = (following + int(counts[length - 1])) << 1
        for symbol in np.flatnonzero(lengths == length):
            reverse = int(f"{following:0{length}b}"[::-1], 2)
            table[reverse :: 1 << length] = (length << 16) | int(symbol)
            following += 1
        following -= int(counts[length])
    return table
