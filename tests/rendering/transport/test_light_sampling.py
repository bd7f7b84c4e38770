"""Light sampling: probabilities by contribution, unbiased pictures, weights, and scenes that are never written into."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")

SIZE = 24


def room(order=("sky", "bright", "faint")):
    """A closed box seen from inside: a bright emitter, a faint one, and a sky outside."""

    def area_light(x, radiance):
        return {
            "type": "sphere",
            "center": [x, 0.8, 0.8],
            "radius": 0.1,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
        }

    emitters = {
        "sky": {"type": "constant", "radiance": 5.0},
        "bright": area_light(-0.5, 20.0),
        "faint": area_light(0.5, 2.0),
    }
    paint = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.6}}
    walls = {"type": "cube", "bsdf": paint}
    return {"type": "scene", "walls": walls} | {name: emitters[name] for name in order}


def camera():
    from lippmann.scene.values.description import Camera

    pose = np.eye(4)
    pose[2, 3] = 0.95
    return Camera("inside", pose, fov_y=np.radians(70))


def stage(scene, depth=3):
    """Integrator and rays of a Mitsuba scene or the dictionary of one."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays

    loaded = mi.load_dict(scene) if isinstance(scene, dict) else scene
    return PathIntegrator(loaded, make_scene_features(loaded), depth), CameraRays(camera(), SIZE, SIZE)


def picture(integrator, source, samples, seed):
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame

    return trace_frame(integrator, source, cut_wavefronts(SIZE, SIZE, samples, memory=2**31), seed=seed).pixels


def estimated_weights(integrator, source):
    from lippmann.rendering.preparation.prepare import trace_pilot, weigh_emitters

    return weigh_emitters(trace_pilot(integrator, source))


def pilot_sampler(integrator, source):
    from lippmann.rendering.preparation.prepare import make_light_sampler, trace_pilot

    return make_light_sampler(integrator.scene, trace_pilot(integrator, source))


def sampling_weights(scene):
    return [float(emitter.sampling_weight()) for emitter in scene.emitters()]


@pytest.mark.parametrize("order", [("sky", "bright", "faint"), ("faint", "sky", "bright"), ("bright", "faint", "sky")])
def test_emitters_are_sampled_by_their_contribution(order):
    from lippmann.rendering.transport.tuning import TUNING

    weights = estimated_weights(*stage(room(order)))
    by_name = dict(zip(order, weights, strict=True))
    assert weights.sum() == pytest.approx(1)
    assert by_name["sky"] == pytest.approx(TUNING.uniform_share / 3)
    assert by_name["bright"] > 3 * by_name["faint"] > 3 * by_name["sky"]


def test_emitters_of_a_scene_with_another_sky_are_told_apart():
    """The new sky comes first among a scene's objects."""
    import mitsuba as mi

    from lippmann.rendering.transport.tuning import TUNING
    from lippmann.scene.mitsuba_source import with_sky

    sky = mi.load_dict({"type": "constant", "radiance": 3.0})
    integrator, source = stage(with_sky(mi.load_dict(room(("bright", "faint"))), sky))
    weights = estimated_weights(integrator, source)
    unseen = [number for number, emitter in enumerate(integrator.scene.emitters()) if emitter.is_environment()]
    assert weights[unseen] == pytest.approx(TUNING.uniform_share / 3)


def test_direct_light_of_a_single_emitter_takes_no_pilot():
    from lippmann.rendering.preparation.prepare import trace_pilot

    assert trace_pilot(*stage(room(("bright",)), depth=1)).region is None


def test_the_scene_stays_as_it_was():

    integrator, source = stage(room())
    first = estimated_weights(integrator, source)
    pilot_sampler(integrator, source)
    assert sampling_weights(integrator.scene) == [1.0, 1.0, 1.0]
    assert np.array_equal(estimated_weights(integrator, source), first)


@pytest.mark.slow
def test_pdf_of_samples_is_that_of_scattered_rays():
    """Emitters are chosen by their weights, whatever those add up to, and both ways to ask for a pdf agree."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLightSampler

    scene = mi.load_dict(room())
    weights = np.array([1.0, 6.0, 3.0])
    lights = WeightedLightSampler(scene, weights)
    count = 30_000
    reference = dr.zeros(mi.Interaction3f, count)
    reference.p = mi.Point3f(0.2, -0.3, 0.1)
    random = mi.PCG32(size=count)
    point = mi.Point2f(random.next_float32(), random.next_float32())
    sample, radiance = lights.sample_direction(reference, point, mi.Bool(True))
    registry = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr()))
    chosen = np.array(dr.reinterpret_array(mi.UInt32, sample.emitter))
    shares = [(chosen == each).mean() for each in registry]
    assert shares == pytest.approx(weights / weights.sum(), abs=5 * np.sqrt(0.25 / count))
    assert np.array(lights.pdf_direction(reference, sample, mi.Bool(True))) == pytest.approx(
        np.array(sample.pdf), rel=1e-3
    )
    # Radiance over pdf has the mean that uniform sampling gives.
    _, uniform = scene.sample_emitter_direction(reference, point, False)
    means = [np.array(each).mean() for each in (radiance, uniform)]
    assert means[0] == pytest.approx(means[1], rel=0.05)


def test_rays_that_hit_no_emitter_have_pdf_0():
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLightSampler

    lights = WeightedLightSampler(mi.load_dict(room()), np.array([0.1, 0.6, 0.3]))
    nothing = dr.zeros(mi.DirectionSample3f, 4)
    assert np.array(lights.pdf_direction(dr.zeros(mi.Interaction3f, 4), nothing, mi.Bool(True))).tolist() == [0.0] * 4


def blackbody(center, radius=0.3):
    """A sphere of radiance 1 from everywhere: it emits 1 and reflects nothing."""
    return {
        "type": "sphere",
        "center": center,
        "radius": radius,
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "emitter": {"type": "area", "radiance": 1.0},
    }


@pytest.mark.parametrize("weights", [(0.8, 0.1, 0.1), (0.1, 0.8, 0.1), (0.02, 0.08, 0.9)])
def test_white_furnace_is_one_by_any_weights(weights):
    """White surfaces, emitters of radiance 1 and a sky of radiance 1: MIS must give 1 wherever one looks."""
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLightSampler

    scene = mi.load_dict(
        {
            "type": "scene",
            "sky": {"type": "constant", "radiance": 1.0},
            "left": blackbody([-0.7, 0.0, 0.0]),
            "right": blackbody([0.7, 0.0, 0.0]),
            "ball": {"type": "sphere", "radius": 0.38, "bsdf": {"type": "diffuse", "reflectance": 1.0}},
        }
    )
    integrator, source = stage(scene, depth=8)
    integrator = integrator.lit_by(replace(integrator.light, sampler=WeightedLightSampler(scene, np.array(weights))))
    pixels = picture(integrator, source, 512, 1)
    blocks = pixels.reshape(4, 6, 4, 6, 3).mean(axis=(1, 3, 4))
    assert blocks == pytest.approx(1.0, abs=0.02)
    assert pixels.mean() == pytest.approx(1.0, abs=2e-3)


@pytest.mark.long
def test_delta_emitters_give_the_same_picture_by_any_weights():
    """A point light, a spot light and a sun above a floor: no scattered ray hits them, and their pdf has no angle."""
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLightSampler

    transform = mi.ScalarTransform4f
    scene = {
        "type": "scene",
        "floor": {"type": "rectangle", "to_world": transform().scale(4)},
        "point": {"type": "point", "position": [0.2, 0.1, 0.6], "intensity": 2.0},
        "spot": {
            "type": "spot",
            "to_world": transform().look_at([0, 0, 0.8], [0.2, 0, 0], [0, 1, 0]),
            "intensity": 3.0,
            "cutoff_angle": 30.0,
        },
        "sun": {"type": "directional", "direction": [0.3, 0, -1], "irradiance": 1.0},
    }
    integrator, source = stage(scene, depth=1)
    samples = 2048
    # Cutting the samples of a pixel into the emitters' shares is stratified, so that little noise is left.
    uniform = picture(integrator, source, samples, 3)
    for lights in (
        pilot_sampler(integrator, source),
        WeightedLightSampler(integrator.scene, np.array([0.15, 0.6, 0.25])),
    ):
        weighted = picture(integrator.lit_by(replace(integrator.light, sampler=lights)), source, samples, 4)
        assert np.abs(weighted - uniform).max() < 0.02 * uniform.max()
        assert weighted.mean() == pytest.approx(uniform.mean(), rel=1e-3)


@pytest.mark.slow
def test_more_emitters_than_are_weighed_have_a_picture():
    """Beyond the most emitters the scene's own sampling is used, and each light still arrives."""
    from lippmann.rendering.preparation.tuning import TUNING
    from lippmann.rendering.transport.light_sampling import SceneLightSampler

    count = TUNING.most_weighed_emitters + 1
    lights = {
        f"light{i}": {"type": "point", "position": [0.0, 0.0, 0.5], "intensity": 1.0 / count} for i in range(count)
    }
    floor = {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 0.5}}
    integrator, source = stage({"type": "scene", "floor": floor} | lights, depth=1)
    assert isinstance(pilot_sampler(integrator, source), SceneLightSampler)
    one, _ = stage({"type": "scene", "floor": floor, "light": lights["light0"] | {"intensity": 1.0}}, depth=1)
    assert picture(integrator, source, 1, 0) == pytest.approx(picture(one, source, 1, 0), rel=1e-3)


@pytest.mark.slow
def test_the_picture_stays_and_its_noise_falls():

    integrator, source = stage(room())
    runs, samples = 12, 16
    even = np.stack([picture(integrator, source, samples, seed) for seed in range(runs)])
    integrator = integrator.lit_by(replace(integrator.light, sampler=pilot_sampler(integrator, source)))
    weighted = np.stack([picture(integrator, source, samples, 100 + seed) for seed in range(runs)])
    assert weighted.var(axis=0, ddof=1).mean() < 0.5 * even.var(axis=0, ddof=1).mean()
    blocks = [x.reshape(runs, 4, 6, 4, 6, 3).mean(axis=(2, 4)) for x in (even, weighted)]
    spread = np.sqrt(sum(b.var(axis=0, ddof=1) / runs for b in blocks)) + 1e-4
    assert np.abs((blocks[0].mean(0) - blocks[1].mean(0)) / spread).max() < 6
    assert weighted.mean() == pytest.approx(even.mean(), rel=0.01)


def test_emitters_without_contribution_are_sampled_uniformly():
    """A camera that sees no surface."""
    from lippmann.rendering.transport.light_sampling import SceneLightSampler
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    scene = room()
    del scene["walls"]
    integrator, _ = stage(scene, depth=1)
    pose = np.diag([-1.0, 1.0, -1.0, 1.0])  # looks away from the emitters
    pose[2, 3] = 5.0
    source = CameraRays(Camera("away", pose, fov_y=0.5), SIZE, SIZE)
    assert estimated_weights(integrator, source) == pytest.approx(np.full(3, 1 / 3))
    assert isinstance(pilot_sampler(integrator, source), SceneLightSampler)


def test_invalid_contributions_do_not_count(monkeypatch):
    from lippmann.rendering.preparation import prepare

    integrator, source = stage(room())
    whole = estimated_weights(integrator, source)
    along = prepare._sample_contributions

    def some_lost(*given):
        import drjit as dr
        import mitsuba as mi

        squares, *others = along(*given)
        return dr.select(dr.arange(mi.UInt32, dr.width(squares)) % 64 == 0, dr.nan, squares), *others

    monkeypatch.setattr(prepare, "_sample_contributions", some_lost)
    assert estimated_weights(integrator, source) == pytest.approx(whole, rel=0.05)


def test_no_emitter_one_or_very_many_keep_the_weights_of_the_scene(monkeypatch):
    from lippmann.rendering.preparation import prepare
    from lippmann.rendering.transport.light_sampling import SceneLightSampler

    for order in ((), ("bright",)):
        integrator, source = stage(room(order))
        assert estimated_weights(integrator, source) == pytest.approx([1.0] * len(order))
        assert isinstance(pilot_sampler(integrator, source), SceneLightSampler)
    monkeypatch.setattr(prepare, "TUNING", replace(prepare.TUNING, most_weighed_emitters=2))
    integrator, source = stage(room())
    assert estimated_weights(integrator, source) == pytest.approx(np.full(3, 1 / 3))


@pytest.mark.slow
def test_two_renders_of_one_scene_leave_each_other_alone(engine):
    """Prepared in either order, or both before either is traced, each gives the bytes that it gives alone."""
    import lippmann
    from lippmann.rendering.request.plan import resolve
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    request = RenderRequest(method="full", integrator="path", spp=2, seed=5)

    def prepared(scene, x):
        # Near either emitter, each of which is the brightest there.
        pose = np.eye(4)
        pose[:3, 3] = x, 0.0, 0.95
        source = CameraRays(Camera("inside", pose, fov_y=np.radians(100)), SIZE, SIZE)
        session = open_session(scene, resolve(request, scene, form="preview"))
        return session, session.integrator(source, np.eye(4)), source

    def traced(session, integrator, source):
        from lippmann.rendering.film.memory_model import cut_wavefronts
        from lippmann.rendering.film.wavefront import trace_frame

        plan = cut_wavefronts(SIZE, SIZE, 2, memory=session.memory)
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


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("method", ["lens-view", "interpolated"])
def test_recorded_kernels_are_shown_the_samplers_arrays(engine, method):
    """Kernels of reuse are recorded once, with all arrays that they read: of scenes with several emitters, too."""
    import lippmann

    display = lippmann.load_display("seed-lenticular").resized(64, 16)
    scene = lippmann.load_scene(room(), background=(0.1, 0.1, 0.1))
    options = {"integrator": "path", "spp": 2, "seed": 3}
    reused = lippmann.render(scene, display, method=method, **options)
    full = lippmann.render(scene, display, method="full", **options)
    assert reused.pixels.mean() == pytest.approx(full.pixels.mean(), rel=0.2)


def test_emitters_are_chosen_as_mitsubas_own_distribution_chooses_them():
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLightSampler

    weights = np.array([0.0, 0.5, 0.125])
    number = mi.PCG32(size=100_000).next_float32()
    sampler = WeightedLightSampler(mi.load_dict(room()), weights)
    found = [np.array(each) for each in sampler._sample_emitter(number, mi.Bool(True))]
    own = mi.DiscreteDistribution(mi.Float(weights)).sample_reuse_pmf(number)
    for one, other in zip(found, own, strict=True):
        np.testing.assert_allclose(one, np.array(other), atol=1e-6)
    assert found[1].min() >= -1e-6
    assert found[1].max() < 1 + 1e-6


def test_the_only_emitter_with_weight_is_always_chosen():
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import WeightedLightSampler

    sampler = WeightedLightSampler(mi.load_dict(room()), np.array([0.0, 1.0, 0.0]))
    index, reused, probability = sampler._sample_emitter(mi.Float([0.0, 0.3, 0.99]), mi.Bool(True))
    assert set(np.array(index)) == {1}
    assert np.array(reused) == pytest.approx([0.0, 0.3, 0.99])
    assert set(np.array(probability)) == {1.0}


def test_emitters_without_size_are_as_likely_as_each_other():
    """Their mean over the unit square is the sum of what each brings; others are never drawn."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import DeltaEmitters

    scene = mi.load_dict(
        room()
        | {
            "point": {"type": "point", "position": [0, 0.5, 0], "intensity": {"type": "rgb", "value": [3, 0, 0]}},
            "sun": {"type": "directional", "direction": [0, -1, 0], "irradiance": {"type": "rgb", "value": [0, 2, 0]}},
        }
    )
    emitters = DeltaEmitters(scene.emitters())
    assert len(emitters) == 2
    reference = dr.zeros(mi.SurfaceInteraction3f, 1000)
    x = (dr.arange(mi.Float, 1000) + 0.5) / 1000
    sample, radiance = emitters.sample_direction(reference, mi.Point2f(x, 0.5), mi.Bool(True))
    assert np.all(np.array(sample.delta))
    np.testing.assert_allclose(np.array(sample.pdf), 0.5)
    np.testing.assert_allclose(np.array(radiance).mean(axis=1), [3 / 0.5**2, 2, 0], rtol=1e-5)


def test_a_scene_may_have_none():
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import DeltaEmitters

    assert len(DeltaEmitters(mi.load_dict(room()).emitters())) == 0


@pytest.mark.parametrize("by_weight", [False, True])
def test_the_probability_of_an_emitter_is_that_by_which_it_is_chosen(by_weight):
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import SceneLightSampler, WeightedLightSampler

    scene = mi.load_dict(room())
    sampler = WeightedLightSampler(scene, np.array([1.0, 5.0, 2.0])) if by_weight else SceneLightSampler(scene)
    emitters = scene.emitters_dr()
    told = np.array(sampler.probability(emitters))
    count = 1 << 12
    at = dr.zeros(mi.Interaction3f, count)
    at.p = mi.Point3f(0, 0, 0.5)
    ds, _ = sampler.sample_direction(at, mi.Point2f((dr.arange(mi.Float, count) + 0.5) / count, 0.5), mi.Bool(True))
    chosen = [float(dr.mean(dr.select(ds.emitter == mi.EmitterPtr(each), 1.0, 0.0))[0]) for each in scene.emitters()]
    assert told == pytest.approx(chosen, abs=2 / count)


# ---- Shadow rays: what dims them, and what blocks them


def panes_and_wall(wall=True):
    """Along z: panes of opacity 0.25 at 1 and 0.5 at 2, over the half x > 0; a wall at 3 over the half y > 0."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f

    def pane(opacity, z):
        surface = {"type": "mask", "opacity": opacity, "bsdf": {"type": "diffuse"}}
        return {"type": "rectangle", "to_world": transform().translate([1, 0, z]), "bsdf": surface}

    scene = {"type": "scene", "near": pane(0.25, 1), "far": pane(0.5, 2)}
    if wall:
        scene["wall"] = {"type": "rectangle", "to_world": transform().translate([0, 1, 3])}
    return scene


def transmittance(shadow_rays, x, y, end=4.0):
    """Of rays along z from 0 to just before ``end`` at these places, with the rays traced for each."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    x, y = upload(x), upload(y)
    origin, target = mi.Point3f(x, y, 0), mi.Point3f(x, y, end)
    ray = mi.Ray3f(origin, mi.Vector3f(0, 0, 1), mi.Float(end * (1 - 1e-4)), 0.0, [])
    ray.maxt = mi.Float(end * (1 - 1e-4))
    light, tests = shadow_rays.transmittance(ray, target, dr.full(mi.Bool, True, len(x)))
    return np.array(light.x), np.array(tests)


PLACES = np.array([(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)])


def test_panes_dim_and_walls_block():
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import ShadowRays

    shadow_rays = ShadowRays(mi.load_dict(panes_and_wall()), has_null=True)
    light, tests = transmittance(shadow_rays, *PLACES.T)
    assert light.tolist() == [1.0, 0.375, 0.0, 0.0]
    assert tests.tolist() == [1, 3, 1, 3]
    nearer, _ = transmittance(shadow_rays, *PLACES.T, end=1.5)
    assert nearer.tolist() == [1.0, 0.75, 1.0, 0.75]


def test_a_wall_alone_blocks_at_once():
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import ShadowRays

    wall = {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 1, 3])}
    light, tests = transmittance(ShadowRays(mi.load_dict({"type": "scene", "wall": wall}), has_null=False), *PLACES.T)
    assert light.tolist() == [1.0, 1.0, 0.0, 0.0]
    assert tests.tolist() == [1, 1, 1, 1]


@pytest.mark.slow
def test_many_panes_block():
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import MAX_CROSSINGS, ShadowRays

    clear = {"type": "mask", "opacity": 0.0, "bsdf": {"type": "diffuse"}}
    for panes, expected in ((MAX_CROSSINGS - 1, 1.0), (MAX_CROSSINGS, 0.0)):
        scene = {
            f"pane{i}": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().translate([0, 0, 1 + i / 100]),
                "bsdf": clear,
            }
            for i in range(panes)
        }
        light, _ = transmittance(ShadowRays(mi.load_dict({"type": "scene", **scene}), True), np.zeros(1), np.zeros(1))
        assert light.tolist() == [expected]


@given(*[st.floats(0, 1e6)] * 2)
def test_weights_of_two_ways_add_up_to_one(a, b):
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import mis_weight

    first, second = mi.Float(a), mi.Float(b)
    if max(a, b) > 1e-10:  # whose squares are numbers
        assert mis_weight(first, second)[0] + mis_weight(second, first)[0] == pytest.approx(1, rel=1e-5)
    assert mis_weight(first, second)[0] == mis_weight(first, second, mi.Float(0))[0]


@given(*[st.floats(0, 1e6)] * 3)
def test_weights_of_the_three_ways_add_up_to_one(a, b, c):
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import mis_weight

    numbers = [mi.Float(value) for value in (a, b, c)]
    total = sum(mis_weight(numbers[k], numbers[k - 1], numbers[k - 2])[0] for k in range(3))
    if max(a, b, c) > 1e-10:  # whose squares are numbers
        assert total == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize(
    ("throughput", "eta", "expected"),
    [((0.04, 0.01, 0.0), 1.0, 0.2), ((0.16, 0.16, 0.16), 1.5, 0.6), ((1.0, 0.5, 0.5), 1.0, 0.95), ((0, 0, 0), 1, 0)],
)
def test_roulette_lets_faint_paths_go_on_by_the_root(throughput, eta, expected):
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import choose_survival

    survival = np.array(choose_survival(mi.Spectrum(*throughput), mi.Float(eta)))
    np.testing.assert_allclose(survival, expected, rtol=1e-5)


def test_emitter_samples_of_all_paths_are_one_stratified_sequence():
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream
    from lippmann.rendering.transport.light_sampling import count_first_samples

    count, first = (np.array(part) for part in count_first_samples(dr.arange(mi.UInt32, 12)))
    assert count.tolist() == [4] * 4 + [2] * 8
    assert np.array_equal(first, np.cumsum(count) - count)
    stream = SampleStream.of_pixels(mi.UInt32(3), mi.UInt32(5), mi.UInt32(1))
    points = np.array(stream.at(dr.arange(mi.UInt32, 32)).next_2d(1)[0])
    assert sorted(np.floor(points * 32)) == list(range(32))
