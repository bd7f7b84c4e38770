"""The few array functions that the display's geometry is written against.

Every formula of this package uses operators and an :class:`ArrayOps` only, so that the very same code runs on NumPy
arrays here and on the renderer's device arrays there. Coordinates must be double precision on both: at single
precision a coordinate on a panel of 28 000 pixels is known to about a thousandth of a pixel, too coarse for the
boundaries between lenses.
"""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias

import numpy as np

#: An array (or scalar) of reals of the kind that the ``ops`` in use understand. ``Any``, because NumPy and Dr.Jit share
#: operators but no type, and Dr.Jit's arrays are untyped.
Array: TypeAlias = Any


class ArrayOps(Protocol):
    """Element-wise functions; ``where`` takes a condition made by a comparison of arrays."""

    def floor(self, a: Array, /) -> Array: ...

    def sqrt(self, a: Array, /) -> Array: ...

    def sin(self, a: Array, /) -> Array: ...

    def cos(self, a: Array, /) -> Array: ...

    def abs(self, a: Array, /) -> Array: ...

    def minimum(self, a: Array, b: Array, /) -> Array: ...

    def maximum(self, a: Array, b: Array, /) -> Array: ...

    def where(self, condition: Array, a: Array, b: Array, /) -> Array: ...

    def interpolate(self, values: Array, at: Array, /) -> Array:
        """``values``, two or more numbers, between their indices, linearly; ``at`` lies from 0 to the last index."""
        ...


class _NumpyOps:
    """NumPy's own functions under the names of :class:`ArrayOps`."""

    floor = staticmethod(np.floor)
    sqrt = staticmethod(np.sqrt)
    sin = staticmethod(np.sin)
    cos = staticmethod(np.cos)
    abs = staticmethod(np.abs)
    minimum = staticmethod(np.minimum)
    maximum = staticmethod(np.maximum)
    where = staticmethod(np.where)

    @staticmethod
    def interpolate(values: Array, at: Array, /) -> Array:
        return np.interp(at, np.arange(len(values)), values)


NUMPY: ArrayOps = _NumpyOps()
