"""Windows in which a scene can be seen: all that is outside them is background, to the last bit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.display.lens_profile import LensProfile
from lippmann.display.view_cone import panel_window, view_window
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.session import find_uniform_background
from lippmann.scene.placement import place
from lippmann.scene.studio_light import BACKDROP

pytestmark = pytest.mark.usefixtures("engine")

PANEL = Panel(300, 240, 0.2)
DISPLAYS = [
    Display("slanted", PANEL, LensArray("lenticular", 1.3, slant=9.46), 2.0, "", 300.0, 20.0),
    Display("leaning", PANEL, LensArray("lenticular", 1.7, slant=-20.0), 2.0, "", math.inf, 5.0),
    Display("square", PANEL, LensArray("square", 1.5), 2.5, "", 250.0, 15.0),
    Display("hexagonal", PANEL, LensArray("hexagonal", 1.7), 2.5, "", math.inf, 15.0),
]


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=2)
    mesh.apply_scale((1.0, 0.6, 1.4))
    return lippmann.load_scene(mesh)


def placed(scene, display, options):
    at = place(scene.bounds, display, options=options, bounds_in=scene.bounds_in)
    from lippmann.device.pbr import build
    from lippmann.device.pbr.scene import scene_corners

    return at, scene_corners(build(scene), at.display_from_world)


@pytest.mark.long_cases("leaning-place0", "square-place0")
@pytest.mark.slow
@pytest.mark.parametrize("place", [{}, {"turn": (30.0, 20.0, 10.0)}, {"shift": (9.0, -7.0, -30.0), "scale": 0.25}])
@pytest.mark.parametrize("display", DISPLAYS, ids=lambda display: display.name)
def test_nothing_of_the_scene_is_outside_a_panels_window(ball, display, place):
    """Whole pictures are rendered without any window."""
    at, corners = placed(
        ball,
        display,
        PlacementOptions(scale=place.get("scale", 0.4), **{k: v for k, v in place.items() if k != "scale"}),
    )
    found = panel_window(corners, display)
    assert found is not None
    image = lippmann.render(
        ball, display, integrator="direct", spp=2, subpixels=True, denoise="none", placement=at, tone_map="none"
    )
    seen = (image.pixels != np.float32(BACKDROP)).any(axis=-1)
    inside = np.zeros_like(seen)
    inside[found.top : found.top + found.height, found.left : found.left + found.width] = True
    assert seen.any()
    assert not (seen & ~inside).any()
    rows, columns = (np.flatnonzero(seen.any(axis=axis)) for axis in (1, 0))
    tight = (np.ptp(rows) + 1) * (np.ptp(columns) + 1)
    # The box around the turned ball is larger than the ball, and there is the margin.
    assert found.width * found.height < 4 * tight + 15000


@pytest.mark.long
@pytest.mark.parametrize("display", DISPLAYS[:2], ids=lambda display: display.name)
def test_nothing_of_the_scene_is_outside_a_quilts_windows(ball, display, monkeypatch):
    from lippmann.rendering import quilt as module

    options = {"views": (4, 3), "size": (400, 300), "integrator": "direct", "spp": 2, "denoise": "none", "seed": 2}
    place = PlacementOptions(scale=0.4, turn=(20.0, 10.0, 0.0), shift=(5.0, 3.0, -8.0))
    windowed = lippmann.render_quilt(ball, display, placement=place, **options)
    left, top, width, height = windowed.provenance.options["window"]
    assert width * height < 0.6 * 100 * 100
    assert windowed.provenance.traced_fraction == pytest.approx(width * height / 1e4)
    monkeypatch.setattr(module, "view_window", lambda *_: None)
    whole = lippmann.render_quilt(ball, display, placement=place, **options)
    assert whole.provenance.options["window"] == [0, 0, 100, 100]
    for number in range(12):
        outside = np.ones((100, 100), bool)
        outside[top : top + height, left : left + width] = False
        np.testing.assert_array_equal(whole.view(number)[outside], windowed.view(number)[outside])
        inside = np.abs(whole.view(number).mean(axis=(0, 1)) - windowed.view(number).mean(axis=(0, 1)))
        assert inside.max() < 0.02
    # Both say the same of their error: what is known without rays is free of it.
    ours, theirs = (quilt.provenance.estimate["psnr"] for quilt in (windowed, whole))
    assert ours == pytest.approx(theirs, abs=1.0)


@pytest.mark.long
def test_denoised_frames_are_traced_where_the_scene_is(ball):
    display = DISPLAYS[0]
    options = {
        "subpixels": True,
        "placement": PlacementOptions(scale=0.6),
        "seed": 3,
        "integrator": "direct",
        "tone_map": "none",
    }
    image = lippmann.render(ball, display, spp=4, denoise="oidn-fast", layers=True, **options)
    assert 0 < image.stats["traced_fraction"] < 0.7
    fine = lippmann.render(ball, display, spp=64, denoise="none", **options)
    assert fine.stats["traced_fraction"] == 1.0
    noisy = lippmann.render(ball, display, spp=4, denoise="none", **options)

    def psnr(picture):
        return -10 * math.log10(np.mean(np.square(picture.pixels - fine.pixels)))

    assert psnr(image) > psnr(noisy) + 2
    assert image.maps["error"].shape == image.maps["depth"].shape == (240, 300)
    stated = image.provenance.estimate
    assert stated["psnr_low"] - 3 < psnr(image)
    corner = image.pixels[0, 0]
    np.testing.assert_array_equal(corner, np.float32(BACKDROP))


def test_pictures_that_are_not_denoised_are_traced_whole(ball):
    image = lippmann.render(ball, DISPLAYS[0], spp=2, integrator="direct", denoise="none")
    assert image.stats["traced_fraction"] == 1.0


@pytest.mark.slow
def test_before_a_sky_that_is_seen_denoised_frames_are_traced_whole():
    scene = {
        "type": "scene",
        "ball": {"type": "sphere", "radius": 0.3},
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 0.5}},
    }
    display = DISPLAYS[0].resized(64, 48)
    image = lippmann.render(
        scene,
        display,
        placement=PlacementOptions(place="display", scale=9),
        integrator="direct",
        spp=2,
        denoise="oidn-fast",
    )
    assert image.stats["traced_fraction"] == 1.0
    assert image.pixels[0, 0] == pytest.approx(0.5, abs=0.1)


def test_where_nothing_is_saved_there_is_no_window(ball, monkeypatch):
    _, corners = placed(ball, DISPLAYS[0], PlacementOptions(scale=3.0))
    assert panel_window(corners, DISPLAYS[0]) is None
    assert view_window(corners, DISPLAYS[0], (100, 80)) is None
    endless = replace(DISPLAYS[0], name="endless")
    assert panel_window(np.full((8, 3), np.inf), endless) is None
    assert view_window(np.full((8, 3), np.inf), endless, (100, 80)) is None
    # Nothing is met before the aperture, 20 mm out, where a corner may lie behind the eye at 300 mm.
    small = np.array(corners) * 0.1
    near, beyond = (np.where(small[:, 2:] > 0, small * [1, 1, 0] + [0, 0, z], small) for z in (20, 400))
    assert panel_window(beyond, DISPLAYS[0]) == panel_window(near, DISPLAYS[0]) != panel_window(small, DISPLAYS[0])
    # All of it beside the panel: one pixel is left.
    beside = np.array(corners)
    beside[:, 0] += 1e4
    assert panel_window(beside, DISPLAYS[0]).width == 1


def test_only_an_even_background_is_known_without_rays(ball):
    from lippmann.device.pbr import build
    from lippmann.rendering.request.render_request import RenderRequest

    built = build(ball)
    assert find_uniform_background(built, RenderRequest(integrator="path")) == BACKDROP
    assert find_uniform_background(built, RenderRequest(integrator="normal")) is None
    lit = lippmann.load_scene(trimesh.creation.box(), environment=None, background=(0.1, 0.2, 0.3))
    assert find_uniform_background(build(lit), RenderRequest(integrator="direct")) == (0.1, 0.2, 0.3)


def test_rays_from_all_across_lenses_meet_a_box_inside_its_window_alone():
    lenses, lens = LensArray("lenticular", 6.0), LensProfile(4.0, 8.0)
    display = Display("real", Panel(300, 240, 0.2), lenses, 5.0, lens=lens, aperture_distance=15.0)
    x, y, z = (each.ravel() for each in np.meshgrid([-6.5, 6.5], [-4.0, 4.0], [-0.2, 0.0]))
    window = panel_window(np.stack([x, y, z], axis=1), display)
    u, v = np.meshgrid(np.arange(300) + 0.5, np.arange(240) + 0.5)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(*display.panel_point(u, v))
    for edge in (0.0, 1.0):
        aside, _ = display.aperture_point(0.5, edge)
        meets = (np.abs(ox + aside - oz / dz * dx) <= 6.5) & (np.abs(oy - oz / dz * dy) <= 4.0)
        rows, columns = np.nonzero(meets)
        assert window.left <= columns.min() < columns.max() < window.left + window.width
        assert window.top <= rows.min() < rows.max() < window.top + window.height
