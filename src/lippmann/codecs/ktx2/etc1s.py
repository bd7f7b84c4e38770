"""ETC1S texels compressed by BasisLZ (Khronos Data Format Specification 1.3, chapters 21 and 22).

Blocks of 4x4 texels take a colour with one of eight tables of brightness from one codebook, and which of the table's
four entries each texel has from another. Both are read once a file; a slice names entries of them for its blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.ktx2.huffman import BitReader, Bytes, Code, DamagedError, take, take_long, take_symbol
from lippmann.runtime.numba_jit import compiled

__all__ = ["Codebooks", "DamagedError", "decode_slice"]

# Amounts added to all channels of a block's colour, by table and selector.
_MODIFIERS = np.array(
    [
        (-8, -2, 2, 8),
        (-17, -5, 5, 17),
        (-29, -9, 9, 29),
        (-42, -13, 13, 42),
        (-60, -18, 18, 60),
        (-80, -24, 24, 80),
        (-106, -33, 33, 106),
        (-183, -47, 47, 183),
    ],
    np.int64,
)

# A colour's channel is told apart from the one before by one of three codes: up to 9, up to 21, beyond.
_SECOND_CODE_FROM, _THIRD_CODE_FROM = 10, 22
_MIDDLE = 16

# The symbol that repeats the last prediction, by at least three; groups of bits of the number of repetitions.
_REPEAT_PREDICTION, _LEAST_REPEATS, _REPEATS_BITS = 256, 3, 4
_LONG_RUN, _RUN_BITS = 63, 7
_DAMAGED = 1


@dataclass(frozen=True, eq=False)
class Codebooks:
    """Tables that all slices of a file share.

    ``endpoints`` ``(n, 4)``: RGB in 5 bits and the table of brightness. ``selectors`` ``(m, 16)``, by rows of a block.
    ``history`` is the length of the list of selectors that were used last.
    """

    endpoints: NDArray[np.int64]
    selectors: NDArray[np.int64]
    predictions: Code
    steps: Code
    choices: Code
    runs: Code
    history: int

    @classmethod
    def read(
        cls, endpoints: int, selectors: int, endpoint_data: bytes, selector_data: bytes, table_data: bytes
    ) -> Codebooks:
        """Codebooks of so many endpoints and selectors.

        Raises
        ------
        DamagedError
            The data follow no rule of the format.
        """
        if not endpoints or not selectors:
            raise DamagedError("its codebooks are empty")
        tables = BitReader(table_data)
        predictions, steps, choices, runs = (tables.take_code() for _ in range(4))
        history = tables.take(13)
        tables.check_end()
        if not history:
            raise DamagedError("its codes are damaged")
        colors = _read_endpoints(endpoint_data, endpoints)
        picks = _read_selectors(selector_data, selectors)
        return cls(colors, picks, predictions, steps, choices, runs, history)


def _read_endpoints(data: bytes, count: int) -> NDArray[np.int64]:
    bits = BitReader(data)
    codes = np.stack([bits.take_code() for _ in range(4)])
    grey = bits.take(1)
    endpoints = np.zeros((count, 4), np.int64)
    damaged = _endpoint_kernel(bits.data, bits.at, codes, grey, endpoints)
    bits.check_end()
    if damaged:
        raise DamagedError("its endpoints are damaged")
    return endpoints


@compiled
def _endpoint_kernel(
    data: Bytes, at: NDArray[np.int64], codes: NDArray[np.uint32], grey: int, endpoints: NDArray[np.int64]
) -> int:
    """Colours and tables, each from its difference to the one before; a nonzero result says that they are damaged."""
    last = np.full(3, _MIDDLE, np.int64)
    table = 0
    for k in range(len(endpoints)):
        step = take_symbol(data, at, codes[3])
        if step < 0:
            return _DAMAGED
        table = (table + step) & 7
        endpoints[k, 3] = table
        for channel in range(1 if grey else 3):
            which = (last[channel] >= _SECOND_CODE_FROM) + (last[channel] >= _THIRD_CODE_FROM)
            step = take_symbol(data, at, codes[which])
            if step < 0:
                return _DAMAGED
            last[channel] = (last[channel] + step) & 31
            endpoints[k, channel] = last[channel]
        if grey:
            endpoints[k, 1] = endpoints[k, 2] = last[0]
    return 0


def _read_selectors(data: bytes, count: int) -> NDArray[np.int64]:
    bits = BitReader(data)
    if bits.take(2):
        raise DamagedError("its selectors are in a codebook that is not in the file")
    raw = bits.take(1)
    code = np.zeros(0, np.uint32) if raw else bits.take_code()
    rows = np.zeros((count, 4), np.int64)
    damaged = _selector_kernel(bits.data, bits.at, code, rows)
    bits.check_end()
    if damaged:
        raise DamagedError("its selectors are damaged")
    return ((rows[..., None] >> (2 * np.arange(4))) & 3).reshape(count, 16)


@compiled
def _selector_kernel(data: Bytes, at: NDArray[np.int64], code: Code, rows: NDArray[np.int64]) -> int:
    """Rows of four selectors as bytes: plain, or from the second on as differences in bits to those before."""
    for k in range(len(rows)):
        for row in range(4):
            if k == 0 or len(code) == 0:
                rows[k, row] = take(data, at, 8)
            else:
                step = take_symbol(data, at, code)
                if step < 0 or step > 255:
                    return _DAMAGED
                rows[k, row] = rows[k - 1, row] ^ step
    return 0


def decode_slice(codebooks: Codebooks, data: bytes, across: int, down: int) -> Bytes:
    """Texels ``(4 down, 4 across, 3)`` of a slice of so many blocks.

    Raises
    ------
    DamagedError
        The data follow no rule of the format.
    """
    texels = np.zeros((4 * down, 4 * across, 3), np.uint8)
    at = np.zeros(1, np.int64)
    raw = np.frombuffer(data, np.uint8)
    damaged = _slice_kernel(
        raw,
        at,
        codebooks.endpoints,
        codebooks.selectors,
        codebooks.predictions,
        codebooks.steps,
        codebooks.choices,
        codebooks.runs,
        codebooks.history,
        _MODIFIERS,
        texels,
    )
    if damaged or at[0] > 8 * len(raw):
        raise DamagedError("its blocks are damaged")
    return texels


@compiled
def _slice_kernel(
    data: Bytes,
    at: NDArray[np.int64],
    endpoints: NDArray[np.int64],
    selectors: NDArray[np.int64],
    predictions: Code,
    steps: Code,
    choices: Code,
    runs: Code,
    history_length: int,
    modifiers: NDArray[np.int64],
    texels: Bytes,
) -> int:
    """Blocks by rows; a nonzero result says that the data are damaged.

    How blocks find their endpoints is said for 2x2 of them at once, two bits each: as the left, upper or upper left
    neighbour has it, or by a step from the one before. Selectors are named outright or by their place in the history.
    """
    down, across = texels.shape[0] // 4, texels.shape[1] // 4
    endpoint_of = np.zeros((2, across), np.int64)
    predicted = np.zeros(across, np.int64)
    history = np.zeros(history_length, np.int64)
    newest = history_length // 2
    endpoint = selector = symbol = repeats = run = 0
    for y in range(down):
        here, above = y & 1, (y & 1) ^ 1
        kinds = 0
        for x in range(across):
            if x & 1 == 0:
                if y & 1:
                    kinds = predicted[x]
                else:
                    if repeats:
                        repeats -= 1
                    else:
                        prediction = take_symbol(data, at, predictions)
                        if prediction < 0 or prediction > _REPEAT_PREDICTION:
                            return _DAMAGED
                        if prediction == _REPEAT_PREDICTION:
                            repeats = take_long(data, at, _REPEATS_BITS) + _LEAST_REPEATS - 1
                        else:
                            symbol = prediction
                    kinds = symbol
                    predicted[x] = symbol >> 4
            kind = kinds & 3
            kinds >>= 2
            if kind == 0:
                if x == 0:
                    return _DAMAGED
            elif kind == 1:
                if y == 0:
                    return _DAMAGED
                endpoint = endpoint_of[above, x]
            elif kind == 2:
                if x == 0 or y == 0:
                    return _DAMAGED
                endpoint = endpoint_of[above, x - 1]
            else:
                step = take_symbol(data, at, steps)
                if step < 0:
                    return _DAMAGED
                endpoint += step
                if endpoint >= len(endpoints):
                    endpoint -= len(endpoints)
            if endpoint >= len(endpoints):
                return _DAMAGED
            endpoint_of[here, x] = endpoint

            if run:
                run -= 1
                choice = len(selectors)
            else:
                choice = take_symbol(data, at, choices)
                if choice < 0:
                    return _DAMAGED
                if choice == len(selectors) + history_length:
                    length = take_symbol(data, at, runs)
                    if length < 0:
                        return _DAMAGED
                    run = (take_long(data, at, _RUN_BITS) if length == _LONG_RUN else length) + 2
                    choice = len(selectors)
            if choice < len(selectors):
                selector = choice
                history[newest] = choice
                newest += 1
                if newest == history_length:
                    newest = history_length // 2
            else:
                place = choice - len(selectors)
                if place >= history_length:
                    return _DAMAGED
                selector = history[place]
                history[place] = history[place // 2]
                history[place // 2] = selector
            if at[0] > 8 * len(data) + 64:
                return _DAMAGED

            table = endpoints[endpoint, 3]
            for channel in range(3):
                five = endpoints[endpoint, channel]
                base = (five << 3) | (five >> 2)
                for texel in range(16):
                    value = base + modifiers[table, selectors[selector, texel]]
                    texels[4 * y + texel // 4, 4 * x + texel % 4, channel] = min(max(value, 0), 255)
    return 0
