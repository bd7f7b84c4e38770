"""The path integrator against Mitsuba's own, and against what can be worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def camera(distance, fov=40.0):
    from lippmann.scene.values.description import Camera

    pose = np.eye(4)
    pose[2, 3] = distance
    return Camera("test", pose, fov_y=np.radians(fov))


def trace(scene_dict, cam, size=32, spp=64, depth=6, seed=0, background=None, absorption=None):
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays

    scene = mi.load_dict(scene_dict)
    has_null = "mask" in str(scene_dict)
    features = make_scene_features(scene, background=background, has_null=has_null, absorption=absorption)
    integrator = PathIntegrator(scene, features, depth)
    return trace_frame(
        integrator, CameraRays(cam, size, size), cut_wavefronts(size, size, spp, memory=2**31), seed=seed
    )


def mitsuba_reference(scene_dict, cam, size, spp, depth, seed):
    import mitsuba as mi

    to_world = mi.ScalarTransform4f(cam.world_from_camera) @ mi.ScalarTransform4f().rotate([0, 1, 0], 180)
    sensor = {
        "type": "perspective",
        "fov": float(np.degrees(cam.fov_y)),
        "fov_axis": "y",
        "to_world": to_world,
        "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
        "near_clip": 1e-3,
    }
    scene = mi.load_dict(scene_dict | {"sensor": sensor})
    integrator = mi.load_dict({"type": "path", "max_depth": depth + 1})
    return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed))


def mixed_scene():
    """Diffuse, rough metal, mirror and glass under an area light, a point light and a sky."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f
    return {
        "type": "scene",
        "floor": {
            "type": "rectangle",
            "to_world": transform().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(3),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.5, 0.3]}},
        },
        "metal": {
            "type": "sphere",
            "center": [-0.9, -0.4, 0],
            "radius": 0.6,
            "bsdf": {"type": "roughconductor", "alpha": 0.3},
        },
        "glass": {"type": "sphere", "center": [0.5, -0.5, 0.6], "radius": 0.5, "bsdf": {"type": "dielectric"}},
        "mirror": {"type": "sphere", "center": [0.8, -0.2, -1], "radius": 0.8, "bsdf": {"type": "conductor"}},
        "lamp": {
            "type": "rectangle",
            "to_world": transform().translate([0, 2, 0]).rotate([1, 0, 0], 90).scale(0.7),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [4, 4, 3]}},
        },
        "point": {"type": "point", "position": [1.5, 1, 2], "intensity": {"type": "rgb", "value": [1, 2, 3]}},
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0.2, 0.3, 0.5]}},
    }


@pytest.mark.slow
@pytest.mark.parametrize("depth", [1, 2, 5])
def test_agrees_with_mitsubas_path_block_by_block(depth):
    size, runs = 32, 4
    cam = camera(5)
    ours = np.stack([trace(mixed_scene(), cam, size, 64, depth, seed).pixels for seed in range(runs)])
    theirs = np.stack([mitsuba_reference(mixed_scene(), cam, size, 64, depth, 100 + seed) for seed in range(runs)])
    blocks = [x.reshape(runs, 4, 8, 4, 8, 3).mean(axis=(2, 4)) for x in (ours, theirs)]
    difference = blocks[0].mean(0) - blocks[1].mean(0)
    spread = np.sqrt(sum(b.var(axis=0, ddof=1) / runs for b in blocks)) + 2e-3
    assert np.abs(difference / spread).max() < 6
    assert abs(ours.mean() - theirs.mean()) < 0.01 * theirs.mean()


def test_white_furnace_is_one_everywhere():
    scene = {
        "type": "scene",
        "sky": {"type": "constant", "radiance": 1.0},
        "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 1.0}},
    }
    pixels = trace(scene, camera(4), spp=256, depth=64).pixels
    # MIS leaves a pixel noise about 1; its error at 256 samples is below 1 %.
    np.testing.assert_allclose(pixels, 1.0, rtol=0, atol=0.05)
    assert pixels.mean() == pytest.approx(1.0, abs=5e-4)


def hole(opacity):
    return {"type": "mask", "opacity": opacity, "nested": {"type": "diffuse", "reflectance": 0.0}}


@pytest.mark.slow
def test_light_falls_through_holes_of_masked_surfaces():
    """A black sheet of opacity 0.25 between a point light and a floor lets 3/4 of its light through, at depth 1."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f

    def scene(sheet):
        objects = {
            "type": "scene",
            "floor": {
                "type": "rectangle",
                "to_world": transform().scale(4),
                "bsdf": {"type": "diffuse", "reflectance": 0.5},
            },
            "lamp": {"type": "point", "position": [3, 0, 3], "intensity": 10.0},
        }
        if sheet:
            # Crosses the light's way to the floor, but not the camera's.
            objects["sheet"] = {
                "type": "rectangle",
                "to_world": transform().translate([3, 0, 1.5]).scale(2),
                "bsdf": hole(0.25),
            }
        return objects

    cam = camera(6, fov=8)
    open_sky = trace(scene(False), cam, 8, 64, 1).pixels
    through = trace(scene(True), cam, 8, 64, 1).pixels
    assert open_sky.min() > 0
    assert through == pytest.approx(0.75 * open_sky, rel=0.001)


def test_holes_are_no_bounce_and_show_the_background():
    import mitsuba as mi

    sheets = {
        f"sheet{i}": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([0, 0, i * 0.1]).scale(4),
            "bsdf": hole(0.5),
        }
        for i in range(3)
    }
    frame = trace(
        {"type": "scene", "sky": {"type": "constant", "radiance": 5.0}, **sheets},
        camera(5, 20),
        16,
        256,
        1,
        background=(0.2, 0.4, 0.8),
    )
    assert frame.pixels.mean(axis=(0, 1)) == pytest.approx([0.025, 0.05, 0.1], rel=0.03)


def test_coloured_glass_fades_with_the_distance():
    import mitsuba as mi

    scene = {
        "type": "scene",
        "sky": {"type": "constant", "radiance": 1.0},
        "block": {
            "type": "cube",
            "to_world": mi.ScalarTransform4f().scale([2, 2, 0.5]),
            "bsdf": {"type": "dielectric", "int_ior": 1.0001, "ext_ior": 1.0},
        },
    }
    pixels = trace(scene, camera(6, 2), 4, 64, 8, absorption={0: (1.0, 0.5, 0.0)}).pixels
    assert pixels.mean(axis=(0, 1)) == pytest.approx(np.exp([-1.0, -0.5, 0.0]), rel=2e-3)


def test_roulette_changes_no_mean():
    """A closed white box of radiance 1 whose walls reflect two thirds: light of each bounce is known."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    albedo, depth = 0.66, 12
    walls = {
        "type": "cube",
        "flip_normals": True,
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}},
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
    }
    scene = mi.load_dict({"type": "scene", "walls": walls})
    integrator = PathIntegrator(scene, make_scene_features(scene), depth)
    source = CameraRays(Camera("inside", np.eye(4), fov_y=1.0), 16, 16)
    frames = [
        trace_frame(integrator, source, cut_wavefronts(16, 16, 256, memory=2**30), seed=seed).pixels.mean()
        for seed in range(8)
    ]
    expected = sum(albedo**k for k in range(depth + 1))
    assert abs(np.mean(frames) - expected) < 4 * np.std(frames, ddof=1) / np.sqrt(8) + 1e-3 * expected


def test_rays_are_counted():
    """One white floor under a point light: each hit tests one shadow; the ray scattered there looks for emitters."""
    import mitsuba as mi

    scene = {
        "type": "scene",
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(9)},
        "lamp": {"type": "point", "position": [0, 0, 3], "intensity": 1.0},
    }
    rays = trace(scene, camera(2, 20), 8, 4, 1).rays
    assert (rays.primary, rays.shadow, rays.secondary, rays.discarded) == (256, 256, 256, 0)


def four_emitters():
    """A grey floor under four emitters, each of which lights a part of it best."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f
    emitters = {
        f"emitter{i}": {
            "type": "sphere",
            "center": [x, y, 0.5],
            "radius": 0.05,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [40.0, 30.0, 20.0]}},
        }
        for i, (x, y) in enumerate([(-2, -2), (2, -2), (-2, 2), (2, 2)])
    }
    floor = {"type": "rectangle", "to_world": transform().scale(3), "bsdf": {"type": "diffuse", "reflectance": 0.5}}
    return {"type": "scene", "floor": floor} | emitters


@pytest.mark.slow
def test_first_samples_take_several_emitter_samples_each(monkeypatch):
    from lippmann.rendering.transport import light_sampling

    def noise():
        runs = np.stack([trace(four_emitters(), camera(4, 50), 16, 1, 1, seed).pixels for seed in range(8)])
        return runs.var(axis=0, ddof=1).mean(), runs.mean()

    several, mean = noise()
    rays = trace(four_emitters(), camera(4, 50), 16, 1, 1).rays
    monkeypatch.setattr(light_sampling, "TUNING", replace(light_sampling.TUNING, emitter_samples=1))
    one, same_mean = noise()
    fewer = trace(four_emitters(), camera(4, 50), 16, 1, 1).rays
    assert (rays.shadow, fewer.shadow) == (4 * 256, 256)
    # One of four by chance has three times the square of its mean for variance; all four in turn leave their edges.
    assert several < 0.05 * one
    assert mean == pytest.approx(same_mean, rel=0.02)


def test_later_surfaces_take_one_emitter_sample():
    """Inside a hollow ball every surface sees the emitter, but for scattered rays that hit the emitter itself."""
    paint = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.5}}
    lamp = {"type": "sphere", "center": [0, 0.5, 0], "radius": 0.02, "emitter": {"type": "area", "radiance": 5.0}}
    scene = {"type": "scene", "ball": {"type": "sphere", "bsdf": paint}, "lamp": lamp}
    rays = trace(scene, camera(0.9, 20), 16, 1, 2).rays
    assert rays.primary == 256
    assert 0.98 * (4 + 1) * 256 < rays.shadow <= (4 + 1) * 256


def test_tiles_and_passes_do_not_change_the_picture():
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.film.memory_model import Plan
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays

    scene = mi.load_dict(mixed_scene())
    integrator = PathIntegrator(scene, make_scene_features(scene), 3)
    whole, bands, passes = (
        trace_frame(integrator, CameraRays(camera(5), 24, 20), Plan(24, 20, 1, 8, rows, run), seed=5).pixels
        for rows, run in ((20, 8), (6, 8), (20, 3))
    )
    assert np.array_equal(whole, bands)
    assert passes == pytest.approx(whole, rel=1e-5, abs=1e-6)
