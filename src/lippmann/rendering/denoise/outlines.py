"""Outlines before the background, by more rays than paths.

Where a surface ends before sky or background, a pixel of few samples shows too much of the one and too little of the
other, and a denoiser cannot know how much of each there should be. The rays of its guides are further samples of just
that: of what share of the pixel is covered. What the paths lack of the one side is put in place of what they have too
much of the other, with the colours that either has in the pixels around.

It is a control variate: the coverage by the paths alone has the expectation of that by all rays, and the colours come
of other pixels, so the expectation of a pixel stays what it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.coverage import Coverage

Floats = NDArray[np.float32]

#: The eight pixels around.
_AROUND = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1) if down or right]
#: Pixels that show more of one side tell more of its colour, by this power of the share.
_POWER = 4
#: Less weight of the pixels around than this, of 8, tells no colour: a pixel counts that is half of one side.
_LEAST_WEIGHT = 0.05


def by_coverage(pixels: Floats, paths: Coverage, further: Coverage) -> Floats:
    """``pixels (H, W, 3)``, linear, with the coverage of all rays.

    Parameters
    ----------
    paths:
        As the samples of ``pixels`` tell it.
    further:
        As further rays through the same pixels do, which know nothing of those samples.

    Returns
    -------
    ndarray
        ``(H, W, 3)`` float32, not negative; ``pixels`` where the coverages agree, and where no pixel around is of one
        side.
    """
    lacking = (paths + further).share - paths.share
    rows, columns = np.nonzero(lacking.any(axis=2))
    if not len(rows):
        return pixels
    surface, behind = _colors_around(pixels, paths.share, rows, columns)
    result = pixels.copy()
    result[rows, columns] += lacking[rows, columns] * (surface - behind)
    return np.maximum(result, np.float32(0), out=result)


def _colors_around(
    pixels: Floats, covered: Floats, rows: NDArray[np.intp], columns: NDArray[np.intp]
) -> tuple[Floats, Floats]:
    """``(n, 3)`` each: the colours of the surfaces and of what is behind them in the pixels around; the same where
    either is not known.

    A colour is the mean of what is seen in the pixels around, or, where these agree that it is beyond white, their mean
    less one standard deviation.
    """
    height, width = pixels.shape[:2]
    # The side is told by all colours together, where sub-pixels have rays of their own, too.
    share = covered.mean(axis=2)
    # Of each side: what is seen of its colours, the colours, and their squares; a deviation is the root of little.
    sums = np.zeros((2, 3, len(rows), 3))
    weights = np.zeros((2, len(rows), 1), dtype=np.float32)
    for down, right in _AROUND:
        row, column = rows + down, columns + right
        inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        row, column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
        color, of_surface = pixels[row, column].astype(np.float64), share[row, column]
        parts = np.stack([np.minimum(color, 1), color, np.square(color)])
        for side, of_side in enumerate((of_surface, 1 - of_surface)):
            weight = (np.where(inside, of_side, 0) ** _POWER)[:, None].astype(np.float32)
            weights[side] += weight
            sums[side] += weight * parts
    sums /= np.maximum(weights, np.float32(_LEAST_WEIGHT))[:, None]
    seen, mean, square = sums.transpose(1, 0, 2, 3)
    # What is beyond white is not seen, and a highlight is no colour of a whole side; but half of what is five times
    # white in all pixels around is white still.
    sure = mean - np.sqrt(np.maximum(square - np.square(mean), 0))
    known = (weights >= _LEAST_WEIGHT).all(axis=0)
    surface, behind = np.where(known, np.maximum(seen, sure), 0).astype(np.float32)
    return surface, behind
