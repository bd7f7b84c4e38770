"""How much of the pixels surfaces cover: as samples, parts of pictures, sub-pixels and guides tell it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.display.panel import PixelWindow
from lippmann.rendering.film.wavefront import Coverage
from lippmann.rendering.request.render_request import RenderRequest

pytestmark = pytest.mark.usefixtures("engine")

SHEET = Display("sheet", Panel(96, 64, 0.2), LensArray("lenticular", 1.24, slant=9.46), 1.9, viewing_distance=900.0)


def test_coverage_of_more_samples_is_by_their_number():
    few, many = (Coverage(np.full((2, 2, 1), share, np.float32), n) for share, n in ((1.0, 2), (0.5, 6)))
    both = few + many
    assert both.samples == 8
    assert both.share == pytest.approx(np.full((2, 2, 1), 0.625))
    none = Coverage(np.zeros((2, 2, 1), np.float32), 0)
    assert (none + many).share == pytest.approx(many.share)
    assert (none + none).share.max() == 0


@pytest.fixture(scope="module")
def session(engine):
    from lippmann.rendering.session import open_session

    return open_session(lippmann.load_scene("tree"), RenderRequest(integrator="path"))


def rays(subpixels=False, window=None):
    from lippmann.rendering.transport.ray_source import DisplayRays

    whole = DisplayRays(SHEET, np.diag([0.12, 0.12, 0.12, 1.0]), subpixels=subpixels)
    return whole if window is None else whole.of_window(window)


def batches(session, source, samples, seed=3, window=None, for_denoiser=True):
    from lippmann.rendering.film.sample_batches import BatchedRender

    integrator = session.integrator(rays(), np.eye(4))
    found = BatchedRender(integrator, source, seed=seed, memory=1 << 28, window=window, for_denoiser=for_denoiser)
    found.add(samples)
    return found


def guides(session, source):
    from lippmann.rendering.film.feature_buffers import plan_guides, trace_guides

    return trace_guides(session.built, source, plan_guides(source, 16, 1 << 28), np.eye(4))


@pytest.fixture(scope="module")
def truth(session):
    """``(64, 96, 3)``: of each sub-pixel, by paths of one surface."""
    single = replace(session, request=replace(session.request, integrator="direct"))
    first, second = batches(single, rays(subpixels=True), 64, seed=9).coverage_halves()
    share = (first + second).share
    assert 0.02 < ((share > 0) & (share < 1)).mean() < 0.9
    return share


def far_from(share, truth, samples):
    """Largest deviation of means over 8 x 8 pixels, by that of random samples; spread ones have less."""
    both = [values.mean(axis=2).reshape(8, 8, 12, 8).swapaxes(1, 2) for values in (share, truth, truth * (1 - truth))]
    found, true, variance = (values.mean(axis=(2, 3)) for values in both)
    return float((np.abs(found - true) / np.sqrt(np.maximum(variance, 1e-3) / (64 * samples))).max())


@pytest.mark.long
@pytest.mark.parametrize("subpixels", [False, True])
def test_paths_and_guides_tell_the_same(session, truth, subpixels):
    source = rays(subpixels)
    halves = batches(session, source, 6).coverage_halves()
    of_guides = guides(session, source).coverage
    assert [half.samples for half in (*halves, *of_guides)] == [3, 3, 8, 8]
    for half in (*halves, *of_guides):
        assert half.share.shape == (64, 96, 3 if subpixels else 1)
        steps = half.share * half.samples
        assert steps == pytest.approx(np.round(steps), abs=1e-3)
        assert far_from(half.share, truth, half.samples) < 4
    assert not np.array_equal(halves[0].share, halves[1].share)
    assert not np.array_equal(of_guides[0].share, of_guides[1].share)


def test_sub_pixels_have_their_own(session, truth):
    share = batches(session, rays(subpixels=True), 16).coverage_halves()[0].share
    errors = [[np.square(share[..., a] - truth[..., b]).mean() for b in range(3)] for a in range(3)]
    assert np.array_equal(np.argmin(errors, axis=1), [0, 1, 2])


def test_parts_and_one_stream_have_that_of_the_whole(session, truth):
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame

    window = PixelWindow(20, 10, 40, 30)
    whole = batches(session, rays(), 5).coverage_halves()
    part = batches(session, rays(), 5, window=window).coverage_halves()
    for half, cut in zip(whole, part, strict=True):
        assert half.samples == cut.samples
        assert np.array_equal(half.share[10:40, 20:60], cut.share)
    plan = cut_wavefronts(96, 64, 4, memory=1 << 28)
    integrator = session.integrator(rays(), np.eye(4))
    frame = trace_frame(integrator, rays(), plan, seed=3, for_denoiser=True)
    assert frame.coverage.samples == 4
    assert far_from(frame.coverage.share, truth, 4) < 4
    without = trace_frame(integrator, rays(), plan, seed=3)
    assert without.coverage is None
    assert np.array_equal(frame.pixels, without.pixels)


def test_it_is_told_with_chains_and_left_out_elsewhere(session):
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.film.sample_batches import BatchedRender

    plain = batches(session, rays(), 4).coverage_halves()
    integrator = session.integrator(rays(), np.eye(4))
    integrator = integrator.lit_by(replace(integrator.light, chains=dr.opaque(mi.UInt32, 2)))
    chained = BatchedRender(integrator, rays(), seed=3, memory=1 << 28, for_denoiser=True)
    chained.add(4)
    for a, b in zip(plain, chained.coverage_halves(), strict=True):
        assert np.array_equal(a.share, b.share)
    assert batches(session, rays(), 4, for_denoiser=False).coverage_halves() is None


def test_classic_surfaces_tell_it_in_guides(engine):
    from lippmann.rendering.session import open_session

    session = open_session(lippmann.load_scene("primitives"), RenderRequest())
    first, second = guides(session, rays()).coverage
    share = (first + second).share
    assert 0 < share.mean() <= 1
