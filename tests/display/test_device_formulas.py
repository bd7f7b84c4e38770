"""The display's formulas give the same on the renderer's arrays as on NumPy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import list_displays


@pytest.fixture(scope="module")
def device(engine):
    """Double-precision device arrays: their type, their operations, and displays of such numbers."""
    import mitsuba as mi

    from lippmann.device.kernel_ops import DEVICE, upload_display

    return mi.Float64, DEVICE, upload_display


def assert_same_on_device(display, device, seed):
    import drjit as dr

    real, ops, upload = device
    rng = np.random.default_rng(seed)
    width, height = display.panel.width, display.panel.height
    # Random points, pixel centres and pixel corners: ties must be decided alike.
    columns, rows = rng.integers(0, width, 500), rng.integers(0, height, 500)
    u = np.concatenate([rng.uniform(0, width, 500), columns + 0.5, columns])
    v = np.concatenate([rng.uniform(0, height, 500), rows + 0.5, rows])
    c = rng.integers(0, 3, len(u)).astype(float)
    point, z = rng.uniform(-5, 5, (2, len(u))), rng.uniform(-60, -0.1, len(u))

    def evaluate(display, number, *ops):
        x, y = display.panel_point(number(u), number(v))
        lens = display.lens_of(x, y, *ops)
        ray = display.light_ray(x, y, *ops)
        projected = display.project(number(point[0]), number(point[1]), number(z), *lens, *ops)
        seen = display.visible_panel_point(number(point[0]), number(point[1]), number(300 - z), x, y, *ops)
        return [
            *lens,
            *(x, y, *ray[0], *ray[1], *projected, *seen),
            *display.subpixel_point(number(u), number(v), number(c), *ops),
            *display.pixel_coordinates(x, y),
        ]

    here, there = evaluate(display, np.asarray), evaluate(upload(display), real, ops)
    assert all(type(array) is real for array in there)
    dr.eval(there)  # by one kernel, not one for each
    there = [np.broadcast_to(array.numpy(), u.shape) for array in there]
    np.testing.assert_array_equal(there[:2], here[:2])
    np.testing.assert_allclose(there[2:], here[2:], rtol=1e-12, atol=1e-11)


@pytest.mark.slow
def test_presets_on_the_device(device):
    for display in list_displays():
        assert_same_on_device(display, device, seed=1)


@pytest.mark.slow
@given(data=st.data(), seed=st.integers(0, 1000))
@settings(deadline=None, max_examples=15)
def test_random_displays_on_the_device(displays, device, data, seed):
    assert_same_on_device(data.draw(displays()), device, seed)
