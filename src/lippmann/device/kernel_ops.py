"""Small operations on the device: those that ``display/`` is written in, uploads, sRGB codes, an object's arrays.

Some have a plain form that compiles to slow code on the CPU, or fails at the smallest sizes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Any, TypeVar, cast

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import (
    COMPRESSED_FROM,
    DESATURATION,
    FRESNEL,
    SRGB_EXPONENT,
    SRGB_OFFSET,
    SRGB_SLOPE,
    SRGB_THRESHOLD,
    Coding,
)
from lippmann.device.types import Array, Bool, Color3f, Float, FloatOrColor, UInt32
from lippmann.display import Display
from lippmann.display.distortion import Distortion

T = TypeVar("T")


def upload(values: NDArray[Any]) -> Array:
    """A flat table on the device in memory of its own: Float, Int32, UInt32 or UInt8 by the type of ``values``.

    On the CPU Dr.Jit would read a NumPy array where it lies. It is not aligned there as packets of loads need it, so
    every look-up of a row would become one slow gather a column, or not, by chance: kernels would be compiled for both.
    And the last packet reads on beyond its end, which crashes where that is the end of a page. So the values are copied
    to memory that Dr.Jit allocates.
    """
    kinds = {"f": (mi.Float, np.float32), "i": (mi.Int32, np.int32), "u": (mi.UInt32, np.uint32)}
    device_type, dtype = (mi.UInt8, np.uint8) if values.dtype == np.uint8 else kinds[values.dtype.kind]
    on_cpu = dr.backend_v(device_type) == dr.JitBackend.LLVM
    table = dr.empty(device_type, values.size) if on_cpu else device_type(values.astype(dtype).ravel())
    dr.sync_thread()  # kernels may still use the memory that is written; and what was read is freed
    if on_cpu:
        np.asarray(table).reshape(values.shape)[...] = values
    return table


def to_numpy(value: Array, lanes: int) -> NDArray[np.float32]:
    """``(lanes,)`` or ``(lanes, channels)``; an array of width 1 is broadcast.

    Channel by channel: all at once would take a kernel that holds the number of lanes, and is compiled for each.
    """
    dr.eval(value)
    if dr.depth_v(value) == 1:
        return np.array(np.broadcast_to(np.asarray(value), lanes), dtype=np.float32)
    channels = [np.broadcast_to(np.asarray(channel), lanes) for channel in value]
    return np.stack(channels, axis=-1, dtype=np.float32)


def divide(number: UInt32, by: UInt32 | int) -> tuple[UInt32, UInt32]:
    """Quotient and remainder of whole numbers, by one division."""
    quotient = number // by
    return quotient, number - quotient * by


def transform_vector(matrix: NDArray[np.floating], vector: Array) -> list[Float]:
    """A vector by the linear part of an affine map, ``(4, 4)`` or some of its first three rows.

    Opaque to the compiler, as :func:`transform_point` is: all pictures share a kernel, wherever their display stands.
    """
    return [sum(dr.opaque(mi.Float, float(m)) * a for m, a in zip(row[:3], vector, strict=True)) for row in matrix[:3]]


def transform_point(matrix: NDArray[np.floating], point: Array) -> list[Float]:
    """A point by an affine map, ``(4, 4)`` or some of its first three rows."""
    turned = transform_vector(matrix, point)
    return [value + dr.opaque(mi.Float, float(offset)) for value, offset in zip(turned, matrix[:3, 3], strict=True)]


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


#: Integrators and materials are shallow; what lies deeper belongs to others.
_DEEPEST = 12


def arrays_of(whole: object) -> list[object]:
    """Dr.Jit arrays and Mitsuba's objects in an object, in its parts and theirs, each once.

    Parts are items of collections, fields of dataclasses and attributes of this project's objects.
    """
    arrays: list[object] = []
    _collect(whole, arrays, set(), 0)
    return arrays


def _collect(value: object, arrays: list[object], visited: set[int], depth: int) -> None:
    if id(value) in visited or depth > _DEEPEST:
        return
    visited.add(id(value))
    if isinstance(value, mi.Object) or type(value).__module__.split(".")[0] in ("drjit", "mitsuba"):
        # Arrays without entries have no variable behind them.
        if not dr.is_array_v(value) or dr.width(value) > 0:
            arrays.append(value)
    elif isinstance(value, dict):
        for item in value.values():
            _collect(item, arrays, visited, depth + 1)
    elif isinstance(value, (list, tuple, set, frozenset)):
        for item in value:
            _collect(item, arrays, visited, depth + 1)
    elif hasattr(value, "__dict__") and (is_dataclass(value) or type(value).__module__.startswith("lippmann.")):
        _collect(vars(value), arrays, visited, depth + 1)


class DeviceOps:
    """Array operations on Dr.Jit arrays, by the names of :class:`lippmann.display.array_ops.ArrayOps`."""

    def floor(self, x: Array, /) -> Array:
        return dr.floor(x)

    def abs(self, x: Array, /) -> Array:
        return dr.abs(x)

    def sqrt(self, x: Array, /) -> Array:
        return dr.sqrt(x)

    def sin(self, x: Array, /) -> Array:
        return dr.sin(x)

    def cos(self, x: Array, /) -> Array:
        return dr.cos(x)

    def minimum(self, a: Array, b: Array, /) -> Array:
        return dr.minimum(a, b)

    def maximum(self, a: Array, b: Array, /) -> Array:
        return dr.maximum(a, b)

    def where(self, condition: Bool, a: Array, b: Array, /) -> Array:
        return dr.select(condition, a, b)

    def interpolate(self, values: Array, at: Array, /) -> Array:
        table, first = mi.Float64(values), dr.minimum(dr.floor(at), len(values) - 2.0)
        low, high = (dr.gather(mi.Float64, table, mi.UInt32(first) + k) for k in (0, 1))
        return dr.fma(at - first, high - low, low)


DEVICE = DeviceOps()


def upload_display(display: Display) -> Display:
    """The display for formulas on the device: its numbers are arrays of width 1, opaque to the compiler.

    As Python numbers they would be literals of every kernel, and each display and size of panel would compile all of
    them anew. Its layout, the number of its sub-pixel cells and which tables it has still decide what is compiled.
    """
    # Derived before the numbers are arrays.
    _ = display.lattice.axis, display.distortion and display.distortion.inverse_factors
    return _upload(display)


def _upload(value: T) -> T:
    """A value with arrays in place of the numbers in it, and of those that it has derived."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return cast("T", dr.opaque(mi.Float64, value))
    if isinstance(value, tuple):
        return cast("T", tuple(_upload(part) for part in value))
    if not is_dataclass(value):
        return value
    twin = object.__new__(type(value))
    for name, part in vars(value).items():
        # Factors are read by their indices.
        is_table = isinstance(value, Distortion) and isinstance(part, tuple)
        vars(twin)[name] = mi.Float64(list(part)) if is_table else _upload(part)
    return cast("T", twin)


def encode(linear: Color3f, coding: Coding) -> Color3f:
    """Coded values in [0, 1] of linear values, see :func:`lippmann.color.transfer.encode`."""
    value = dr.clip(pbr_neutral(linear) if coding == "pbr-neutral" else linear, 0, 1)
    return value if coding == "linear" else linear_to_srgb(value)


def pbr_neutral(linear: Color3f) -> Color3f:
    """See :func:`lippmann.color.transfer.pbr_neutral`."""
    color = dr.maximum(linear, 0)
    least = dr.min(color)
    color -= dr.select(least < 2 * FRESNEL, least - dr.square(least) / (4 * FRESNEL), FRESNEL)
    peak = dr.max(color)
    room = 1 - COMPRESSED_FROM
    compressed = 1 - room**2 / (dr.maximum(peak, COMPRESSED_FROM) + room - COMPRESSED_FROM)
    white = 1 - 1 / (DESATURATION * (peak - compressed) + 1)
    bright = color * (compressed / peak) * (1 - white) + compressed * white
    return dr.select(peak >= COMPRESSED_FROM, bright, color)


def linear_to_srgb(linear: FloatOrColor) -> FloatOrColor:
    """sRGB codes of linear values, 0 or more: the curve goes on above 1."""
    curve = (1 + SRGB_OFFSET) * dr.power(dr.maximum(linear, SRGB_THRESHOLD), 1 / SRGB_EXPONENT) - SRGB_OFFSET
    return dr.select(linear <= SRGB_THRESHOLD, SRGB_SLOPE * dr.maximum(linear, 0), curve)


def srgb_to_linear(code: Color3f) -> Color3f:
    """The inverse of :func:`linear_to_srgb`."""
    threshold = SRGB_SLOPE * SRGB_THRESHOLD
    curve = dr.power((dr.maximum(code, threshold) + SRGB_OFFSET) / (1 + SRGB_OFFSET), SRGB_EXPONENT)
    return dr.select(code <= threshold, dr.maximum(code, 0) / SRGB_SLOPE, curve)
