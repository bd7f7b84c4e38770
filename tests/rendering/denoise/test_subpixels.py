"""Sub-pixels whose rays keep all colours: what they show is what they show otherwise, and cleaned by all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.display import Display, LensArray, Panel
from lippmann.display.panel import PixelWindow
from lippmann.metrics.mse_psnr import psnr
from lippmann.rendering.request.render_request import RenderRequest

pytestmark = pytest.mark.usefixtures("engine")

SHEET = Display("sheet", Panel(96, 64, 0.2), LensArray("lenticular", 1.24, slant=9.46), 1.9, viewing_distance=900.0)


@pytest.fixture(scope="module")
def integrator(engine):
    from lippmann.rendering.session import open_session

    session = open_session(lippmann.load_scene("teapot"), RenderRequest(integrator="direct"))
    return session.integrator(rays(), np.eye(4))


def rays(window=None, display=SHEET):
    from lippmann.rendering.transport.ray_source import DisplayRays

    whole = DisplayRays(display, np.diag([0.08, 0.08, 0.08, 1.0]), subpixels=True)
    return whole if window is None else whole.of_window(window)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "window"), [pytest.param("rgb", None, marks=pytest.mark.long), ("brg", PixelWindow(20, 10, 40, 30))]
)
def test_own_colours_are_those_that_sub_pixels_have_alone(integrator, order, window):
    from lippmann.rendering.film.sample_batches import BatchedRender
    from lippmann.rendering.transport.ray_source import SubpixelRays

    offsets = tuple((order.index(color) / 3 - 1 / 3, 0.0) for color in "rgb")
    source = rays(window, replace(SHEET, panel=replace(SHEET.panel, subpixel_offsets=offsets)))
    alone = BatchedRender(integrator, source, seed=3, memory=1 << 28)
    together = BatchedRender(integrator, SubpixelRays(source), seed=3, memory=1 << 28)
    for batches in (alone, together):
        batches.add(5)
    assert alone.picture().std() > 0.05
    np.testing.assert_allclose(together.picture(), alone.picture(), rtol=1e-5, atol=1e-6)
    for half, other in zip(together.average_halves(), alone.average_halves(), strict=True):
        np.testing.assert_allclose(together.to_display(half), other, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(together.squared_error().values, alone.squared_error().values, rtol=1e-3, atol=1e-6)
    assert together.rays == alone.rays


@pytest.mark.slow
def test_a_denoiser_is_given_all_colours(integrator, as_denoised):
    from lippmann.rendering.denoise.dual_buffer import DenoisedPicture
    from lippmann.rendering.film.sample_batches import BatchedRender
    from lippmann.rendering.transport.ray_source import SubpixelRays

    batches = BatchedRender(integrator, SubpixelRays(rays()), seed=3, memory=1 << 28)
    given, turns = [], []

    def keep(pixels, samples, rotated):
        given.append(pixels)
        turns.append(rotated)
        return pixels + np.float32(0.5)

    denoised = DenoisedPicture(batches, keep, "srgb")
    for samples in (1, 3):
        batches.add(samples)
        np.testing.assert_allclose(denoised.picture(), batches.picture() + 0.5, atol=1e-5)
    one, *halves = given
    assert turns == [False, False, True]
    assert one.shape == halves[0].shape == (64, 288, 3)
    for half, traced in zip(halves, batches.average_halves(), strict=True):
        np.testing.assert_allclose(half, traced, rtol=1e-6)
    # All colours of a sub-pixel are there, not only its own.
    assert (one.reshape(-1, 3).max(axis=0) > 0).all()
    assert (one[:, 0::3, 1:] > 0).any()
    assert denoised.squared_error().values.shape == (64, 96)


def picture(method="pooled", samples=2, seed=5, **options):
    return lippmann.render(
        "room",
        SHEET,
        subpixels=True,
        integrator="direct",
        method=method,
        spp=samples,
        seed=seed,
        tone_map="none",
        **options,
    )


@pytest.fixture(scope="module")
def references(engine):
    """Two of them, whose noise has nothing in common."""
    return [coded(picture("full", 24, seed=seed, denoise="none")) for seed in (8, 9)]


def coded(image):
    return encode_srgb(np.clip(image.pixels, 0, 1).astype(np.float64))


def error(image, references):
    """Mean squared, free of the references' noise."""
    first, second = (coded(image) - reference for reference in references)
    return float((first * second).mean())


@pytest.mark.long
@pytest.mark.parametrize(("method", "samples"), [("pooled", 2), ("full", 1)])
def test_all_colours_are_worth_more_than_one(references, method, samples, monkeypatch):
    found = picture(method, samples, denoise="oidn-fast")
    monkeypatch.setattr(RenderRequest, "keeps_colors", lambda *_: False)
    of_one = picture(method, samples, denoise="oidn-fast")
    assert error(found, references) < 0.6 * error(of_one, references)
    assert found.provenance.rays == of_one.provenance.rays
    told = found.provenance.estimate
    assert (told is None) == (samples == 1)
    if told is not None:
        assert told["psnr_low"] - 1 < psnr(error(found, references)) < told["psnr_high"] + 1
