"""Outlines in front of the background, by more rays than paths.

Where a surface ends in front of sky or background, a pixel of few samples shows too much of the one and too little of
the other, and a denoiser cannot know how much of each there should be. The rays of its guides are further samples of
just that: of what share of the pixel is covered. What the paths lack of the one side is put in place of what they have
too much of the other, with the colours that either has in the pixels around.

It is a control variate: the coverage by the paths alone has the expectation of that by all rays, and the colours come
of other pixels, so the expectation of a pixel stays what it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.wavefront import Coverage
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: Less weight of the pixels around than this, of 8, tells no colour: a pixel counts that is half of one side.
_LEAST_WEIGHT = 0.05
#: Places of the pixels around one in a square of nine.
_AROUND = [step for step in np.ndindex(3, 3) if step != (1, 1)]


def exchange_coverage(pixels: Floats, paths: Coverage, further: Coverage, *, threads: int = 1) -> Floats:
    """``pixels (H, W, 3)``, linear, with the coverage of all rays.

    Parameters
    ----------
    paths:
        As the samples of ``pixels`` tell it.
    further:
        As further rays through the same pixels do, which know nothing of those samples.
    threads:
        CPU threads; the result does not depend on them.

    Returns
    -------
    ndarray
        ``(H, W, 3)`` float32, not negative where it differs; ``pixels`` where the coverages agree, and where no pixel
        around is of one side.
    """
    lacking = (paths + further).share - paths.share
    rows, columns = np.nonzero(lacking.any(axis=2))
    if not len(rows):
        return pixels
    result = pixels.astype(np.float32)
    # The side is told by all colours together, where sub-pixels have rays of their own, too.
    covered = paths.share.mean(axis=2, dtype=np.float64)
    # Pixels that show more of one side tell more of its colour: by the fourth power.
    of_surface, behind = (np.pad(np.square(np.square(share)), 1) for share in (covered, 1 - covered))
    colors = np.pad(pixels, ((1, 1), (1, 1), (0, 0)))

    def exchange(first: int, last: int) -> None:
        here = rows[first:last], columns[first:last]
        front_weight, front = _color_around(colors, of_surface, here)
        back_weight, back = _color_around(colors, behind, here)
        is_known = np.minimum(front_weight, back_weight) >= _LEAST_WEIGHT
        exchanged = np.maximum(0, result[here] + lacking[here] * (front - back))
        result[here] = np.where(is_known[:, None], exchanged, result[here])

    Bands(threads).pixels(exchange, len(rows))
    return result


def _color_around(
    colors: Floats, weights: NDArray[np.float64], here: tuple[NDArray[np.intp], NDArray[np.intp]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How much is seen of one side in the eight pixels around some, ``(N,)``, and its colour, ``(N, 3)``.

    ``colors``, and their ``weights`` for that side, are those of the picture with an edge of one pixel around.
    """
    total = np.zeros(len(here[0]))
    within, color, square = np.zeros((3, len(total), 3))
    for down, right in _AROUND:
        there = here[0] + down, here[1] + right
        weight, value = weights[there], colors[there].astype(np.float64)
        total += weight
        within += weight[:, None] * np.minimum(value, 1)
        color += weight[:, None] * value
        square += weight[:, None] * np.square(value)
    each = np.maximum(total, _LEAST_WEIGHT)[:, None]
    # What is beyond white is not seen, and a highlight is no colour of a whole side; but half of what is five times
    # white in all pixels around is white still. A deviation is the root of little.
    mean = color / each
    deviation = np.sqrt(np.maximum(square / each - np.square(mean), 0))
    return total, np.maximum(within / each, mean - deviation)
