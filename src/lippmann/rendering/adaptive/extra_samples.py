"""Samples beyond the budget, for pictures of a default number of samples that are not clean with it.

Most scenes are clean with few samples and a denoiser. Sharp highlights on bent metal, or many small things, are not: a
picture of them gets up to a few times the samples, as many as its own estimate suggests.
"""

from __future__ import annotations

import math

from lippmann.rendering.adaptive.method_race import DENOISED_SLOPE
from lippmann.rendering.adaptive.stopping import STEP, Goal, Outcome

#: PSNR in dB that a picture has where nothing is asked for.
_WANTED = 34.0
#: Estimated PSNR in dB at which a picture counts as clean, and what others get samples for. The estimate is of light
#: before tone mapping, which brings out the noise of highlights: up to 1.5 dB more than what is wanted.
CLEAN, _AIM = 35.5, 35.0


def is_modest(goal: Goal) -> bool:
    """Whether no more is asked for than a picture has anyway: then the fewest samples are assessed first.

    As most pictures reach that with a few samples, it takes no longer than if nothing were asked for.
    """
    return goal.quality is not None and goal.quality_worst is None and goal.quality <= _WANTED


def extra_samples(outcome: Outcome, most: int | None) -> int:
    """Samples per pixel that a picture lacks to be clean; 0 if it is.

    Parameters
    ----------
    outcome:
        What came of the budget.
    most:
        Samples that the picture may have in all; None where a number was asked for.
    """
    if most is None or outcome.estimate is None or outcome.estimate.psnr >= CLEAN:
        return 0
    step = min(STEP, outcome.samples)
    needed = outcome.samples * 10 ** ((_AIM - outcome.estimate.psnr) / (10 * DENOISED_SLOPE))
    needed = max(needed, outcome.samples + step)
    return max(0, min(most, step * math.ceil(needed / step)) - outcome.samples)
