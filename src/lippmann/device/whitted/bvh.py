"""A bounding volume hierarchy without a stack, in the order in which a ray walks it.

Nodes are split where the surface area heuristic says, along the axis for which it promises most (MacDonald and Booth
1990). An entry is an inner node with the boxes of both its children, which are tested at once. Entries are laid out
depth first, each saying how many to skip where a child is missed ("skip pointers", Smits 1998), so that a ray keeps one
index and nothing more. Eight layouts, one for each octant of ray directions, visit the nearer child first. All nodes of
a level are split at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.whitted_shapes import Numbers

#: Layouts, by the signs of a direction: 1 for x < 0, 2 for y < 0, 4 for z < 0.
OCTANTS = 8
#: Steps of the grid on which the corners of boxes lie: an entry then is eight words, one fetch.
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
    """Layouts ``(8, n - 1, 8)`` uint32 over a grid of 2^16 steps along each axis.

    An entry is two nodes, the one that rays of the layout's octant come to first, then its sibling. A node is x, y and
    z, each near | far << 16 in steps of ``step (3,)`` from ``origin (3,)``, and a last word: below ``LEAF`` the number
    of entries below the node, else ``LEAF`` + the index of the one box inside. Near is the side at which rays enter:
    the lower one where they go up the axis, else the higher one. The entries of the first node follow on its own, those
    of the second on these.
    """

    nodes: NDArray[np.uint32]
    origin: Numbers
    step: Numbers

    @property
    def count(self) -> int:
        return int(self.nodes.shape[1])


def make_bvh(boxes: Numbers) -> Bvh:
    """The tree over boxes ``(n, 2, 3)``, n at least 2."""
    tree = _grow(boxes)
    low, high = _gather_up(tree, boxes)
    inner = tree.left >= 0
    entries = tree.stop - tree.start - 1
    size = np.maximum(high[0] - low[0], 1e-6 * max(np.abs(boxes).max(), 1e-30))
    # One step of margin on each side for rounding on the device, and boxes grow to whole steps.
    step = size / (GRID - 5)
    origin = low[0] - 2 * step
    corners = np.floor((low - origin) / step) - 1, np.ceil((high - origin) / step) + 1
    sides = np.stack([corner.astype(np.uint32) for corner in corners])
    last = np.where(inner, entries, LEAF + tree.order[tree.start]).astype(np.uint32)
    layouts = np.empty((OCTANTS, len(boxes) - 1, 8), np.uint32)
    for octant in range(OCTANTS):
        down = octant >> np.arange(3) & 1 == 1
        near, far = np.where(down, sides[::-1], sides)
        nodes = np.column_stack([near | far << 16, last])
        first, second = _visit(tree, octant)
        layouts[octant, _places(tree, entries, octant)[inner]] = np.hstack([nodes[first], nodes[second]])[inner]
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
        order[member], middle, axis = _split(boxes, centers, order[member], run, start, stop, len(levels))
        inner = stop - start > 1
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


def _split(
    boxes: Numbers, centers: Numbers, order: Whole, run: Whole, start: Whole, stop: Whole, level: int
) -> tuple[Whole, Whole, Whole]:
    """Members sorted along the best axis of their run, where to cut each run, and that axis."""
    placed = centers[order]
    extent = _per_run(np.maximum, placed, start, stop) - _per_run(np.minimum, placed, start, stop)
    halve = level >= _LAST_WEIGHED_LEVEL or (stop - start).max() > _MOST_WEIGHED
    if halve:
        axis = np.argmax(extent, axis=1)
        order = order[np.lexsort((placed[np.arange(len(run)), axis[run]], run))]
        return order, start + (stop - start) // 2, axis
    ways = []
    for direction in range(3):
        sorted_members = order[np.lexsort((placed[:, direction], run))]
        ways.append((sorted_members, *_cuts(boxes[sorted_members], start, stop)))
    orders, middles, costs = (np.stack(part) for part in zip(*ways, strict=True))
    # Among equals the longest axis: its order tells best which child a ray comes to first.
    axis = np.lexsort((-extent.T, costs), axis=0)[0]
    return np.choose(axis[run], orders), np.choose(axis, middles), axis


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


def _cuts(boxes: Numbers, start: Whole, stop: Whole) -> tuple[Whole, Numbers]:
    """Best cut of each run of sorted members ``boxes (m, 2, 3)``, and its cost: area times members, summed.

    The place is that of the second part's first member.
    """
    sizes = stop - start
    first = np.cumsum(sizes) - sizes
    run = np.repeat(np.arange(len(sizes)), sizes)
    inside = np.arange(len(run)) - first[run]
    before = _area(_merge_boxes(boxes, inside))
    after = _area(_merge_boxes(boxes[::-1], (sizes[run] - 1 - inside)[::-1]))[::-1]
    # Cutting before member i costs before[i - 1] * i + after[i] * (size - i).
    cost = np.full(len(run), np.inf)
    cost[1:] = before[:-1] * inside[1:] + after[1:] * (sizes[run] - inside)[1:]
    cost[inside == 0] = np.inf
    best = np.minimum.reduceat(cost, first)
    cut = np.maximum.reduceat(np.where(cost == best[run], inside, 0), first)
    return start + np.where((cut > 0) & np.isfinite(best), cut, sizes // 2), best


def _merge_boxes(boxes: Numbers, inside: Whole) -> Numbers:
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


def _gather_up(tree: _Tree, boxes: Numbers) -> tuple[Numbers, Numbers]:
    """Lowest and highest corner of each node."""
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
    return low, high


def _visit(tree: _Tree, octant: int) -> tuple[Whole, Whole]:
    """Children of each node in the order in which rays of an octant come to them; any numbers for leaves."""
    swap = octant >> tree.axis & 1
    return tree.left + swap, tree.left + 1 - swap


def _places(tree: _Tree, entries: Whole, octant: int) -> Whole:
    """Place of each inner node in the layout that rays of this octant walk."""
    places = np.zeros(len(tree.start), np.int64)
    firsts, seconds = _visit(tree, octant)
    for start, end in zip(tree.levels, [*tree.levels[1:], len(tree.start)], strict=True):
        nodes = np.arange(start, end)
        nodes = nodes[tree.left[nodes] >= 0]
        places[firsts[nodes]] = places[nodes] + 1
        places[seconds[nodes]] = places[nodes] + 1 + entries[firsts[nodes]]
    return places
