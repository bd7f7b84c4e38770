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
    The picture, and the weight of ``y`` in it, ``(H, W)`` in [0, 1].
    """
    slope2 = coding_slope((x + y) / 2) ** 2
    difference = y - x
    # Fireflies of the judge would outweigh all else. Where they are cut both candidates are judged alike.
    bound = 2 * np.maximum(x, y) + 0.5
    toward = (np.minimum(judge, bound) - x) * difference * slope2
    own = difference**2 * slope2
    weight = _weights(_block_sums(toward.sum(-1), block), _block_sums(own.sum(-1), block))
    weight = _spread_out(weight, block, x.shape)
    return (x + weight[..., None] * difference).astype(np.float32), weight


def local_mean(picture: Picture, block: int) -> Picture:
    """Means of ``(H, W, 3)`` over each block and those around it, colour by colour, spread out to the same shape."""
    ones = _neighbourhood(_block_sums(np.ones(picture.shape[:2], np.float32), block))
    means = [_neighbourhood(_block_sums(picture[..., c], block)) / ones for c in range(3)]
    return np.stack([_spread_out(mean.astype(np.float32), block, picture.shape) for mean in means], axis=-1)


def _spread_out(blocks: Picture, block: int, shape: tuple[int, ...]) -> Picture:
    return np.repeat(np.repeat(blocks, block, 0), block, 1)[: shape[0], : shape[1]]


def _weights(toward: NDArray[np.float64], length: NDArray[np.float64]) -> Picture:
    """Weight of each block, by what it and those around it say."""
    toward = _neighbourhood(toward) + WHOLE * toward.mean()
    length = np.maximum(_neighbourhood(length) + WHOLE * length.mean(), 1e-20)
    return np.clip(toward / length, 0, 1).astype(np.float32)


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
