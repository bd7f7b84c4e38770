"""A preview is what replay shows of the whole picture, without the whole picture."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image as Pillow

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.display.visible_pixels import EyeMap
from lippmann.errors import UsageError
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.live.eye_preview import render_eye_preview
from lippmann.rendering.request.render_request import RenderRequest

pytestmark = pytest.mark.usefixtures("engine")

DISPLAYS = {
    "lenticular": Display("lenticular", Panel(96, 64, 0.5), LensArray("lenticular", 4.0), 3.0, "", 300.0, 20.0),
    "slanted": Display("slanted", Panel(90, 60, 0.5), LensArray("lenticular", 2.3, 12.0), 3.0, "", 400.0, 20.0),
    "hexagonal": Display("hexagonal", Panel(96, 64, 0.5), LensArray("hexagonal", 4.0), 3.0, "", float("inf"), 20.0),
}
EYES = [(0.0, 0.0, 300.0), (25.0, -10.0, 220.0)]


@pytest.fixture(scope="module")
def teapot():
    return lippmann.load_scene("teapot")


@pytest.mark.long_cases(but=["hexagonal-eye0"])
@pytest.mark.slow
@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("name", DISPLAYS)
def test_it_is_the_replay_of_the_whole_picture(teapot, name, eye):
    display = DISPLAYS[name]
    placed = PlacementOptions(turn=(20.0, 0.0, 0.0))
    exact = {"integrator": "albedo", "pixel_filter": "point", "spp": 1, "placement": placed}
    whole = lippmann.render(teapot, display, method="full", **exact)
    found = render_eye_preview(teapot, display, eye, RenderRequest(**exact), (60, 60))
    height, width = found.pixels.shape[:2]
    assert (width, height) == (60, 40)
    replayed = whole.replay(eye, size=(width, height), filter="nearest")
    assert replayed.std() > 0.05
    # A point on a boundary between pixels may fall to either side.
    assert (np.abs(found.pixels - replayed).max(axis=2) > 1e-4).mean() < 0.01

    light = {"spp": 64, "denoise": "none", "placement": placed, "tone_map": "none"}
    whole = lippmann.render(teapot, display, method="full", **light)
    assert whole.provenance.subpixels == (name == "slanted")
    found = render_eye_preview(teapot, display, eye, RenderRequest(**light), (60, 60))
    replayed = whole.replay(eye, size=(width, height), filter="nearest")
    assert np.abs(found.pixels - replayed).mean() < 0.015
    assert found.pixels.mean() == pytest.approx(replayed.mean(), rel=0.02)


FINE = Display("fine", Panel(360, 240, 0.125), LensArray("lenticular", 0.6, 12.0), 0.8, "", 400.0, 20.0)
BLOCKS = Display("blocks", Panel(192, 128, 0.25), LensArray("square", 1.0), 1.0, "", 400.0, 20.0)


def corner():
    """A floor, a wall and a ball before it, under a lamp."""
    import mitsuba as mi

    def paint(*color):
        bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(color)}}
        return {"type": "twosided", "bsdf": bsdf}

    place, glow = mi.ScalarTransform4f, {"type": "area", "radiance": {"type": "rgb", "value": 60.0}}
    floor = place().translate([0, -0.9, 0]).rotate([1, 0, 0], -90).scale(1.6)
    return {
        "type": "scene",
        "floor": {"type": "rectangle", "to_world": floor, "bsdf": paint(0.6, 0.5, 0.4)},
        "wall": {
            "type": "rectangle",
            "to_world": place().translate([0, 0, -1.1]).scale(1.6),
            "bsdf": paint(0.4, 0.5, 0.6),
        },
        "lamp": {"type": "sphere", "center": [-0.7, 1.6, 1.2], "radius": 0.3, "emitter": glow},
        "ball": {"type": "sphere", "center": [0.1, -0.2, -0.1], "radius": 0.6, "bsdf": paint(0.7, 0.3, 0.2)},
    }


@pytest.mark.long_cases("blocks")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("display", "room", "most"), [(FINE, corner, 0.29), (BLOCKS, "room", 0.5)], ids=["fine", "blocks"]
)
def test_noise_is_taken_out_of_the_eyes_view(display, room, most):
    """Before noisy walls: the network does not smooth edges, which are most of the error elsewhere.

    Of sub-pixels it gets all colours: by three seeds this leaves 0.25 to 0.26 of the error, and one colour of each 0.33
    to 0.34, as their noise looks like texture.
    """
    scene = lippmann.load_scene(room if isinstance(room, str) else room())
    placed = (
        PlacementOptions() if isinstance(room, str) else PlacementOptions(place="display", scale=display.size_mm[0] / 2)
    )

    def shown(**options):
        request = RenderRequest(integrator="path", placement=placed, **options)
        return render_eye_preview(scene, display, EYES[0], request, (90, 90))

    many = shown(spp=64, denoise="none").pixels
    noisy, clean = (shown(spp=4, denoise=each, seed=3) for each in ("none", "auto"))
    assert "denoise" not in noisy.provenance.options
    assert clean.provenance.options["denoise_effort"] == "fast"
    assert np.mean((clean.pixels - many) ** 2) < most * np.mean((noisy.pixels - many) ** 2)


def test_a_denoiser_that_is_asked_for_is_there_or_missed_at_once(teapot, monkeypatch):
    asked = render_eye_preview(teapot, BLOCKS, EYES[0], RenderRequest(spp=4, denoise="oidn-high"), (60, 60))
    assert asked.provenance.options["denoise_effort"] == "high"
    with pytest.raises(UsageError, match="denoise: normal has no noise"):
        render_eye_preview(teapot, BLOCKS, EYES[0], RenderRequest(integrator="normal", denoise="oidn"), (60, 60))
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(UsageError, match="denoise: Open Image Denoise is not installed"):
        render_eye_preview(teapot, BLOCKS, EYES[0], RenderRequest(denoise="oidn"), (60, 60))


def test_every_pixel_is_traced_once_and_what_lies_past_the_panel_not_at_all():
    seen = EyeMap(DISPLAYS["hexagonal"], (200, 125), subpixels=False).pixels_for_eye((900.0, 0.0, 300.0))
    assert len(np.unique(np.stack([seen.column, seen.row]), axis=1).T) == len(seen.column)
    assert seen.number.max() == len(seen.column) - 1
    assert (seen.number == -1).any()
    assert seen.number.shape == (125, 200, 1)


@pytest.mark.parametrize(("display", "subpixels"), [(FINE, True), (BLOCKS, False)], ids=["fine", "blocks"])
def test_denoisers_get_all_colors_of_each_value_and_pictures_come_back(display, subpixels):
    visible = EyeMap(display, (150, 100), subpixels=subpixels).pixels_for_eye(EYES[0])
    values = np.random.default_rng(4).random((len(visible.column), 3), dtype=np.float32)
    picture = visible.arrange_for_denoiser(values)
    assert picture.shape[1] == (3 * 150 if subpixels else display.lens_grid.columns)
    assert (picture == values[visible.places]).all(axis=2)[visible.places >= 0].all()
    assert np.array_equal(visible.arrange_denoised(picture), visible.arrange(values))


@pytest.mark.parametrize(("display", "subpixels"), [(FINE, True), (FINE, False), (BLOCKS, False)])
def test_denoisers_get_means_of_points_as_the_picture_does_but_where_lenses_are_blocks(display, subpixels):
    visible = replace(EyeMap(display, (150, 100), subpixels=subpixels).pixels_for_eye(EYES[0]), across=2)
    values = np.random.default_rng(5).random((len(visible.column), 3), dtype=np.float32)
    picture = visible.arrange_for_denoiser(values)
    assert picture.shape[1] == (display.lens_grid.columns if display is BLOCKS else 75 * visible.channels)
    assert visible.points == (1 if display is BLOCKS else 4)
    assert visible.arrange(values).shape == (50, 75, 3)
    assert visible.arrange_denoised(picture) == pytest.approx(visible.arrange(values), abs=1e-6)


def test_a_photograph_fills_picture_and_preview_with_its_own_colours(tmp_path):
    """Orange, far brighter than tone mapping would leave it: one ray a pixel, no network, no edge in any view."""
    color = np.array([250, 120, 10], np.uint8)
    Pillow.fromarray(np.broadcast_to(color, (30, 40, 3)).copy()).save(tmp_path / "p.png")
    np.save(tmp_path / "d.npy", 1 / np.tile(np.linspace(1, 2, 40), (30, 1)))
    photo = lippmann.load_scene(tmp_path / "p.png", depth_map=tmp_path / "d.npy")
    display = DISPLAYS["slanted"]
    whole = lippmann.render(photo, display, tone_map="auto")
    assert (whole.provenance.spp, whole.provenance.method, "denoise" in whole.provenance.options) == (1, "full", False)
    assert np.abs(whole.srgb().astype(int) - color).max() <= 1
    found = render_eye_preview(photo, display, EYES[1], RenderRequest(tone_map="auto"), (60, 60))
    assert (found.provenance.spp, "denoise" in found.provenance.options) == (1, False)
    assert found.pixels.max(axis=(0, 1)) == pytest.approx(whole.pixels.max(axis=(0, 1)))


def test_a_preview_of_one_eye_counts_the_rays_that_it_traced():
    """One of each lens's 225 pixels is traced, and the surroundings fill the rest of the picture."""
    ball = {"type": "sphere", "bsdf": {"type": "diffuse"}}
    scene = lippmann.load_scene({"type": "scene", "ball": ball, "sky": {"type": "constant"}})
    display = lippmann.load_display("mla-square")
    preview = render_eye_preview(scene, display, EYES[0], RenderRequest(spp=1), (512, 512))
    assert not any("empty" in note for note in preview.provenance.notes)
