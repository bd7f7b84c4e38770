"""Samples beyond the budget, for pictures of a default number of samples that are not clean with it.

Most scenes are clean with few samples and a denoiser. Sharp highlights on bent metal, or many small things, are not: a
picture of them gets up to a few times the samples, as many as its own estimate suggests: of the whole, or of the worst
micro-image, which an eye in its place sees for itself.
"""

from __future__ import annotations

import math

from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.psnr import Estimate


def extra_samples(estimate: Estimate, samples: int, most: int | None) -> int:
    """Samples per pixel that a picture lacks to be clean; 0 if it is.

    Parameters
    ----------
    estimate, samples:
        What the samples so far came to, and how many each pixel had.
    most:
        Samples that the picture may have in all; None where a number was asked for.
    """
    if most is None or (estimate.psnr >= TUNING.clean and estimate.worst >= TUNING.clean_worst):
        return 0
    step = min(TUNING.step, samples)
    missing = max(TUNING.clean - estimate.psnr, TUNING.clean_worst - estimate.worst)
    needed = max(samples * 10 ** (missing / (10 * TUNING.denoised_slope)), samples + step)
    return max(0, min(most, step * math.ceil(needed / step)) - samples)
