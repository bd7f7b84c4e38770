"""Reuse under straight lenticular lenses, in a world of flat things and on the bundled scenes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel

pytestmark = pytest.mark.usefixtures("engine")

GAP = 4.0


def display_of(lenses, height=24, pitch=8.0, viewing_distance=float("inf")):
    panel = Panel(round(lenses * 8), height, 1.0)
    return Display("t", panel, LensArray("lenticular", pitch), GAP, "", viewing_distance, 60.0)


def soft(x, y):
    waves = [0.5 + 0.3 * np.sin(x / 90 + phase) * np.cos(y / 80 - phase) for phase in (0.0, 1.0, 2.0)]
    return np.stack(waves, axis=-1)


def checks(x, y):
    return np.where(((np.floor(x / 45) + np.floor(y / 9)) % 2 == 0)[..., None], (0.9, 0.8, 0.7), (0.1, 0.2, 0.1))


def rules(careful=True, **others):
    from lippmann.rendering.reprojection.rules import Rules

    if careful:
        return Rules(True, 0.06, False, probe_rows=4, probe_stride=16, run_step=3)._replace(**others)
    return Rules(False, 0.12, False, probe_rows=8, probe_stride=32, run_step=4)._replace(**others)


def make(display, tracer, the_rules, method="lens_view", threads=1):
    from lippmann.rendering.reprojection.default_order import DefaultOrder
    from lippmann.rendering.reprojection.point_image import PointImage
    from lippmann.runtime.row_threads import Bands

    points = PointImage.empty(display.panel.height, display.panel.width)
    renderer = DefaultOrder(display, points, tracer, Bands(threads), the_rules)
    getattr(renderer, method)()
    if the_rules.careful:
        renderer.correct()
    assert len(tracer.traced) == len(np.unique(tracer.traced))
    return points


def error(points, full):
    return np.abs(points.color - full.color).max(axis=-1)


# The fixtures are classes: nothing is carried from example to example.
@pytest.mark.long
@settings(
    deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(
    st.floats(-60, 55).filter(lambda z: abs(z) > 9),
    st.sampled_from([(8, 8.0, float("inf")), (21, 7.7, 500.0), (9, 8.3, 300.0)]),
    st.sampled_from(["lens_view", "interpolated"]),
)
def test_a_soft_plane_at_any_height_is_nearly_exact(flat_tracer, sheet, z, shape, method):
    lenses, pitch, distance = shape
    display = display_of(lenses, 12, pitch, distance)
    tracer = flat_tracer(display, [sheet(z, soft)])
    points = make(display, tracer, rules(), method)
    assert np.all(points.status >= 0)
    assert error(points, tracer.full()).max() < 0.01
    assert np.allclose(points.disparity, GAP / z, rtol=1e-3)
    assert points.share(0) < 0.75


@pytest.mark.slow
def test_a_plane_far_behind_costs_few_rays(flat_tracer, sheet):
    display = display_of(32, 32)
    tracer = flat_tracer(display, [sheet(-200.0, lambda x, y: soft(x / 16, y))])
    points = make(display, tracer, rules(careful=False, probe_rows=16))
    assert error(points, tracer.full()).max() < 0.04
    assert points.share(0) < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("method", ["lens_view", "interpolated"])
@pytest.mark.parametrize("careful", [False, True])
def test_every_pixel_gets_a_color_and_traced_ones_are_true(flat_tracer, sheet, method, careful):
    display = display_of(16, 40)
    things = [
        sheet(-40.0, checks),
        sheet(15.0, soft, lambda x, y: (x - 10) ** 2 + y**2 < 144),
        sheet(-14.0, soft, lambda x, y: (x + 25) ** 2 + (y - 5) ** 2 < 90, mirror=True),
    ]
    tracer = flat_tracer(display, things)
    full = tracer.full()
    points = make(display, tracer, rules(careful), method)
    assert set(np.unique(points.status)) <= {0, 1, 2}
    assert method == "interpolated" or 2 not in points.status
    traced = points.status == 0
    assert np.array_equal(points.color[traced], full.color[traced])
    assert np.array_equal(np.sort(tracer.traced), np.flatnonzero(traced))
    if careful:
        assert np.mean(error(points, full) > 0.1) < 0.004
    assert np.mean(error(points, full) > 0.1) < 0.5


@pytest.mark.parametrize("method", ["lens_view", "interpolated"])
@pytest.mark.parametrize("careful", [False, True])
def test_threads_do_not_matter(flat_tracer, sheet, method, careful):
    display = display_of(12, 80)
    things = [sheet(-40.0, checks), sheet(15.0, soft, lambda x, y: (x - 10) ** 2 + y**2 < 144)]
    made = [make(display, flat_tracer(display, things), rules(careful), method, threads) for threads in (1, 2, 3)]
    for other in made[1:]:
        for one, two in zip(made[0], other, strict=True):
            assert np.array_equal(one, two)


def test_care_keeps_mirrors_and_a_thin_thing_that_one_key_lens_shows(flat_tracer, sheet):
    display = display_of(16, 64)
    mirror = sheet(-12.0, lambda x, y: np.stack([0.5 + 0.4 * np.sin(30 * x)] * 3, -1), lambda x, y: y < 0, mirror=True)
    twigs = [
        sheet(-1.0, soft, lambda x, y, b=b: (np.abs(x + 61) < 4) & (np.abs(y - b) < 0.5)) for b in (8.5, 12.5, 16.5)
    ]
    tracer = flat_tracer(display, [mirror, *twigs])
    wrong = error(make(display, tracer, rules()), tracer.full()) > 0.1
    lens = wrong.reshape(64, 16, 8).sum(axis=(0, 2))
    assert lens.max() <= 4  # of 512


def test_the_last_of_an_even_number_of_lenses_takes_its_left_neighbour(flat_tracer, sheet):
    display = display_of(6, 16)
    tracer = flat_tracer(display, [sheet(-6.0, soft)])
    points = make(display, tracer, rules(careful=False), "interpolated")
    row, column = np.nonzero(points.status == 2)
    assert set(column // 8) <= {1, 3, 5}
    last = column >= 40
    assert last.any()
    assert np.array_equal(points.color[row[last], column[last]], points.color[row[last], column[last] - 8])
    mean = 0.5 * (points.color[row[~last], column[~last] - 8] + points.color[row[~last], column[~last] + 8])
    assert np.allclose(points.color[row[~last], column[~last]], mean, atol=1e-6)


@pytest.mark.parametrize(("width", "lenses"), [(8, 1), (13, 1), (17, 2), (40, 5)])
@pytest.mark.parametrize("method", ["lens_view", "interpolated"])
def test_panels_of_few_lenses(flat_tracer, sheet, width, lenses, method):
    display = Display("s", Panel(width, 5, 1.0), LensArray("lenticular", 8.0), GAP, aperture_distance=60.0)
    for careful in (False, True):
        tracer = flat_tracer(display, [sheet(-20.0, checks)])
        points = make(display, tracer, rules(careful), method)
        assert np.all(points.status >= 0)
        assert np.isfinite(points.color).all()
