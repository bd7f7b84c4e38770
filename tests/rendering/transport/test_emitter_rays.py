"""Rays from emitters carry the emitters' power to the points that they meet."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def rgb(*values):
    return {"type": "rgb", "value": list(values) if len(values) > 1 else values[0]}


def diffuse(albedo):
    return {"type": "diffuse", "reflectance": rgb(albedo)}


def rays_of(scene):
    import mitsuba as mi

    from lippmann.rendering.transport.emitter_rays import EmitterRays
    from lippmann.rendering.transport.light_sampling import SceneLightSampler

    loaded = mi.load_dict({"type": "scene", **scene})
    return EmitterRays(loaded, SceneLightSampler(loaded))


def test_points_scatter_the_power_that_emitters_send():
    intensity, albedo = 3.0, 0.4
    ball = {"type": "sphere", "radius": 2.0, "flip_normals": True, "bsdf": diffuse(albedo)}
    small = {"type": "sphere", "radius": 0.2, "center": [1, 0, 0], "emitter": {"type": "area", "radiance": rgb(7.0)}}
    rays = rays_of({"ball": ball, "small": small, "light": {"type": "point", "intensity": rgb(intensity)}})
    assert len(rays.senders) == 2
    count = 1 << 14
    points, met = rays.meet(np.arange(count) % 2, np.array([0.5, 0.5]), 3)
    # The flux of a radiance L from an area A is pi A L; some from the point is in the way of the small ball.
    sent = 4 * math.pi * intensity + math.pi * 4 * math.pi * 0.2**2 * 7.0
    blocked = 4 * math.pi * intensity * (1 - math.sqrt(1 - 0.2**2)) / 2
    assert met.mean() > 0.98
    assert points.glow.sum(axis=0) * math.pi / count == pytest.approx(albedo * (sent - blocked), rel=0.01)


def test_surfaces_that_reflect_on_one_side_are_dark_on_the_other():
    """A plate below a light: seen from its front it scatters, from its back it does not, a painted one on both."""
    import mitsuba as mi

    light = {"type": "point", "position": [0, 0, 1], "intensity": rgb(1.0)}
    count = 4096
    met = []
    for turn, paint in ((0, diffuse(0.5)), (180, diffuse(0.5)), (180, {"type": "twosided", "bsdf": diffuse(0.5)})):
        pose = mi.ScalarTransform4f().rotate([1, 0, 0], turn).scale(3)
        plate = {"type": "rectangle", "to_world": pose, "bsdf": paint}
        points, hit = rays_of({"plate": plate, "light": light}).meet(np.zeros(count, int), np.ones(1), 5)
        met.append(hit.mean())
        np.testing.assert_array_equal(points.normal[:, 2], 1)
        np.testing.assert_array_equal(points.scattered, 0)
        assert points.sampled == pytest.approx(np.ones(len(points)))
    assert met[0] == met[2] > 0.3
    assert met[1] == 0


def test_the_sky_and_directional_emitters_send_none():
    sun = {"type": "directional", "direction": [0, -1, -1], "irradiance": rgb(1)}
    ball = {"type": "sphere", "emitter": {"type": "area"}}
    assert rays_of({"sky": {"type": "constant"}, "sun": sun, "ball": ball}).senders.tolist() != []
    assert rays_of({"sky": {"type": "constant"}, "sun": sun, "ball": {"type": "sphere"}}).senders.tolist() == []
