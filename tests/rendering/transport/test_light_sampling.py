"""How often lamps are drawn: by what they shed on the picture, and without a change of what it shows."""

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


def drawn(scene):
    return [float(emitter.sampling_weight()) for emitter in scene.emitters()]


@pytest.mark.parametrize("order", [("sky", "lamp", "spark"), ("spark", "sky", "lamp"), ("lamp", "spark", "sky")])
def test_lamps_are_drawn_by_what_they_shed(order):
    from lippmann.rendering.transport.light_sampling import EVEN_SHARE, weigh_lamps

    integrator, source = stage(room(order))
    weights = weigh_lamps(integrator, source)
    assert drawn(integrator.scene) == pytest.approx(weights)
    by_name = dict(zip(order, weights, strict=True))
    assert weights.sum() == pytest.approx(1)
    assert by_name["sky"] == pytest.approx(EVEN_SHARE / 3)
    assert by_name["lamp"] > 3 * by_name["spark"] > 3 * by_name["sky"]


def test_lamps_of_a_scene_with_another_sky_are_told_apart():
    """The new sky comes first among a scene's objects."""
    import mitsuba as mi

    from lippmann.rendering.transport.light_sampling import EVEN_SHARE, weigh_lamps
    from lippmann.scene.mitsuba_source import with_sky

    sky = mi.load_dict({"type": "constant", "radiance": 3.0})
    integrator, source = stage(with_sky(mi.load_dict(room(("lamp", "spark"))), sky))
    weights = weigh_lamps(integrator, source)
    assert drawn(integrator.scene) == pytest.approx(weights)
    unseen = [number for number, emitter in enumerate(integrator.scene.emitters()) if emitter.is_environment()]
    assert weights[unseen] == pytest.approx(EVEN_SHARE / 3)


def test_weights_depend_on_nothing_that_was_before():
    from lippmann.rendering.transport.light_sampling import weigh_lamps

    integrator, source = stage(room())
    first = weigh_lamps(integrator, source)
    assert np.array_equal(weigh_lamps(integrator, source), first)


def test_the_picture_stays_and_its_noise_falls():
    from lippmann.rendering.transport.light_sampling import weigh_lamps

    integrator, source = stage(room())
    runs, samples = 12, 16
    even = np.stack([picture(integrator, source, samples, seed) for seed in range(runs)])
    weigh_lamps(integrator, source)
    weighed = np.stack([picture(integrator, source, samples, 100 + seed) for seed in range(runs)])
    assert weighed.var(axis=0, ddof=1).mean() < 0.5 * even.var(axis=0, ddof=1).mean()
    blocks = [x.reshape(runs, 4, 6, 4, 6, 3).mean(axis=(2, 4)) for x in (even, weighed)]
    spread = np.sqrt(sum(b.var(axis=0, ddof=1) / runs for b in blocks)) + 1e-4
    assert np.abs((blocks[0].mean(0) - blocks[1].mean(0)) / spread).max() < 6
    assert weighed.mean() == pytest.approx(even.mean(), rel=0.01)


def test_lamps_that_nobody_sees_are_drawn_alike():
    """A camera that sees no surface tells nothing."""
    from lippmann.rendering.transport.light_sampling import weigh_lamps
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    scene = room()
    del scene["walls"]
    integrator, _ = stage(scene, depth=1)
    pose = np.diag([-1.0, 1.0, -1.0, 1.0])  # looks away from the lamps
    pose[2, 3] = 5.0
    source = CameraRays(Camera("away", pose, fov_y=0.5), SIZE, SIZE)
    assert weigh_lamps(integrator, source) == pytest.approx(np.full(3, 1 / 3))


def test_paths_without_a_value_do_not_count(monkeypatch):
    from lippmann.rendering.transport import light_sampling as lamps

    integrator, source = stage(room())
    whole = lamps.weigh_lamps(integrator, source)
    along = lamps._squares_along

    def some_lost(*given):
        import drjit as dr
        import mitsuba as mi

        found = along(*given)
        return dr.select(dr.arange(mi.UInt32, dr.width(found)) % 64 == 0, dr.nan, found)

    monkeypatch.setattr(lamps, "_squares_along", some_lost)
    assert lamps.weigh_lamps(integrator, source) == pytest.approx(whole, rel=0.05)


def test_one_lamp_or_very_many_are_left_alone(monkeypatch):
    from lippmann.rendering.transport import light_sampling as lamps

    integrator, source = stage(room(("lamp",)))
    assert lamps.weigh_lamps(integrator, source).tolist() == [1.0]
    monkeypatch.setattr(lamps, "MOST_LAMPS", 2)
    integrator, source = stage(room())
    assert lamps.weigh_lamps(integrator, source) == pytest.approx(np.full(3, 1 / 3))
    assert drawn(integrator.scene) == [1.0, 1.0, 1.0]


def test_the_callers_own_scene_is_not_changed(cut_display):
    """Whoever hands over a loaded scene finds it as it was."""
    import mitsuba as mi

    import lippmann

    own = mi.load_dict(room())
    before = drawn(own)
    display = lippmann.load_display(cut_display(32, 16))
    lippmann.render(lippmann.load_scene(own), display, method="full", spp=1)
    assert drawn(own) == before
    described = lippmann.load_scene(room())
    lippmann.render(described, display, method="full", spp=1)
    assert drawn(described.physical.scene()) != before
