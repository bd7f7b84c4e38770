"""The correction of a picture, as it is asked for."""

from __future__ import annotations

import math

import pytest

import lippmann
from lippmann.errors import UsageError
from lippmann.options.correction import check_correction


@pytest.mark.parametrize(
    ("correct", "headroom", "what"),
    [
        ("lense", 0.0, "correct"),
        ("none", 0.1, "nothing is corrected"),
        ("lens", 0.3, "out of range"),
        ("lens", -0.1, "out of range"),
        ("lens", math.nan, "out of range"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_rendered(correct, headroom, what):
    with pytest.raises(UsageError, match=what):
        lippmann.render("teapot", "print-60lpi", correct=correct, headroom=headroom)


def test_what_can_be_is_taken():
    check_correction("none", 0.0)
    check_correction("lens", 0.25)
