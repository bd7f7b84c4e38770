"""A bounding volume hierarchy without a stack, in the order in which a ray walks it.

Nodes are split where the surface area heuristic says, along the longest side of the box around their members' centres
(MacDonald and Booth 1990). The tree is laid out depth first, each node saying how many entries to skip where its box is
missed ("skip pointers", Smits 1998), so that a ray keeps one index and nothing more. Eight layouts, one for each octant
of ray directions, visit the nearer child first. All nodes of a level are split at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.whitted_shapes import Numbers

#: Layouts, by the signs of a direction: 1 for x < 0, 2 for y < 0, 4 for z < 0.
OCTANTS = 8
#: Steps of the grid on which the corners of boxes lie: a node then is four words, one fetch.
GRID = 1 << 16
#: Last words from here on are leaves.
LEAF = 1 << 31
#: Nodes with more members are halved at their median: the heuristic would not pay for its own time.
_MOST_WEIGHED = 1 << 16
#: From this level on all nodes are halved, so that no arrangement of members makes a tree as deep as they are many.
_LAST_WEIGHED_LEVEL = 48

Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Tree:
    """``levels`` are the first numbers of each level's nodes; ``left`` is -1 for leaves, ``right`` always left + 1."""

    levels: list[int]
    start: Whole
    stop: Whole
    left: Whole
    axis: Whole
    order: Whole


@dataclass(frozen=True, eq=False)
class Bvh:
    """Layouts ``(8, 2 n - 1, 4)`` uint32 over a grid of 2^16 steps along each axis.

    A node is x, y and z, each near | far << 16 in steps of ``step (3,)`` from ``origin (3,)``, and a last word: below
    ``LEAF`` how many entries to skip where the box is missed, else ``LEAF`` + the index of the one box inside. Near is
    the side at which rays of the layout's octant enter: the lower one where they go up the axis, else the higher one.
    """

    nodes: NDArray[np.uint32]
    origin: Numbers
    step: Numbers

    @property
    def count(self) -> int:
        return int(self.nodes.shape[1])


def make_bvh(boxes: Numbers) -> Bvh:
    """The tree over boxes ``(n, 2, 3)``, n at least 1."""
    tree = _grow(boxes)
    low, high, sizes = _gather_up(tree, boxes)
    size = np.maximum(high[0] - low[0], 1e-6 * max(np.abs(boxes).max(), 1e-30))
    # One step of margin on each side for rounding on the device, and boxes grow to whole steps.
    step = size / (GRID - 5)
    origin = low[0] - 2 * step
    corners = np.floor((low - origin) / step) - 1, np.ceil((high - origin) / step) + 1
    sides = np.stack([corner.astype(np.uint32) for corner in corners])
    last = np.where(tree.left < 0, LEAF + tree.order[tree.start], sizes).astype(np.uint32)
    layouts = np.empty((OCTANTS, len(last), 4), np.uint32)
    for octant in range(OCTANTS):
        down = octant >> np.arange(3) & 1 == 1
        near, far = np.where(down, sides[::-1], sides)
        layouts[octant, _places(tree, sizes, octant)] = np.column_stack([near | far << 16, last])
    return Bvh(layouts, origin, step)


def _grow(boxes: Numbers) -> _Tree:
    count = len(boxes)
    order = np.arange(count)
    centers = boxes.mean(axis=1)
    start, stop = np.array([0]), np.array([count])
    starts: list[Whole] = []
    stops: list[Whole] = []
    lefts: list[Whole] = []
    axes: list[Whole] = []
    levels: list[int] = []
    total = 0
    while len(start):
        run, member = _members(start, stop)
        placed = centers[order[member]]
        extent = _per_run(np.maximum, placed, start, stop) - _per_run(np.minimum, placed, start, stop)
        axis = np.argmax(extent, axis=1)
        by_run = np.lexsort((placed[np.arange(len(run)), axis[run]], run))
        order[member] = order[member][by_run]
        inner = stop - start > 1
        middle = _cuts(boxes[order[member]], start, stop, len(levels) >= _LAST_WEIGHED_LEVEL)
        levels.append(total)
        starts.append(start)
        stops.append(stop)
        axes.append(axis)
        lefts.append(np.where(inner, total + len(start) + 2 * (np.cumsum(inner) - 1), -1))
        total += len(start)
        start, stop = (
            np.stack([start[inner], middle[inner]], axis=1).ravel(),
            np.stack([middle[inner], stop[inner]], axis=1).ravel(),
        )
    return _Tree(
        levels, np.concatenate(starts), np.concatenate(stops), np.concatenate(lefts), np.concatenate(axes), order
    )


def _members(start: Whole, stop: Whole) -> tuple[Whole, Whole]:
    """For runs of members: the number of the run and the place of each member, one after the other."""
    sizes = stop - start
    run = np.repeat(np.arange(len(start)), sizes)
    first = np.cumsum(sizes) - sizes
    return run, np.arange(len(run)) - first[run] + start[run]


def _per_run(reduce: np.ufunc, values: Numbers, start: Whole, stop: Whole) -> Numbers:
    sizes = stop - start
    result: Numbers = reduce.reduceat(values, np.cumsum(sizes) - sizes)
    return result


def _cuts(boxes: Numbers, start: Whole, stop: Whole, halve: bool) -> Whole:
    """Where to cut each run of sorted members ``boxes (m, 2, 3)``: the place of the second part's first member."""
    sizes = stop - start
    middle = start + sizes // 2
    if halve or sizes.max() > _MOST_WEIGHED or sizes.max() == 1:
        return middle
    first = np.cumsum(sizes) - sizes
    run = np.repeat(np.arange(len(sizes)), sizes)
    inside = np.arange(len(run)) - first[run]
    before = _area(_running(boxes, inside))
    after = _area(_running(boxes[::-1], (sizes[run] - 1 - inside)[::-1]))[::-1]
    # Cutting before member i costs before[i - 1] * i + after[i] * (size - i).
    cost = np.full(len(run), np.inf)
    cost[1:] = before[:-1] * inside[1:] + after[1:] * (sizes[run] - inside)[1:]
    cost[inside == 0] = np.inf
    best = np.minimum.reduceat(cost, first)
    cut = np.maximum.reduceat(np.where(cost == best[run], inside, 0), first)
    return np.where((cut > 0) & np.isfinite(best), start + cut, middle)


def _running(boxes: Numbers, inside: Whole) -> Numbers:
    """Box around each member and all before it in its run (``inside`` counts them), by doubling steps."""
    grown = boxes.copy()
    step = 1
    while step <= inside.max():
        reach = np.flatnonzero(inside >= step)
        low = np.minimum(grown[reach, 0], grown[reach - step, 0])
        high = np.maximum(grown[reach, 1], grown[reach - step, 1])
        grown[reach, 0], grown[reach, 1] = low, high
        step *= 2
    return grown


def _area(boxes: Numbers) -> Numbers:
    side = boxes[:, 1] - boxes[:, 0]
    area: Numbers = side[:, 0] * side[:, 1] + side[:, 1] * side[:, 2] + side[:, 2] * side[:, 0]
    return area


def _gather_up(tree: _Tree, boxes: Numbers) -> tuple[Numbers, Numbers, Whole]:
    """Lowest and highest corner and number of entries of each node's subtree."""
    count = len(tree.start)
    low, high = np.empty((count, 3)), np.empty((count, 3))
    leaf = tree.left < 0
    low[leaf], high[leaf] = boxes[tree.order[tree.start[leaf]], 0], boxes[tree.order[tree.start[leaf]], 1]
    for first, end in zip(reversed(tree.levels), [count, *reversed(tree.levels)], strict=False):
        nodes = np.arange(first, end)
        nodes = nodes[tree.left[nodes] >= 0]
        left = tree.left[nodes]
        low[nodes] = np.minimum(low[left], low[left + 1])
        high[nodes] = np.maximum(high[left], high[left + 1])
    return low, high, 2 * (tree.stop - tree.start) - 1


def _places(tree: _Tree, sizes: Whole, octant: int) -> Whole:
    """Place of each node in the layout that rays of this octant walk."""
    places = np.zeros(len(tree.start), np.int64)
    for first, end in zip(tree.levels, [*tree.levels[1:], len(tree.start)], strict=True):
        nodes = np.arange(first, end)
        nodes = nodes[tree.left[nodes] >= 0]
        left = tree.left[nodes]
        swap = (octant >> tree.axis[nodes]) & 1
        near, far = left + swap, left + 1 - swap
        places[near] = places[nodes] + 1
        places[far] = places[near] + sizes[near]
    return places
