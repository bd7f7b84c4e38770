"""Cells of pooled light: their names, what they are taken to hold, and how they are found again."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def keys_at(points, normals=(0.0, 0.0, 1.0), finest=0.1):
    import mitsuba as mi

    from lippmann.render.pooled.keys import key_of

    points = np.atleast_2d(np.asarray(points, np.float32))
    normals = np.broadcast_to(np.asarray(normals, np.float32), points.shape)
    p, n = (mi.Vector3f(*(mi.Float(np.ascontiguousarray(c)) for c in part.T)) for part in (points, normals))
    return np.array(key_of(p, n, mi.UInt32(1), mi.UInt32(0), mi.Float(finest)))


def filled(points, color, half):
    from lippmann.render.pooled.pool import Pool

    pool = Pool()
    pool.add(keys_at(points), np.ones(len(points), np.float32), color.astype(np.float32), half)
    return pool


def read(table, points):
    import mitsuba as mi

    place, found = table.find(mi.UInt64(keys_at(points)), mi.Bool(True))
    a, _ = table.read(place, True)
    return np.array(a).T, np.array(found)


def test_neighbours_share_all_but_the_last_level():
    from lippmann.render.pooled.keys import LEVELS, SHIFTS

    a, b, c = keys_at([[0.05, 0.05, 0.05], [0.15, 0.05, 0.05], [0.25, 0.05, 0.05]])
    assert a != b
    assert a >> SHIFTS[LEVELS - 1] == b >> SHIFTS[LEVELS - 1]
    assert a >> SHIFTS[LEVELS - 1] != c >> SHIFTS[LEVELS - 1]
    assert a >> SHIFTS[LEVELS - 2] == c >> SHIFTS[LEVELS - 2]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_sides_of_a_surface_have_no_cell_in_common(axis):
    up = np.eye(3)[axis]
    above, below = keys_at([[0, 0, 0]], up)[0], keys_at([[0, 0, 0]], -up)[0]
    assert above >> 32 != below >> 32


def test_axes_lie_in_the_middle_of_their_cells():
    for up in np.eye(3):
        tilted = up + 0.01 * np.roll(up, 1)
        assert keys_at([[0, 0, 0]], up)[0] >> 32 == keys_at([[0, 0, 0]], tilted / np.linalg.norm(tilted))[0] >> 32


def test_even_light_is_shared_by_all():
    random = np.random.default_rng(1)
    points = random.uniform(0, 6, (4000, 3)) * [1, 1, 0]
    color = random.exponential(1.0, (4000, 1)) * np.ones(3)
    table = filled(points, color, random.random(4000) < 0.5).table()
    values, found = read(table, points)
    assert found.all()
    # Single samples scatter by 1; the mean of the halves, some 2000 each, by 0.02.
    assert np.abs(values - 1).mean() < 0.2


def test_a_sharp_edge_stays_sharp():
    random = np.random.default_rng(2)
    points = random.uniform(0, 6.4, (60000, 3)) * [1, 1, 0]
    lit = points[:, :1] < 3.2
    color = lit * random.uniform(0.5, 1.5, (60000, 1)) * np.ones(3)
    table = filled(points, color, random.random(60000) < 0.5).table()
    probes = np.array([[2.9, 1.0, 0.0], [3.5, 1.0, 0.0]])
    values, _ = read(table, probes)
    assert values[0].mean() == pytest.approx(1, abs=0.2)
    assert values[1].mean() < 0.05


def test_what_is_in_no_cell_gets_the_mean_of_all():
    table = filled(np.zeros((8, 3)), np.full((8, 3), 2.0), np.arange(8) % 2 == 1).table()
    values, found = read(table, [[500.0, 0.0, 0.0]])
    assert not found.any()
    np.testing.assert_allclose(values, 2, rtol=1e-6)


def test_pouring_in_parts_is_the_same_as_at_once(monkeypatch):
    monkeypatch.setattr("lippmann.render.pooled.pool.LEAST_BATCH", 1)
    random = np.random.default_rng(3)
    points, color = random.uniform(0, 3, (500, 3)), random.uniform(0, 1, (500, 3)).astype(np.float32)
    half = random.random(500) < 0.5
    whole, parts = filled(points, color, half), filled(points[:100], color[:100], half[:100])
    for at in range(100, 500, 100):
        cut = slice(at, at + 100)
        parts.add(keys_at(points[cut]), np.ones(100, np.float32), color[cut], half[cut])
    for pool in (whole, parts):
        pool.settle()
    np.testing.assert_array_equal(whole.keys, parts.keys)
    np.testing.assert_allclose(whole.sums, parts.sums, rtol=1e-4, atol=1e-6)


def test_giving_up_levels_keeps_all_light():
    from lippmann.render.pooled.pool import Pool

    random = np.random.default_rng(4)
    points = random.uniform(0, 3, (2000, 3))
    pool = Pool(most_cells=200)
    pool.add(keys_at(points), np.ones(2000, np.float32), np.ones((2000, 3), np.float32), random.random(2000) < 0.5)
    pool.settle()
    assert len(pool.keys) <= 200
    assert pool.given_up > 0
    assert pool.sums[:, :, 0].sum() == 2000
    values, found = read(pool.table(), points)
    assert found.all()
    np.testing.assert_allclose(values, 1, rtol=1e-5)


def test_a_single_bright_hit_is_held_back():
    # A path in a thousand that meets a small lamp by chance: its cell would show as a blob under every lens.
    random = np.random.default_rng(3)
    points = random.uniform(0, 6, (40000, 3)) * [1, 1, 0]
    color = np.ones((40000, 3)) + 0.1 * random.standard_normal((40000, 1))
    color[::1000] = 200.0
    values, _ = read(filled(points, color, random.random(40000) < 0.5).table(), points)
    plain = color.mean()
    # By its own mean a cell with a hit, of some 5 samples in each half, would hold 40 or more.
    assert values.max() < 5 * plain


def test_true_differences_are_not_held_back():
    random = np.random.default_rng(4)
    points = random.uniform(0, 6, (40000, 3)) * [1, 1, 0]
    spot = np.hypot(points[:, 0] - 3, points[:, 1] - 3) < 0.5
    color = np.where(spot, 30.0, 1.0)[:, None] * np.ones(3) + 0.1 * random.standard_normal((40000, 1))
    values, _ = read(filled(points, color, random.random(40000) < 0.5).table(), points)
    inside = np.hypot(points[:, 0] - 3, points[:, 1] - 3) < 0.3
    assert values[inside].mean() > 27
