"""A picture at rest converges, whatever a denoiser makes of it."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.rendering.request.tuning import TUNING

pytestmark = pytest.mark.usefixtures("engine")


@pytest.mark.parametrize(("samples", "value"), [(TUNING.fewest - 1, 0.0), (TUNING.fewest, 0.5)])
def test_a_denoiser_that_errs_is_overruled_once_there_are_samples(monkeypatch, samples, value):
    from lippmann.rendering.live import progressive

    monkeypatch.setattr(progressive, "denoise", lambda picture, *guides, **options: np.zeros_like(picture))
    noise = np.random.default_rng(1).normal(0, 0.01, (2, 20, 30, 3)).astype(np.float32)
    guides = np.ones((2, 20, 30, 3), np.float32)
    *steps, picture = progressive._denoise_halves(tuple(0.5 + noise), tuple(guides), samples, 1)
    assert all(step is None for step in steps)
    assert len(steps) == (2 if samples >= TUNING.fewest else 0)
    assert picture == pytest.approx(value, abs=0.05)
