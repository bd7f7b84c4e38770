"""Volumetric path tracing against Mitsuba's ``volpath``, and against the law of Beer and Lambert."""

from __future__ import annotations

import numpy as np
import pytest

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import UsageError
from lippmann.runtime.engine import start

pytestmark = pytest.mark.usefixtures("engine")

SIZE, DEPTH, SEEDS = 16, 5, 8


def transform():
    import mitsuba as mi

    return mi.ScalarTransform4f()


def rgb(*value):
    return {"type": "rgb", "value": list(value)}


def homogeneous(**more):
    return {
        "type": "homogeneous",
        "albedo": rgb(0.9, 0.6, 0.8),
        "sigma_t": rgb(0.25, 0.5, 1.0),
        "scale": 2.0,
        "phase": {"type": "hg", "g": 0.4},
        **more,
    }


def grid():
    import mitsuba as mi

    density = np.random.default_rng(3).random((4, 4, 4, 1)).astype(np.float32)
    volume = {"type": "gridvolume", "grid": mi.VolumeGrid(density), "to_world": transform().translate(-1).scale(2)}
    return {"type": "heterogeneous", "albedo": 0.8, "scale": 3.0, "sigma_t": volume}


def fog_room(medium, distance=4.0):
    """A cube of fog with glass in it, over a floor, under a lamp and a sky; from nearer than 1 the eye is inside."""
    import mitsuba as mi

    medium = mi.load_dict(medium)
    sensor = {
        "type": "perspective",
        "fov": 40,
        "to_world": transform().look_at([0, 0, distance], [0, 0, 0], [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
    }
    if distance < 1:
        sensor["medium"] = medium
    floor = transform().translate([0, -1.2, 0]).rotate([1, 0, 0], -90).scale(3)
    lamp = transform().translate([0, 2, 0]).rotate([1, 0, 0], 90).scale(0.7)
    return {
        "type": "scene",
        "sensor": sensor,
        "floor": {
            "type": "rectangle",
            "to_world": floor,
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.7, 0.5, 0.3)},
        },
        "ball": {"type": "sphere", "radius": 0.3, "center": [0.4, -0.3, 0.2], "bsdf": {"type": "dielectric"}},
        "fog": {"type": "cube", "bsdf": {"type": "null"}, "interior": medium},
        "lamp": {"type": "rectangle", "to_world": lamp, "emitter": {"type": "area", "radiance": rgb(8, 8, 6)}},
        "sky": {"type": "constant", "radiance": rgb(0.2, 0.3, 0.5)},
    }


def trace(scene, camera, spp, depth=DEPTH, seed=0):
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.rendering.transport.volume_path import VolumePathIntegrator

    integrator = VolumePathIntegrator(scene, depth)
    plan = cut_wavefronts(SIZE, SIZE, spp, memory=2**31)
    return trace_frame(integrator, CameraRays(camera, SIZE, SIZE), plan, seed=seed).pixels


def camera_of(scene):
    from lippmann.scene.mitsuba_source import MitsubaSource

    return MitsubaSource("fog", scene).cameras()[0]


@pytest.mark.long_cases(but=["homogeneous-0.8"])
@pytest.mark.slow
@pytest.mark.parametrize("distance", [4.0, 0.8])
@pytest.mark.parametrize("medium", [homogeneous, grid])
def test_means_are_those_of_volpath(medium, distance):
    """Of the whole picture and of its four quarters, by Welch's t-test of pictures with different seeds."""
    import mitsuba as mi

    scene = mi.load_dict(fog_room(medium(), distance))
    camera, volpath = camera_of(scene), mi.load_dict({"type": "volpath", "max_depth": DEPTH + 1})
    ours = np.array([trace(scene, camera, 128, seed=seed) for seed in range(SEEDS)])
    theirs = np.array(
        [np.array(mi.render(scene, integrator=volpath, spp=256, seed=100 + seed)) for seed in range(SEEDS)]
    )

    def quarters(pictures):
        half = SIZE // 2
        return pictures.reshape(SEEDS, 2, half, 2, half, 3).mean(axis=(2, 4)).reshape(SEEDS, -1)

    a, b = quarters(ours), quarters(theirs)
    error = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / SEEDS)
    assert (abs(a.mean(axis=0) - b.mean(axis=0)) < 4.5 * error).all()
    assert (error < 0.03 * b.mean(axis=0)).all()  # the test can tell


@pytest.mark.slow
def test_light_through_a_slab_decays_by_beer_and_lambert():
    import mitsuba as mi

    slab = transform().scale([3, 3, 0.5])
    medium = homogeneous(albedo=0.0, scale=1.5)
    parts = fog_room(homogeneous()) | {
        "fog": {"type": "cube", "to_world": slab, "interior": medium, "bsdf": {"type": "null"}}
    }
    scene = mi.load_dict({name: parts[name] for name in ("type", "sensor", "fog", "sky")})
    pixels = trace(scene, camera_of(scene), 1024)
    middle = pixels[SIZE // 2 - 1 : SIZE // 2 + 1, SIZE // 2 - 1 : SIZE // 2 + 1].mean(axis=(0, 1))
    assert middle == pytest.approx(np.array([0.2, 0.3, 0.5]) * np.exp(-1.5 * np.array([0.25, 0.5, 1.0])), rel=0.02)


@pytest.mark.slow
def test_a_white_medium_in_white_light_cannot_be_seen():
    import mitsuba as mi

    parts = fog_room(homogeneous(albedo=1.0))
    scene = mi.load_dict({name: parts[name] for name in ("type", "sensor", "fog", "sky")})
    pixels = trace(scene, camera_of(scene), 256, depth=200)
    assert pixels.mean(axis=(0, 1)) == pytest.approx(np.array([0.2, 0.3, 0.5]), rel=0.01)


@pytest.mark.slow
def test_fog_around_everything_reaches_the_eye():
    """A sensor's medium that no shape holds surrounds the scene."""
    import mitsuba as mi

    thin = homogeneous(albedo=0.0, scale=0.1)
    lamp = {"type": "rectangle", "to_world": transform().scale(9), "emitter": {"type": "area", "radiance": 1.0}}
    sensor = fog_room(homogeneous())["sensor"] | {"medium": thin}
    scene = mi.load_dict({"type": "scene", "sensor": sensor, "lamp": lamp})
    middle = trace(scene, camera_of(scene), 1024)[SIZE // 2 - 1 : SIZE // 2 + 1, SIZE // 2 - 1 : SIZE // 2 + 1]
    assert middle.mean(axis=(0, 1)) == pytest.approx(np.exp(-0.4 * np.array([0.25, 0.5, 1.0])), rel=0.02)


def test_the_radiance_of_fog_depends_on_the_view():
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream
    from lippmann.rendering.transport.volume_path import VolumePathIntegrator

    scene = mi.load_dict(fog_room(homogeneous()))
    origin = mi.Point3f([0.0, 0.0, 2.5], [0.0, 0.0, 0.0], [0.8, 2.0, -1.1])  # inside; before; over the floor
    ray = mi.Ray3f(origin, mi.Vector3f([0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [-1.0, -1.0, 0.0]))
    stream = SampleStream.of_pixels(mi.UInt32([0, 1, 2]), mi.UInt32(0), mi.UInt32(0))
    _, _, hit = VolumePathIntegrator(scene, DEPTH).sample_with_hit(ray, stream, mi.Bool(True))
    assert np.array(hit.view_dependent).tolist() == [True, True, False]
    assert np.array(hit.distance)[1:] == pytest.approx([1.0, 1.2], rel=1e-3)


class TestPictures:
    """Scenes with media from a dictionary to a display's pixels."""

    display = Display("small", Panel(36, 24, 0.25), LensArray("lenticular", 0.75), 6.8, aperture_distance=20.0)

    @pytest.fixture(autouse=True)
    def _started(self):
        """Media are made before the scene is loaded: for the device that a picture takes by itself."""
        start()

    @pytest.mark.slow
    def test_are_told_of(self):
        image = lippmann.render(fog_room(homogeneous()), self.display, spp=2)
        assert any("participating media" in note for note in image.provenance.notes)
        assert image.pixels.mean() > 0.05

    @pytest.mark.slow
    def test_seek_a_quality_denoised_but_not_pooled(self):
        image = lippmann.render(fog_room(homogeneous()), self.display, quality_worst=15.0)
        assert image.provenance.method == "full"
        assert image.provenance.options["denoise"] == "oidn"

    @pytest.mark.parametrize("method", ["pooled", "lens-view", "interpolated"])
    def test_share_no_light(self, method):
        with pytest.raises(UsageError, match="participating media"):
            lippmann.render(fog_room(homogeneous()), self.display, spp=2, method=method)

    def test_show_media_of_instances(self):
        from lippmann.device.pbr.media import has_media

        fog = {"type": "shapegroup", "fog": fog_room(homogeneous())["fog"]}
        clear = {"type": "shapegroup", "medium": {"type": "sphere"}}
        copy = {"type": "instance", "group": {"type": "ref", "id": "group"}}
        for group, expected in ((fog, True), (clear, False)):
            parts = {"type": "scene", "group": group, "copy": copy}
            assert has_media(lippmann.load_scene(parts).description.scene()) is expected

    @pytest.mark.slow
    def test_what_has_no_media_has_the_integrator_for_surfaces(self):
        """So that its pictures stay the same to the last bit."""
        from lippmann.rendering.request.plan import resolve
        from lippmann.rendering.session import open_session
        from lippmann.rendering.transport.path import PathIntegrator
        from lippmann.rendering.transport.ray_source import DisplayRays
        from lippmann.rendering.transport.volume_path import VolumePathIntegrator

        parts = fog_room(homogeneous())
        clear = {name: part for name, part in parts.items() if name != "fog"}
        for room, kind in ((clear, PathIntegrator), (parts, VolumePathIntegrator)):
            scene = lippmann.load_scene(room)
            session = open_session(scene, resolve(lippmann.RenderRequest(), scene, self.display))
            integrator = session.integrator(DisplayRays(self.display, np.eye(4)), np.eye(4))
            assert type(integrator) is kind
