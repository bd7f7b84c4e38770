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

from lippmann.rendering.denoise.outlines_kernel import exchange_rows
from lippmann.rendering.film.coverage import Coverage
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]


def by_coverage(pixels: Floats, paths: Coverage, further: Coverage, *, threads: int = 1) -> Floats:
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
    lacking = np.ascontiguousarray((paths + further).share - paths.share)
    if not lacking.any():
        return pixels
    result = np.empty(pixels.shape, dtype=np.float32)
    Bands(threads).lines(exchange_rows, len(pixels), pixels, np.ascontiguousarray(paths.share), lacking, result)
    return result
