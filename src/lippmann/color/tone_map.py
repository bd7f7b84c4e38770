"""Scene light into the range of a display: Khronos PBR Neutral.

The curve is that of the Khronos PBR Neutral Tone Mapper specification (2024): it takes off the light that a surface of
refractive index 1.5 reflects head on, so that base colours come out as they are, keeps values up to 0.8 and compresses
brighter ones towards white.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Reflectance of a surface of index 1.5 head on.
_FRESNEL = 0.04
#: Where compression begins, after that is taken off, and how fast bright colours turn white.
_COMPRESSED_FROM = 0.8 - _FRESNEL
_DESATURATION = 0.15


def pbr_neutral(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear RGB ``(..., 3)`` in [0, 1] of linear RGB; negative values count as 0."""
    color = np.maximum(linear, 0.0)
    least = color.min(axis=-1, keepdims=True)
    color = color - np.where(least < 2.0 * _FRESNEL, least - least**2 / (4.0 * _FRESNEL), _FRESNEL)
    peak = color.max(axis=-1, keepdims=True)
    room = 1.0 - _COMPRESSED_FROM
    compressed = 1.0 - room**2 / (np.maximum(peak, _COMPRESSED_FROM) + room - _COMPRESSED_FROM)
    white = 1.0 - 1.0 / (_DESATURATION * (np.maximum(peak, _COMPRESSED_FROM) - compressed) + 1.0)
    bright = color * (compressed / np.maximum(peak, _COMPRESSED_FROM)) * (1.0 - white) + compressed * white
    return np.where(peak < _COMPRESSED_FROM, color, bright).astype(np.float32)
