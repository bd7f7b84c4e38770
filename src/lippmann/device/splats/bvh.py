"""A bounding volume hierarchy over the boxes of Gaussians.

Nodes are split where the surface area heuristic says, over bins along the axis on which the boxes' middles spread most
(Wald 2007, "On fast construction of SAH-based bounding volume hierarchies"). Large Gaussians end in nodes of their own,
which a split at the median would not bring about.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import compiled, inlined

#: Most Gaussians of a leaf.
LEAF = 4
_BINS = 16
#: Beyond this depth nodes are halved as they stand: no arrangement makes a tree deeper than the stack of a walk.
_LAST_WEIGHED = 40

Floats = NDArray[np.float32]
Integers = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class SplatBvh:
    """``boxes`` ``(m, 2, 3)`` float32 of nodes, the root first.

    ``first`` and ``size`` ``(m,)`` are, of a leaf, its run of ``order``, and of an inner node the first of its two
    children, which stand side by side, and 0. ``order`` ``(n,)`` holds the numbers of the boxes.
    """

    boxes: Floats
    first: Integers
    size: Integers
    order: Integers


def make_bvh(boxes: Floats) -> SplatBvh:
    """The hierarchy over boxes ``(n, 2, 3)``, n at least 1."""
    count = len(boxes)
    order = np.arange(count, dtype=np.int32)
    most = 2 * count
    node_boxes = np.empty((most, 2, 3), np.float32)
    first, size = np.empty(most, np.int32), np.empty(most, np.int32)
    made = _build(boxes, order, node_boxes, first, size)
    return SplatBvh(node_boxes[:made].copy(), first[:made].copy(), size[:made].copy(), order)


@inlined
def _area(low: Floats, high: Floats) -> float:
    """Half the area of a box."""
    x, y, z = high[0] - low[0], high[1] - low[1], high[2] - low[2]
    return float(x * y + y * z + z * x)


@inlined
def _clear(low: Floats, high: Floats) -> None:
    """Make a box empty; a loop compiles in a fraction of the time that assignments to slices take."""
    for k in range(3):
        low[k], high[k] = np.inf, -np.inf


@inlined
def _push(stack: NDArray[np.int64], place: int, node: int, start: int, stop: int, depth: int) -> None:
    stack[place, 0], stack[place, 1], stack[place, 2], stack[place, 3] = node, start, stop, depth


@compiled
def _build(boxes: Floats, order: Integers, node_boxes: Floats, first: Integers, size: Integers) -> int:
    """Fill in the nodes, and sort ``order`` into runs of leaves; the number of nodes."""
    stack = np.empty((128, 4), np.int64)  # node, start, stop, depth
    _push(stack, 0, 0, 0, len(order), 0)
    waiting, made = 1, 1
    low_of, high_of = np.empty((_BINS, 3), np.float32), np.empty((_BINS, 3), np.float32)
    members = np.empty(_BINS, np.int64)
    after = np.empty(_BINS)
    low, high = np.empty(3, np.float32), np.empty(3, np.float32)
    middle_low, middle_high = np.empty(3, np.float32), np.empty(3, np.float32)
    while waiting > 0:
        waiting -= 1
        node, start, stop, depth = stack[waiting, 0], stack[waiting, 1], stack[waiting, 2], stack[waiting, 3]
        _clear(low, high)
        _clear(middle_low, middle_high)
        for place in range(start, stop):
            for k in range(3):
                a, b = boxes[order[place], 0, k], boxes[order[place], 1, k]
                low[k], high[k] = min(low[k], a), max(high[k], b)
                middle = 0.5 * a + 0.5 * b
                middle_low[k], middle_high[k] = min(middle_low[k], middle), max(middle_high[k], middle)
        for k in range(3):
            node_boxes[node, 0, k], node_boxes[node, 1, k] = low[k], high[k]
        if stop - start <= LEAF:
            first[node], size[node] = start, stop - start
            continue
        axis = 0
        for k in range(1, 3):
            if middle_high[k] - middle_low[k] > middle_high[axis] - middle_low[axis]:
                axis = k
        extent = middle_high[axis] - middle_low[axis]
        cut = start + (stop - start) // 2
        if extent > 0.0 and depth < _LAST_WEIGHED:
            for b in range(_BINS):
                members[b] = 0
                _clear(low_of[b], high_of[b])
            per_bin = _BINS / extent
            for place in range(start, stop):
                number = order[place]
                middle = 0.5 * boxes[number, 0, axis] + 0.5 * boxes[number, 1, axis]
                bin_ = min(int((middle - middle_low[axis]) * per_bin), _BINS - 1)
                members[bin_] += 1
                for k in range(3):
                    low_of[bin_, k] = min(low_of[bin_, k], boxes[number, 0, k])
                    high_of[bin_, k] = max(high_of[bin_, k], boxes[number, 1, k])
            _clear(low, high)
            count = 0
            for b in range(_BINS - 1, 0, -1):
                count += members[b]
                for k in range(3):
                    low[k], high[k] = min(low[k], low_of[b, k]), max(high[k], high_of[b, k])
                after[b] = count * _area(low, high) if count > 0 else np.inf
            _clear(low, high)
            count = 0
            best, split = np.inf, 0
            for b in range(1, _BINS):
                count += members[b - 1]
                for k in range(3):
                    low[k], high[k] = min(low[k], low_of[b - 1, k]), max(high[k], high_of[b - 1, k])
                if count > 0:
                    cost = count * _area(low, high) + after[b]
                    if cost < best:
                        best, split = cost, b
            if split > 0:
                left, right = start, stop - 1
                while left <= right:
                    number = order[left]
                    middle = 0.5 * boxes[number, 0, axis] + 0.5 * boxes[number, 1, axis]
                    if min(int((middle - middle_low[axis]) * per_bin), _BINS - 1) < split:
                        left += 1
                    else:
                        order[left], order[right] = order[right], number
                        right -= 1
                cut = left
        first[node], size[node] = made, 0
        _push(stack, waiting, made + 1, cut, stop, depth + 1)
        _push(stack, waiting + 1, made, start, cut, depth + 1)
        waiting += 2
        made += 2
    return made
