"""Plain pictures of a scene's camera."""

from __future__ import annotations

import numpy as np
import pytest

import lippmann

pytestmark = pytest.mark.usefixtures("engine")


@pytest.mark.slow
def test_noise_is_taken_out_where_that_is_asked_for():
    def shown(**options):
        return lippmann.preview("teapot", (64, 64), **options)

    many = shown(spp=256).pixels
    noisy, clean = shown(spp=4, seed=3), shown(spp=4, seed=3, denoise="oidn")
    assert "denoise" not in noisy.provenance.options
    assert clean.provenance.options["denoise_effort"] == "fast"
    assert clean.provenance.seconds["denoise"] > 0
    assert np.mean((clean.pixels - many) ** 2) < 0.5 * np.mean((noisy.pixels - many) ** 2)
