"""What a request means for a scene of Gaussian splats, and what it cannot ask for."""

import numpy as np
import pytest

from lippmann.errors import UsageError
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.readers.load import load_scene
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription
from lippmann.scene.values.splats import Splats

SPLATS = Splats(
    np.float32([[0, 0, 0], [1, 1, 1]]),
    np.ones((2, 3), np.float32),
    np.float32([[0, 0, 0, 1]] * 2),
    np.ones(2, np.float32),
    np.zeros((2, 1, 3), np.float32),
)
TRIANGLE = Mesh("t", np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.uint32([[0, 1, 2]]), 0)
ALONE = SceneDescription("alone", splats=SPLATS)
UNLIT = SceneDescription("unlit", [TRIANGLE], [Material(unlit=True)], [Instance(0, np.eye(4))])
BOTH = SceneDescription("both", [TRIANGLE], [Material()], [Instance(0, np.eye(4))], splats=SPLATS)


def resolved(description, **options):
    return resolve(RenderRequest(**options), load_scene(description))


def test_one_ray_a_pixel_shows_splats():
    request = resolved(ALONE, tone_map="auto")
    assert (request.method, request.denoise, request.spp, request.pixel_filter) == ("full", "none", 1, "point")
    assert (request.tone_map, request.exposure) == ("none", 0.0)
    assert request.reason == "full: splats have no noise"


def test_samples_that_are_asked_for_are_spread_over_the_pixel():
    assert resolved(ALONE, spp=4).pixel_filter == "box"
    assert resolved(ALONE, pixel_filter="box").pixel_filter == "box"
    assert resolved(ALONE, quality=40.0).pixel_filter == "box"
    assert resolved(ALONE, tone_map="pbr-neutral").tone_map == "pbr-neutral"


def test_surfaces_beside_splats_have_noise():
    request = resolved(BOTH)
    assert (request.method, request.denoise, request.spp, request.pixel_filter) == ("full", "none", 16, "box")
    assert request.caustics == "paths"
    assert resolved(BOTH, exposure=1.0).exposure == 1.0


@pytest.mark.parametrize(
    ("description", "options", "said"),
    [
        (ALONE, {"method": "pooled"}, "alone: method: pooled shares the light of surfaces"),
        (BOTH, {"method": "lens-view"}, "both: method: lens-view shares the light of surfaces"),
        (ALONE, {"integrator": "normal"}, "integrator: normal is told of surfaces"),
        (ALONE, {"layers": True}, "layers: are told of surfaces"),
        (BOTH, {"denoise": "oidn"}, "denoise: oidn goes by the edges of surfaces"),
        (BOTH, {"caustics": "photons"}, "caustics: photons land on surfaces"),
        (ALONE, {"exposure": 1.0}, "exposure: 1; must be 0"),
        (ALONE, {"clamp_indirect": 1.0}, "alone: clamp_indirect: it has no indirect light"),
        (UNLIT, {"clamp_indirect": 1.0}, "unlit: clamp_indirect: it has no indirect light"),
        (UNLIT, {"caustics": "photons"}, "unlit: caustics: no light makes any on it"),
        (UNLIT, {"caustics": "none"}, "unlit: caustics: no light makes any on it"),
        (ALONE, {"caustics": "paths"}, "alone: caustics: no light makes any on it"),
        (ALONE, {"depth": 3}, "alone: depth: 3: no path goes on from it"),
        (UNLIT, {"depth": 3}, "unlit: depth: 3: no path goes on from it"),
        (ALONE, {"integrator": "direct"}, "alone: integrator: no light falls on it"),
        (UNLIT, {"integrator": "direct"}, "unlit: integrator: no light falls on it"),
    ],
)
def test_what_splats_do_not_have_is_refused(description, options, said):
    with pytest.raises(UsageError, match=said):
        resolved(description, **options)


def test_surfaces_beside_splats_have_indirect_light():
    assert resolved(BOTH, clamp_indirect=1.0).clamp_indirect == 1.0


def test_a_plan_of_such_a_scene_may_be_planned_again():
    planned = resolved(UNLIT)
    assert resolve(planned, load_scene(UNLIT)).depth == planned.depth
    planned = resolved(ALONE)
    assert resolve(planned, load_scene(ALONE)).caustics == "paths"
