"""The correction of a picture for its display's lenses, as it may be asked for."""

from __future__ import annotations

from typing import get_args

from lippmann.errors import UsageError
from lippmann.options.choices import Correction

#: The largest headroom of a correction: half of the display's contrast.
MOST_HEADROOM = 0.25


def check_correction(correct: Correction, headroom: float) -> None:
    """Refuse an unknown correction, and a headroom out of range or of a picture that is not corrected.

    Raises
    ------
    UsageError
        What is wrong, with the parameter's name.
    """
    if correct not in get_args(Correction):
        raise UsageError.unknown("correction", correct, get_args(Correction), parameter="correct")
    if not 0.0 <= headroom <= MOST_HEADROOM:
        raise UsageError(f"{headroom!r} is out of range", parameter="headroom", rule=f"it is 0 to {MOST_HEADROOM:g}")
    if headroom and correct == "none":
        fix = 'add correct="lens", or leave it out'
        raise UsageError("nothing is corrected", parameter="headroom", rule="it is room for a correction", fix=fix)
