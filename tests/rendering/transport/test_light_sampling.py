"""How often emitters are sampled: by what they bring to the picture, which they change as little as the scene."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

SIZE = 24


def room(order=("sky", "lamp", "spark")):
    """A closed box that is seen from inside: a bright lamp, a faint one, and a sky that nobody sees."""

    def lamp(x, radiance):
        return {
            "type": "sphere",
            "center": [x, 0.8, 0.8],
            "radius": 0.1,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
        }

    lamps = {
        "sky": {"type": "constant", "radiance": 5.0},
        "lamp": lamp(-0.5, 20.0),
        "spark": lamp(0.5, 2.0),
    }
    paint = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.6}}
    walls = {"type": "cube", "bsdf": paint}
    return {"type": "scene", "walls": walls} | {name: lamps[name] for name in order}


def camera():
    from lippmann.scene.values.description import Camera

    pose = np.eye(4)
    pose[2, 3] = 0.95
    return Camera("inside", pose, fov_y=np.radians(70))


def stage(scene, depth=3):
    """Integrator and rays of a Mitsuba scene or the dictionary of one."""
    import mitsuba as mi

    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.rendering.transport.scene_flags import make_traits

    loaded = mi.load_dict(scene) if isinstance(scene, dict) else scene
    return PathIntegrator(loaded, make_traits(loaded), depth), CameraRays(camera(), SIZE, SIZE)


def picture(integrator, source, samples, seed):
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.film.wavefront_plan import make_plan

    return trace_frame(integrator, source, make_plan(SIZE, SIZE, samples, memory=2**31), seed=seed).pixels


def sampling_weights(scene):
    return [float(emitter.sampling_weight()) for emitter in scene.emitters()]


@pytest.mark.parametrize("order", [("sky", "lamp", "spark"), ("spark", "sky", "lamp"), ("lamp", "spark", "sky")])
def test_emitters_are_sampled_by_what_they_bring(order):
    from lippmann.rendering.transport.light_sampling import EVEN_SHARE, emitter_weights

    weights = emitter_weights(*stage(room(order)))
    by_name = dict(zip(order, weights, strict=True))
    assert weights.sum() == pytest.approx(1)
    assert by_name["sky"] == pytest.approx(EVEN_SHARE / 3)
    assert by_name["lamp"] > 3 * by_name["spark"] > 3 * by_name["sky"]


def test_emitters_of_a_scene_with_another_sky_are_told_apart():
    """The new sky comes first among a scene's objects."""
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import EVEN_SHARE, emitter_weights
    from lippmann.scene.mitsuba_source import with_sky

    sky = mi.load_dict({"type": "constant", "radiance": 3.0})
    integrator, source = stage(with_sky(mi.load_dict(room(("lamp", "spark"))), sky))
    weights = emitter_weights(integrator, source)
    unseen = [number for number, emitter in enumerate(integrator.scene.emitters()) if emitter.is_environment()]
    assert weights[unseen] == pytest.approx(EVEN_SHARE / 3)


def test_the_scene_stays_as_it_was():
    from lippmann.rendering.transport.light_sampling import emitter_weights, lights_for_picture

    integrator, source = stage(room())
    first = emitter_weights(integrator, source)
    lights_for_picture(integrator, source)
    assert sampling_weights(integrator.scene) == [1.0, 1.0, 1.0]
    assert np.array_equal(emitter_weights(integrator, source), first)


def test_samples_have_the_density_that_is_said_of_them():
    """Emitters come as often as their weights say, and a sample's density is what a ray that meets it is told."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLights

    scene = mi.load_dict(room())
    weights = np.array([0.1, 0.6, 0.3])
    lights = WeightedLights(scene, weights)
    count = 30_000
    reference = dr.zeros(mi.Interaction3f, count)
    reference.p = mi.Point3f(0.2, -0.3, 0.1)
    random = mi.PCG32(size=count)
    point = mi.Point2f(random.next_float32(), random.next_float32())
    sample, radiance = lights.sample_direction(reference, point, mi.Bool(True))
    registry = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr()))
    chosen = np.array(dr.reinterpret_array(mi.UInt32, sample.emitter))
    shares = [(chosen == each).mean() for each in registry]
    assert shares == pytest.approx(weights, abs=5 * np.sqrt(0.25 / count))
    assert np.array(lights.pdf_direction(reference, sample, mi.Bool(True))) == pytest.approx(
        np.array(sample.pdf), rel=1e-3
    )
    # What each direction brings, over its density, has the mean that sampling all alike gives.
    _, brought = scene.sample_emitter_direction(reference, point, False)
    means = [np.array(each).mean() for each in (radiance, brought)]
    assert means[0] == pytest.approx(means[1], rel=0.05)


def test_rays_that_meet_no_emitter_have_no_density():
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLights

    lights = WeightedLights(mi.load_dict(room()), np.array([0.1, 0.6, 0.3]))
    nothing = dr.zeros(mi.DirectionSample3f, 4)
    assert np.array(lights.pdf_direction(dr.zeros(mi.Interaction3f, 4), nothing, mi.Bool(True))).tolist() == [0.0] * 4


def test_the_picture_stays_and_its_noise_falls():
    from lippmann.rendering.transport.light_sampling import lights_for_picture

    integrator, source = stage(room())
    runs, samples = 12, 16
    even = np.stack([picture(integrator, source, samples, seed) for seed in range(runs)])
    integrator.lights = lights_for_picture(integrator, source)
    weighted = np.stack([picture(integrator, source, samples, 100 + seed) for seed in range(runs)])
    assert weighted.var(axis=0, ddof=1).mean() < 0.5 * even.var(axis=0, ddof=1).mean()
    blocks = [x.reshape(runs, 4, 6, 4, 6, 3).mean(axis=(2, 4)) for x in (even, weighted)]
    spread = np.sqrt(sum(b.var(axis=0, ddof=1) / runs for b in blocks)) + 1e-4
    assert np.abs((blocks[0].mean(0) - blocks[1].mean(0)) / spread).max() < 6
    assert weighted.mean() == pytest.approx(even.mean(), rel=0.01)


def test_emitters_that_nobody_sees_are_sampled_alike():
    """A camera that sees no surface tells nothing."""
    from lippmann.rendering.transport.light_sampling import SceneLights, emitter_weights, lights_for_picture
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    scene = room()
    del scene["walls"]
    integrator, _ = stage(scene, depth=1)
    pose = np.diag([-1.0, 1.0, -1.0, 1.0])  # looks away from the emitters
    pose[2, 3] = 5.0
    source = CameraRays(Camera("away", pose, fov_y=0.5), SIZE, SIZE)
    assert emitter_weights(integrator, source) == pytest.approx(np.full(3, 1 / 3))
    assert isinstance(lights_for_picture(integrator, source), SceneLights)


def test_paths_without_a_value_do_not_count(monkeypatch):
    from lippmann.rendering.transport import light_sampling

    integrator, source = stage(room())
    whole = light_sampling.emitter_weights(integrator, source)
    along = light_sampling._squares_along

    def some_lost(*given):
        import drjit as dr
        import mitsuba as mi

        found = along(*given)
        return dr.select(dr.arange(mi.UInt32, dr.width(found)) % 64 == 0, dr.nan, found)

    monkeypatch.setattr(light_sampling, "_squares_along", some_lost)
    assert light_sampling.emitter_weights(integrator, source) == pytest.approx(whole, rel=0.05)


def test_no_emitter_one_or_very_many_are_left_alone(monkeypatch):
    from lippmann.rendering.transport import light_sampling
    from lippmann.rendering.transport.light_sampling import SceneLights

    for order in ((), ("lamp",)):
        integrator, source = stage(room(order))
        assert light_sampling.emitter_weights(integrator, source).tolist() == [1.0] * len(order)
        assert isinstance(light_sampling.lights_for_picture(integrator, source), SceneLights)
    monkeypatch.setattr(light_sampling, "MOST_EMITTERS", 2)
    integrator, source = stage(room())
    assert light_sampling.emitter_weights(integrator, source) == pytest.approx(np.full(3, 1 / 3))


def test_two_renders_of_one_scene_leave_each_other_alone(engine):
    """Prepared in either order, or both before either is traced, each gives the bytes that it gives alone."""
    import lippmann
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.request.resolve import resolve
    from lippmann.rendering.session import open_session
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    request = RenderRequest(method="full", integrator="path", spp=2, seed=5)

    def prepared(scene, x):
        # Near either lamp, each of which is the brightest there.
        pose = np.eye(4)
        pose[:3, 3] = x, 0.0, 0.95
        source = CameraRays(Camera("inside", pose, fov_y=np.radians(100)), SIZE, SIZE)
        session = open_session(scene, resolve(request, scene, form="preview"))
        return session, session.integrator(source, np.eye(4)), source

    def traced(session, integrator, source):
        from lippmann.rendering.film.wavefront import trace_frame
        from lippmann.rendering.film.wavefront_plan import make_plan

        plan = make_plan(SIZE, SIZE, 2, memory=session.memory)
        return trace_frame(integrator, source, plan, seed=request.seed).pixels.tobytes()

    places = (-0.9, 0.9)
    alone = [traced(*prepared(lippmann.load_scene(room()), x)) for x in places]
    assert alone[0] != alone[1]
    scene = lippmann.load_scene(room())
    both = [prepared(scene, x) for x in places]
    assert [traced(*each) for each in both] == alone
    assert [traced(*each) for each in reversed(both)] == alone[::-1]
    again = [prepared(scene, x) for x in reversed(places)]
    assert [traced(*each) for each in again] == alone[::-1]


def test_the_callers_own_scene_is_not_changed(cut_display):
    """Whoever hands over a loaded scene finds it as it was; nor is one of our own written into."""
    import mitsuba as mi

    import lippmann

    own = mi.load_dict(room())
    before = sampling_weights(own)
    display = lippmann.load_display(cut_display(32, 16))
    lippmann.render(lippmann.load_scene(own), display, method="full", spp=1)
    assert sampling_weights(own) == before
    described = lippmann.load_scene(room())
    lippmann.render(described, display, method="full", spp=1)
    assert sampling_weights(described.physical.scene()) == before
