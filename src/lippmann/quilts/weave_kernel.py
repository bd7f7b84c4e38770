"""The compiled kernel of weaving. It is imported late: loading Numba takes half a second."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.image.stored_values import FloatArray
from lippmann.runtime.numba_jit import inlined, uncounted

Real = NDArray[np.float64]


@inlined
def _interpolate(view: FloatArray, channel: int, across: float, down: float) -> float:
    """Bilinear interpolation of ``view`` ``(rows, width, 3)`` at a position in pixels."""
    left, top = int(across), int(down)
    right, bottom = min(left + 1, view.shape[1] - 1), min(top + 1, view.shape[0] - 1)
    part_x, part_y = across - left, down - top
    upper = view[top, left, channel] * (1 - part_x) + view[top, right, channel] * part_x
    lower = view[bottom, left, channel] * (1 - part_x) + view[bottom, right, channel] * part_x
    return float(upper * (1 - part_y) + lower * part_y)


@inlined
def _at(values: NDArray[Any], y: int, x: int) -> Any:
    """An element of an array that broadcasts to the pixels: ``(H or 1, W or 1)``."""
    return values[min(y, values.shape[0] - 1), min(x, values.shape[1] - 1)]


@uncounted
def weave_channel(
    views: FloatArray, channel: int, number: NDArray[np.intp], share: Real, across: Real, down: Real, woven: FloatArray
) -> None:
    """Fill one channel of ``woven`` ``(H, W, 3)`` with samples of the views.

    ``views`` is ``(views, rows, width, 3)``. The other arrays broadcast to ``(H, W)``: ``number`` is a view, ``share``
    the weight of the next one, ``across`` and ``down`` are pixel coordinates in them, 0 at the centre of the first
    pixel. They come as they are: for arrays with strides of 0 Numba would compile the kernel anew.
    """
    last = views.shape[0] - 1
    for y in range(woven.shape[0]):
        for x in range(woven.shape[1]):
            first, part, right, below = _at(number, y, x), _at(share, y, x), _at(across, y, x), _at(down, y, x)
            color = _interpolate(views[first], channel, right, below)
            if part > 0.0:
                color += part * (_interpolate(views[min(first + 1, last)], channel, right, below) - color)
            woven[y, x, channel] = color
