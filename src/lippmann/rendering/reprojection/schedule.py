"""Hierarchical order of the micro-images, and the sources of each.

Key lenses, several apart along both axes of the array, come first. Each finer step receives points from the nearest
finished lenses on either side: first between two lenses of a row, then between two of a column. A surface at height z
is seen through ``|z| / gap`` lenses. So a surface far from the lens plane is known from the keys, and a nearer one is
traced in the finer step that first meets it. All lenses of a step are traced at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.reprojection.tuning import TUNING

Lenses = NDArray[np.int64]


@dataclass(frozen=True)
class Step:
    """Lenses ``targets (n,)`` made together, from ``sources (n, 2)`` on either side (-1: none)."""

    targets: Lenses
    sources: Lenses


def refine(columns: Lenses, rows: int, width: int) -> tuple[Lenses, list[Step]]:
    """Key lenses, and the finer steps, for the lenses of ``columns`` in all ``rows``.

    Lens (i, j) has the number ``j * width + i``. The last column and the last row are keys, too.
    """
    done_columns, across = _refine_axis(columns)
    done_rows, down = _refine_axis(np.arange(rows))
    keys = _grid(done_columns, done_rows, width)
    steps = []
    for along_row, along_column in zip(across, down, strict=True):
        sides = [_grid(along_row.sources[:, side], done_rows, width) for side in range(2)]
        steps.append(Step(_grid(along_row.targets, done_rows, width), np.stack(sides, axis=1)))
        done_columns = np.concatenate([done_columns, along_row.targets])
        sides = [_grid(done_columns, along_column.sources[:, side], width) for side in range(2)]
        steps.append(Step(_grid(done_columns, along_column.targets, width), np.stack(sides, axis=1)))
        done_rows = np.concatenate([done_rows, along_column.targets])
    return keys, [step for step in steps if len(step.targets)]


def odd_and_even(columns: int, rows: int) -> tuple[Lenses, Step]:
    """Odd columns of lenses, counted from 1, and the step that makes the even ones between their odd neighbours.

    The last column of an even number has a neighbour to its left only.
    """
    even = np.arange(1, columns, 2)
    first = np.arange(rows) * columns
    right = np.where(even + 1 < columns, first[:, None] + even + 1, -1)
    targets = first[:, None] + even
    return np.arange(0, columns, 2), Step(targets.ravel(), np.stack([targets - 1, right], axis=-1).reshape(-1, 2))


def _refine_axis(places: Lenses) -> tuple[Lenses, list[Step]]:
    """Key lenses among ``places`` along one axis, the last one included, and a step for each smaller stride."""
    count = len(places)
    done = np.union1d(np.arange(0, count, TUNING.key_stride), [count - 1])
    keys, steps = places[done], []
    for stride in (math.isqrt(TUNING.key_stride), 1):
        new = np.setdiff1d(np.arange(0, count, stride), done)
        after = np.searchsorted(done, new)
        steps.append(Step(places[new], places[np.stack([done[after - 1], done[after]], axis=1)]))
        done = np.union1d(done, new)
    return keys, steps


def _grid(columns: Lenses, rows: Lenses, width: int) -> Lenses:
    return (rows[:, None] * width + columns).ravel()
