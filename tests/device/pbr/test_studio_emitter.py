"""The studio's emitter against Mitsuba's, which looks the same light up in a picture."""

import numpy as np
import pytest

from lippmann.scene.matrices import rotation
from lippmann.scene.studio_light import studio
from lippmann.scene.values.description import Environment

COUNT = 40_000


@pytest.fixture(scope="module")
def emitters(engine):
    """The studio in closed form and as a picture, both turned."""
    del engine
    from lippmann.device.pbr.emitters import environment_object, turn_environment

    light = studio(1.5)
    both = environment_object(light), environment_object(Environment(light.pixels))
    for emitter in both:
        turn_environment(emitter, rotation((30.0, 20.0, 10.0)))
    return both


def directions():
    values = np.random.default_rng(3).normal(size=(3, COUNT))
    return (values / np.linalg.norm(values, axis=0)).astype(np.float32)


def seen(emitter, toward):
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    si = dr.zeros(mi.SurfaceInteraction3f, toward.shape[1])
    si.wi = -mi.Vector3f(*map(upload, toward))
    return np.array(emitter.eval(si))[0]


def sampled(emitter):
    """The emitter's samples about a point, and its pdf for them."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    numbers = np.random.default_rng(4).random((2, COUNT)).astype(np.float32)
    at = dr.zeros(mi.Interaction3f, COUNT)
    at.p = mi.Point3f(0.3, -2, 5)
    ds, weight = emitter.sample_direction(at, mi.Point2f(*map(upload, numbers)))
    return ds, np.array(weight)[0], np.array(emitter.pdf_direction(at, ds))


def test_it_looks_like_its_picture(emitters):
    exact, picture = (seen(emitter, directions()) for emitter in emitters)
    # The picture is coarse: its texels are wider than the edges of the narrow box.
    assert np.abs(exact - picture).mean() < 0.05 * picture.mean()


def test_samples_come_by_their_density(emitters):
    emitter = emitters[0]
    ds, weight, pdf = sampled(emitter)
    np.testing.assert_allclose(np.array(ds.pdf), pdf, rtol=1e-3)
    toward = np.array(ds.d)
    np.testing.assert_allclose(np.linalg.norm(toward, axis=0), 1, atol=1e-5)
    np.testing.assert_allclose(weight * pdf, seen(emitter, toward), rtol=1e-3)
    # Both integrals over the sphere: of one, and of the light. Sampling leaves little noise in either.
    assert (1 / pdf).mean() == pytest.approx(4 * np.pi, rel=0.03)
    even = 4 * np.pi * seen(emitter, directions()).mean()
    assert weight.mean() == pytest.approx(even, rel=0.03)
    assert weight.std() < 0.12 * weight.mean()


def test_samples_lie_beyond_any_scene(emitters):
    ds, _, _ = sampled(emitters[0])
    assert np.array(ds.dist).min() >= 1e9


def test_its_strength_is_a_parameter(emitters):
    import mitsuba as mi

    emitter, toward = emitters[0], directions()
    before = seen(emitter, toward)
    parameters = mi.traverse(emitter)
    for factor in (3.0, 1.0):
        parameters["scale"] = mi.Float(factor)
        parameters.update()
        np.testing.assert_allclose(seen(emitter, toward), factor * before, rtol=1e-5)
