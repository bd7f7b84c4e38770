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
    color = np.maximum(linear, np.float32(0.0))
    # Channel by channel: NumPy is slow over an axis of three.
    least = np.minimum(np.minimum(color[..., 0], color[..., 1]), color[..., 2])
    color -= np.where(least < 2.0 * _FRESNEL, least - least**2 / (4.0 * _FRESNEL), _FRESNEL)[..., None]
    peak = np.maximum(np.maximum(color[..., 0], color[..., 1]), color[..., 2])
    is_bright = peak >= _COMPRESSED_FROM
    peak, bright = peak[is_bright, None], color[is_bright]
    room = 1.0 - _COMPRESSED_FROM
    compressed = 1.0 - room**2 / (peak + room - _COMPRESSED_FROM)
    white = 1.0 - 1.0 / (_DESATURATION * (peak - compressed) + 1.0)
    color[is_bright] = bright * (compressed / peak) * (1.0 - white) + compressed * white
    return color
