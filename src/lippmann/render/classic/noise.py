"""Lattice noise as Tachyon makes it: 28 x 28 x 28 whole numbers up to 12000, the same on every machine."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

SIDE = 28
_SEED = 1234567
_MULTIPLIER = 1099087573  # Fishman's, as in landscape.py
_HIGHEST = 12000.0


def lattice() -> NDArray[np.int32]:
    """The values ``(28^3 + 28^2 + 28 + 2,)``, z fastest.

    The last layer of each axis repeats the first. Beyond the end, where interpolation in the last layer reads, the last
    value stands in.
    """
    count = SIDE**3
    drawn = np.empty(count)
    state = _SEED
    for number in range(count):
        state = state * _MULTIPLIER % 2**32
        drawn[number] = state / 2**32
    values = (drawn * _HIGHEST).astype(np.int32).reshape(SIDE, SIDE, SIDE)
    for axis in range(3):
        np.moveaxis(values, axis, 0)[-1] = np.moveaxis(values, axis, 0)[0]
    flat = values.ravel()
    return np.concatenate([flat, np.full(SIDE**2 + SIDE + 2, flat[-1])]).astype(np.int32)


class Noise:
    """The lattice on the device."""

    def __init__(self) -> None:
        self._values = mi.Int32(lattice())

    def at(self, p: Any, active: Any) -> Any:
        """Noise at points: whole numbers from 0 to 12000, mirrored about the planes through the origin.

        Cells join up along z into the next row, as they lie in memory; each step of the interpolation is cut to a
        whole number.
        """
        p = dr.abs(p)
        whole = mi.Vector3u(mi.UInt32(p.x), mi.UInt32(p.y), mi.UInt32(p.z))
        share = p - mi.Vector3f(whole)
        cell = (whole.x % SIDE * SIDE + whole.y % SIDE) * SIDE + whole.z % SIDE

        def value(x: int, y: int, z: int) -> Any:
            return dr.gather(mi.Int32, self._values, cell + (x * SIDE + y) * SIDE + z, active)

        def between(a: Any, b: Any, part: Any) -> Any:
            return a + mi.Int32(mi.Float(b - a) * part)

        along_x = [[between(value(0, y, z), value(1, y, z), share.x) for z in (0, 1)] for y in (0, 1)]
        along_y = [between(along_x[0][z], along_x[1][z], share.y) for z in (0, 1)]
        return mi.Float(between(along_y[0], along_y[1], share.z))
