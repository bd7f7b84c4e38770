"""Which pictures are joined to light vertices, what that saves, and that it changes nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

SIDE = 32


def room(emitter, *, open_to=None):
    """A matt room with an emitter, or the floor of one alone."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    paint = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.6, 0.5]}}}
    walls = {
        "floor": place().translate([0, -1, 0]).rotate([1, 0, 0], -90),
        "back": place().translate([0, 0, -1]),
        "left": place().translate([-1, 0, 0]).rotate([0, 1, 0], 90),
        "right": place().translate([1, 0, 0]).rotate([0, 1, 0], -90),
        "ceiling": place().translate([0, 1, 0]).rotate([1, 0, 0], 90),
    }
    shown = {name: {"type": "rectangle", "to_world": pose, "bsdf": paint} for name, pose in walls.items()}
    if open_to == "sky":
        shown = {"floor": shown["floor"]}
    return {"type": "scene", **shown, "emitter": emitter}


def small(x=-0.8, y=0.8, radius=0.05, radiance=150.0):
    return {
        "type": "sphere",
        "center": [x, y, -0.7],
        "radius": radius,
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
    }


SKY = {"type": "constant", "radiance": 1.0}


def stage(scene):
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    loaded = mi.load_dict(scene)
    pose = np.eye(4)
    pose[2, 3] = 3.2
    return PathIntegrator(loaded, make_scene_features(loaded), 8), CameraRays(
        Camera("eye", pose, fov_y=0.6), SIDE, SIDE
    )


def given(integrator, source, /, *, gain=1.0, **options):
    from lippmann.rendering.preparation.prepare import trace_light_vertices, trace_pilot
    from lippmann.rendering.request.render_request import RenderRequest

    request = RenderRequest(**({"integrator": "path", "spp": 16} | options))
    passes = trace_light_vertices(integrator, request, trace_pilot(integrator, source), gain)
    if passes is None:
        return None
    return integrator.lit_by(replace(integrator.light, light_vertices=passes.of_pass(0), vertex_passes=passes))


def batches(integrator, source, memory=1 << 30, spp=16, seed=5):
    from lippmann.rendering.film.sample_batches import BatchedRender

    found = BatchedRender(integrator, source, seed=seed, memory=memory)
    found.add(spp)
    return found


def test_a_small_emitter_beside_a_wall_is_worth_it():
    integrator, source = stage(room(small()))
    joined = batches(given(integrator, source), source).average_halves()
    plain = batches(integrator, source).average_halves()
    noise = [np.square(np.clip(a, 0, 1) - np.clip(b, 0, 1)).mean() for a, b in (joined, plain)]
    assert noise[0] < 0.4 * noise[1]


@pytest.mark.parametrize(
    ("emitter", "options"),
    [
        (SKY, {}),
        (small(x=0, y=0.2, radius=0.3, radiance=3.0), {}),  # in the middle: all walls are lit alike
        (small(), {"depth": 1}),
        (small(), {"integrator": "classic"}),
    ],
)
def test_other_pictures_are_left_to_paths(emitter, options):
    integrator, source = stage(room(emitter))
    assert given(integrator, source, **options) is None


def test_nothing_is_joined_where_indirect_light_is_dim():
    assert not given(*stage(room(small(), open_to="sky")))
    # What is worth it in a picture is not in one that is exposed for the brightness of its emitter.
    integrator, source = stage(room(small()))
    assert not given(integrator, source, gain=0.05)


def test_scenes_of_very_many_emitters_are_left_to_paths(monkeypatch):
    from lippmann.rendering.preparation import prepare

    scene = room(small()) | {"point": {"type": "point", "position": [-0.8, 0.8, -0.7], "intensity": 1e-3}}
    assert given(*stage(scene))
    monkeypatch.setattr(prepare, "TUNING", replace(prepare.TUNING, most_weighed_emitters=1))
    assert not given(*stage(scene))


def test_passes_serve_their_samples_and_pictures_do_not_depend_on_the_memory(monkeypatch):
    import lippmann.rendering.preparation.prepare as module

    monkeypatch.setattr(module, "TUNING", replace(module.TUNING, pass_samples=4))
    integrator, source = stage(room(small()))
    integrator = given(integrator, source, seed=3)
    served, passes = [], integrator.light.vertex_passes
    of_pass = passes.of_pass
    monkeypatch.setattr(passes, "of_pass", lambda number: served.append(number) or of_pass(number))
    whole = batches(integrator, source)
    assert sorted(set(served)) == [0, 1, 2, 3]
    again = batches(integrator, source, memory=1 << 21)
    np.testing.assert_allclose(whole.picture(), again.picture(), rtol=1e-5)
    a, b = whole.average_halves()
    assert not np.array_equal(a, b)


def test_files_say_so():
    import lippmann
    from lippmann.display import Display, LensArray, Panel

    display = Display("square", Panel(SIDE, SIDE, 0.25), LensArray("square", 2.0), gap=6.8, aperture_distance=10.0)
    asked = {"integrator": "path", "method": "full", "denoise": "none", "spp": 2, "exposure": 0.0, "seed": 2}
    found = [lippmann.render(lippmann.load_scene(room(emitter)), display, **asked) for emitter in (small(), SKY)]
    told = [image.provenance.options.get("light_vertices") for image in found]
    assert told[0] > 0
    assert told[1] is None
