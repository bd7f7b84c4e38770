"""What the blur of caustics adds to the error, against blur that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.display.panel import PixelWindow

pytestmark = pytest.mark.usefixtures("engine")

SIZE = 32
WHOLE = PixelWindow(0, 0, SIZE, SIZE)


class PlaneOfPhotons:
    """Stands in for photons of passes: spread over what pixels gather from, as dense as ``light`` says there."""

    #: From the middle of the plane; pixels see 0.5 of it, and gather from 0.2 farther away.
    EXTENT = 0.8

    def __init__(self, light, radius, count=64_000):
        self._light, self._radius, self._count = light, radius, count
        self.pass_samples = 8

    def of_pass(self, number):
        from lippmann.rendering.transport.caustic_photons import shrink_radius
        from lippmann.rendering.transport.photon_map import PhotonMap, Photons

        halves = []
        for seed in (2 * number, 2 * number + 1):
            random = np.random.default_rng(seed)
            places = random.uniform(-self.EXTENT, self.EXTENT, (2, self._count))
            position = np.float32(np.stack([*places, np.zeros(self._count)], axis=1))
            up = np.tile(np.float32([0, 0, 1]), (self._count, 1))
            each = self._light(position[:, :1]) * (2 * self.EXTENT) ** 2 / self._count
            power = np.repeat(each, 3, axis=1).astype(np.float32)
            halves.append(Photons(position, up, up, power, np.ones(self._count, np.uint32)))
        return PhotonMap((halves[0], halves[1]), self._radius * shrink_radius(number))


def matt_plane(passes):
    """An integrator before a white plane, seen from z = 5; pixels cover x and y from -0.5 to 0.5."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    plane = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().scale(3),
        "bsdf": {"type": "diffuse", "reflectance": 1.0},
    }
    scene = mi.load_dict({"type": "scene", "plane": plane})
    integrator = PathIntegrator(scene, make_scene_features(scene, has_null=False), 2)
    if passes is not None:
        integrator = integrator.lit_by(replace(integrator.light, photons=passes.of_pass(0), photon_passes=passes))
    pose = np.eye(4)
    pose[2, 3] = 5.0
    return integrator, CameraRays(Camera("test", pose, height=1.0), SIZE, SIZE)


def blur_of(light, radius, *, samples=8, window=WHOLE, seed=3):
    from lippmann.rendering.film.caustic_blur import SquaredBlur

    integrator, source = matt_plane(PlaneOfPhotons(light, radius))
    return SquaredBlur(integrator, integrator.light.photon_passes, source, window, seed).after(samples)


def test_pictures_without_photons_have_none():
    from lippmann.rendering.film.sample_batches import BatchedRender

    assert BatchedRender(*matt_plane(None), memory=1 << 30).squared_blur() is None


@pytest.mark.long
def test_smooth_light_is_held_for_three_times_as_blurred_as_it_is():
    """A parabola's: the second moment of the kernel is a sixth of the squared radius."""
    radius, bend = 0.2, 5.0
    found = blur_of(lambda x: 1 + bend * x**2, radius).mean()
    bias = bend * radius**2 / 6 / np.pi
    assert found == pytest.approx((3 * bias) ** 2, rel=0.15)


@pytest.mark.slow
def test_an_edge_is_told_to_a_factor():
    radius = 0.1
    found = blur_of(lambda x: np.where(x > 0, 1.0, 0.0), radius).mean()
    place = np.linspace(-1, 1, 20001) * radius
    kernel = 8 / (3 * np.pi) * np.maximum(1 - (place / radius) ** 2, 0) ** 1.5 / radius
    step = place[1] - place[0]
    true = np.square((np.cumsum(kernel) * step - (place > 0)) / np.pi).sum() * step
    assert found == pytest.approx(true / 2.315, rel=0.15)


@pytest.mark.long
def test_pixels_are_the_same_in_parts_and_some_stand_for_all(monkeypatch):
    from lippmann.rendering.film import caustic_blur

    light = lambda x: np.where(x > 0, 1.0, 0.0)  # noqa: E731
    every = blur_of(light, 0.1, samples=8)
    monkeypatch.setattr(caustic_blur, "TUNING", replace(caustic_blur.TUNING, probe_side=round(SIZE / np.sqrt(2))))
    whole = blur_of(light, 0.1, samples=8)
    measured = (whole != 0).any(axis=2)
    assert 0.3 < measured[:, 14:18].mean() < 0.7  # a probe has half as many rays
    assert whole.mean() == pytest.approx(every.mean(), rel=0.3)
    part = PixelWindow(8, 4, 16, 12)
    np.testing.assert_array_equal(blur_of(light, 0.1, samples=8, window=part), whole[part.slices])


@pytest.mark.long
def test_it_is_measured_once_and_follows_the_radii_of_later_passes():
    from lippmann.rendering.film import caustic_blur

    integrator, source = matt_plane(PlaneOfPhotons(lambda x: 1 + 5 * x**2, 0.2))
    blur = caustic_blur.SquaredBlur(integrator, integrator.light.photon_passes, source, WHOLE, 3)
    first = blur.after(8)
    np.testing.assert_allclose(blur.after(16), first * np.square((1 + 5 / 6) / 2), rtol=1e-6)


@pytest.mark.long
def test_the_estimate_of_a_picture_counts_it():
    from lippmann.color.transfer import coding_slope
    from lippmann.rendering.film.sample_batches import BatchedRender

    integrator, source = matt_plane(PlaneOfPhotons(lambda x: np.where(x > 0, 1.0, 0.0), 0.1))
    batches = BatchedRender(integrator, source, seed=3, memory=1 << 28)
    batches.add(8)
    blur = batches.squared_blur()
    errors = batches.squared_error()
    counted = errors.values.copy()
    np.testing.assert_array_equal(errors.blur, blur)
    without = integrator.lit_by(replace(integrator.light, photon_passes=None))
    plain = BatchedRender(without, source, seed=3, memory=1 << 28)
    plain.add(8)
    assert plain.squared_blur() is None
    assert plain.squared_error().blur is None
    np.testing.assert_allclose(counted - plain.squared_error().values, blur, atol=1e-7)
    slope = coding_slope(batches.picture(), "srgb")
    linear = blur_of(lambda x: np.where(x > 0, 1.0, 0.0), 0.1)
    np.testing.assert_allclose(blur, (slope**2 * linear).mean(axis=2), rtol=1e-5)
