"""The display's formulas on the device: Dr.Jit's version of the array operations that ``display/`` is written in.

The formulas themselves stay where they are, in ``display/``. They are evaluated in double precision: a panel is up to
a metre wide, its lens boundaries must be hit to a small part of a pixel, and single precision leaves 0.06 um at best.
"""

from __future__ import annotations

from typing import Any

import drjit as dr


class DeviceOps:
    """Array operations on Dr.Jit arrays, by the names of :class:`lippmann.display.array_ops.ArrayOps`."""

    def floor(self, x: Any, /) -> Any:
        return dr.floor(x)

    def abs(self, x: Any, /) -> Any:
        return dr.abs(x)

    def sqrt(self, x: Any, /) -> Any:
        return dr.sqrt(x)

    def minimum(self, a: Any, b: Any, /) -> Any:
        return dr.minimum(a, b)

    def maximum(self, a: Any, b: Any, /) -> Any:
        return dr.maximum(a, b)

    def where(self, condition: Any, a: Any, b: Any, /) -> Any:
        return dr.select(condition, a, b)


DEVICE = DeviceOps()
