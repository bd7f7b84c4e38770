"""Facts as people read them."""

from __future__ import annotations

from lippmann.wording import depths_in_words


def test_a_flat_scene_has_no_negative_zero():
    assert depths_in_words(0.0, -0.0) == "from 0.0 mm behind to 0.0 mm in front of the lens plane"
    assert depths_in_words(-12.34, 5.67) == "from 12.3 mm behind to 5.7 mm in front of the lens plane"
