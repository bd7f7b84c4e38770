"""What a plan decides and why, and that it decides nothing where the user has chosen."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.options.choices import ASKED
from lippmann.rendering.denoise.guided_denoiser import choose_effort
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import Choice, RenderRequest
from lippmann.rendering.request.tuning import TUNING
from lippmann.scene.readers.load import load_scene
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

SCENE = load_scene("teapot")


def unlit(*, fills_panel=False, others=()):
    """A triangle that shows its own colour, beside ``others``."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    materials = [Material("shown", unlit=True), *others]
    meshes = [Mesh("m", corners, np.array([[0, 1, 2]], np.uint32), i) for i in range(len(materials))]
    instances = [Instance(i, np.eye(4)) for i in range(len(meshes))]
    return load_scene(SceneDescription("unlit", meshes, materials, instances, fills_panel=fills_panel))


def decided(**values):
    return resolve(RenderRequest(**values), SCENE)


@pytest.mark.parametrize("values", [{}, {"spp": 4}, {"integrator": "direct"}, {"layers": True}])
def test_light_is_pooled_unless_something_else_is_said(values):
    found = decided(**values)
    assert (found.method, found.denoise) == ("pooled", "oidn")
    assert found.reason.startswith("pooled")


@pytest.mark.parametrize("goal", [{"quality_worst": 30.0}, {"quality": 30.0}, {"max_time": 5.0}])
def test_a_goal_is_reached_by_pooled_light(goal):
    for found in (decided(**goal), decided(method="pooled", **goal)):
        assert (found.method, found.denoise, found.spp) == ("pooled", "oidn", None)
    assert decided(method="pooled", denoise="oidn-fast", **goal).denoise == "oidn-fast"


@pytest.mark.parametrize("goal", [{"quality_worst": 30.0}, {"quality": 30.0}, {"max_time": 5.0}])
def test_light_that_cannot_be_pooled_is_not_pooled_for_a_goal(goal):
    found = decided(integrator="classic", **goal)
    assert (found.method, found.denoise) == ("full", "none")
    assert "the light of classic is not pooled" in found.reason


@pytest.mark.parametrize("denoise", ["none", "oidn", "oidn-fast", "oidn-high"])
def test_what_is_asked_for_wins(denoise):
    found = decided(quality_worst=30.0, denoise=denoise)
    assert (found.method, found.denoise) == ("full", denoise)
    assert "as asked for" in found.reason


def test_pooled_light_is_denoised():
    assert decided(method="pooled").denoise == "oidn"


@pytest.mark.parametrize("method", ["full", "lens-view", "interpolated"])
def test_a_named_method_is_left_alone(method):
    found = decided(method=method)
    assert (found.method, found.denoise, found.reason) == (method, "none", "")
    named = decided(method=method, denoise="oidn")
    assert named.denoise == "oidn"


def test_what_has_no_noise_is_not_denoised():
    found = decided(integrator="normal", spp=4)
    assert found.denoise == "none"
    assert "no noise" in found.reason


def test_effort_follows_the_samples_unless_it_is_named():
    assert [choose_effort("oidn", samples) for samples in (TUNING.usual - 1, TUNING.usual)] == ["fast", "high"]
    assert [choose_effort(name, 1000) for name in ("oidn-fast", "oidn-high")] == ["fast", "high"]
    assert choose_effort("oidn-high", 1) == "high"


def test_a_photograph_has_one_ray_a_pixel_and_keeps_its_colours():
    found = resolve(RenderRequest(tone_map="auto"), unlit(fills_panel=True), load_display("seed-lenticular"))
    assert (found.method, found.denoise, found.spp, found.pixel_filter) == ("full", "none", 1, "point")
    assert (found.tone_map, found.exposure) == ("none", 0.0)
    assert found.reason == "full: a photograph is shown as it is"
    assert found.spp_reserve is None


def test_what_has_no_noise_is_shown_by_rays_all_over_a_lens():
    sheet = load_display("print:lpi=60,ppi=720,size=20x15mm,thickness=26mil")
    photograph = unlit(fills_panel=True)
    found = resolve(RenderRequest(), photograph, sheet)
    assert (found.method, found.spp, found.pixel_filter) == ("full", 4, "box")
    for values in ({"spp": 1}, {"effort": "draft"}):
        found = resolve(RenderRequest(**values), photograph, sheet)
        assert (found.spp, found.pixel_filter) == (1, "point")
    found = resolve(RenderRequest(pixel_filter="point"), photograph, sheet)
    assert (found.spp, found.pixel_filter) == (1, "point")
    # A quilt's views are those of cameras.
    assert resolve(RenderRequest(), photograph, sheet, "quilt", size=(565, 425)).spp == 1
    found = resolve(RenderRequest(integrator="classic"), SCENE, sheet)
    assert (found.spp, found.pixel_filter) == (4, "box")
    pinhole = load_display("seed-lenticular")
    assert resolve(RenderRequest(integrator="classic"), SCENE, pinhole).spp == 1


def test_unlit_models_keep_their_colours_and_have_smooth_outlines():
    found = resolve(RenderRequest(tone_map="auto"), unlit(), load_display("seed-lenticular"))
    assert (found.method, found.denoise, found.pixel_filter, found.tone_map) == ("full", "none", "box", "none")
    assert (found.spp, found.spp_reserve) == (16, 128)


def test_lit_surfaces_beside_unlit_ones_have_noise():
    found = resolve(RenderRequest(tone_map="auto"), unlit(others=[Material("lit")]), load_display("seed-lenticular"))
    assert (found.method, found.tone_map) == ("pooled", "pbr-neutral")


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"spp": 4}, ("full", "none", 4, "box")),
        ({"method": "pooled"}, ("pooled", "oidn", 4, "box")),
        ({"denoise": "oidn-fast"}, ("full", "oidn-fast", 16, "box")),
        ({"quality": 40.0}, ("full", "none", None, "box")),
    ],
)
def test_what_is_asked_of_a_photograph_wins(values, expected):
    found = resolve(RenderRequest(**values), unlit(fills_panel=True), load_display("seed-lenticular"))
    assert (found.method, found.denoise, found.spp, found.pixel_filter) == expected


def test_a_tone_map_of_a_photograph_that_is_asked_for_wins():
    found = resolve(RenderRequest(tone_map="pbr-neutral"), unlit(fills_panel=True), load_display("seed-lenticular"))
    assert found.tone_map == "pbr-neutral"


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, ("full", "oidn-fast")),
        ({"integrator": "direct"}, ("full", "oidn-fast")),
        ({"method": "pooled"}, ("pooled", "oidn-fast")),
        ({"method": "full"}, ("full", "none")),
        ({"method": "lens-view"}, ("lens-view", "none")),
        ({"denoise": "oidn-high"}, ("full", "oidn-high")),
        ({"denoise": "none"}, ("full", "none")),
        ({"integrator": "classic"}, ("full", "none")),
        ({"integrator": "normal"}, ("full", "none")),
    ],
)
@pytest.mark.parametrize("name", ["seed-lenticular", "looking-glass-portrait"])
def test_a_draft_has_one_sample_and_the_fast_network(name, values, expected):
    if values.get("method") == "lens-view":
        values = {**values, "subpixels": False}
    found = resolve(RenderRequest(effort="draft", **values), SCENE, load_display(name))
    assert (found.spp, found.spp_reserve, found.method, found.denoise) == (1, None, *expected)


@pytest.mark.parametrize("form", ["picture", "tiles", "quilt", "forecast"])
def test_a_draft_is_one_in_every_form(form):
    found = resolve(RenderRequest(effort="draft"), SCENE, load_display("looking-glass-portrait"), form)
    assert (found.spp, found.method, found.denoise) == (1, "full", "oidn-fast")
    plain = resolve(RenderRequest(effort="draft"), SCENE, form="preview")
    assert (plain.spp, plain.denoise) == (1, "oidn-fast")


@pytest.mark.parametrize(
    ("values", "denoiser"), [({}, "oidn"), ({"denoise": "none"}, "none"), ({"integrator": "normal"}, "none")]
)
def test_plain_pictures_are_denoised_where_they_have_noise(values, denoiser):
    assert resolve(RenderRequest(**values), SCENE, form="preview").denoise == denoiser
    assert resolve(RenderRequest(**values), unlit(), form="preview").denoise == "none"


def test_a_draft_of_a_photograph_needs_no_network():
    found = resolve(RenderRequest(effort="draft"), unlit(fills_panel=True), load_display("seed-lenticular"))
    assert (found.method, found.denoise, found.spp) == ("full", "none", 1)
    one_ray = "one ray through each pixel's middle shows it"
    assert found.plan.samples.reason == f"a draft takes as many samples as the default: {one_ray}"


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({}, "a draft"),
        ({"integrator": "direct", "denoise": "none"}, "a draft"),
        ({"integrator": "classic"}, "a draft takes as many samples as the default: as the scene's file says"),
        ({"integrator": "normal"}, "a draft"),
    ],
)
def test_a_draft_that_is_the_same_picture_as_the_default_says_so(values, reason):
    display = load_display("seed-lenticular")
    draft, usual = (resolve(RenderRequest(effort=effort, **values), SCENE, display) for effort in ("draft", "normal"))
    assert draft.plan.samples.reason == reason
    is_same = all(getattr(draft, name) == getattr(usual, name) for name in ("spp", "method", "denoise", "pixel_filter"))
    assert is_same == (reason != "a draft")


def test_tones_are_mapped_unless_a_colour_of_the_background_was_asked_for():
    assert decided().tone_map == "pbr-neutral"
    assert decided(tone_map="none").tone_map == "none"
    before_white = load_scene("teapot", background=(1.0, 1.0, 1.0))
    assert resolve(RenderRequest(), before_white).tone_map == "none"
    assert resolve(RenderRequest(tone_map="pbr-neutral"), before_white).tone_map == "pbr-neutral"


def test_every_value_that_was_asked_for_is_kept_and_said_to_be():
    asked = {
        "integrator": "direct",
        "depth": 3,
        "method": "full",
        "denoise": "oidn-high",
        "subpixels": True,
        "pixel_filter": "point",
        "exposure": 1.5,
        "tone_map": "none",
        "caustics": "paths",
    }
    planned = resolve(RenderRequest(spp=5, **asked), SCENE, load_display("seed-lenticular"))
    for name, value in asked.items():
        choice = planned.plan.entries[name]
        assert (choice.value, choice.reason) == (value, ASKED), name
        assert getattr(planned, name) == value
    assert planned.plan.samples == Choice(5)
    assert planned.reason == ""


def test_whatever_is_left_open_has_a_reason():
    planned = resolve(RenderRequest(), SCENE, load_display("looking-glass-portrait"))
    plan = planned.plan
    assert all(choice.reason and choice.reason != ASKED for choice in plan.entries.values())
    assert (plan.samples.value, plan.reserve.value, plan.subpixels.value) == (3, 21, True)
    assert plan.to_dict()["samples"] == {"value": 3, "reason": plan.samples.reason}
    assert f"samples: 3 ({plan.samples.reason})" in plan.lines()
    # A picture may be planned again, as a sequence's frames are: its values are asked for then.
    again = resolve(planned, SCENE, load_display("looking-glass-portrait"))
    assert again == planned


@pytest.mark.parametrize(
    ("width", "samples", "reserve"),
    [(64, 16, 128), (512, 4, 32), (1024, 4, 32), (1500, 4, 32), (4200, 4, 8), (6000, 4, None)],
)
def test_samples_and_reserve_follow_the_size(width, samples, reserve):
    plan = resolve(RenderRequest(), SCENE, load_display("seed-lenticular"), size=(width, width)).plan
    assert (plan.samples.value, plan.reserve.value) == (samples, reserve)
    foreseen = resolve(RenderRequest(), SCENE, load_display("seed-lenticular"), "forecast", size=(width, width)).plan
    assert foreseen == plan
    tiled = resolve(RenderRequest(), SCENE, load_display("seed-lenticular"), "tiles", size=(width, width)).plan
    assert (tiled.samples.value, tiled.reserve.value) == (samples, None)


@pytest.mark.parametrize(("width", "samples"), [(64, 16), (512, 3), (2048, 3), (4096, 2)])
def test_sub_pixels_with_rays_of_their_own_take_fewer_samples(width, samples):
    display = load_display("looking-glass-portrait")
    assert resolve(RenderRequest(), SCENE, display, size=(width, width)).spp == samples


def test_a_pilots_results_take_the_place_of_what_it_decides():
    plan = resolve(RenderRequest(), SCENE).plan
    told = plan.with_pilot({"caustics": "photons", "exposure": 2.0, "seen_chains": 8})
    assert told.entries["caustics"].value == "photons"
    assert told.entries["seen_chains"].value == 8
    # This scene has no physical light sources, so no pilot measured its exposure.
    assert told.entries["exposure"].value == 0.0
    none = plan.with_pilot({}).entries["caustics"]
    assert none.value == "none"
    assert none.reason.startswith("no emitter shines")
    asked = resolve(RenderRequest(caustics="paths"), SCENE).plan
    assert asked.with_pilot({"caustics": "paths"}).entries["caustics"].reason == ASKED


@pytest.mark.parametrize(
    ("form", "values", "expected"),
    [
        ("picture", {}, ("pooled", 40.0, 256)),
        ("quilt", {}, ("pooled", 40.0, 256)),
        ("picture", {"method": "full"}, ("full", 40.0, 256)),
        ("picture", {"method": "lens-view"}, ("lens-view", None, 64)),
        ("picture", {"integrator": "classic"}, ("full", None, 64)),
        ("tiles", {}, ("pooled", None, 64)),
        ("forecast", {}, ("pooled", None, 64)),
        ("preview", {}, ("full", None, 64)),
    ],
)
def test_a_final_picture_works_for_a_quality_where_it_can(form, values, expected):
    display = None if form == "preview" else load_display("seed-lenticular")
    planned = resolve(RenderRequest(effort="final", **values), SCENE, display, form)
    assert (planned.method, planned.quality, planned.spp) == expected
    assert planned.spp_reserve is None
    assert "final" in planned.plan.samples.reason


def test_a_photograph_is_final_with_one_ray():
    planned = resolve(RenderRequest(effort="final"), unlit(fills_panel=True), load_display("seed-lenticular"))
    assert (planned.spp, planned.quality, planned.denoise) == (1, None, "none")


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        ({"environment": "studio"}, "environment"),
        ({"single_scattering": True}, "single_scattering"),
        ({"light": {"light_strength": 2.0}, "environment": "none"}, "environment and light_strength"),
    ],
)
def test_classic_models_refuse_other_light_and_materials_than_the_files(asked, named):
    scene = load_scene("small-balls", **asked)
    with pytest.raises(UsageError, match=f"integrator: {named} beside classic; .* of the file alone"):
        resolve(RenderRequest(integrator="classic"), scene)
    assert resolve(RenderRequest(integrator="path"), scene).integrator == "path"


@pytest.mark.parametrize(
    ("options", "light", "request_options", "said"),
    [
        (
            {"background": (1, 1, 1)},
            {},
            {},
            r"integrator: normal beside background=\.\.\.; .*; leave out background",
        ),
        ({}, {"light_turn": (20, 0)}, {}, r"integrator: normal beside light_turn=\.\.\."),
        ({}, {}, {"depth": 3}, "depth: 3: normal follows no path"),
        (
            {"single_scattering": True},
            {"light_strength": 2.0},
            {},
            r"leave out light_strength=\.\.\. and single_scattering=\.\.\.",
        ),
    ],
)
def test_a_property_of_surfaces_has_no_light(options, light, request_options, said):
    scene = load_scene("teapot", light=light, **options)
    with pytest.raises(UsageError, match=said):
        resolve(RenderRequest(integrator="normal", **request_options), scene)
    assert resolve(RenderRequest(integrator="path", **request_options), scene).integrator == "path"


def test_a_plan_of_a_property_may_be_planned_again():
    planned = resolve(RenderRequest(integrator="normal"), SCENE)
    assert resolve(planned, SCENE).integrator == "normal"
