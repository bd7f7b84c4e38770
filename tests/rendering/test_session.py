"""What every render begins with: memory, engine, scene, placement, integrator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.errors import MemoryLimitError
from lippmann.options.placement import PlacementOptions
from lippmann.rendering import session as sessions
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Stopwatch, memory_limit, open_session

pytestmark = pytest.mark.usefixtures("engine")

DIRECT = RenderRequest(method="full", integrator="direct", pixel_filter="box", denoise="none", spp=2)


@pytest.fixture(scope="module")
def teapot():
    return lippmann.load_scene("teapot")


def test_what_does_not_fit_is_refused_before_the_engine_starts(teapot, monkeypatch):
    monkeypatch.setattr(sessions.engines, "start", lambda *_: pytest.fail("the engine was started"))
    with pytest.raises(MemoryLimitError, match=r"1\.0 MiB are too small for 512x512 pixels"):
        open_session(teapot, replace(DIRECT, memory=1 << 20), (512, 512))


def test_tiles_have_a_memory_of_their_own(teapot):
    assert open_session(teapot, replace(DIRECT, memory=1 << 20), memory=1 << 30).memory == 1 << 30


def test_memory_is_what_is_asked_for_or_a_share_of_what_is_free(monkeypatch):
    monkeypatch.setattr(sessions.machine, "available_memory", lambda: 1000)
    assert memory_limit(DIRECT) == 600
    assert memory_limit(replace(DIRECT, memory=5)) == 5


def test_the_scene_is_built_on_the_engine_that_was_asked_for(teapot, monkeypatch):
    """Building started another: the GPU, wherever there was one, and all threads."""
    import drjit as dr

    from lippmann.runtime import machine

    monkeypatch.setattr(machine, "usable_cores", lambda: 2)
    session = open_session(teapot, replace(DIRECT, device="cpu", threads=1))
    assert (session.engine.threads, dr.thread_count()) == (1, 1)


def test_a_placement_found_before_is_taken_as_it_is(teapot):
    display = load_display("seed-lenticular")
    turned = replace(DIRECT, placement=PlacementOptions(turn=(30.0, 0.0, 0.0)))
    placement = open_session(teapot, turned).place(display)
    assert placement is not open_session(teapot, turned).place(display)
    assert open_session(teapot, replace(DIRECT, placement=placement)).place(display) is placement
    straight = open_session(teapot, DIRECT).place(display)
    assert not np.allclose(straight.world_from_display, placement.world_from_display)


def test_stages_are_timed_and_reported():
    reports = []
    watch = Stopwatch(reports.append)
    assert watch.stage("build", lambda: 3) == 3
    first = watch.seconds["build"]
    watch.stage("build", lambda: None)
    assert watch.seconds["build"] >= first
    assert watch.total >= watch.seconds["build"]
    assert [(report.stage, report.done, report.total) for report in reports] == 2 * [("build", 0, 1), ("build", 1, 1)]


def test_rays_begin_at_the_eyes_that_a_placement_says(teapot):
    """A caller that traced the display it had placed forgot that a monitor's eyes may stand closer together."""
    session, monitor = open_session(teapot, DIRECT), load_display("odyssey-3d")
    placement = replace(session.place(monitor), eye_share=0.5)
    assert session.rays(monitor, placement).display.gap == pytest.approx(2 * monitor.gap)


def test_all_samples_of_a_pixel_are_seen_by_one_eye(teapot):
    """They were spread over places between both eyes, which blurred in depth what the monitor shows sharp."""
    import mitsuba as mi

    session, monitor = open_session(teapot, DIRECT), load_display("odyssey-3d")
    jitter = mi.Point2f(mi.Float([0.0, 0.5, 0.99]), 0.5)
    source = session.rays(monitor, replace(session.place(monitor), eye_share=1.0))
    (x, _, z), (dx, _, dz) = source.light_rays(mi.UInt32(100), mi.UInt32(100), mi.UInt32(0), jitter)
    at_eye = np.asarray(x + (monitor.viewing_distance - z) / dz * dx)
    assert np.ptp(at_eye) < 1.01 * monitor.lens_array.pitch
    assert abs(at_eye) == pytest.approx(monitor.stereo.eyes / 2, abs=monitor.lens_array.pitch)
