"""UASTC texels: blocks of 4x4 texels in 16 bytes, of 19 modes (Khronos Data Format Specification 1.3, chapter 24).

A block names two colours for each of one to three subsets of its texels, and how far between them each texel lies, in
terms of ASTC (the same, chapter 23).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.ktx2.huffman import Bytes, take
from lippmann.runtime.numba_jit import compiled

Table = NDArray[np.int64]

_SOLID = 8

# Of each mode: the bits that name it, their number, bits of weights, range of endpoints, subsets, planes of weights,
# channels, bits of hints for other formats.
_MODES = (
    (0x01, 4, 4, 19, 1, 1, 3, 15),
    (0x35, 6, 2, 20, 1, 1, 3, 15),
    (0x1D, 5, 3, 8, 2, 1, 3, 15),
    (0x03, 5, 2, 7, 3, 1, 3, 15),
    (0x13, 5, 2, 12, 2, 1, 3, 15),
    (0x0B, 5, 3, 20, 1, 1, 3, 15),
    (0x1B, 5, 2, 18, 1, 2, 3, 15),
    (0x07, 5, 2, 12, 2, 1, 3, 15),
    (0x17, 5, 0, 0, 0, 0, 4, 0),
    (0x0F, 5, 2, 8, 2, 1, 4, 23),
    (0x02, 3, 4, 13, 1, 1, 4, 17),
    (0x00, 2, 2, 13, 1, 2, 4, 17),
    (0x06, 3, 3, 19, 1, 1, 4, 17),
    (0x1F, 5, 1, 20, 1, 2, 4, 23),
    (0x0D, 5, 2, 20, 1, 1, 4, 23),
    (0x05, 7, 4, 20, 1, 1, 2, 23),
    (0x15, 6, 2, 20, 2, 1, 2, 23),
    (0x25, 6, 2, 20, 1, 2, 2, 23),
    (0x09, 4, 5, 11, 1, 1, 3, 15),
)

# Bits, trits and quints of the ranges of ASTC's numbers.
_RANGES = (
    *((1, 0, 0), (0, 1, 0), (2, 0, 0), (0, 0, 1), (1, 1, 0), (3, 0, 0), (1, 0, 1), (2, 1, 0), (4, 0, 0), (2, 0, 1)),
    *((3, 1, 0), (5, 0, 0), (3, 0, 1), (4, 1, 0), (6, 0, 0), (4, 0, 1), (5, 1, 0), (7, 0, 0), (5, 0, 1), (6, 1, 0)),
    (8, 0, 0),
)

# How a number with a trit or a quint becomes 8 bits, by its bits: the factor of the trit, and which bits are added.
_TRITS = {1: (204, "000000000"), 2: (93, "b000b0bb0"), 3: (44, "cb000cbcb"), 4: (22, "dcb000dcb"), 5: (11, "edcb000ed")}
_TRITS |= {6: (5, "fedcb000f")}
_QUINTS = {1: (113, "000000000"), 2: (54, "b0000bb00"), 3: (26, "cb0000cbc"), 4: (13, "dcb0000dc"), 5: (6, "edcb0000e")}

# ASTC's seeds of the patterns of subsets: of two subsets, of mode 7, and of three subsets.
_TWO = (
    *(28, 20, 16, 29, 91, 9, 107, 72, 149, 204, 50, 114, 496, 17, 78, 39, 252, 828, 43, 156, 116, 210, 476, 273, 684),
    *(359, 246, 195, 694, 524),
)
_OF_MODE_7 = (36, 48, 61, 137, 161, 183, 226, 281, 302, 307, 479, 495, 593, 594, 605, 799, 812, 988, 993)
_THREE = (260, 74, 32, 156, 183, 15, 745, 0, 335, 902, 254)
_WITH_OTHER_PATTERNS = 7

# Bits of the last, incomplete group of trits (five to a group) and quints (three).
_TRIT_BITS, _QUINT_BITS = np.array([0, 2, 4, 5, 7, 8]), np.array([0, 3, 5, 7])


def decode_uastc(data: bytes, across: int, down: int) -> Bytes | None:
    """Texels ``(4 down, 4 across, 4)``, RGBA, of so many blocks; None if one of them is of no mode.

    ``data`` holds 16 bytes for each block, by rows.
    """
    blocks = np.frombuffer(data, np.uint8).reshape(down * across, 16)
    texels = np.zeros((4 * down, 4 * across, 4), np.uint8)
    tables = _mode_of(), np.array(_MODES), np.array(_RANGES), _values(), _patterns(), _weights()
    return None if _kernel(blocks, *tables, _TRIT_BITS, _QUINT_BITS, texels) else texels


@cache
def _mode_of() -> Table:
    """The mode that each first 7 bits name; -1 where they name none."""
    modes = np.full(128, -1, np.int64)
    for mode, (name, bits, *_) in enumerate(_MODES):
        modes[name :: 1 << bits] = mode
    return modes


@cache
def _values() -> Table:
    """Endpoints ``(21, 256)`` in 8 bits, by range and number."""
    values = np.zeros((len(_RANGES), 256), np.int64)
    for row, (bits, trits, quints) in enumerate(_RANGES):
        for number in range((1 << bits) * (1 + 2 * trits + 4 * quints)):
            values[row, number] = _value(number & ((1 << bits) - 1), number >> bits, bits, trits, quints)
    return values


def _value(low: int, digit: int, bits: int, trits: int, quints: int) -> int:
    if not trits and not quints:
        repeated = f"{low:0{bits}b}" * 8
        return int(repeated[:8], 2)
    if not bits:
        return 0  # no mode has such endpoints
    factor, pattern = (_TRITS if trits else _QUINTS)[bits]
    added = int("".join("0" if letter == "0" else str(low >> (ord(letter) - ord("a")) & 1) for letter in pattern), 2)
    ends = 0x1FF if low & 1 else 0
    value = (digit * factor + added) ^ ends
    return (ends & 0x80) | (value >> 2)


@cache
def _patterns() -> Table:
    """Subsets ``(3, 30, 16)`` of the texels: patterns of two subsets, those of mode 7, and of three."""
    patterns = np.zeros((3, len(_TWO), 16), np.int64)
    for kind, (seeds, subsets) in enumerate(((_TWO, 2), (_OF_MODE_7, 2), (_THREE, 3))):
        for k, seed in enumerate(seeds):
            patterns[kind, k] = [_subset(seed, texel % 4, texel // 4, subsets) for texel in range(16)]
        patterns[kind, len(seeds) :] = -1
    return patterns


def _subset(seed: int, x: int, y: int, subsets: int) -> int:
    """The subset of a texel of a block of 4x4 (the same specification, section 23.22)."""
    seed += (subsets - 1) * 1024
    mixed = _mix(seed)
    squares = [((mixed >> shift) & 15) ** 2 for shift in (0, 4, 8, 12, 16, 20)]
    narrow, wide = (4 if seed & 2 else 5), (6 if subsets == 3 else 5)
    even, odd = (narrow, wide) if seed & 1 else (wide, narrow)
    factors = [square >> (odd if k % 2 else even) for k, square in enumerate(squares)]
    sums = [
        factors[2 * k] * 2 * x + factors[2 * k + 1] * 2 * y + (mixed >> shift) & 63
        for k, shift in enumerate((14, 10, 6))
    ]
    return int(np.argmax(sums[:subsets]))


def _mix(number: int) -> int:
    """ASTC's hash of 32 bits."""
    for kind, shift in (("x", 15), ("-", -17), ("+", -7), ("+", -4), ("x", 5), ("+", -16), ("x", 7), ("x", 3)):
        moved = number >> shift if shift > 0 else number << -shift
        number = {"x": number ^ moved, "-": number - moved, "+": number + moved}[kind] & 0xFFFFFFFF
    number = (number ^ (number << 6)) & 0xFFFFFFFF
    return number ^ (number >> 17)


@cache
def _weights() -> Table:
    """Weights ``(6, 32)`` of the second colour, of 64, by bits and number."""
    weights = np.zeros((6, 32), np.int64)
    for bits in range(1, 6):
        for number in range(1 << bits):
            repeated = int((f"{number:0{bits}b}" * 6)[:6], 2)
            weights[bits, number] = repeated + (repeated > 32)
    return weights


@compiled
def _kernel(
    blocks: Bytes,
    mode_of: Table,
    modes: Table,
    ranges: Table,
    values: Table,
    patterns: Table,
    weights: Table,
    trit_bits: Table,
    quint_bits: Table,
    texels: Bytes,
) -> int:
    """Fill in all texels; a nonzero result says that a block is damaged."""
    across = texels.shape[1] // 4
    at = np.zeros(1, np.int64)
    ends = np.zeros((3, 2, 4), np.int64)
    groups = np.zeros(8, np.int64)
    pattern = np.zeros(16, np.int64)
    anchors = np.zeros(3, np.int64)
    for index in range(len(blocks)):
        block = blocks[index]
        top, left = 4 * (index // across), 4 * (index % across)
        mode = mode_of[block[0] & 127]
        if mode < 0:
            return 1
        at[0] = modes[mode, 1]
        if mode == _SOLID:
            for channel in range(4):
                value = take(block, at, 8)
                for texel in range(16):
                    texels[top + texel // 4, left + texel % 4, channel] = value
            continue
        weight_bits, endpoint_range, subsets, planes, channels = modes[mode, 2:7]
        at[0] += modes[mode, 7]

        # Loops: assignments to slices take several times as long to compile.
        for texel in range(16):
            pattern[texel] = 0
        for subset in range(3):
            anchors[subset] = 0
        if subsets > 1:
            kind = 2 if subsets == 3 else (1 if mode == _WITH_OTHER_PATTERNS else 0)
            which = take(block, at, 4 if subsets == 3 else 5)
            if which >= patterns.shape[1] or patterns[kind, which, 0] < 0:
                return 1
            for texel in range(15, -1, -1):
                pattern[texel] = patterns[kind, which, texel]
                anchors[pattern[texel]] = texel
        second_channel = -1
        if planes == 2:
            second_channel = 3 if channels == 2 else take(block, at, 2)

        bits, trits, quints = ranges[endpoint_range]
        count = 2 * channels * subsets
        per_group, base = (5, 3) if trits else ((3, 5) if quints else (count, 1))
        if trits or quints:
            for k in range((count + per_group - 1) // per_group):
                size = min(per_group, count - k * per_group)
                groups[k] = take(block, at, trit_bits[size] if trits else quint_bits[size])
        for k in range(count):
            number = take(block, at, bits)
            if base > 1:
                group = k // per_group
                number |= (groups[group] % base) << bits
                groups[group] //= base
            subset, rest = k // (2 * channels), k % (2 * channels)
            ends[subset, rest % 2, rest // 2] = values[endpoint_range, number]
        for subset in range(subsets):
            for end in range(2):
                if channels == 2:
                    ends[subset, end, 3] = ends[subset, end, 1]
                    ends[subset, end, 1] = ends[subset, end, 2] = ends[subset, end, 0]
                elif channels == 3:
                    ends[subset, end, 3] = 255

        for texel in range(16):
            subset = pattern[texel]
            fewer = 1 if anchors[subset] == texel else 0
            first = weights[weight_bits, take(block, at, weight_bits - fewer)]
            second = weights[weight_bits, take(block, at, weight_bits - fewer)] if planes == 2 else first
            for channel in range(4):
                weight = second if channel == second_channel else first
                low, high = ends[subset, 0, channel] * 257, ends[subset, 1, channel] * 257
                value = (low * (64 - weight) + high * weight + 32) >> 6
                texels[top + texel // 4, left + texel % 4, channel] = value >> 8
    return 0
