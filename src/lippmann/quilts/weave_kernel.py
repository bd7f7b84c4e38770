"""The compiled kernel of weaving. It is imported late: loading Numba takes half a second."""

from __future__ import annotations

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


@uncounted
def weave_channel(
    views: FloatArray, channel: int, number: NDArray[np.intp], share: Real, across: Real, down: Real, woven: FloatArray
) -> None:
    """Fill one channel of ``woven`` ``(H, W, 3)`` with samples of the views.

    ``views`` is ``(views, rows, width, 3)``. The other arrays are ``(H, W)``: ``number`` is a view, ``share`` the
    weight of the next one, ``across`` and ``down`` are pixel coordinates in them, 0 at the centre of the first pixel.
    """
    last = views.shape[0] - 1
    for y in range(woven.shape[0]):
        for x in range(woven.shape[1]):
            first = number[y, x]
            color = _interpolate(views[first], channel, across[y, x], down[y, x])
            if share[y, x] > 0.0:
                color += share[y, x] * (
                    _interpolate(views[min(first + 1, last)], channel, across[y, x], down[y, x]) - color
                )
            woven[y, x, channel] = color
