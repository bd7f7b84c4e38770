"""Kernels over the pixels of a picture, in parts that take little memory."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.types import Array, UInt32
from lippmann.rendering.film.memory_model import PREFERRED_LANES


def light_of_pixels(mean_light: Callable[[UInt32], Array], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """A picture ``(H, W, C)`` of that ``shape``; ``mean_light`` gives the light of pixels by their numbers."""
    light = np.empty((shape[0] * shape[1], shape[2]), dtype=np.float32)
    for first in range(0, len(light), PREFERRED_LANES):
        part = light[first : first + PREFERRED_LANES]
        part[:] = np.array(mean_light(dr.arange(mi.UInt32, len(part)) + dr.opaque(mi.UInt32, first))).T
    return light.reshape(shape)
