"""Facts as people read them."""

from __future__ import annotations

import pytest

from lippmann.wording import depths_in_words, duration_in_words


def test_a_flat_scene_has_no_negative_zero():
    assert depths_in_words(0.0, -0.0) == "from 0.0 mm behind to 0.0 mm in front of the lens plane"
    assert depths_in_words(-12.34, 5.67) == "from 12.3 mm behind to 5.7 mm in front of the lens plane"


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.123, "0.12 s"), (9.94, "9.9 s"), (45.4, "45 s"), (150.0, "2.5 min"), (3599.0, "60.0 min"), (6480.0, "1.8 h")],
)
def test_a_time_has_the_unit_that_suits_it(seconds, words):
    assert duration_in_words(seconds) == words
