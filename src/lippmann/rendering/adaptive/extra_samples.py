"""Samples beyond the budget, for pictures of a default number of samples that are not clean with it.

Most scenes are clean with few samples and a denoiser. Sharp highlights on bent metal, or many small things, are not: a
picture of them gets up to a few times the samples, as many as its own estimate suggests.
"""

from __future__ import annotations

import math

from lippmann.rendering.adaptive.method_race import DENOISED_SLOPE
from lippmann.rendering.adaptive.stopping import STEP, Outcome

#: PSNR in dB at which a picture counts as clean, and what is asked of it beyond that, as estimates are uncertain.
CLEAN, _SPARE = 34.5, 0.5
#: The estimate of two samples is of halves with one each, which the denoiser helps least: the picture is mostly better.
_UNDERSTATED_OF_TWO = 0.9


def extra_samples(outcome: Outcome, most: int | None) -> int:
    """Samples per pixel that a picture lacks to be clean; 0 if it is.

    Parameters
    ----------
    outcome:
        What came of the budget.
    most:
        Samples that the picture may have in all; None where a number was asked for.
    """
    if most is None or outcome.estimate is None:
        return 0
    psnr = outcome.estimate.psnr + (_UNDERSTATED_OF_TWO if outcome.samples <= 2 else 0.0)
    if psnr >= CLEAN:
        return 0
    needed = outcome.samples * 10 ** ((CLEAN + _SPARE - psnr) / (10 * DENOISED_SLOPE))
    step = min(STEP, outcome.samples)
    return max(0, min(most, step * math.ceil(needed / step)) - outcome.samples)
