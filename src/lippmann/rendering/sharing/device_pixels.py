"""Pictures on the device, and kernels over their pixels in parts that take little memory."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lippmann.device.types import Array, Float, UInt32
from lippmann.rendering.film.memory_model import PREFERRED_LANES


def upload(*arrays: ArrayLike) -> list[Float]:
    """Each array in one row on the device, in single precision."""
    return [mi.Float(np.ascontiguousarray(values, dtype=np.float32).ravel()) for values in arrays]


def light_of_pixels(mean_light: Callable[[UInt32], Array], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """A picture ``(H, W, C)`` of that ``shape``; ``mean_light`` gives the light of pixels by their numbers."""
    light = np.empty((shape[0] * shape[1], shape[2]), dtype=np.float32)
    for first in range(0, len(light), PREFERRED_LANES):
        part = light[first : first + PREFERRED_LANES]
        part[:] = np.array(mean_light(dr.arange(mi.UInt32, len(part)) + dr.opaque(mi.UInt32, first))).T
    return light.reshape(shape)
