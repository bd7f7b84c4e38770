"""What a picture becomes whose time was up after one sample."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture
def pictures(engine, monkeypatch):
    import lippmann
    from lippmann.display import Display, LensArray, Panel
    from lippmann.rendering.adaptive import stopping

    monkeypatch.setattr(stopping, "_count_affordable", lambda *_: 0)
    display = Display("test", Panel(64, 64, 1.0), LensArray("square", 8.0), 30.0, "", 500.0, 80.0)

    def picture(seconds, **options):
        made = lippmann.render("teapot", display, integrator="path", max_time=seconds, seed=3, **options)
        assert made.provenance.spp == 1
        assert made.provenance.estimate is None
        return made

    return picture


def test_a_single_sample_is_cleaned_where_there_is_time(pictures):
    clean, noisy = pictures(1000.0), pictures(1000.0, denoise="none")
    assert clean.provenance.method == "pooled"
    assert "denoise" in clean.provenance.options

    def roughness(picture):
        values = np.clip(picture.pixels, 0, 1)
        return float(np.abs(np.diff(values, axis=1)).mean())

    assert roughness(clean) < 0.6 * roughness(noisy)


def test_a_single_sample_stays_as_it_is_where_the_time_is_up(pictures):
    picture = pictures(0.001)
    assert "denoise" not in picture.provenance.options
