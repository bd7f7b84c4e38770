"""What a look at seen light tells: how single chains vary, as far as a picture shows it."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def test_the_variance_is_that_of_single_chains():
    from lippmann.color.transfer import coding_slope
    from lippmann.rendering.film.seen_look import variance_of

    random = np.random.default_rng(4)
    looks = random.normal(0.5, 0.05, (4000, 8, 1)).repeat(3, axis=2)
    expected = 0.05**2 * float(coding_slope(np.array(0.5), "srgb")) ** 2
    assert variance_of(looks, 16, "srgb") == pytest.approx(expected, rel=0.05)
    assert variance_of(looks, 16, "linear") == pytest.approx(0.05**2, rel=0.05)


def test_what_is_white_anyway_does_not_vary():
    from lippmann.rendering.film.seen_look import variance_of

    random = np.random.default_rng(4)
    half_covered = 300.0 * (random.random((500, 8, 1)) < 0.5).repeat(3, axis=2)
    single = np.zeros((500, 8, 3))
    single[0, 0] = 300.0
    # A pixel half covered by an emitter is white with any few samples; a single hit makes a white pixel of a grey one.
    assert variance_of(half_covered, 16, "linear") < 0.2 * 16**2 * 0.25
    for together in (16, 64):
        expected = together**2 / single[..., 0].size
        assert variance_of(single, together, "linear") == pytest.approx(expected, rel=0.15)
    assert variance_of(np.full((5, 8, 3), 300.0), 16, "srgb") == 0


def test_pixels_without_light_count():
    """They are passed over, but are part of the mean."""
    from lippmann.rendering.film.seen_look import SeenLook

    class Dark(SeenLook):
        def _traced(self, samples):
            met = np.zeros((5000, 8, 3), np.float32)
            met[:50] = np.random.default_rng(1).random((50, 8, 3))
            return met

    look = Dark(None, None, 1, "linear", 0)
    assert look.variance_of_means(4, 16) == pytest.approx(0.01 / 48, rel=0.35)
