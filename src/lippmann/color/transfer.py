"""Linear light to display codes and back, the slope of the curve, and the tone map before it.

The tone map is Khronos PBR Neutral (specification of 2024): it takes off the light that a surface of refractive index
1.5 reflects head on, so that base colours come out as they are, keeps values up to 0.8 and compresses brighter ones
towards white.

The curve is that of IEC 61966-2-1 (sRGB). Codes of ``bits`` bits stand for coded values ``code / (2**bits - 1)``; a
value between two codes goes to the nearer one, values outside [0, 1] to the nearest end. ``code -> linear -> code`` is
the identity for both bit depths and both transfers.
"""

from __future__ import annotations

from functools import lru_cache, reduce
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: How linear values become the codes of integer formats: ``srgb`` by the sRGB curve, ``linear`` by scaling alone (what
#: the papers' programs did: the value itself is the display code).
Transfer = Literal["srgb", "linear"]

#: How linear light becomes the codes between which errors are measured: by a curve, or by the tone map and sRGB.
Coding = Literal[Transfer, "pbr-neutral"]

FloatArray = NDArray[np.float32]

#: The sRGB curve: a line of this slope up to the threshold, then a power of this exponent, scaled and offset.
SRGB_THRESHOLD, SRGB_SLOPE, SRGB_EXPONENT, SRGB_OFFSET = 0.0031308, 12.92, 2.4, 0.055

#: Values coded at a time: keeps the temporary arrays small beside the picture.
_BLOCK = 1 << 22


def encode_srgb(linear: NDArray[np.floating]) -> NDArray[np.floating]:
    """sRGB-coded values in [0, 1] of linear values, which are clipped to [0, 1]; same shape and precision."""
    value: NDArray[np.floating] = np.clip(linear, 0, 1)
    curve = (1 + SRGB_OFFSET) * value ** (1 / SRGB_EXPONENT) - SRGB_OFFSET
    return np.where(value <= SRGB_THRESHOLD, SRGB_SLOPE * value, curve)


def encode(linear: NDArray[np.floating], coding: Coding) -> NDArray[np.floating]:
    """Coded values in [0, 1] of linear values, RGB ``(..., 3)`` for a tone map; same shape and precision."""
    if coding == "linear":
        return np.asarray(np.clip(linear, 0, 1))
    return encode_srgb(pbr_neutral(linear) if coding == "pbr-neutral" else linear)


def decode_srgb(coded: ArrayLike) -> NDArray[np.float64]:
    """Linear values of sRGB-coded ones; same shape. The curve's line goes on below 0, its power above 1."""
    value = np.asarray(coded, np.float64)
    # The floor keeps the power, computed for every value, from roots of negative numbers.
    curve = ((np.maximum(value, 0.0) + SRGB_OFFSET) / (1 + SRGB_OFFSET)) ** SRGB_EXPONENT
    return np.where(value <= 0.04045, value / SRGB_SLOPE, curve)


def coding_slope(linear: NDArray[np.floating], coding: Coding = "srgb") -> NDArray[np.float32]:
    """Slope of the coding: by how much a code in [0, 1] changes with its linear value; 0 outside [0, 1].

    A tone map mixes colours. Its slope is that along the pixel's own colour, ``(..., 3)``: most noise is of brightness.
    """
    return encode_with_slope(linear, coding)[1]


def encode_with_slope(linear: NDArray[np.floating], coding: Coding) -> tuple[NDArray[np.floating], NDArray[np.float32]]:
    """What :func:`encode` and :func:`coding_slope` return, by one tone map and one power for both."""
    if coding == "pbr-neutral":
        along, _, mapped = _tone_chord((1 - _SLOPE_STEP) * linear, linear)
        codes, slope = encode_with_slope(mapped, "srgb")
        return codes, np.asarray(along * slope, np.float32)
    inside = (linear >= 0) & (linear <= 1)
    if coding == "linear":
        return encode(linear, coding), inside.astype(np.float32)
    is_line = linear <= SRGB_THRESHOLD
    x = np.clip(linear, SRGB_THRESHOLD, 1)
    curve = (1 + SRGB_OFFSET) * x ** (1 / SRGB_EXPONENT)
    codes = np.where(is_line, SRGB_SLOPE * np.maximum(linear, 0), curve - SRGB_OFFSET)
    slope = np.where(is_line, SRGB_SLOPE, curve / (SRGB_EXPONENT * x))
    return codes, np.where(inside, slope, 0).astype(np.float32)


def coding_chord(low: NDArray[np.floating], high: NDArray[np.floating], coding: Coding) -> NDArray[np.float32]:
    """Slope of the coding between two values, ``low`` at most ``high``; that at ``high`` where they are the same."""
    if coding == "pbr-neutral":
        along, mapped_low, mapped = _tone_chord(low, high)
        return np.asarray(along * coding_chord(mapped_low, mapped, "srgb"), np.float32)
    step = np.asarray(high - low)
    same = step <= _LEAST_STEP
    chord = np.asarray((encode(high, coding) - encode(low, coding)) / np.where(same, 1, step), np.float32)
    chord[same] = coding_slope(high[same], coding)
    return chord


def _tone_chord(
    low: NDArray[np.floating], high: NDArray[np.floating]
) -> tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]:
    """Slope of the tone map between two values ``(..., 3)``, ``low`` at most ``high``, and what it makes of both."""
    mapped_low, mapped = pbr_neutral(low), pbr_neutral(high)
    # A channel moves its own value by 1 at most: what a bright colour's white adds to dark ones is not theirs.
    along = np.clip((mapped - mapped_low) / np.maximum(high - low, np.float32(_LEAST_STEP)), 0, 1)
    return along, mapped_low, mapped


def quantize(linear: FloatArray, bits: int, transfer: Transfer) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Codes (uint8 for 8 bits, uint16 for 16) of linear values; same shape, always C-contiguous."""
    codes = np.empty(linear.shape, dtype=np.uint8 if bits == 8 else np.uint16)
    top = 2**bits - 1
    source, target = np.ascontiguousarray(linear).reshape(-1), codes.reshape(-1)
    for start in range(0, source.size, _BLOCK):
        block = source[start : start + _BLOCK]
        coded = encode(block, transfer)
        target[start : start + _BLOCK] = np.floor(coded * top + np.float32(0.5))
    return codes


def dequantize(codes: NDArray[np.uint8] | NDArray[np.uint16], transfer: Transfer) -> FloatArray:
    """Linear float32 values of uint8 or uint16 codes; same shape."""
    # One table look-up per value: exact in double precision, and quicker than the curve itself.
    return linear_levels(codes.dtype, transfer)[codes]


@lru_cache(maxsize=4)
def linear_levels(dtype: np.dtype[np.uint8] | np.dtype[np.uint16], transfer: Transfer) -> FloatArray:
    """The linear values of all codes of a type, uint8 or uint16, in their order; not to be changed."""
    top = np.iinfo(dtype).max
    levels = np.arange(top + 1, dtype=np.float64) / top
    return (decode_srgb(levels) if transfer == "srgb" else levels).astype(np.float32)


#: Reflectance of a surface of index 1.5 head on.
FRESNEL = 0.04
#: Value, after that is taken off, at which compression begins; and how fast bright colours turn white.
COMPRESSED_FROM = 0.8 - FRESNEL
DESATURATION = 0.15
#: Share of a value by which it is changed for the slope of the tone map; the least change that says anything.
_SLOPE_STEP = np.float32(0.01)
_LEAST_STEP = 1e-6


def over_channels(operation: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
    """``operation.reduce(values, axis=-1)`` of ``(..., C)``; a view where C is 1.

    NumPy's own takes ten times as long over an axis of three.
    """
    result: NDArray[Any] = reduce(operation, np.moveaxis(values, -1, 0))
    return result


def pbr_neutral(linear: NDArray[np.floating]) -> NDArray[np.floating]:
    """Linear RGB ``(..., 3)`` in [0, 1] of linear RGB; negative values count as 0."""
    color: NDArray[np.floating] = np.maximum(linear, np.float32(0.0))
    least = over_channels(np.minimum, color)
    color -= np.where(least < 2.0 * FRESNEL, least - least**2 / (4.0 * FRESNEL), FRESNEL)[..., None]
    peak = over_channels(np.maximum, color)
    is_bright = peak >= COMPRESSED_FROM
    peak, bright = peak[is_bright, None], color[is_bright]
    room = 1.0 - COMPRESSED_FROM
    compressed = 1.0 - room**2 / (peak + room - COMPRESSED_FROM)
    white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0)
    color[is_bright] = bright * (compressed / peak) * (1.0 - white) + compressed * white
    return color
