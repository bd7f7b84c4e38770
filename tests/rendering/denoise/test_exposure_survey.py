"""What is decided for a whole picture before its parts are denoised."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann import api
from lippmann.display import load_display
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.tiles.job import make_job

pytestmark = pytest.mark.usefixtures("engine")

SETTINGS = RenderRequest(integrator="direct", denoise="oidn", spp=4)


def treatment(scene="small-balls", settings=SETTINGS, size=(96, 64)):
    from lippmann.tiles.tile_render import prepare

    display = load_display("seed-lenticular").resized(*size)
    return prepare(make_job(api.load_scene(scene), display, settings, stored="float32", side=128)).treatment


@pytest.mark.long
def test_many_rays_deserve_the_high_effort():
    assert treatment().effort == "fast"
    assert treatment(settings=replace(SETTINGS, spp=64)).effort == "high"
    assert treatment(settings=replace(SETTINGS, denoise="oidn-high")).effort == "high"
    assert treatment(settings=replace(SETTINGS, denoise="oidn-fast", spp=64)).effort == "fast"


@pytest.mark.slow
def test_plain_settings_need_none():
    assert treatment(settings=RenderRequest(method="full", integrator="direct", spp=1)) is None


def test_exposure_makes_the_mean_a_middle_grey():
    from lippmann.rendering.denoise.exposure_survey import exposure_of

    picture = np.random.default_rng(0).lognormal(0, 0.1, (128, 128, 1)).astype(np.float32) * np.ones(3, np.float32)
    assert exposure_of(picture) == pytest.approx(0.18, rel=0.02)
    assert exposure_of(4 * picture) == pytest.approx(0.18 / 4, rel=0.02)
    picture[:, :64] = 0  # black does not count
    assert exposure_of(picture) == pytest.approx(0.18, rel=0.02)
    assert exposure_of(0 * picture) == 1.0


def test_exposure_is_what_open_image_denoise_finds_itself():
    from lippmann.rendering.denoise.exposure_survey import exposure_of
    from lippmann.rendering.denoise.oidn import denoise

    # In squares of 16 pixels, in which the library takes its means.
    bright = np.random.default_rng(1).exponential(1.0, (8, 8))
    picture = (np.kron(bright, np.ones((16, 16)))[..., None] * [20.0, 10.0, 5.0]).astype(np.float32)
    own = denoise(picture, effort="fast")
    found = exposure_of(picture)
    np.testing.assert_allclose(denoise(picture, exposure=found, effort="fast"), own, rtol=2e-3)
    assert np.abs(denoise(picture, exposure=found / 30, effort="fast") / own - 1).max() > 0.01
