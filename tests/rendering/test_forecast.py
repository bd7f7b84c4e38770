"""What is foreseen against what then is rendered."""

from __future__ import annotations

import html
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import lippmann
from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.errors import MemoryLimitError, UsageError
from lippmann.rendering import forecast

pytestmark = pytest.mark.usefixtures("engine")

SHEET = Display("sheet", Panel(240, 160, 0.25), LensArray("lenticular", 2.0), 3.0, aperture_distance=15.0)


@pytest.fixture(autouse=True)
def short_probe(monkeypatch):
    monkeypatch.setattr(forecast, "PROBE_SECONDS", 0.2)


@pytest.mark.long
@pytest.mark.parametrize("seconds", [0.0, 0.5])
def test_rays_are_those_of_the_rendering(monkeypatch, seconds):
    # However long the probe lasts: later samples take fewer shadow rays than the first.
    monkeypatch.setattr(forecast, "PROBE_SECONDS", seconds)
    options = {"spp": 8, "subpixels": True, "seed": 4}
    foreseen = lippmann.plan("teapot", SHEET, **options)
    rays = lippmann.render("teapot", SHEET, **options).stats["rays"]
    assert foreseen.rays["primary"] == rays["primary"] == 240 * 160 * 3 * 8
    for kind in ("shadow", "secondary"):
        assert foreseen.rays[kind] == pytest.approx(rays[kind], rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "size"), [("full", (640, 200)), ("half", (320, 200))])
def test_a_pair_has_the_rays_of_both_eyes(width, size):
    monitor = load_display("lume-pad").resized(320, 200)
    monitor = replace(monitor, stereo=replace(monitor.stereo, width=width))
    foreseen = lippmann.plan("teapot", monitor, spp=2)
    assert foreseen.size == size
    assert foreseen.rays["primary"] == size[0] * size[1] * 2


@pytest.mark.long
def test_depth_is_that_of_the_picture():
    foreseen = lippmann.plan("teapot", SHEET, spp=1)
    image = lippmann.render("teapot", SHEET, spp=1, layers=True)
    assert foreseen.depth_range == tuple(image.provenance.options["depth_range"])
    far, near = foreseen.depth_budget
    # N g behind, with 8 pixels to a lens 3 mm away; in front, recorded rays begin 15 mm away.
    assert (far, near) == pytest.approx((-24.0, 15.0), rel=1e-6)
    depth = image.maps["depth"]
    beyond = np.isfinite(depth) & ((depth < far) | (depth > near))
    assert foreseen.blurred_share == pytest.approx(beyond.mean(), abs=0.03)
    assert foreseen.blur[0] == pytest.approx(-foreseen.depth_range[0] / 24.0)
    assert foreseen.blur[1] == pytest.approx(abs(foreseen.depth_range[1]) / 24.0)


def test_a_notebook_shows_a_table(monkeypatch):
    monkeypatch.setattr(forecast, "resident_memory", lambda: 0)
    foreseen = lippmann.plan("teapot", SHEET, placement={"turn": 30, "place": "fit"}, spp=1, memory=16 << 20)
    assert foreseen.memory == {"expected": 16 << 20, "limit": 16 << 20}
    # A pitch of 2 mm over a gap of 3 mm: 36.9 degrees, and tan 18.4 over tan 17.5 times as much in 35.
    assert foreseen.in_words()["resolved"].endswith(
        "in a view cone of 37 degrees (in 35, 1.1 times as much would fuse)"
    )
    page = foreseen._repr_html_()
    ElementTree.fromstring(page)  # well-formed
    for text in (*foreseen.in_words().values(), *foreseen.notes):
        assert f">{html.escape(text)}</td>" in page


@pytest.mark.long
def test_work_grows_with_samples_and_pixels(monkeypatch):
    measured, trace = [], forecast._Probe.trace
    monkeypatch.setattr(forecast._Probe, "trace", lambda *given: measured.append(trace(*given)) or measured[-1])
    one, many = (lippmann.plan("teapot", SHEET, spp=spp, integrator="direct", method="full") for spp in (2, 2000))
    assert many.rays["primary"] == 1000 * one.rays["primary"]
    # Each measures anew, so their times cannot be compared with one another.
    for foreseen, found in zip((one, many), measured, strict=True):
        assert found.seconds_per_sample > 0
        traced = foreseen.rays["primary"] * found.seconds_per_sample
        assert foreseen.seconds["trace"] == pytest.approx(found.compile + traced)
    large = lippmann.plan("teapot", SHEET.resized(2400, 1600), spp=2, integrator="direct", method="full")
    assert large.memory["expected"] - one.memory["expected"] > 100 * 240 * 160 * 36 * 0.5
    assert set(one.seconds) == {"load", "build", "trace", "total"}
    assert one.seconds["total"] == pytest.approx(sum(v for k, v in one.seconds.items() if k != "total"))


@pytest.mark.long
def test_denoising_counts():
    found = lippmann.plan("teapot", SHEET, spp=2, denoise="oidn-fast")
    assert found.seconds["denoise"] > 0
    assert found.memory["expected"] > lippmann.plan("teapot", SHEET, spp=2, method="full").memory["expected"]


@pytest.mark.long
def test_small_and_classic_pictures():
    tiny = SHEET.resized(8, 3)
    found = lippmann.plan("teapot", tiny, spp=1)
    assert found.rays["primary"] == 24
    classic = lippmann.plan("teapot", SHEET, integrator="classic")
    assert classic.spp == 1
    assert classic.rays["primary"] == 240 * 160


def test_what_rendering_would_refuse_is_refused():
    with pytest.raises(MemoryLimitError):
        lippmann.plan("teapot", load_display("panel-8k"), memory=1 << 20)
    with pytest.raises(UsageError, match="has no noise"):
        lippmann.plan("teapot", SHEET, integrator="depth", denoise="oidn")


def test_the_plan_is_that_of_the_picture():
    small = SHEET.resized(96, 64)
    foreseen = lippmann.plan("teapot", small)
    told = lippmann.render("teapot", small).provenance.options["plan"]
    assert told == [
        f"{name}: {foreseen.in_words()[name]}" for name in foreseen.plan if name not in ("window", "wavefronts")
    ]
    assert foreseen.plan["samples"]["value"] == foreseen.spp
    assert foreseen.to_dict()["plan"] == foreseen.plan
    assert foreseen.plan["window"]["value"] == "all pixels"
    assert foreseen.plan["wavefronts"]["value"] >= 1
