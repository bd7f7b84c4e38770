"""Light shared between the views of a quilt: on planes of which all is known, and in a rendered quilt."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.display.view_cone import cone_tangent
from lippmann.errors import UsageError
from lippmann.rendering.film.feature_buffers import Guides
from lippmann.rendering.sharing.cross_view import share_views
from lippmann.rendering.sharing.tuning import TUNING

pytestmark = pytest.mark.usefixtures("engine")

DISPLAY = Display("sheet", Panel(75, 100, 0.3), LensArray("lenticular", 1.9), 3.1, viewing_distance=240.0)
COLUMNS, ROWS, VIEW = 5, 4, (30, 40)


def quilt_rays():
    from lippmann.rendering.transport.ray_source import QuiltRays

    return QuiltRays(DISPLAY, np.eye(4), COLUMNS, ROWS, VIEW)


def seen(z):
    """x and y, ``(H, W)`` each, of the points of the plane at z that the pixels' middles see."""
    import mitsuba as mi

    source = quilt_rays()
    row, column = (mi.UInt32(part.ravel()) for part in np.indices((source.height, source.width)))
    ray = source.rays(column, row, mi.UInt32(0), mi.Point2f(0.5, 0.5))
    origin, direction = (np.array(part).T.reshape(source.height, source.width, 3) for part in (ray.o, ray.d))
    points = origin + direction * ((z - origin[..., 2:]) / direction[..., 2:])
    return points[..., 0], points[..., 1]


def plane(z, albedo=1.0):
    shape = (ROWS * VIEW[1], COLUMNS * VIEW[0])
    normal = np.zeros((*shape, 3), dtype=np.float32)
    normal[..., 2] = 1
    return Guides(np.full((*shape, 3), albedo, np.float32), normal, np.full(shape, z, np.float32))


def shared(pixels, guides):
    return share_views(np.asarray(pixels, np.float32), quilt_rays(), guides)


def gray(values):
    return np.repeat(np.asarray(values, np.float32)[..., None], 3, axis=2)


@pytest.mark.slow
@given(z=st.floats(-60, 60))
@settings(max_examples=15, deadline=None)
def test_views_meet_at_the_same_point(z):
    x, y = seen(z)
    light = gray(1 + 0.5 * np.sin(0.7 * x) + 0.2 * np.cos(y))
    # Places are rounded to pixels, so that the sine is off by half a pixel's step at most; other rows never mix.
    pixel = DISPLAY.size_mm[0] / VIEW[0] * (1 - z / DISPLAY.viewing_distance)
    assert np.abs(shared(light, plane(z)) - light).max() <= 0.5 * 0.7 * 0.5 * pixel * 1.01


def test_noise_goes_down_as_weights_say():
    noise = np.random.default_rng(1).normal(size=(ROWS * VIEW[1], COLUMNS * VIEW[0], 3)) * 0.1
    result = shared(1 + noise, plane(0.0)) - 1
    reach = int(TUNING.view_reach / (2 * cone_tangent(DISPLAY) / (COLUMNS * ROWS)))
    assert reach == 2
    weights = 1 - np.abs(np.arange(-reach, reach + 1)) / (reach + 1)
    # In the lens plane pixels meet exactly; view 10 has all its neighbours.
    right, top = 10 % COLUMNS * VIEW[0], (ROWS - 1 - 10 // COLUMNS) * VIEW[1]
    middle = result[top : top + VIEW[1], right : right + VIEW[0]]
    assert middle.std() == pytest.approx(0.1 * np.sqrt(np.square(weights).sum()) / weights.sum(), rel=0.05)


def test_textures_stay_where_they_are():
    guides = plane(-20.0)
    albedo = np.random.default_rng(2).uniform(0.1, 0.9, guides.albedo.shape).astype(np.float32)
    light = 0.8 * (albedo + 0.02)
    np.testing.assert_allclose(shared(light, Guides(albedo, guides.normal, guides.height)), light, rtol=1e-5)


@pytest.mark.parametrize("what", ["height", "normal"])
def test_other_surfaces_share_nothing(what):
    rng = np.random.default_rng(3)
    guides = plane(0.0)
    pixels = rng.uniform(0, 1, guides.albedo.shape).astype(np.float32)
    # Every view has a surface of its own.
    column, row = np.arange(COLUMNS * VIEW[0]) // VIEW[0], np.arange(ROWS * VIEW[1])[:, None] // VIEW[1]
    view = (ROWS - 1 - row) * COLUMNS + column
    if what == "height":
        guides = Guides(guides.albedo, guides.normal, (view % 12 * 10 - 60).astype(np.float32))
    else:
        angle = 0.6 * (view % 10)
        guides = Guides(
            guides.albedo,
            np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=-1).astype(np.float32),
            guides.height,
        )
    np.testing.assert_allclose(shared(pixels, guides), pixels, rtol=1e-5)


def quilt(**options):
    made = lippmann.render_quilt(
        "teapot",
        "portrait",
        size=(384, 384),
        integrator="direct",
        tone_map="none",
        **{"seed": 5, "denoise": "oidn-fast", **options},
    )
    return made.pixels, made.provenance


@pytest.mark.long
def test_a_pooled_quilt_is_nearer_to_the_truth_and_knows_it():
    truth, _ = quilt(spp=64, seed=9, method="full", denoise="none")
    (plain, _), (pooled, told) = quilt(spp=4, method="full"), quilt(spp=4, method="pooled")
    error, pooled_error = (np.square(np.clip(found, 0, 1) - truth.clip(0, 1)).mean() for found in (plain, pooled))
    assert pooled_error < 0.8 * error
    assert told.method == "pooled"
    assert told.estimate is not None


def test_what_views_cannot_do_is_refused():
    with pytest.raises(UsageError, match="is not possible in a quilt"):
        quilt(spp=4, method="lens-view")
