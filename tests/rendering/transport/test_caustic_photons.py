"""Photons of caustics: their flux against theory, pictures with them against formulas and against paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

#: Refractive index of ``dielectric`` where nothing is said.
GLASS = 1.5046


def camera(distance, fov=40.0):
    from lippmann.scene.values.description import Camera

    pose = np.eye(4)
    pose[2, 3] = distance
    return Camera("test", pose, fov_y=np.radians(fov))


def transmittance(sine, index=GLASS):
    """Of a boundary for unpolarised light that comes at an angle of this sine from the thin side (Fresnel)."""
    cos_i, cos_t = np.sqrt(1 - sine**2), np.sqrt(1 - (sine / index) ** 2)
    across = ((cos_i - index * cos_t) / (cos_i + index * cos_t)) ** 2
    along = ((index * cos_i - cos_t) / (index * cos_i + cos_t)) ** 2
    return 1 - (across + along) / 2


def landed(scene_dict, count=1 << 17, seed=3):
    """Photons of a scene, and how many emissions each emitter and caster had."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.casters import find_casters
    from lippmann.rendering.transport.photon_shooter import PhotonShooter

    scene = mi.load_dict({"type": "scene"} | scene_dict)
    casters = find_casters(scene)
    assert casters.pairs > 0
    shooter = PhotonShooter(scene, make_scene_features(scene, has_null="mask" in str(scene_dict)), casters)
    return shooter.shoot(count, np.full(casters.pairs, 1 / casters.pairs), seed)[0]


def room(half=10.0):
    """A matt cube about the origin, seen from within."""
    import mitsuba as mi

    return {
        "type": "cube",
        "to_world": mi.ScalarTransform4f().scale(half),
        "flip_normals": True,
        "bsdf": {"type": "diffuse"},
    }


def lamp(position, intensity=2.0):
    return {"type": "point", "position": position, "intensity": {"type": "rgb", "value": [intensity, 1.0, 0.5]}}


@pytest.mark.slow
@pytest.mark.parametrize("distance", [1.5, 4.0])
def test_flux_through_a_glass_ball(distance):
    """A lamp's flux within the cone of the ball, less what either boundary reflects."""
    ball = {"type": "sphere", "radius": 1.0, "bsdf": {"type": "dielectric"}}
    photons = landed({"ball": ball, "room": room(), "lamp": lamp([0, 0, distance])})
    sine = (np.arange(20_000) + 0.5) / 20_000 / distance  # of the angle about the axis
    angle_step = np.gradient(np.arcsin(sine))
    # The chance to get in and out is the same at both boundaries.
    expected = (transmittance(sine * distance) ** 2 * 2 * np.pi * sine * angle_step).sum()
    through = photons.power[photons.surfaces == 2].sum(axis=0)
    np.testing.assert_allclose(through / [2.0, 1.0, 0.5], expected, rtol=0.01)
    reflected = photons.power[photons.surfaces == 1].sum(axis=0)
    whole = (2 * np.pi * sine * angle_step).sum()
    first = (transmittance(sine * distance) * 2 * np.pi * sine * angle_step).sum()
    np.testing.assert_allclose(reflected / [2.0, 1.0, 0.5], whole - first, rtol=0.02)


@pytest.mark.slow
def test_flux_from_a_mirror_cylinder():
    """All that the cylinder catches: the lamp's intensity times the solid angle."""
    cylinder = {
        "type": "cylinder",
        "p0": [0, 0, -2],
        "p1": [0, 0, 2],
        "radius": 0.5,
        "bsdf": {"type": "conductor", "material": "none"},
    }
    photons = landed({"cylinder": cylinder, "room": room(), "lamp": lamp([3, 0, 1])})
    angle, z = np.meshgrid(np.linspace(-np.pi, np.pi, 2001), np.linspace(-2, 2, 2001))
    normal = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    apart = np.array([3, 0, 1.0]) - np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), z], axis=-1)
    distance = np.linalg.norm(apart, axis=-1)
    seen = np.maximum((apart * normal).sum(axis=-1), 0) / distance**3
    solid = np.trapezoid(np.trapezoid(seen * 0.5, dx=2 * np.pi / 2000), dx=4 / 2000)
    assert set(photons.surfaces.tolist()) == {1}
    np.testing.assert_allclose(photons.power.sum(axis=0) / [2.0, 1.0, 0.5], solid, rtol=0.01)


@pytest.mark.slow
def test_flux_through_a_prism(tmp_path):
    """Parallel light straight onto one face, and out of another at an angle of 30 degrees within."""
    import trimesh

    height, depth = 1.5, 2.0
    width = height * np.tan(np.radians(30))
    corners = [(0, 0, 0), (0, height, 0), (width, 0, 0), (0, 0, depth), (0, height, depth), (width, 0, depth)]
    hull = trimesh.Trimesh(corners, process=False).convex_hull
    hull.unmerge_vertices()  # faces, not a rounded body
    hull.export(tmp_path / "prism.ply")
    prism = {
        "type": "ply",
        "filename": str(tmp_path / "prism.ply"),
        "face_normals": True,
        "bsdf": {"type": "dielectric"},
    }
    import mitsuba as mi

    wall = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([5, 0, 0]).rotate([0, 1, 0], -90).scale(30),
        "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}},
    }
    sun = {"type": "directional", "direction": [1, 0, 0], "irradiance": {"type": "rgb", "value": [3, 2, 1]}}
    photons = landed({"prism": prism, "wall": wall, "sun": sun}, count=1 << 20)
    expected = height * depth * transmittance(0.0) * transmittance(np.sin(np.radians(30)) * GLASS)
    through = photons.power[photons.surfaces == 2].sum(axis=0)
    np.testing.assert_allclose(through / [3, 2, 1], expected, rtol=0.01)
    # And where to: turned by Snell's law towards the thick end.
    out = photons.toward[photons.surfaces == 2]
    turned = np.arcsin(np.sin(np.radians(30)) * GLASS) - np.radians(30)
    np.testing.assert_allclose(np.abs(np.arctan2(out[:, 1], out[:, 0])), np.pi - turned, atol=1e-3)


@pytest.mark.slow
def test_photons_pass_holes_on_their_way():
    """A half-transparent sheet between lamp and mirror, and one behind it, let through their share each."""
    import mitsuba as mi

    sheet = {"type": "mask", "opacity": 0.25, "bsdf": {"type": "diffuse", "reflectance": 0.0}}
    place = mi.ScalarTransform4f
    scene = {
        "mirror": {"type": "disk", "bsdf": {"type": "conductor", "material": "none"}},
        "room": room(),
        "lamp": lamp([0, 0, 3.0]),
    }
    free = landed(scene).power.sum(axis=0)
    above = {"type": "rectangle", "to_world": place().translate([0, 0, 1]).scale(9), "bsdf": sheet}
    crossed = landed(scene | {"above": above})
    np.testing.assert_allclose(crossed.power.sum(axis=0), free * 0.75**2, rtol=0.02)


def traced(scene_dict, view, *, photons, size=24, spp=64, seed=0, depth=6, samples=1 << 26):
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.casters import find_casters
    from lippmann.rendering.transport.caustic_photons import CausticPhotons
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays

    scene = mi.load_dict({"type": "scene"} | scene_dict)
    features = make_scene_features(scene, has_null="mask" in str(scene_dict))
    integrator = PathIntegrator(scene, features, depth)
    if photons:
        photons = CausticPhotons(scene, features, find_casters(scene), samples=samples, seed=seed)
        integrator = integrator.lit_by(replace(integrator.light, photons=photons.of_pass(0)))
    plan = cut_wavefronts(size, size, spp, memory=2**31)
    return trace_frame(integrator, CameraRays(view, size, size), plan, seed=seed).pixels


@pytest.mark.slow
def test_a_lamp_s_mirror_image_lights_a_wall():
    """What no path can find: the wall is lit by the lamp and, through the mirror on the floor, by its image below."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    scene = {
        "wall": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 0.6}, "to_world": place().scale(2)},
        "floor": {
            "type": "rectangle",
            "to_world": place().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(9),
            "bsdf": {"type": "conductor", "material": "none"},
        },
        "lamp": lamp([0.2, 0.5, 1.0]),
    }
    view = camera(3.0, fov=20.0)
    picture = traced(scene, view, photons=True, depth=3, spp=16)
    half = 3.0 * np.tan(np.radians(10.0))
    x, y = np.meshgrid(((np.arange(24) + 0.5) / 12 - 1) * half, (1 - (np.arange(24) + 0.5) / 12) * half)

    def lit(lx, ly, lz):
        return lz / ((x - lx) ** 2 + (y - ly) ** 2 + lz**2) ** 1.5

    direct, mirrored = lit(0.2, 0.5, 1.0), lit(0.2, -2.5, 1.0)
    expected = 0.6 / np.pi * (direct + mirrored)[..., None] * [2.0, 1.0, 0.5]
    np.testing.assert_allclose(picture, expected, rtol=0.03)
    assert np.median(picture / expected) == pytest.approx(1.0, abs=0.004)
    plain = traced(scene, view, photons=False, depth=3, spp=16)
    np.testing.assert_allclose(plain, 0.6 / np.pi * direct[..., None] * [2.0, 1.0, 0.5], rtol=0.01)


def caustics_of_a_large_lamp(floor):
    """Light that paths find, too: a wide lamp above balls of glass, mirror and thin glass."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    return {
        "floor": {
            "type": "rectangle",
            "to_world": place().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(3),
            "bsdf": floor,
        },
        "glass": {"type": "sphere", "center": [0.6, -0.4, 0.4], "radius": 0.5, "bsdf": {"type": "dielectric"}},
        "mirror": {"type": "sphere", "center": [-0.7, -0.4, 0], "radius": 0.6, "bsdf": {"type": "conductor"}},
        "lamp": {
            "type": "rectangle",
            "to_world": place().translate([0, 3, 0]).rotate([1, 0, 0], 90).scale(1.5),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [4, 4, 3]}},
        },
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0.2, 0.3, 0.5]}},
    }


@pytest.mark.long
@pytest.mark.parametrize(
    "floor",
    [
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.5, 0.3]}},
        {"type": "plastic"},
        {"type": "roughplastic", "alpha": 0.2},
        {"type": "mask", "opacity": 0.6, "bsdf": {"type": "diffuse"}},
    ],
    ids=lambda floor: floor["type"],
)
def test_pictures_with_photons_are_those_of_paths(floor):
    """Means of parts of the picture, by the scatter of independent pictures; the blur moves little light."""
    scene, view = caustics_of_a_large_lamp(floor), camera(5.0)
    found = {
        photons: np.stack([traced(scene, view, photons=photons, seed=seed, spp=64) for seed in range(4)])
        for photons in (False, True)
    }
    parts = {
        photons: pictures.reshape(4, 6, 4, 6, 4, 3).mean(axis=(2, 4)).reshape(4, -1)
        for photons, pictures in found.items()
    }
    mean = {photons: values.mean(axis=0) for photons, values in parts.items()}
    error = np.sqrt(sum(values.var(axis=0, ddof=1) / 4 for values in parts.values()))
    # Few pictures know their scatter badly: a share of the value for blur and for that.
    np.testing.assert_array_less(np.abs(mean[True] - mean[False]), 5 * error + 0.015 * mean[False] + 1e-4)
    assert mean[True].mean() == pytest.approx(mean[False].mean(), rel=0.004)


@pytest.mark.long
def test_a_picture_is_the_same_however_it_is_cut(monkeypatch):
    """The same seed gives the same photons and the same bytes."""
    scene, view = caustics_of_a_large_lamp({"type": "diffuse"}), camera(5.0)
    first, second = (traced(scene, view, photons=True, spp=4, seed=7) for _ in range(2))
    assert first.tobytes() == second.tobytes()
    assert first.tobytes() != traced(scene, view, photons=True, spp=4, seed=8).tobytes()


def test_without_casters_or_lamps_there_are_no_photons():
    import mitsuba as mi

    from lippmann.rendering.transport.casters import find_casters

    mirror = {"type": "sphere", "bsdf": {"type": "conductor"}}
    sky = {"type": "constant"}
    assert find_casters(mi.load_dict({"type": "scene", "ball": mirror, "sky": sky})).pairs == 0
    matt = {"type": "sphere", "bsdf": {"type": "roughconductor"}}
    assert find_casters(mi.load_dict({"type": "scene", "ball": matt, "lamp": lamp([0, 0, 9])})).pairs == 0
    assert find_casters(mi.load_dict({"type": "scene", "ball": mirror, "lamp": lamp([0, 0, 9])})).pairs == 1


@pytest.mark.long
def test_instances_and_curves_throw_what_the_shapes_throw(tmp_path):
    """Shapes that give no points get photons through the boxes about them: the same flux."""
    import mitsuba as mi

    from lippmann.rendering.transport.casters import find_casters, hides_caustics

    place = mi.ScalarTransform4f
    glass = {"type": "dielectric"}
    rest = {"room": room(), "lamp": lamp([0, 0, 4.0]), "second": lamp([0.7, 0.8, -0.9])}
    ball = {"type": "sphere", "radius": 0.5, "bsdf": glass}
    plain = landed({"ball": ball | {"to_world": place().translate([0, 0, 1]).scale(2)}, **rest}, count=1 << 19)
    group = {"type": "shapegroup", "ball": ball, "matt": {"type": "sphere", "center": [9, 9, 9], "radius": 0.01}}
    of = {"type": "ref", "id": "group"}
    copy = {"type": "instance", "of": of, "to_world": place().translate([0, 0, 1]).scale(2)}
    (tmp_path / "thread.txt").write_text("-1 0 -2 .2\n0 0 -2 .2\n1 0 -2 .2\n2 0 -2 .2\n")
    thread = {"type": "bsplinecurve", "filename": str(tmp_path / "thread.txt"), "bsdf": glass}
    copies = {"group": group, "copy": copy, **rest}
    copied = landed(copies, count=1 << 21)
    for events in (1, 2):
        expected, found = (photons.power[photons.surfaces == events].sum(axis=0) for photons in (plain, copied))
        np.testing.assert_allclose(found, expected, rtol=0.04)  # the copy scatters by 0.02
    # A thread beside the ball, of the same size as a cylinder that gives points.
    alone = {"room": room(), "lamp": lamp([0.3, 3.0, -1.5])}
    rod = {"type": "cylinder", "p0": [0, 0, -2], "p1": [1, 0, -2], "radius": 0.2, "bsdf": glass}
    through = landed({"thread": thread, "ball": ball, **alone}, count=1 << 21)
    rods = landed({"rod": rod, "ball": ball, **alone}, count=1 << 19)
    np.testing.assert_allclose(through.power.sum(axis=0), rods.power.sum(axis=0), rtol=0.03)
    assert hides_caustics(mi.load_dict({"type": "scene", "thread": thread, **alone}))
    found = find_casters(mi.load_dict({"type": "scene", **copies}))
    assert np.isfinite(found.boxes).all(axis=1).tolist() == [True]


def photons_of(scene_dict, **options):
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.casters import find_casters
    from lippmann.rendering.transport.caustic_photons import CausticPhotons

    scene = mi.load_dict({"type": "scene"} | scene_dict)
    features = make_scene_features(scene, has_null=False)
    return CausticPhotons(scene, features, find_casters(scene), **({"samples": 1 << 18, "seed": 2} | options))


def test_passes_have_photons_of_their_own_and_shrinking_radii():
    from lippmann.rendering.transport.caustic_photons import shrink_radius

    ball = {"ball": {"type": "sphere", "bsdf": {"type": "dielectric"}}, "room": room(), "lamp": lamp([0, 0, 4.0])}
    photons = photons_of(ball, kept=2)
    first, second = photons.of_pass(0), photons.of_pass(1)
    assert second.radius == pytest.approx(first.radius * np.sqrt(5 / 6))
    assert len({half.position.tobytes() for each in (first, second) for half in each.halves}) == 4
    assert photons.of_pass(0) is first  # kept
    assert photons.of_pass(2).radius == pytest.approx(first.radius * np.sqrt(5 / 6 * 8 / 9))
    again = photons.of_pass(0)  # made anew
    assert again is not first
    assert again.halves[0].position.tobytes() == first.halves[0].position.tobytes()
    # So slowly that noise and blur both go: radius squared as n to the power of -1/3.
    assert shrink_radius(999) ** 2 == pytest.approx(1000 ** (-1 / 3), rel=0.15)


@pytest.mark.long
def test_what_is_not_seen_gets_few_photons():
    """Two balls, of which one throws its light outside of the region."""
    ball = {"type": "sphere", "bsdf": {"type": "dielectric"}}
    far = ball | {"center": [40, 0, 0]}
    scene = {"ball": ball, "far": far, "room": room(60.0), "lamp": lamp([0, 0, 20.0])}
    everywhere = photons_of(scene).of_pass(0).halves[0]
    region = np.array([[-20.0, -20, -61], [20, 20, 61]])
    chosen = photons_of(scene, region=region).of_pass(0).halves[0]
    assert len(chosen.inside(region)) > 1.1 * len(everywhere.inside(region))
    np.testing.assert_allclose(
        chosen.inside(region).power.sum(axis=0), everywhere.inside(region).power.sum(axis=0), rtol=0.02
    )
    assert photons_of(scene, region=np.array([[50.0, 50, 50], [51, 51, 51]])).are_none


def test_emissions_go_with_the_samples_of_a_picture():
    from lippmann.rendering.transport.caustic_photons import emissions

    assert emissions(8000) == 2400
    assert emissions(1 << 24) == 6 << 16  # fewer of many: those of a half go with the power 2/3 of the paths
    assert emissions(1) == 6


def test_kernels_of_any_size_shoot_the_same_photons(monkeypatch):
    from scipy.spatial import cKDTree

    from lippmann.rendering.transport import photon_shooter

    scene = {"room": room(), "ball": {"type": "sphere", "bsdf": {"type": "dielectric"}}, "emitter": lamp([3, 2, 4])}
    whole = landed(scene, count=5000)
    monkeypatch.setattr(photon_shooter, "TUNING", replace(photon_shooter.TUNING, lanes=700))
    in_parts = landed(scene, count=5000)
    assert len(whole) == len(in_parts) > 1500
    # Of each kernel, photons come in the order of the surfaces that they have met.
    apart, other = cKDTree(whole.position).query(in_parts.position)
    assert apart.max() < 1e-3
    assert np.array_equal(whole.surfaces[other], in_parts.surfaces)
    assert np.allclose(whole.power[other], in_parts.power, rtol=1e-3)
    assert np.allclose(whole.toward[other], in_parts.toward, atol=1e-3)


@pytest.mark.parametrize("count", [40, 9000])
def test_radius_holds_the_neighbours_asked_for_and_loads_no_search_tree(monkeypatch, count):
    import sys

    from scipy.spatial import cKDTree

    from lippmann.rendering.transport.caustic_photons import _radius
    from lippmann.rendering.transport.photon_map import Photons

    photons = Photons.dark(count)
    photons.position[:] = np.random.default_rng(1).random((count, 3), np.float32)
    distances, _ = cKDTree(photons.position).query(photons.position, k=[16])
    for name in [name for name in sys.modules if name.startswith("scipy.spatial")]:
        monkeypatch.setitem(sys.modules, name, None)  # takes longer to load than the photons to shoot
    assert _radius(photons, 16.2) == pytest.approx(np.median(distances), rel=0.05)


@pytest.mark.parametrize(("count", "radius"), [(0, 1), (1, 1), (2, 5), (3, 5)])
def test_the_radius_of_few_photons(count, radius):
    """The pilot's photons may be seen where those of the first pass all miss."""
    from lippmann.rendering.transport.caustic_photons import _radius
    from lippmann.rendering.transport.photon_map import Photons

    photons = Photons.dark(count)
    photons.position[:] = np.array([[0, 0, 0], [3, 4, 0], [0, 0, 5]], np.float32)[:count]
    assert _radius(photons, 16) == pytest.approx(radius)
