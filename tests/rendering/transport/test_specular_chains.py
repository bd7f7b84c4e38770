"""Further chains of sharp events: they bring what paths would have met, and no more, with less noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from block_agreement import SIDE, agree

pytestmark = pytest.mark.usefixtures("engine")


def rgb(*values):
    return {"type": "rgb", "value": list(values) if len(values) > 1 else values[0]}


def scene_of_all_events():
    """Balls of each kind of surface before a wall, under an emitter that they mirror, and a sky."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    gloss = {"type": "principled", "base_color": rgb(0.2, 0.3, 0.6), "roughness": 0.1, "clearcoat": 1.0}
    hole = {"type": "mask", "opacity": 0.4, "nested": {"type": "conductor", "material": "Al"}}
    surfaces = {
        "mirror": {"type": "conductor", "material": "Al"},
        "glass": {"type": "dielectric", "int_ior": 1.5},
        "plastic": {"type": "plastic", "diffuse_reflectance": rgb(0.5, 0.2, 0.1)},
        "gloss": gloss,
        "hole": hole,
        "matt": {"type": "diffuse", "reflectance": rgb(0.6)},
    }
    balls = {
        name: {
            "type": "sphere",
            "center": [(number % 3 - 1) * 0.7, 0.35 - 0.7 * (number // 3), 0],
            "radius": 0.3,
            "bsdf": surface,
        }
        for number, (name, surface) in enumerate(surfaces.items())
    }
    return {
        "type": "scene",
        **balls,
        "wall": {
            "type": "rectangle",
            "to_world": place().translate([0, 0, -1]).scale(2),
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.4)},
        },
        "light": {
            "type": "sphere",
            "center": [0.8, 0.9, 1.2],
            "radius": 0.25,
            "emitter": {"type": "area", "radiance": rgb(15, 12, 9)},
        },
        "sky": {"type": "constant", "radiance": rgb(0.2, 0.3, 0.4)},
    }


def described(description):
    """Integrator of a description's scene, with the photons of its caustics, and the eye."""
    from lippmann.device.pbr import build_description

    built = build_description(description)
    return prepared(built.mitsuba, has_null=built.has_null)


def prepared(scene, *, has_null):
    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.preparation.prepare import shoot_photons, trace_pilot
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    integrator = PathIntegrator(scene, make_scene_features(scene, has_null=has_null), 6)
    pose = np.eye(4)
    pose[2, 3] = 3.0
    source = CameraRays(Camera("eye", pose, fov_y=0.6), SIDE, SIDE)
    request = RenderRequest(integrator="path", caustics="photons", spp=8)
    caustics = shoot_photons(integrator, request, source, trace_pilot(integrator, source), 1 << 30)
    assert caustics.technique == "photons"
    return integrator.lit_by(replace(integrator.light, photons=caustics.photons, photon_passes=caustics.passes)), source


def chained(integrator, chains):
    """The integrator with so many chains of each path."""
    import drjit as dr
    import mitsuba as mi

    return integrator.lit_by(replace(integrator.light, chains=dr.opaque(mi.UInt32, chains) if chains else None))


def pictures(integrator, source, chains, *, seeds, spp=8):
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame

    integrator = chained(integrator, chains)
    plan = cut_wavefronts(SIDE, SIDE, spp, memory=2**30)
    return np.stack([trace_frame(integrator, source, plan, seed=seed).pixels for seed in seeds]).astype(np.float64)


@pytest.fixture(scope="module")
def all_events(engine):
    import mitsuba as mi

    return prepared(mi.load_dict(scene_of_all_events()), has_null=True)


def test_every_kind_of_surface_shows_as_much_light(all_events):
    integrator, source = all_events
    plain, further = (pictures(integrator, source, chains, seeds=range(24)) for chains in (0, 3))
    agree(plain, further)


def test_so_it_does_without_photons(all_events):
    """Whatever brings the caustics: a path's events are told apart for the chains alone."""
    integrator, source = all_events
    integrator = integrator.lit_by(replace(integrator.light, photons=None, photon_passes=None))
    plain, further = (pictures(integrator, source, chains, seeds=range(24)) for chains in (0, 4))
    agree(plain, further)


def small_emitter_in_glazed_balls():
    """Lobes of some width, matt below, coloured glass, under a small emitter: MIS, lobes by chance, absorption."""
    import trimesh

    from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription

    ball = trimesh.creation.icosphere(3, 0.3)
    wall = trimesh.creation.box((4, 4, 0.1))
    materials = [
        Material("metal", metallic=1.0, roughness=0.1, base_color=(0.9, 0.7, 0.4)),
        Material("glaze", base_color=(0.5, 0.1, 0.1), roughness=0.8, clearcoat=1.0, clearcoat_roughness=0.08),
        Material("chrome", metallic=1.0, roughness=0.0),
        Material(
            "glass",
            transmission=1.0,
            roughness=0.0,
            thickness=1.0,
            attenuation_color=(0.9, 0.4, 0.2),
            attenuation_distance=0.5,
        ),
        Material("wall", base_color=(0.5, 0.5, 0.5), roughness=1.0),
    ]
    meshes = [
        Mesh("", ball.vertices.astype(np.float32), ball.faces.astype(np.uint32), n, ball.vertex_normals.astype("f4"))
        for n in range(4)
    ]
    meshes.append(Mesh("", wall.vertices.astype(np.float32), wall.faces.astype(np.uint32), 4))
    instances = []
    for number, (x, y) in enumerate([(-0.35, 0.35), (0.35, 0.35), (-0.35, -0.35), (0.35, -0.35), (0, 0)]):
        place = np.eye(4)
        place[:3, 3] = x, y, -1.0 if number == 4 else 0.0
        instances.append(Instance(number, place))
    at = np.eye(4)
    at[:3, 3] = 0.6, 0.8, 1.5
    light = Light("point", (6.0, 6.0, 6.0), at, radius=0.12)
    return SceneDescription("balls", meshes, materials, instances, lights=[light])


@pytest.mark.long
def test_narrow_lobes_are_weighed_as_paths_weigh_them():
    integrator, source = described(small_emitter_in_glazed_balls())
    plain, further = (pictures(integrator, source, chains, seeds=range(40)) for chains in (0, 7))
    agree(plain, further)
    # Highlights of a small emitter: what chains are for.
    assert further.var(axis=0).mean() < 0.5 * plain.var(axis=0).mean()


@pytest.mark.long
def test_emitters_without_size_are_seen_in_narrow_lobes():
    """No ray meets them: chains sample them where the half vector makes the event sharp, and paths leave out just that.

    Lobes narrow enough to be sharp, wide enough for pixels to agree.
    """
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.scene.values.description import Light

    scene = small_emitter_in_glazed_balls()
    sun, at = np.eye(4), scene.lights[0].world_from_light
    sun[:3, :3] = [[1, 0, 0], [0, 0.8, 0.6], [0, -0.6, 0.8]]
    lights = [Light("point", (4.0, 5.0, 6.0), at), Light("directional", (1.5, 1.2, 0.9), sun)]
    integrator, source = described(replace(scene, lights=lights))
    assert len(integrator.delta_emitters) == 2
    for depth in (1, 6):
        paths = PathIntegrator(integrator.scene, integrator.features, depth, light=integrator.light)
        plain, further = (pictures(paths, source, chains, seeds=range(40)) for chains in (0, 5))
        agree(plain, further)
        assert further.var(axis=0).mean() < 0.7 * plain.var(axis=0).mean()


@pytest.mark.long
def test_their_highlights_go_past_a_denoiser():
    """All that is seen in sharp lobes is told apart, that of emitters without size, too."""

    from lippmann.rendering.film.sample_batches import BatchedRender
    from lippmann.scene.values.description import Light

    scene = small_emitter_in_glazed_balls()
    light = Light("directional", (3.0, 3.0, 3.0), np.eye(4))
    integrator, source = described(replace(scene, lights=[light]))
    batches = BatchedRender(chained(integrator, 8), source, seed=1, memory=1 << 30, for_denoiser=True)
    batches.add(16)
    assert batches.specular().max() > 1
    assert (batches.picture() - batches.specular()).max() < 1


@pytest.mark.long
def test_gain_limit_and_background_are_those_of_paths(all_events):
    import mitsuba as mi

    from lippmann.rendering.transport.path import PathIntegrator

    integrator, source = all_events
    features = replace(integrator.features, background=(0.1, 0.2, 0.3))
    light = replace(integrator.light, gain=mi.Float(3.0), most_indirect=mi.Float(0.5))
    paths = PathIntegrator(integrator.scene, features, integrator.depth, light=light)
    plain, further = (pictures(paths, source, chains, seeds=range(20)) for chains in (0, 3))
    agree(plain, further)


def test_chains_count_as_rays_and_depend_on_the_seed_alone(all_events):

    from lippmann.rendering.film.sample_batches import BatchedRender

    integrator, source = all_events
    whole = BatchedRender(chained(integrator, 4), source, seed=5, memory=1 << 30)
    whole.add(8)
    again = BatchedRender(chained(integrator, 4), source, seed=5, memory=(1 << 21))
    again.add(8)
    np.testing.assert_allclose(whole.picture(), again.picture(), rtol=1e-5)
    plain = BatchedRender(integrator, source, seed=5, memory=1 << 30)
    plain.add(8)
    lanes = SIDE * SIDE * 8
    assert whole.rays.primary == plain.rays.primary == lanes
    assert whole.rays.secondary - plain.rays.secondary >= 4 * lanes
    a, b = whole.average_halves()
    assert not np.array_equal(a, b)


def polished_plate():
    """A plate whose lobe is as wide as the emitter that it mirrors, so that both ways of sampling count; and a wall."""
    import trimesh

    from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription

    plate, wall = trimesh.creation.box((1.6, 1.6, 0.02)), trimesh.creation.box((0.02, 1.6, 1.0))
    meshes = [
        Mesh("", m.vertices.astype(np.float32), m.faces.astype(np.uint32), number)
        for number, m in enumerate((plate, wall))
    ]
    materials = [Material("metal", metallic=1.0, roughness=0.13), Material("wall", roughness=1.0, specular=0.0)]
    at, beside = np.eye(4), np.eye(4)
    at[:3, 3], beside[:3, 3] = (0.2, 0.0, 2.0), (-0.9, 0.0, 0.3)
    light = Light("point", (3.0, 3.0, 3.0), at, radius=0.12)
    return SceneDescription("plate", meshes, materials, [Instance(0, np.eye(4)), Instance(1, beside)], lights=[light])


@pytest.mark.long
def test_chains_count_the_emitter_samples_of_their_path():
    """With one sample a pixel the first surface has four, which the weights of what is met there know."""
    integrator, source = described(polished_plate())
    plain, further = (pictures(integrator, source, chains, seeds=range(100), spp=1) for chains in (0, 7))
    agree(plain, further)
    assert further.mean() == pytest.approx(plain.mean(), rel=0.01)


def test_seen_light_is_told_apart_and_is_all_that_is_seen(all_events):
    """The emitter's mirror images and the sky's; not what lies on matt surfaces."""

    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.sample_batches import BatchedRender
    from lippmann.rendering.film.wavefront import trace_frame

    integrator, source = all_events
    integrator = chained(integrator, 4)
    both = [BatchedRender(integrator, source, seed=5, memory=1 << 30, for_denoiser=keeps) for keeps in (True, False)]
    for batches in both:
        batches.add(16)
    frame = trace_frame(integrator, source, cut_wavefronts(SIDE, SIDE, 16, memory=2**30), seed=5, for_denoiser=True)
    picture, specular, halves = both[0].picture(), both[0].specular(), both[0].specular_halves()
    assert np.array_equal(picture, both[1].picture())
    assert both[1].specular() is None
    assert both[1].specular_halves() is None
    assert specular == pytest.approx(np.mean(halves, axis=0), rel=1e-5, abs=1e-7)
    assert not np.array_equal(*halves)
    assert frame.specular.mean() == pytest.approx(specular.mean(), rel=0.1)
    assert np.all(specular <= picture * (1 + 1e-5) + 1e-6)
    matt = specular[SIDE // 2 + 5 : SIDE // 2 + 7, SIDE // 2 + 5 : SIDE // 2 + 7]
    assert np.abs(matt).max() == 0
    assert specular.max() > 2  # brighter than anything matt
    share = specular.sum() / picture.sum()
    assert 0.05 < share < 0.95


@pytest.mark.long
def test_what_one_chain_brings_beyond_a_limit_is_excess(all_events):
    """Chain by chain, and of several chains together; colours keep their hue."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import divide
    from lippmann.device.sobol import SampleStream
    from lippmann.rendering.transport.ray_source import PixelRays
    from lippmann.rendering.transport.specular_chains import trace_specular_light

    integrator, source = all_events
    most, of_pixel, chains = 4.0, 64, 3

    def told(number, per_lane):
        pixel, sample = divide(dr.arange(mi.UInt32, SIDE * SIDE * number), number)
        row, column = divide(pixel, SIDE)
        stream = SampleStream.of_pixels(pixel, sample, dr.opaque(mi.UInt32, 1))
        pixels = PixelRays(source, column, row, mi.UInt32(0))
        light, excess, _ = trace_specular_light(
            integrator, pixels, stream, dr.opaque(mi.UInt32, per_lane), mi.Bool(True), dr.opaque(mi.Float, most)
        )
        return np.array(mi.Color3f(light)).T, np.array(mi.Color3f(excess)).T

    light, excess = told(of_pixel * chains, 1)
    brightest = light.max(axis=1, keepdims=True)
    beyond = np.where(brightest > most, light * (1 - most / np.maximum(brightest, most)), 0)
    assert (beyond.max(axis=1) > 0).sum() > 100
    assert excess == pytest.approx(beyond, rel=1e-5, abs=1e-5)
    # The chains of a lane are those of as many lanes.
    together = [part.reshape(SIDE * SIDE, -1, 3).sum(axis=1) for part in told(of_pixel, chains)]
    alone = [part.reshape(SIDE * SIDE, -1, 3).sum(axis=1) for part in (light, excess)]
    assert together[0] == pytest.approx(alone[0], rel=1e-4, abs=1e-3)
    assert together[1] == pytest.approx(alone[1], rel=1e-4, abs=1e-3)


@pytest.mark.long
def test_of_many_chains_each_counts_as_a_whole(all_events):
    """The emitter is 15 times white: one of 8 chains counts up to 5.7 of that, one of 64 as a whole."""
    import mitsuba as mi

    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.sample_batches import BatchedRender
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.specular_chains import limit_chain

    assert 4 < limit_chain(8.0) < 5
    assert 20 < limit_chain(64.0) < 30
    integrator, source = all_events
    four = chained(integrator, 4)
    dim = four.lit_by(replace(four.light, gain=mi.Float(0.25)))
    few = [BatchedRender(four, source, seed=seed, memory=1 << 30, for_denoiser=True) for seed in range(16)]
    many, limited = (BatchedRender(each, source, seed=5, memory=1 << 30, for_denoiser=True) for each in (four, dim))
    for each in few:
        each.add(2)
    many.add(16)
    limited.add(2)
    frame = trace_frame(dim, source, cut_wavefronts(SIDE, SIDE, 2, memory=2**30), seed=5, for_denoiser=True)
    assert BatchedRender(integrator, source, memory=1 << 30).excess() is None
    assert many.excess().max() == 0
    assert limited.excess().max() == frame.excess.max() == 0  # the gain leaves less than 5.7
    excess, specular = (
        np.stack([part(each) for each in few]) for part in (BatchedRender.excess, BatchedRender.specular)
    )
    bright = excess.max(axis=-1) > 0
    assert 5 < bright.sum() < 0.01 * bright.size
    assert np.all(excess <= specular * (1 + 1e-5))
    # Of single hits, by one of a pixel's chains, is left what counts of them.
    assert (specular - excess).max(axis=-1)[bright].min() == pytest.approx(limit_chain(8.0) / 8, rel=0.1)


def test_sky_at_outlines_stays_with_paths(engine):
    """Samples of both sides belong together: of a ball as bright as its sky nothing would be seen."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    scene = mi.load_dict(
        {
            "type": "scene",
            "ball": {"type": "sphere", "radius": 0.5, "bsdf": {"type": "diffuse", "reflectance": rgb(1.0)}},
            "sky": {"type": "constant", "radiance": rgb(0.5)},
        }
    )
    integrator = PathIntegrator(scene, make_scene_features(scene, has_null=False), 2)
    pose = np.eye(4)
    pose[2, 3] = 3.0
    source = CameraRays(Camera("eye", pose, fov_y=0.6), SIDE, SIDE)
    plan = cut_wavefronts(SIDE, SIDE, 4, memory=2**30)
    plain = trace_frame(integrator, source, plan, for_denoiser=True)
    further = trace_frame(chained(integrator, 4), source, plan, for_denoiser=True)
    assert plain.specular is None
    assert np.abs(further.specular).max() == 0
    np.testing.assert_allclose(further.pixels, plain.pixels, rtol=1e-5)
