"""The best of two pictures, region by region, by their measured error.

``x + w (y - x)`` comes nearest to a third, unbiased picture ``j`` for ``w = <j - x, y - x> / <y - x, y - x>``. Noise in
``j`` that is independent of both drops out of the mean: over a region it does not favour either.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.render.coding import coding_slope

Picture = NDArray[np.float32]

#: Blocks around a block whose pixels help to weigh its own, each way.
REACH = 2
#: Blocks that the whole picture counts for in the weight of each.
WHOLE = 1.0


def blended(x: Picture, y: Picture, judge: Picture, block: int) -> tuple[Picture, Picture]:
    """``x`` or ``y`` or what lies between, whichever is nearest to what ``judge`` is an estimate of.

    All are ``(H, W, 3)``, linear; ``block`` is the side of the blocks that are weighed, in pixels.

    Returns
    -------
    The picture, and its leverage: how much each value moves with the judge's own noise there, ``(H, W, 3)``. An error
    that is measured against the same judge comes out too small by twice the leverage times that noise's variance
    (Stein's lemma).
    """
    slope2 = coding_slope((x + y) / 2) ** 2
    difference = y - x
    # Fireflies of the judge would outweigh all else. Where they are cut both candidates are judged alike.
    bound = 2 * np.maximum(x, y) + 0.5
    toward = (np.minimum(judge, bound) - x) * difference * slope2
    own = difference**2 * slope2
    weight, lever = _weights(_block_sums(toward.sum(-1), block), _block_sums(own.sum(-1), block))
    weight, lever = (np.repeat(np.repeat(part, block, 0), block, 1) for part in (weight, lever))
    cut = (slice(x.shape[0]), slice(x.shape[1]), None)
    return (x + weight[cut] * difference).astype(np.float32), (lever[cut] * own).astype(np.float32)


def _weights(toward: NDArray[np.float64], length: NDArray[np.float64]) -> tuple[Picture, Picture]:
    """Weight of each block, and how it moves with the sums of the block itself."""
    toward_all, length_all = toward.mean(), length.mean()
    share = 1 / _neighbourhood_size(toward.shape) + WHOLE / toward.size
    toward = _neighbourhood(toward) + WHOLE * toward_all
    length = np.maximum(_neighbourhood(length) + WHOLE * length_all, 1e-20)
    weight = toward / length
    lever = np.where((weight > 0) & (weight < 1), share / length, 0)
    return np.clip(weight, 0, 1).astype(np.float32), lever.astype(np.float32)


def _neighbourhood_size(shape: tuple[int, ...]) -> NDArray[np.float64]:
    counts = []
    for length in shape:
        at = np.arange(length)
        counts.append(np.minimum(at + REACH + 1, length) - np.maximum(at - REACH, 0))
    return np.asarray(np.multiply.outer(counts[0], counts[1]), np.float64)


def _block_sums(values: Picture, block: int) -> NDArray[np.float64]:
    height, width = values.shape
    rows, columns = np.arange(0, height, block), np.arange(0, width, block)
    sums = np.add.reduceat(np.add.reduceat(values.astype(np.float64), rows, 0), columns, 1)
    return np.asarray(sums)


def _neighbourhood(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means over the square of blocks around each, cut at the edges."""
    for axis in (0, 1):
        padded = np.moveaxis(values, axis, 0)
        sums = np.concatenate([np.zeros((1, padded.shape[1])), np.cumsum(padded, 0)])
        at = np.arange(len(padded))
        low, high = np.maximum(at - REACH, 0), np.minimum(at + REACH + 1, len(padded))
        values = np.moveaxis((sums[high] - sums[low]) / (high - low)[:, None], 0, axis)
    return np.asarray(values)
