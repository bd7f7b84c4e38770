"""Rays on the device are those of the display's own formulas, evaluated in NumPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import list_displays, load_display
from lippmann.display.lens_profile import LensProfile

pytestmark = pytest.mark.usefixtures("engine")

TURN = np.array([[0.0, -2.0, 0.0, 5.0], [2.0, 0.0, 0.0, -7.0], [0.0, 0.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0]])

#: Micro-lenses that fill their hexagons, and round ones.
HEXAGONAL = replace(load_display("mla-hexagonal"), name="mla-hexagons", lens=LensProfile(6.0, 9.0))
ROUND = replace(HEXAGONAL, name="mla-discs", lens=LensProfile(6.0, 9.0, diameter=0.9 * HEXAGONAL.lens_array.pitch))


@pytest.mark.long_cases(
    but=[
        "looking-glass-portrait-True",
        "mla-discs-False",
        "mla-hexagonal-True",
        "mla-hexagons-False",
        "mla-square-True",
        "print-60lpi-True",
        "seed-lenticular-True",
    ]
)
@pytest.mark.slow
@pytest.mark.parametrize("subpixels", [False, True])
@pytest.mark.parametrize("display", [*list_displays(), HEXAGONAL, ROUND], ids=lambda display: display.name)
def test_device_rays_equal_numpy_rays(display, subpixels):
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.ray_source import DisplayRays

    rng = np.random.default_rng(4)
    count = 20_000
    column = rng.integers(0, display.panel.width, count)
    row = rng.integers(0, display.panel.height, count)
    channel = rng.integers(0, 3, count)
    jitter = rng.random((2, count)).astype(np.float32)
    source = DisplayRays(display, TURN, subpixels)
    ray = source.rays(mi.UInt32(column), mi.UInt32(row), mi.UInt32(channel), mi.Point2f(jitter))
    dr.eval(ray.o, ray.d)  # by one kernel

    u, v = column + (0.5 if display.stereo else jitter[0].astype(float)), row + jitter[1].astype(float)
    if subpixels:
        u = column + 0.5 + (jitter[0].astype(float) - 0.5) / 3
        x, y = display.subpixel_point(u, v, channel)
    else:
        x, y = display.panel_point(u, v)
    origin, direction = (np.array(part) for part in display.light_ray(x, y))
    for axis, aside in enumerate(display.aperture_point(*jitter.astype(float))):
        origin[axis] += aside
    expected_o = TURN[:3, :3] @ origin + TURN[:3, 3:]
    expected_d = TURN[:3, :3] @ direction / 2
    scale = np.abs(expected_o).max()
    np.testing.assert_allclose(np.array(ray.o), expected_o, rtol=0, atol=scale * 2e-7)
    np.testing.assert_allclose(np.array(ray.d), expected_d, rtol=0, atol=2e-7)
    np.testing.assert_allclose(np.linalg.norm(np.array(ray.d), axis=0), 1, rtol=0, atol=1e-6)


def test_camera_rays_look_down_their_own_axis():
    import mitsuba as mi

    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    pose = np.eye(4)
    pose[:3, 3] = (1, 2, 3)
    corners = (mi.UInt32([0, 0, 3, 3]), mi.UInt32([0, 1, 0, 1]), None, mi.Point2f([0, 0, 1, 1], [0, 1, 0, 1]))
    wide = CameraRays(Camera("wide", pose, fov_y=np.pi / 2), 4, 2).rays(*corners)
    slopes = np.array(wide.d)[:2] / -np.array(wide.d)[2]
    assert slopes == pytest.approx(np.array([[-2, -2, 2, 2], [1, -1, 1, -1]]), abs=1e-6)
    assert np.array(wide.o) == pytest.approx(np.array([[1, 2, 3]] * 4).T)
    flat = CameraRays(Camera("flat", pose, height=6.0), 4, 2).rays(*corners)
    assert np.array(flat.o) == pytest.approx(np.array([[-5, -5, 7, 7], [5, -1, 5, -1], [3, 3, 3, 3]]))
    assert np.array(flat.d) == pytest.approx(np.array([[0, 0, -1]] * 4).T)
