"""Colours of vertices, as programs write them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Colours in [0, 1] overshoot it by less; real numbers beyond it count to 255.
_MOST_OVERSHOOT = 2.0


def full_brightness(colors: NDArray[np.floating]) -> float:
    """Value of full brightness of colours that are real numbers: 1, or 255 where one of them exceeds it by far."""
    return 255.0 if np.nanmax(colors, initial=0.0) > _MOST_OVERSHOOT else 1.0
