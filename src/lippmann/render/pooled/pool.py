"""The pool: light summed by cells, and what each cell is taken to hold.

Two halves of the samples are kept apart in all sums. Whether a cell's children truly differ is measured by the
covariance of their deviations between the halves, which noise does not enter; a child's own mean then counts for
``k = t / (t + s)`` and its parent's estimate for the rest, ``t`` being that variance of the children and ``s`` that of
the child's own mean (empirical Bayes; James and Stein 1961). With few samples light is shared widely, with many each
cell stands on its own. A mean that is much farther from its parent's than both can explain is held back.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.render.pooled.keys import DIRECTION_LEVELS, LEVELS, NOWHERE, SHIFTS, mix

Keys = NDArray[np.uint64]
Sums = NDArray[np.float32]

#: Columns of a half's sums: samples, weight, weighted colour (3), weighted squared luminance, squared weight.
COLUMNS = 7
#: A cell with fewer samples says what its parent says.
LEAST_SAMPLES = 4
#: Samples that the estimate of the neighbourhood counts for in a cell's own of how its children differ.
PRIOR = 32.0
#: Relative variance of a cell's children that is expected at least: without it smooth light would be held for flat.
LEAST_VARIATION = 1e-2
#: A cell's mean counts up to so many times as far from its parent's as it is expected to be, by how cells differ and by
#: the noise of the other half: beyond that it rests on a single bright hit, which every lens would show.
MOST_AWAY = 2.0
TINY = 1e-12
#: Samples that wait to be summed up, at least.
LEAST_BATCH = 1 << 20
#: Places of one bucket of the table.
BUCKET = 4


def luminance(color: Any) -> Any:
    return color[..., 0] * 0.2126 + color[..., 1] * 0.7152 + color[..., 2] * 0.0722


class Pool:
    """Sums of all finest cells, ordered by key: ``keys`` is ``(cells,)``, ``sums`` is ``(cells, 2, COLUMNS)``."""

    def __init__(self, most_cells: int = 1 << 26) -> None:
        self.most_cells = most_cells
        #: Levels given up so that the cells are not more than ``most_cells``.
        self.given_up = 0
        self.keys: Keys = np.zeros(0, np.uint64)
        self.sums: Sums = np.zeros((0, 2, COLUMNS), np.float32)
        self._waiting: list[tuple[Keys, Sums, Sums, NDArray[np.bool_]]] = []

    def add(self, keys: Keys, weight: Sums, color: Sums, half: NDArray[np.bool_]) -> None:
        """Pour in samples: ``keys`` (n), ``weight`` (n), ``color`` (n, 3), ``half`` (n)."""
        held = keys != NOWHERE
        self._waiting.append((keys[held], weight[held], color[held], half[held]))
        # Sorting a few at a time into many would take the square of the time.
        if sum(len(part[0]) for part in self._waiting) > max(LEAST_BATCH, len(self.keys)):
            self.settle()

    def settle(self) -> None:
        """Sum up what was poured in."""
        if not self._waiting:
            return
        keys, weight, color, half = (np.concatenate(column) for column in zip(*self._waiting, strict=True))
        self._waiting = []
        keys &= self._mask()
        order = np.argsort(keys)
        keys, weight, color, half = keys[order], weight[order], color[order], half[order]
        starts = _starts(keys)
        if len(starts) == 0:
            return
        rows = np.empty((len(keys), COLUMNS), np.float32)
        rows[:, 0] = 1
        rows[:, 1] = weight
        rows[:, 2:5] = color * weight[:, None]
        rows[:, 5] = weight * luminance(color) ** 2
        rows[:, 6] = weight * weight
        sums = np.empty((len(starts), 2, COLUMNS), np.float32)
        for number in (0, 1):
            sums[:, number] = np.add.reduceat(rows * (half == number)[:, None], starts)
        self._merge(keys[starts], sums)
        while len(self.keys) > self.most_cells and self.given_up < LEVELS:
            self.given_up += 1
            keys, sums = self.keys & self._mask(), self.sums
            starts = _starts(keys)
            self.keys, self.sums = keys[starts], np.add.reduceat(sums, starts)

    def _mask(self) -> np.uint64:
        """The bits of a key that name a cell of the finest level still kept."""
        return ~np.uint64((1 << SHIFTS[LEVELS - self.given_up]) - 1)

    def _merge(self, keys: Keys, sums: Sums) -> None:
        if len(self.keys):
            keys, sums = np.concatenate([self.keys, keys]), np.concatenate([self.sums, sums])
            order = np.argsort(keys, kind="stable")
            keys, sums = keys[order], sums[order]
            starts = _starts(keys)
            keys, sums = keys[starts], np.add.reduceat(sums, starts)
        self.keys, self.sums = keys, sums

    def table(self) -> Table:
        """What each cell is taken to hold, by half, with the size of the region that it was taken from."""
        self.settle()
        levels = _levels(self)
        sizes = [float(1 << (LEVELS - level)) for level in range(LEVELS + 1)]
        tags, values = [], []
        estimate = np.zeros((1, 2, 3), np.float32)
        size = np.full(1, sizes[0], np.float32)
        varies: NDArray[np.float64] | None = None
        for level, (keys, sums, parent) in enumerate(levels[: LEVELS + 1 - self.given_up]):
            means: Sums = (sums[:, :, 2:5] / np.maximum(sums[:, :, 1:2], TINY)).astype(np.float32)
            if level == 0:
                total = sums.sum(1)
                both = total[:, 2:5] / np.maximum(total[:, 1:2], TINY)
                here = np.where(sums[:, :, 1:2] > 0, means, both[:, None])
                width = np.full(len(keys), sizes[0], np.float32)
            else:
                k, varies, expected = _shrinkage(sums, means, parent, levels[level - 1][1], varies)
                away = means - estimate[parent]
                k *= np.minimum(1, MOST_AWAY * expected / np.maximum(np.abs(luminance(away)), TINY))
                here = estimate[parent] + k[:, :, None] * away
                width = size[parent] + k.mean(1) * (sizes[level] - size[parent])
            kept = sums[:, :, 0].sum(1) >= LEAST_SAMPLES if level else np.ones(len(keys), bool)
            tags.append(tag_of(keys[kept], np.full(1, level, np.uint64)))
            values.append(np.concatenate([here[kept].reshape(-1, 6), width[kept, None]], axis=1))
            estimate, size = here, width
        everywhere = self.sums.sum(0)
        everywhere = everywhere[:, 2:5] / np.maximum(everywhere[:, 1:2], TINY)
        return Table(np.concatenate(tags), np.concatenate(values).astype(np.float32), everywhere.ravel())


def _shrinkage(
    sums: Sums, means: Sums, parent: NDArray[np.intp], above: Sums, prior: NDArray[np.float64] | None
) -> tuple[Sums, NDArray[np.float64], Sums]:
    """How much each child's own mean counts, ``(children, 2)``, what its own children are expected to vary by, and how
    far its mean is expected to be from its parent's, ``(children, 2)``."""
    count = len(above)
    parents = above[:, :, 2:5] / np.maximum(above[:, :, 1:2], TINY)
    deviation = luminance(means - parents[parent])
    weight = np.minimum(sums[:, 0, 1], sums[:, 1, 1])
    covariance: NDArray[Any] = np.bincount(parent, weight * deviation[:, 0] * deviation[:, 1], count)
    held: NDArray[Any] = np.bincount(parent, weight, count)
    if prior is not None:
        covariance, held = covariance + PRIOR * prior, held + PRIOR
    total = above.sum(1)
    mean = luminance(total[:, 2:5]) / np.maximum(total[:, 1], TINY)
    varies = np.maximum(covariance / np.maximum(held, TINY), LEAST_VARIATION * mean * mean)
    # Each half's noise is measured on the other: a mean that chance made high must not be distrusted for that alone.
    square = above[:, ::-1, 5] / np.maximum(above[:, ::-1, 1], TINY)
    variance = np.maximum(square - luminance(parents[:, ::-1]) ** 2, TINY)
    noise = variance[parent] * sums[:, :, 6] / np.maximum(sums[:, :, 1], TINY) ** 2
    expected = varies[parent][:, None]
    k = np.where(sums[:, :, 1] > 0, expected / np.maximum(expected + noise, TINY), 0)
    return k.astype(np.float32), varies[parent] / 2, np.sqrt(expected + noise).astype(np.float32)


def _starts(keys: Keys) -> NDArray[np.intp]:
    """Where runs of equal keys begin."""
    return np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]])) if len(keys) else np.zeros(0, np.intp)


def _levels(pool: Pool) -> list[tuple[Keys, Sums, Any]]:
    """Keys (prefixes), sums and the parents' numbers, from root to leaf."""
    keys, sums = pool.keys >> np.uint64(SHIFTS[LEVELS]), pool.sums
    levels: list[tuple[Keys, Sums, Any]] = []
    for level in range(LEVELS, 0, -1):
        prefix = keys >> np.uint64(SHIFTS[level - 1] - SHIFTS[level])
        starts = _starts(prefix)
        marks = np.zeros(len(keys), np.intp)
        marks[starts] = 1
        levels.append((keys, sums, np.cumsum(marks) - 1))
        keys, sums = prefix[starts], np.add.reduceat(sums, starts) if len(starts) else sums
    levels.append((keys, sums, None))
    return levels[::-1]


def tag_of(prefix: Any, level: Any) -> Any:
    """A number for a cell of any level."""
    return mix(prefix ^ mix(level + 1))


class Table:
    """Cells by tag, on the device: buckets of four places, of which a cell may lie in two."""

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, tags: Keys, values: Sums, elsewhere: Sums) -> None:
        buckets = 1 << max(4, int(len(tags) * 2 / BUCKET).bit_length())
        while (places := _place(tags, buckets)) is None:
            buckets *= 2
        self.cells = len(tags)
        self._mask = dr.opaque(mi.UInt32, buckets - 1)
        check = np.zeros(buckets * BUCKET, np.uint32)
        check[places] = (tags >> np.uint64(32)).astype(np.uint32) | np.uint32(1)
        table = np.zeros((buckets * BUCKET, 8), np.float32)
        table[places, :7] = values
        # What is found nowhere is at the end.
        table = np.concatenate([table, np.zeros((1, 8), np.float32)])
        table[-1, :6] = elsewhere
        self._nowhere = dr.opaque(mi.UInt32, len(table) - 1)
        self._check = _owned(mi.UInt32(check))
        self._values = _owned(mi.Float(table.ravel()))

    def find(self, key: Any, active: Any) -> tuple[Any, Any]:
        """Number of the finest cell that holds ``key``, and whether there is any."""
        low, high = mi.Int32(0), mi.Int32(LEVELS)  # the finest is in [low, high], if there is any at all
        place, found = mi.UInt32(self._nowhere), mi.Bool(False)
        for _ in range(4):
            middle = (low + high + 1) >> 1
            here, there = self._probe(key, middle, active)
            place = dr.select(there, here, place)
            found |= there
            low = dr.select(there, middle, low)
            high = dr.select(there, high, dr.maximum(middle - 1, low))
        return place, found

    def _probe(self, key: Any, level: Any, active: Any) -> tuple[Any, Any]:
        shift = 32 - 3 * level - 2 * dr.maximum(level - (LEVELS - DIRECTION_LEVELS), 0)
        tag = tag_of(key >> mi.UInt64(shift), mi.UInt64(level))
        check = mi.UInt32(tag >> 32) | 1
        place, there = mi.UInt32(0), mi.Bool(False)
        for step in range(2):
            bucket = (mi.UInt32(tag) + step) & self._mask
            quad = dr.gather(mi.Vector4u, self._check, bucket, active & ~there)
            for slot in range(BUCKET):
                match = active & (quad[slot] == check) & ~there
                place = dr.select(match, bucket * BUCKET + slot, place)
                there |= match
        return place, there

    def read(self, place: Any, active: Any) -> tuple[Any, Any]:
        """What the two halves say of a cell."""
        a = dr.gather(mi.Vector4f, self._values, place * 2, active)
        b = dr.gather(mi.Vector4f, self._values, place * 2 + 1, active)
        return mi.Color3f(a.x, a.y, a.z), mi.Color3f(a.w, b.x, b.y)

    def read_size(self, place: Any, active: Any) -> Any:
        """Side of the region that a cell's light was taken from, in finest cells."""
        return dr.gather(mi.Float, self._values, place * 8 + 6, active)


def _owned(array: Any) -> Any:
    """A copy in memory of the device's own: where NumPy's lies shows in the kernel, which would be compiled anew."""
    copy = array + dr.opaque(type(array), 0)
    dr.eval(copy)
    return copy


def _place(tags: Keys, buckets: int) -> NDArray[np.intp] | None:
    """A place for each cell, or None where they do not fit."""
    places = np.zeros(len(tags), np.intp)
    filled = np.zeros(buckets, np.intp)
    left = np.arange(len(tags))
    for step in range(2):
        bucket = ((tags[left] + np.uint64(step)) & np.uint64(buckets - 1)).astype(np.intp)
        order = np.argsort(bucket, kind="stable")
        bucket, left = bucket[order], left[order]
        starts = _starts(bucket.astype(np.uint64))
        lengths = np.diff(np.append(starts, len(bucket)))
        slot = np.arange(len(bucket)) - np.repeat(starts, lengths) + filled[bucket]
        fits = slot < BUCKET
        places[left[fits]] = bucket[fits] * BUCKET + slot[fits]
        np.add.at(filled, bucket[fits], 1)
        left = left[~fits]
        if len(left) == 0:
            return places
    return None
