"""Operations whose plain form compiles to slow code on the CPU, or fails at the smallest sizes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.types import Array, Bool, UInt32

#: A multiple of the lanes of any processor's vectors.
_PACKET = 64


def upload(values: NDArray[Any]) -> Array:
    """A flat table on the device in memory of its own: Float, Int32 or UInt32 by the type of ``values``.

    On the CPU Dr.Jit reads a NumPy array where it lies. It is not aligned there as packets of loads need it, so every
    look-up of a row would become one slow gather a column. And the last packet reads on beyond its end, which crashes
    where that is the end of a page; so what is read is filled up to whole packets.
    """
    kinds = {"f": (mi.Float, np.float32), "i": (mi.Int32, np.int32), "u": (mi.UInt32, np.uint32)}
    device_type, dtype = kinds[values.dtype.kind]
    filled = np.zeros(-(-values.size // _PACKET) * _PACKET, dtype)
    filled[: values.size] = values.ravel()
    table = device_type(filled)
    if values.size:
        # Something is added, as Dr.Jit would hand over the array itself where all of it is asked for.
        table = dr.gather(device_type, table, dr.arange(mi.UInt32, values.size)) + dr.opaque(device_type, 0)
        dr.eval(table)
        dr.sync_thread()  # what is read is freed
    return table


def divide(number: UInt32, by: UInt32 | int) -> tuple[UInt32, UInt32]:
    """Quotient and remainder of whole numbers, by one division."""
    quotient = number // by
    return quotient, number - quotient * by


def binary_search(first: int, last: int, goes_on: Callable[[UInt32], Bool]) -> UInt32:
    """First index in [``first``, ``last``] at which ``goes_on`` is false; ``last`` where it holds before that.

    An array for any range; ``dr.binary_search`` returns the Python number itself for a range of one.
    """
    return mi.UInt32(dr.binary_search(first, last, goes_on))


def smaller(a: Array, b: Array) -> Array:
    """The smaller of two numbers; ``b`` where one is NaN.

    One instruction. ``dr.minimum`` is several on x86, because its result is NaN where either is.
    """
    return dr.select(a < b, a, b)


def larger(a: Array, b: Array) -> Array:
    """The larger of two numbers; ``b`` where one is NaN. See :func:`smaller`."""
    return dr.select(a > b, a, b)
