"""The weight of each value, which some layouts keep as a fourth colour: linear, full at the type's highest code."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def weight_codes(weight: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Weights in [0, 1] as values of a type of colours: codes, rounded to the nearest, or floats."""
    if dtype.kind == "f":
        return weight.astype(dtype)
    top = np.iinfo(dtype).max
    return np.floor(np.clip(weight.astype(np.float64), 0, 1) * top + 0.5).astype(dtype)


def weights(codes: NDArray[Any]) -> NDArray[np.float32]:
    """Weights as float32; :func:`weight_codes` gives the codes back."""
    top = 1.0 if codes.dtype.kind == "f" else np.iinfo(codes.dtype).max
    return (codes.astype(np.float64) / top).astype(np.float32)
