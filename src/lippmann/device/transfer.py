"""Linear light to display codes on the device: the twin of :func:`lippmann.color.transfer.encode`."""

from __future__ import annotations

import drjit as dr

from lippmann.color.transfer import SRGB_EXPONENT, SRGB_OFFSET, SRGB_SLOPE, SRGB_THRESHOLD, Transfer
from lippmann.device.types import FloatOrColor

#: Keeps the power, which is computed for every value, from infinite slopes at 0; far below the curve's straight part.
_LEAST = 1e-9


def encode(linear: FloatOrColor, transfer: Transfer) -> FloatOrColor:
    """Coded values in [0, 1] of linear values, which are clipped to [0, 1]."""
    value = dr.clip(linear, 0, 1)
    if transfer == "linear":
        return value
    curve = (1 + SRGB_OFFSET) * dr.power(dr.maximum(value, _LEAST), 1 / SRGB_EXPONENT) - SRGB_OFFSET
    return dr.select(value <= SRGB_THRESHOLD, SRGB_SLOPE * value, curve)
