"""Coverage at outlines in front of the background, from paths and the guides' rays together.

Where a surface ends in front of the background, the coverage of a pixel with few samples is noisy, and a denoiser
cannot know the right one. The rays of its guides are further samples of coverage. The difference between the coverage
by all rays and by the paths alone is multiplied by the difference between the surface's and the background's colour, as
estimated from the pixels around, and added.

This is a control variate: both coverages have the same expectation, and the colours come from other pixels, so the
expectation of the pixel does not change.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.wavefront import Coverage
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: Least total weight of the eight pixels around for a colour; a pixel that is half covered has more.
_LEAST_WEIGHT = 0.05
#: Places of the pixels around one in a square of nine.
_AROUND = [step for step in np.ndindex(3, 3) if step != (1, 1)]


def exchange_coverage(pixels: Floats, paths: Coverage, further: Coverage, *, threads: int = 1) -> Floats:
    """``pixels (H, W, 3)``, linear, with the coverage of all rays.

    Parameters
    ----------
    paths:
        Coverage by the samples of ``pixels``.
    further:
        Coverage by further, independent rays through the same pixels.
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
    # One coverage for all colours, also where sub-pixels have rays of their own.
    covered = paths.share.mean(axis=2, dtype=np.float64)
    # Colours are averaged with the fourth power of the coverage as weight: mixed pixels hardly count.
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
    """Total weight ``(N,)`` and mean colour ``(N, 3)`` of one side over the eight pixels around each of ``here``.

    ``colors`` and ``weights`` are those of the picture, padded by one pixel.
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
    # Values beyond white are clipped, so that one highlight does not set the colour of its side. A side that is far
    # beyond white in all its pixels keeps the mean minus one standard deviation.
    mean = color / each
    deviation = np.sqrt(np.maximum(square / each - np.square(mean), 0))
    return total, np.maximum(within / each, mean - deviation)
