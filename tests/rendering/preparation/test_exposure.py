"""Physical light is brought to mid-grey; a given exposure is kept; all ways of rendering agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann import api
from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.image import read_picture
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.live.live_view import LiveView
from lippmann.rendering.live.renderer import LiveRenderer
from lippmann.rendering.picture import choose_exposure
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.matrices import translation
from lippmann.scene.values.description import Camera, Instance, Light, Material, Mesh, SceneDescription

pytestmark = pytest.mark.usefixtures("engine")

SUN = 100_000.0  # lux
DISPLAY = load_display("mla-square").resized(120, 120)


def scene(*, physical=True, illuminance=SUN, **rest):
    """A grey wall in the sun, slightly askew."""
    corners = np.float32([(-10, -10, 0), (10, -10, 1), (10, 10, 1), (-10, 10, 0)])
    wall = Mesh("wall", corners, np.uint32([(0, 1, 2), (0, 2, 3)]), 0)
    light = Light("directional", (illuminance,) * 3, np.eye(4))
    return api.load_scene(
        SceneDescription(
            "wall",
            [wall],
            [Material(base_color=(0.5, 0.5, 0.5), specular=0.0)],
            [Instance(0, np.eye(4))],
            lights=[light],
            physical_lights=physical,
            **rest,
        )
    )


#: Light as it is, not as it is shown.
LINEAR = {"integrator": "direct", "tone_map": "none"}


def picture(what, **options):
    return api.render(what, DISPLAY, spp=4, method="full", **LINEAR, **options)


@pytest.mark.slow
def test_the_median_of_what_is_lit_is_mid_grey():
    image = picture(scene())
    lit = image.pixels[image.pixels.max(-1) > 0].mean(-1)
    assert np.median(lit) == pytest.approx(0.18, rel=0.02)
    exposure = image.provenance.options["exposure"]
    assert exposure == pytest.approx(np.log2(0.18 / (SUN * 0.5 / np.pi)), abs=0.05)
    assert any(f"exposure {exposure:+.2f} EV" in note for note in image.provenance.notes)


@pytest.mark.slow
def test_an_exposure_that_is_given_is_kept():
    plain = picture(scene(), exposure=0.0)
    assert "exposure" not in plain.provenance.options
    assert plain.pixels.max() > 10_000
    raised = picture(scene(), exposure=-10.0)
    np.testing.assert_allclose(raised.pixels, plain.pixels * 2.0**-10, rtol=1e-5)
    assert raised.provenance.options["exposure"] == -10.0


EYE = Camera("eye", translation((0, 0, 30)), fov_y=0.5, focus_distance=30.0, exposure=2.0)


def test_a_cameras_own_exposure_comes_on_top_of_a_fixed_one():
    plain = scene(cameras=[replace(EYE, exposure=0.0)])
    raised = scene(cameras=[EYE])
    placement = {"camera": "eye"}
    without = picture(plain, exposure=-10.0, placement=placement)
    image = picture(raised, exposure=-10.0, placement=placement)
    assert without.pixels.max() > 1.0
    np.testing.assert_allclose(image.pixels, 4.0 * without.pixels, rtol=1e-5)
    assert image.provenance.options["exposure"] == -8.0
    np.testing.assert_array_equal(picture(raised, exposure=-10.0).pixels, picture(plain, exposure=-10.0).pixels)
    seen = api.preview(raised, size=(32, 32), spp=1, exposure=-10.0, denoise="none", **LINEAR).pixels
    np.testing.assert_allclose(
        seen, 4.0 * api.preview(plain, size=(32, 32), spp=1, exposure=-10.0, denoise="none", **LINEAR).pixels, rtol=1e-5
    )


def test_an_automatic_exposure_leaves_the_cameras_out_and_says_so():
    placement = {"camera": "eye"}
    image = picture(scene(cameras=[EYE]), placement=placement)
    plain = picture(scene(cameras=[replace(EYE, exposure=0.0)]), placement=placement)
    np.testing.assert_array_equal(image.pixels, plain.pixels)
    assert any("own exposure (+2.00 EV) counts with a fixed one alone" in note for note in image.provenance.notes)
    # A sequence holds what was measured: the camera's own comes on top again.
    request = RenderRequest(integrator="direct", method="full", spp=4, placement=PlacementOptions(camera="eye"))
    held = choose_exposure(scene(cameras=[EYE]), DISPLAY, request)
    assert held == pytest.approx(image.provenance.options["exposure"] - 2.0)


def test_light_of_the_studio_knows_no_exposure_of_a_camera():
    dark = [scene(illuminance=0.0, physical=False, cameras=[replace(EYE, exposure=stops)]) for stops in (0.0, 2.0)]
    without, image = (picture(each, placement={"camera": "eye"}).pixels for each in dark)
    assert without.max() > 0.1
    np.testing.assert_array_equal(image, without)


def test_live_pictures_count_the_cameras_exposure_once():
    request = RenderRequest(exposure=-10.0, placement=PlacementOptions(camera="eye"))
    plain, raised = (
        LiveRenderer(scene(cameras=[replace(EYE, exposure=stops)]), DISPLAY).frame(
            LiveView((0.0, 0.0, 400.0), (32, 32), request=replace(request, tone_map="none", exposure=exposure))
        )
        for stops, exposure in ((0.0, -8.0), (2.0, -10.0))
    )
    assert plain.exposure == raised.exposure == -8.0
    np.testing.assert_array_equal(plain.pixels, raised.pixels)


def test_light_that_is_not_physical_stays_as_it_is():
    image = picture(scene(physical=False, illuminance=2.0))
    assert "exposure" not in image.provenance.options
    assert np.median(image.pixels[image.pixels.max(-1) > 0]) == pytest.approx(2.0 * 0.5 / np.pi, rel=0.02)


@pytest.mark.long
def test_the_background_keeps_its_colour():
    image = picture(scene(background=(0.25, 0.5, 0.75)), placement=api.PlacementOptions(scale=0.3))
    np.testing.assert_allclose(image.pixels[0, 0], (0.25, 0.5, 0.75), rtol=1e-5)


@pytest.mark.long
def test_previews_quilts_tiles_and_reuse_choose_alike(tmp_path):
    whole = picture(scene())
    preview = api.preview(scene(), size=(64, 64), spp=4, **LINEAR)
    assert np.median(preview.pixels[preview.pixels.max(-1) > 0]) == pytest.approx(0.18, rel=0.05)
    reused = api.render(scene(), DISPLAY, spp=1, method="lens-view", **LINEAR)
    assert reused.provenance.options["exposure"] == pytest.approx(whole.provenance.options["exposure"], abs=0.02)
    path = tmp_path / "a.exr"
    done = api.render_to_file(scene(), path, DISPLAY, spp=4, method="full", **LINEAR)
    assert done.provenance.options["exposure"] == whole.provenance.options["exposure"]
    np.testing.assert_allclose(read_picture(path).pixels, whole.pixels, rtol=2e-3)


def test_values_that_are_no_light_have_no_exposure():
    with pytest.raises(UsageError, match=r"exposure: .*no amounts of light"):
        api.render(scene(), DISPLAY, integrator="normal", exposure=1.0)
    with pytest.raises(UsageError, match=r"exposure: .*stops from -40 to 40"):
        api.render(scene(), DISPLAY, exposure=41.0)


@pytest.mark.slow
def test_a_sequence_keeps_the_exposure_of_the_motions_first_frame():
    from lippmann.scene.placement import place
    from lippmann.sequences.frames import hold_exposure

    class Sunset:
        def scene(self, frame):
            return scene(illuminance=SUN / 2**frame)

    request = RenderRequest(integrator="direct", method="full", spp=4)
    held = hold_exposure(request, Sunset(), DISPLAY, lambda frame: place(scene().bounds, DISPLAY))
    assert held.exposure == picture(scene()).provenance.options["exposure"]
    assert picture(Sunset().scene(3), exposure=held.exposure).pixels.max() < 0.05
    assert hold_exposure(RenderRequest(exposure=2.0), Sunset(), DISPLAY, place).exposure == 2.0


def lit_by_few_paths(seed):
    """Pixels of 0.5 in the mean, of which one in twenty has met all of the light, and the others next to none."""
    hit = np.random.default_rng(seed).random((64, 64, 1)) < 0.05
    return np.where(hit, 9.62, 0.02).astype(np.float32).repeat(3, axis=2)


def test_light_that_few_paths_find_is_exposed_for_by_means():
    from lippmann.rendering.preparation.exposure import compute_exposure

    found = compute_exposure(lit_by_few_paths(1), None)
    assert found == pytest.approx(np.log2(0.18 / 0.5), abs=0.5)


def test_what_is_not_lit_does_not_count():
    from lippmann.rendering.preparation.exposure import compute_exposure

    pixels = np.random.default_rng(3).uniform(0.1, 0.5, (60, 63, 1)).astype(np.float32).repeat(3, axis=2)
    pixels[:20] = 0
    assert compute_exposure(pixels, None) == pytest.approx(np.log2(0.18 / 0.3), abs=0.1)
    assert compute_exposure(0 * pixels, None) == 0.0
    assert compute_exposure(pixels + 2, (2.0, 2.0, 2.0)) == pytest.approx(np.log2(0.18 / 2.3), abs=0.1)
