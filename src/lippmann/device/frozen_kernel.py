"""Kernels that are traced once per picture and then only launched.

The reuse renderers trace many short lists of pixels, and the live renderer frame after frame. Telling Dr.Jit anew, list
by list, what to compute takes longer than computing it; a frozen function does so once. It must be shown all device
arrays that the kernel reads.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from types import MethodType
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import arrays_of
from lippmann.device.types import Array
from lippmann.runtime.engine_lock import no_collection

Numbers = NDArray[np.uint32]


def align(numbers: Numbers) -> Numbers:
    """A copy that begins at a whole number of 64 bytes, the widest vector of a processor.

    The device reads host memory in place and would record the kernel anew for every new alignment.
    """
    raw = np.empty(numbers.nbytes + 64, dtype=np.uint8)
    start = -raw.ctypes.data % 64
    copy = raw[start : start + numbers.nbytes].view(np.uint32)
    copy[:] = numbers
    return copy


class Frozen:
    """A kernel that is recorded at its first call and only launched after that.

    Parameters
    ----------
    kernel:
        A function of Dr.Jit arrays of one width (or of width 1), whose results have that width; a method does not keep
        its object alive.
    reads:
        An object through whose attributes all other device arrays are reached that the kernel reads.
    changes:
        Whether other arrays may take their places between two launches.
    """

    def __init__(
        self, kernel: Callable[..., Array | tuple[Array, ...]], reads: object, *, changes: bool = False
    ) -> None:
        self._kernel: Callable[[], Any] = (
            weakref.WeakMethod(kernel) if isinstance(kernel, MethodType) else lambda: kernel
        )
        self._reads, self._known = reads, None if changes else _opaque_arrays(reads)
        # A frozen function is a reference cycle: a scene that it held would live on until some collection, and all
        # kernels that are compiled meanwhile would take in its surfaces and emitters.
        of: Callable[[], Any] = weakref.ref(self)
        self._recorded = dr.freeze(
            lambda *arguments: of()._kernel()(*arguments), state_fn=lambda *_, **__: of()._state()
        )

    def __call__(self, *arguments: Array) -> Array:
        with no_collection():
            return self._recorded(*arguments)

    def _state(self) -> list[object]:
        return self._known or _opaque_arrays(self._reads)


def _opaque_arrays(reads: object) -> list[object]:
    state = arrays_of(reads)
    dr.make_opaque(state)
    return state
