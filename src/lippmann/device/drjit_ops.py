"""The display's formulas on the device: Dr.Jit's version of the array operations that ``display/`` is written in.

The formulas themselves stay where they are, in ``display/``. They are evaluated in double precision: a panel is up to
a metre wide, its lens boundaries must be hit to a small part of a pixel, and single precision leaves 0.06 um at best.
"""

from __future__ import annotations

import drjit as dr

from lippmann.device.types import Array, Bool


class DeviceOps:
    """Array operations on Dr.Jit arrays, by the names of :class:`lippmann.display.array_ops.ArrayOps`."""

    def floor(self, x: Array, /) -> Array:
        return dr.floor(x)

    def abs(self, x: Array, /) -> Array:
        return dr.abs(x)

    def sqrt(self, x: Array, /) -> Array:
        return dr.sqrt(x)

    def minimum(self, a: Array, b: Array, /) -> Array:
        return dr.minimum(a, b)

    def maximum(self, a: Array, b: Array, /) -> Array:
        return dr.maximum(a, b)

    def where(self, condition: Bool, a: Array, b: Array, /) -> Array:
        return dr.select(condition, a, b)


DEVICE = DeviceOps()
