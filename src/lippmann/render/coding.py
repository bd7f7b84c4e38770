"""What the coding curve does to small errors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.image.provenance import Transfer


def coding_slope(linear: NDArray[Any], transfer: Transfer = "srgb") -> NDArray[np.float32]:
    """By how much a code in [0, 1] changes with its linear value; 0 where it is cut off, below 0 and above 1.

    The sRGB curve is that of IEC 61966-2-1: straight up to 0.0031308, a power above.
    """
    inside = (linear >= 0) & (linear <= 1)
    if transfer == "linear":
        return inside.astype(np.float32)
    x = np.clip(linear, 0.0031308, 1)
    slope = np.where(linear <= 0.0031308, 12.92, (1.055 / 2.4) * x ** (1 / 2.4 - 1))
    return np.where(inside, slope, 0).astype(np.float32)
