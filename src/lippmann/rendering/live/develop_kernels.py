"""From linear light to codes, pixel by pixel, compiled by Numba."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import quantize
from lippmann.runtime.numba_jit import uncounted

#: Entries of the table of codes, over [0, 1].
_ENTRIES = 1 << 12
#: Of the curve of :mod:`lippmann.color.tone_map`: reflectance, start of the compression, and desaturation.
_FRESNEL, _FROM, _DESATURATION = 0.04, 0.8 - 0.04, 0.15


def code_tables() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """A first guess at the 8-bit sRGB code for each of many values in [0, 1], and the least value of each code.

    Exact: the guess is mended by the least values, which are those of :func:`lippmann.color.transfer.quantize`.
    """
    codes = np.arange(256)
    low, high = np.zeros(256, np.uint32), np.full(256, np.float32(1.0).view(np.uint32), np.uint32)
    while (low < high).any():  # on the bits of positive numbers, whose order is that of the numbers
        middle = low + (high - low) // 2
        reaches = quantize(middle.view(np.float32), 8, "srgb") >= codes
        low, high = np.where(reaches, low, middle + 1), np.where(reaches, middle, high)
    least = high.astype(np.uint32).view(np.float32)
    guesses = np.asarray(quantize(np.linspace(0, 1, _ENTRIES, dtype=np.float32), 8, "srgb"), np.uint8)
    return guesses, least


@uncounted
def encode_rows(
    first: int,
    last: int,
    values: NDArray[np.float32],
    neutral: bool,
    guesses: NDArray[np.uint8],
    least: NDArray[np.float32],
    codes: NDArray[np.uint8],
) -> None:
    """Codes ``(n, 3)`` of linear values ``(n, 3)``, from ``first`` to ``last``; by PBR Neutral first, if asked for."""
    for i in range(first, last):
        r, g, b = max(values[i, 0], np.float32(0)), max(values[i, 1], np.float32(0)), max(values[i, 2], np.float32(0))
        if neutral:
            low = min(r, g, b)
            off = low - low * low / np.float32(4 * _FRESNEL) if low < np.float32(2 * _FRESNEL) else np.float32(_FRESNEL)
            r, g, b = r - off, g - off, b - off
            peak = max(r, g, b)
            if peak >= np.float32(_FROM):
                one, room = np.float32(1), np.float32(1 - _FROM)
                compressed = one - room * room / (peak + room - np.float32(_FROM))
                white = one - one / (np.float32(_DESATURATION) * (peak - compressed) + one)
                kept = compressed / peak * (one - white)
                r, g, b = r * kept + compressed * white, g * kept + compressed * white, b * kept + compressed * white
        codes[i, 0] = _code(r, guesses, least)
        codes[i, 1] = _code(g, guesses, least)
        codes[i, 2] = _code(b, guesses, least)


@uncounted
def _code(value: np.float32, guesses: NDArray[np.uint8], least: NDArray[np.float32]) -> int:
    value = min(max(value, np.float32(0)), np.float32(1))
    code = int(guesses[int(value * np.float32(len(guesses) - 1))])
    while code < 255 and value >= least[code + 1]:
        code += 1
    while code > 0 and value < least[code]:
        code -= 1
    return code


@uncounted
def spread_rows(
    first: int, last: int, codes: NDArray[np.uint8], number: NDArray[np.int32], picture: NDArray[np.uint8]
) -> None:
    """The picture ``(n, 3)`` of codes by their numbers ``(n,)``; black where there is none."""
    for i in range(first, last):
        k = number[i]
        for c in range(3):
            picture[i, c] = codes[k, c] if k >= 0 else 0


@uncounted
def gather_rows(
    first: int, last: int, values: NDArray[np.float32], number: NDArray[np.int32], picture: NDArray[np.float32]
) -> None:
    """The picture ``(n, 3)`` of each colour's values by their own numbers ``(n, 3)``; 0 where there is none."""
    for i in range(first, last):
        for c in range(3):
            k = number[i, c]
            picture[i, c] = values[k, c] if k >= 0 else np.float32(0)
