"""In which order micro-images are made, and from which others each receives its points.

Key lenses some way apart come first; then those halfway between receive points from the done ones on either side, and
so on down to neighbours. Points of a surface at height z are seen through ``|z| / gap`` lenses, so that a surface far
from the lens plane is already known from the keys, and a nearer one is traced where the finer steps first meet it: each
lens receives from the nearest lenses that are done, and whole steps are traced at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Lenses = NDArray[np.int64]

#: Distance of the key lenses. Farther apart they save more on surfaces far from the lens plane, at the price of one
#: more round of tracing, whose own cost counts on displays of few lenses.
KEY_STRIDE, FEW_LENSES = 16, 128
KEY_STRIDE_OF_FEW = {True: 4, False: 2}


@dataclass(frozen=True)
class Step:
    """Lenses ``targets (n,)`` made together, from ``sources (n, 2)`` to the left and right (-1: none)."""

    targets: Lenses
    sources: Lenses


def few_lenses(lenses: int) -> bool:
    """Whether a display has so few lenses in a row that whatever is done once per round costs more than rays do."""
    return lenses < FEW_LENSES


def key_stride(lenses: int, careful: bool = False) -> int:
    """Distance of the key lenses on a display of so many lenses in a row; with care rays are dearer than rounds."""
    return KEY_STRIDE_OF_FEW[careful] if few_lenses(lenses) else KEY_STRIDE


def refine(lenses: Lenses, stride: int) -> tuple[Lenses, list[Step]]:
    """Keys every ``stride`` (a power of two) of ``lenses``, the last one among them, and the steps between."""
    count = len(lenses)
    done = np.union1d(np.arange(0, count, stride), [count - 1])
    keys = lenses[done]
    steps = []
    while stride > 1:
        stride //= 2
        new = np.setdiff1d(np.arange(0, count, stride), done)
        after = np.searchsorted(done, new)
        if len(new):
            steps.append(Step(lenses[new], lenses[np.stack([done[after - 1], done[after]], axis=1)]))
        done = np.union1d(done, new)
    return keys, steps


def odd_and_even(lenses: int) -> tuple[Lenses, Step]:
    """Odd micro-images, counted from 1, and the step that makes the even ones between their odd neighbours.

    The last micro-image of an even number has a neighbour to its left only.
    """
    even = np.arange(1, lenses, 2)
    right = np.where(even + 1 < lenses, even + 1, -1)
    return np.arange(0, lenses, 2), Step(even, np.stack([even - 1, right], axis=1))
