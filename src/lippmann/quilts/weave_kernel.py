"""The compiled part of weaving. It is imported late: loading Numba takes half a second."""

from __future__ import annotations

from typing import Any

from lippmann.runtime.numba_jit import inlined, uncounted


@inlined
def _between(view: Any, channel: int, across: float, down: float) -> float:
    """A value of ``(rows, width, 3)`` at a place, interpolated between its pixels."""
    left, top = int(across), int(down)
    right, bottom = min(left + 1, view.shape[1] - 1), min(top + 1, view.shape[0] - 1)
    part_x, part_y = across - left, down - top
    upper = view[top, left, channel] * (1 - part_x) + view[top, right, channel] * part_x
    lower = view[bottom, left, channel] * (1 - part_x) + view[bottom, right, channel] * part_x
    return float(upper * (1 - part_y) + lower * part_y)


@uncounted
def weave_channel(views: Any, channel: int, number: Any, share: Any, across: Any, down: Any, woven: Any) -> None:
    """One channel of ``woven`` ``(H, W, 3)``: each value from the view ``number`` and, by ``share``, the next one.

    ``views`` is ``(views, rows, width, 3)``; ``across`` and ``down`` are pixel coordinates in them, 0 at the middle of
    the first pixel. These two, ``number`` and ``share`` are ``(H, W)``.
    """
    last = views.shape[0] - 1
    for y in range(woven.shape[0]):
        for x in range(woven.shape[1]):
            first = number[y, x]
            color = _between(views[first], channel, across[y, x], down[y, x])
            if share[y, x] > 0.0:
                color += share[y, x] * (
                    _between(views[min(first + 1, last)], channel, across[y, x], down[y, x]) - color
                )
            woven[y, x, channel] = color
