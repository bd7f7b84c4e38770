"""In which order the micro-images of an array are made, and from which others each receives its points.

As under straight cylindrical lenses (:mod:`lippmann.rendering.reprojection.common.schedule`), but along both axes in
turn: keys on a wide lattice, then those between two of a row, then those between two of a column, down to neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.reprojection.common.schedule import Lenses, refine

#: Distance of the key lenses on displays of less than so many lenses in a row or column, and of more.
FEW_LENSES, KEY_STRIDE_OF_FEW, KEY_STRIDE = 128, 4, 16


def array_key_stride(lenses: int) -> int:
    """Distance of the key lenses for so many lenses along the longer axis."""
    return KEY_STRIDE_OF_FEW if lenses < FEW_LENSES else KEY_STRIDE


@dataclass(frozen=True)
class ArrayStep:
    """Lenses ``targets (n,)`` made together, from ``sources (n, 2)`` on either side (-1: none)."""

    targets: Lenses
    sources: Lenses


def refine_grid(columns: NDArray[np.int64], rows: int, stride: int, width: int) -> tuple[Lenses, list[ArrayStep]]:
    """Keys and the steps between them, for the lenses of some ``columns`` in all ``rows``.

    Lens (i, j) has the number ``j * width + i``; keys lie ``stride`` (a power of two) entries of ``columns`` apart, and
    so many rows.
    """
    done_columns, across = refine(columns, stride)
    done_rows, down = refine(np.arange(rows), stride)
    keys = _grid(done_columns, done_rows, width)
    steps = []
    for number in range(max(len(across), len(down))):
        if number < len(across):
            step = across[number]
            sides = [_grid(step.sources[:, side], done_rows, width) for side in range(2)]
            steps.append(ArrayStep(_grid(step.targets, done_rows, width), np.stack(sides, axis=1)))
            done_columns = np.concatenate([done_columns, step.targets])
        if number < len(down):
            step = down[number]
            sides = [_grid(done_columns, step.sources[:, side], width) for side in range(2)]
            steps.append(ArrayStep(_grid(done_columns, step.targets, width), np.stack(sides, axis=1)))
            done_rows = np.concatenate([done_rows, step.targets])
    return keys, steps


def _grid(columns: Lenses, rows: Lenses, width: int) -> Lenses:
    return (rows[:, None] * width + columns).ravel()
