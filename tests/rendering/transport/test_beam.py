"""The beam of a sample against the display's geometry, and pictures of small mirrors with and without it."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import list_displays

pytestmark = pytest.mark.usefixtures("engine")


def beam_before(display, samples=1):
    from lippmann.rendering.transport.beam import beam_of
    from lippmann.rendering.transport.ray_source import DisplayRays

    beam = beam_of(DisplayRays(display, np.eye(4)), samples)
    return np.array(beam.width).ravel(), np.array(beam.spread).ravel()


@pytest.mark.parametrize("name", ["seed-lenticular", "mla-square"])
def test_lenses_focus_the_beam_of_a_pixel(name):
    import mitsuba as mi

    display = next(each for each in list_displays() if each.name == name)
    from lippmann.rendering.transport.ray_source import DisplayRays

    width, spread = beam_before(display)
    pitch, gap = display.panel.pixel_pitch, display.gap
    # Rays begin before the nearest thing that can be seen, and all meet in the lens, at height 0.
    middle = mi.UInt32(display.panel.width // 2), mi.UInt32(display.panel.height // 2), mi.UInt32(0)
    ray = DisplayRays(display, np.eye(4)).rays(*middle, mi.Point2f(0.5))
    to_lens = float(np.array(-ray.o.z / ray.d.z)[0])
    focused = [0] if name == "seed-lenticular" else [0, 1]
    for axis in focused:
        # Of slanted directions a little less: the mean over the display.
        assert spread[axis] == pytest.approx(pitch / gap, rel=0.1)
        assert width[axis] + spread[axis] * to_lens == pytest.approx(0, abs=0.02 * float(abs(width[axis])))
    if name == "seed-lenticular":
        assert width[1] == pytest.approx(pitch, rel=0.02)
        assert spread[1] == 0


def test_beams_are_thinner_by_the_root_of_the_samples():
    display = list_displays()[0]
    whole, part = beam_before(display), beam_before(display, 16)
    for one, other in zip(whole, part, strict=True):
        np.testing.assert_allclose(np.array(one) / 4, other, rtol=1e-6)


def test_a_camera_has_a_beam_that_grows_with_distance():
    from lippmann.rendering.transport.beam import beam_of
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    beam = beam_of(CameraRays(Camera("test", np.eye(4), fov_y=0.02), 50, 50), 1)
    assert np.array(beam.width).ravel() == pytest.approx(0)
    assert np.array(beam.spread).ravel() == pytest.approx(0.02 / 50, rel=1e-3)


def small_ball(roughness, radius=0.02):
    """A mirror ball, smaller than a pixel's beam, and a small emitter far from it."""
    from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription

    theta, phi = np.meshgrid(np.linspace(0, np.pi, 48), np.linspace(0, 2 * np.pi, 96), indexing="ij")
    normals = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    index = np.arange(theta.size).reshape(theta.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.uint32)
    mesh = Mesh("ball", np.float32(normals * radius), faces, 0, np.float32(normals))
    place = np.eye(4)
    place[:3, 3] = 0.3, 0.6, 1.0
    light = Light("point", (20.0, 20.0, 20.0), place, radius=0.05)
    metal = Material("metal", metallic=1.0, roughness=roughness)
    return SceneDescription("ball", [mesh], [metal], [Instance(0, np.eye(4))], lights=[light])


def seen(description, beam_samples, *, spp=16, seeds=range(12), pixels=8):
    """Means of pictures by so many seeds, seen from above over the width of the ball; ``None``: without a beam."""
    from lippmann.device.pbr import build_description
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.film.wavefront_plan import make_plan
    from lippmann.rendering.transport.beam import beam_of
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.rendering.transport.scene_features import make_scene_features
    from lippmann.scene.values.description import Camera

    built = build_description(description)
    integrator = PathIntegrator(built.mitsuba, make_scene_features(built.mitsuba, has_null=built.has_null), 2)
    pose = np.eye(4)
    pose[2, 3] = 1.0
    source = CameraRays(Camera("test", pose, height=0.05), pixels, pixels)
    if beam_samples is not None:
        integrator.beam = beam_of(source, beam_samples)
    plan = make_plan(pixels, pixels, spp, memory=2**30)
    return np.array([trace_frame(integrator, source, plan, seed=seed).pixels.mean() for seed in seeds])


def test_small_mirrors_show_as_much_light_with_less_noise():
    plain, few, many = (seen(small_ball(0.05), samples) for samples in (None, 1, 16))
    assert few.mean() == pytest.approx(0.58, rel=0.05)  # of a ball with wide lobes, whose noise is small
    assert many.std() < 0.5 * plain.std()
    assert few.std() < 0.1 * plain.std()


def test_wide_lobes_are_hardly_changed():
    plain, beam = (seen(small_ball(0.3), samples) for samples in (None, 16))
    error = np.hypot(plain.std(), beam.std()) / np.sqrt(len(plain))
    assert abs(beam.mean() - plain.mean()) < 3 * error + 0.01 * plain.mean()


def test_the_widened_lobe_is_that_of_a_rougher_surface():
    import mitsuba as mi

    from lippmann.device.pbr import build_description
    from lippmann.device.pbr.surface_point import widen_lobes

    by = 0.01
    narrow, rough = (build_description(small_ball(value)) for value in (0.2, (0.2**4 + by) ** 0.25))
    values = []
    for built, widened in ((narrow, by), (rough, 0.0)):
        ray = mi.Ray3f(mi.Point3f([0.0, 0.004, 0.01], [0.0, 0.01, -0.002], 1), mi.Vector3f(0, 0, -1))
        si = built.mitsuba.ray_intersect(ray)
        widen_lobes(si, mi.Float(widened))
        wo = mi.Vector3f([0.1, -0.2, 0.4], [0.0, 0.3, 0.1], 0.9)
        value, pdf = si.bsdf().eval_pdf(mi.BSDFContext(), si, wo / np.sqrt(0.9))
        values.append(np.vstack([np.array(value), np.array(pdf)]))
    np.testing.assert_allclose(values[0], values[1], rtol=1e-3)
    assert (values[0] > 0).all()


@pytest.mark.parametrize("radius", [0.5, 2.0])
def test_normals_turn_by_the_width_over_the_radius(radius):
    import mitsuba as mi

    from lippmann.rendering.transport.beam import MOST_WIDENING, turn_of_normals, widening

    scene = mi.load_dict({"type": "scene", "ball": {"type": "sphere", "radius": radius}, "plane": {"type": "disk"}})
    ray = mi.Ray3f(mi.Point3f(0.1 * radius, [0.2 * radius, -0.3 * radius], 5), mi.Vector3f(0, 0, -1))
    si = scene.ray_intersect(ray, mi.RayFlags.All | mi.RayFlags.dNSdUV, True)
    turn = turn_of_normals(si, mi.Vector2f(-0.01, 0.4))
    np.testing.assert_allclose(np.array(turn), 0.01 / radius, rtol=1e-4)
    np.testing.assert_allclose(np.array(widening(turn)), (0.01 / radius) ** 2 / 6, rtol=1e-4)
    assert float(np.array(widening(mi.Float(9.0))).max()) == pytest.approx(MOST_WIDENING)


def test_flat_surfaces_do_not_turn():
    import mitsuba as mi

    from lippmann.rendering.transport.beam import turn_of_normals

    scene = mi.load_dict({"type": "scene", "plane": {"type": "rectangle"}})
    ray = mi.Ray3f(mi.Point3f(0.1, 0.2, 5), mi.Vector3f(0, 0, -1))
    si = scene.ray_intersect(ray, mi.RayFlags.All | mi.RayFlags.dNSdUV, True)
    assert float(np.array(turn_of_normals(si, mi.Vector2f(1.0)))[0]) == 0


@pytest.mark.parametrize(
    ("asked", "has_beam"),
    [
        ({"method": "pooled", "spp": 4}, True),
        ({"method": "full", "spp": 4}, False),
        ({"method": "pooled", "quality": 35.0}, False),
    ],
)
def test_pooled_light_of_a_known_number_of_samples_has_a_beam(asked, has_beam):
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.request.resolve import resolve
    from lippmann.rendering.session import open_session
    from lippmann.rendering.transport.ray_source import DisplayRays
    from lippmann.scene.readers.load import load_scene

    display = list_displays()[0].resized(64, 64)
    for scene, may_have in (("small-balls", True), ("tree", False)):
        loaded = load_scene(scene)
        request = resolve(RenderRequest(integrator="path", **asked), loaded, size=(64, 64))
        session = open_session(loaded, request)
        at = session.place(display)
        integrator = session.integrator(DisplayRays(display, at.world_from_display), at.display_from_world)
        assert (integrator.beam is not None) == (has_beam and may_have)
