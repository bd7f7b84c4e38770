"""Look-ups of photons against the sum over all of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def scattered(count, seed, *, flat=True):
    """Photons about the plane z = 0 in a square of side 1, some of them elsewhere and from below."""
    from lippmann.rendering.transport.photon_map import Photons

    random = np.random.default_rng(seed)
    position = random.uniform(-0.5, 0.5, (count, 3))
    position[:, 2] *= 0.02 if flat else 1
    toward = random.normal(size=(count, 3))
    toward[:, 2] = np.abs(toward[:, 2])
    toward[: count // 10, 2] *= -1
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    normal = np.tile([0.0, 0.0, 1.0], (count, 1))
    normal[::7] = [0.0, 1.0, 0.0]
    power = random.uniform(0, 2, (count, 3))
    arrays = (np.asarray(each, dtype=np.float32) for each in (position, normal, toward, power))
    return Photons(*arrays, random.integers(1, 5, count).astype(np.uint32))


def gathered(
    photon_map, points, half, surfaces, *, choice=0.5, active=True, normal=(0, 0, 1), by_kernel=True, part=0, **parts
):
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(points))
    si.p = mi.Point3f(np.ascontiguousarray(points.T))
    # Opaque to the compiler as they are in pictures, so that all look-ups share a kernel.
    up = mi.Vector3f(*(dr.opaque(mi.Float, float(along)) for along in normal))
    none, choice = mi.Vector3f(0), mi.Float(np.float32(choice))
    si.n = mi.Normal3f(up)
    si.sh_frame = mi.Frame3f(up)
    si.wi = mi.Vector3f(0, 0, 1)
    half, surfaces, part = (dr.opaque(mi.UInt32, number) for number in (half, surfaces, part))
    by_kernel, active = dr.opaque(mi.Bool, by_kernel), mi.Bool(active)
    return photon_map.gather(si, up, none, half, surfaces, choice, by_kernel, active, part=part, **parts)


def looked_up(photon_map, points, half, surfaces, active=True):
    import drjit as dr
    import mitsuba as mi

    found = gathered(photon_map, points, half, surfaces, active=active).irradiance
    return np.array(found + dr.zeros(mi.Color3f, len(points))).T


def test_one_photon_stands_for_all_in_proportion_to_its_power():
    """The mean over all choices of any function of the direction is its sum over the photons."""
    from lippmann.rendering.transport.photon_map import PhotonMap

    some = scattered(300, 4)
    photon_map = PhotonMap((some, some), 0.4)
    choices = (np.arange(40_000) + 0.5) / 40_000
    points = np.zeros((len(choices), 3), np.float32)
    found = gathered(photon_map, points, 0, 9, choice=choices)
    flux, toward = np.array(found.flux), np.array(found.toward)
    near = np.linalg.norm(some.position, axis=1) < 0.4
    near &= (some.normal[:, 2] > 0.7) & (some.toward[:, 2] > 0) & (np.abs(some.position[:, 2]) < 0.16)
    assert near.sum() > 5
    kernel = 2 / (np.pi * 0.4**2) * (1 - (some.position[near] ** 2).sum(axis=1) / 0.4**2)
    expected = ((some.power[near].T * kernel) * some.toward[near].T[0] ** 2).sum(axis=1)
    np.testing.assert_allclose((flux * toward[0] ** 2).mean(axis=1), expected, rtol=0.02)
    chosen = {tuple(way) for way in np.round(toward.T, 4).tolist()}
    assert chosen == {tuple(way) for way in np.round(some.toward[near], 4).tolist()}


@pytest.mark.slow
def irradiance_of_cell(photons, position, normal, side):
    """The irradiance of :meth:`PhotonMap.gather` at a surface that is not seen, point by point: ``(m, 3)``.

    The plane's area in a cell is that of the polygon of its meetings with the cell's edges.
    """
    from scipy.spatial import ConvexHull

    from lippmann.rendering.transport.photon_map import _LEAST_AREA
    from lippmann.rendering.transport.tuning import TUNING

    found = np.zeros((len(position), 3), np.float32)
    corners = np.array(list(itertools.product((0, 1), repeat=3)), np.float64)
    edges = [(a, b) for a in range(8) for b in range(a) if np.abs(corners[a] - corners[b]).sum() == 1]
    for number, (point, n) in enumerate(zip(position.astype(np.float64), normal.astype(np.float64), strict=True)):
        cell = np.floor(point / side)
        height = ((cell + corners) * side - point) @ n
        meetings = np.array(
            [
                corners[a] + height[a] / (height[a] - height[b]) * (corners[b] - corners[a])
                for a, b in edges
                if height[a] * height[b] < 0
            ]
        )
        flat = np.linalg.svd(n[None])[2][1:]  # two directions in the plane
        area = max(ConvexHull(meetings * side @ flat.T).volume, _LEAST_AREA * side**2)
        fits = (np.floor(photons.position / side) == cell).all(axis=1)
        fits &= (photons.normal @ n > TUNING.least_agreement) & (photons.toward @ n > 0)
        fits &= np.abs((photons.position - point) @ n) < TUNING.farthest_from_plane * side
        found[number] = photons.power[fits].sum(axis=0) / area
    return found


def irradiance_by_all(photons, position, normal, radius, surfaces):
    """The irradiance of :meth:`PhotonMap.gather`, photon by photon: ``(m, 3)`` at ``(m, 3)`` points without a lobe."""
    from lippmann.rendering.transport.tuning import TUNING

    apart = photons.position[None] - position[:, None]
    distance2 = (apart**2).sum(axis=2)
    fits = distance2 < radius**2
    fits &= np.einsum("nk,mk->mn", photons.normal, normal) > TUNING.least_agreement
    fits &= np.einsum("nk,mk->mn", photons.toward, normal) > 0
    fits &= np.abs(np.einsum("mnk,mk->mn", apart, normal)) < TUNING.farthest_from_plane * radius
    fits &= photons.surfaces[None] <= surfaces
    weight = np.where(fits, 1 - distance2 / radius**2, 0)
    return np.asarray(weight @ photons.power * 2 / (np.pi * radius**2), dtype=np.float32)


@pytest.mark.parametrize("radius", [0.004, 0.05, 0.3, 2.0])
@pytest.mark.parametrize("flat", [True, False])
def test_a_look_up_is_the_sum_over_all_photons(radius, flat):
    from lippmann.rendering.transport.photon_map import PhotonMap

    halves = scattered(3000, 1, flat=flat), scattered(500, 2, flat=flat)
    photon_map = PhotonMap(halves, radius)
    random = np.random.default_rng(3)
    points = random.uniform(-0.6, 0.6, (400, 3)).astype(np.float32) * [1, 1, 0.01]
    points = points.astype(np.float32)
    normal = np.tile(np.float32([0, 0, 1]), (400, 1))
    for half, surfaces in ((0, 9), (1, 9), (0, 2), (1, 0)):
        found = looked_up(photon_map, points, half, surfaces)
        expected = irradiance_by_all(halves[half], points, normal, radius, surfaces)
        np.testing.assert_allclose(found, expected, rtol=2e-4, atol=1e-4 * max(1e-9, expected.max()))
    assert (looked_up(photon_map, points, 0, 0) == 0).all()  # each has had one event at least


@pytest.mark.slow
@pytest.mark.parametrize("by_kernel", [True, False])
def test_parts_of_the_photons_have_the_mean_of_all(by_kernel):
    from lippmann.rendering.transport.photon_map import PhotonMap

    halves = scattered(3000, 5), scattered(1000, 6)
    photon_map = PhotonMap(halves, 0.2)
    points = np.float32(np.random.default_rng(7).uniform(-0.5, 0.5, (200, 3)) * [1, 1, 0.01])
    for half in (0, 1):
        whole = np.array(gathered(photon_map, points, half, 9, by_kernel=by_kernel).irradiance)
        parts = np.stack(
            [
                np.array(gathered(photon_map, points, half, 9, by_kernel=by_kernel, part=k, most=8).irradiance)
                for k in range(32)
            ]
        )
        np.testing.assert_allclose(parts.mean(axis=0), whole, rtol=1e-4, atol=1e-5 * whole.max())
        assert (parts.std(axis=0).mean(axis=1) > 0.05 * whole.mean(axis=1)).all()  # each looks at photons of its own


@pytest.mark.parametrize("by_kernel", [True, False])
@pytest.mark.parametrize("count", [7, 1000, 20_000])
def test_a_look_up_meets_few_photons_of_a_cell_however_many_there_are(count, by_kernel):
    """All photons of a focus are alike: what a look-up brings tells how many it has met, and how much each counted."""
    from lippmann.rendering.transport.photon_map import PhotonMap, Photons

    most = 8

    def brought(photons, part):
        at = np.full((photons, 3), 0.5, np.float32)
        up = np.tile(np.float32([0, 0, 1]), (photons, 1))
        focus = Photons(at, up, up, np.ones((photons, 3), np.float32), np.ones(photons, np.uint32))
        found = gathered(PhotonMap((focus, focus), 1.0), at[:1], 0, 9, by_kernel=by_kernel, part=part, most=most)
        return np.array(found.irradiance).item(0)

    of_each = brought(1, 0) * 2 ** max(0, np.ceil(np.log2(count / most)))
    met = np.array([brought(count, part) for part in (0, 1, 77)]) / of_each
    np.testing.assert_allclose(met, np.round(met), rtol=1e-5)
    assert (met >= min(count, most // 2) - 1e-3).all()
    assert (met <= most + 1e-3).all()


def gathered_slowly(photons, points, normal, shading, wi, lobe, radius):
    """``(m, 3)`` irradiance, photon by photon, on surfaces shaded by another normal, with a narrow lobe about it.

    The Epanechnikov kernel ``2 / (pi r^2) (1 - d^2 / r^2)`` of the photons nearby on the same side of the same surface;
    times the cosine to the shading normal over that to the true one, 4 at most; without those that the lobe reflects
    sharply (half vector within 0.05 rad of it) or that come through the surface. All vectors are in world space.
    """
    result = np.zeros((len(points), 3))
    for place, point in enumerate(points.astype(np.float64)):
        for position, n, toward, power in zip(
            photons.position, photons.normal, photons.toward, photons.power, strict=True
        ):
            apart = position - point
            if apart @ apart >= radius**2 or abs(apart @ normal) >= 0.4 * radius:
                continue
            if n @ normal <= 0.7 or toward @ normal <= 0:
                continue
            half = wi + toward
            is_reflected = (wi @ shading) * (toward @ shading) > 0
            if lobe is not None and (not is_reflected or half @ lobe > np.cos(0.05) * np.linalg.norm(half)):
                continue
            turned = min(abs(toward @ shading) / (toward @ normal), 4.0)
            result[place] += power * turned * (1 - apart @ apart / radius**2)
    return result * 2 / (np.pi * radius**2)


@pytest.mark.slow
@pytest.mark.parametrize("with_lobe", [pytest.param(False, marks=pytest.mark.long), True])
def test_a_look_up_on_shaded_surfaces_is_the_slow_one(with_lobe):
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.photon_map import PhotonMap

    some, radius = scattered(4000, 11), 0.3
    normal, shading, wi = np.array([0, 0, 1.0]), np.array([0.48, 0.36, 0.8]), np.array([-0.6, 0.0, 0.8])
    points = np.random.default_rng(12).uniform(-0.4, 0.4, (25, 3)).astype(np.float32) * np.float32([1, 1, 0.01])
    si = dr.zeros(mi.SurfaceInteraction3f, len(points))
    si.p = mi.Point3f(np.ascontiguousarray(points.T))
    up, turned, seen_from = (mi.Vector3f(*each.tolist()) for each in (normal, shading, wi))
    si.n, si.sh_frame = mi.Normal3f(up), mi.Frame3f(turned)
    si.wi = si.to_local(seen_from)
    lobe = mi.Vector3f(0, 0, 1 if with_lobe else 0)
    known = mi.UInt32(0), mi.UInt32(9), mi.Float(0.5), mi.Bool(True), mi.Bool(True)
    found = PhotonMap((some, some), radius).gather(si, up, lobe, *known)
    expected = gathered_slowly(some, points, normal, shading, wi, shading if with_lobe else None, radius)
    np.testing.assert_allclose(np.array(found.irradiance).T, expected, rtol=2e-4)
    # The lobe takes some photons, not all: what is above can fail.
    plain = gathered_slowly(some, points, normal, shading, wi, None, radius)
    assert (0.1 * plain < expected).all()
    assert (expected < plain).any() == with_lobe


def tilted(normal, count, seed):
    """Photons spread over a square of side 2 of a plane through 0, with a flux of 2.5 to a unit of area."""
    from lippmann.rendering.transport.photon_map import Photons

    random = np.random.default_rng(seed)
    along = np.linalg.svd(np.array([normal]))[2][1:]
    position = np.float32(random.uniform(-1, 1, (count, 2)) @ along)
    up = np.tile(np.float32(normal), (count, 1))
    power = np.full((count, 3), 4 * 2.5 / count, np.float32)
    return Photons(position, up, up, power, np.ones(count, np.uint32)), along


NORMALS = [(0.0, 0.0, 1.0), (0.6, 0.0, -0.8), (-0.48, 0.6, 0.64), (0.01, -0.02, 0.99975)]


@pytest.mark.slow
@pytest.mark.parametrize("normal", NORMALS)
def test_surfaces_that_are_not_seen_have_the_light_of_their_cell(normal):
    from lippmann.rendering.transport.photon_map import PhotonMap

    photons, along = tilted(normal, 20_000, 3)
    random = np.random.default_rng(4)
    # Not quite on the photons' plane, which for upright ones is the border of cells.
    points = np.float32(random.uniform(-0.7, 0.7, (60, 2)) @ along + 0.03 * np.array(normal))
    moved = at_place(photons, np.float32(photons.position + 0.03 * np.float32(normal)))
    found = gathered(PhotonMap((moved, moved), 0.1), points, 0, 9, normal=normal, by_kernel=False).irradiance
    expected = irradiance_of_cell(moved, points, np.tile(np.float32(normal), (60, 1)), 0.1)
    np.testing.assert_allclose(np.array(found).T, expected, rtol=0.03, atol=0.03)


def at_place(photons, position):
    from dataclasses import replace

    return replace(photons, position=position)


@pytest.mark.slow
@pytest.mark.parametrize("normal", NORMALS)
def test_cells_keep_the_flux(normal):
    from lippmann.rendering.transport.photon_map import PhotonMap

    photons, along = tilted(normal, 200_000, 5)
    photons = at_place(photons, np.float32(photons.position + 0.03 * np.float32(normal)))
    random = np.random.default_rng(6)
    points = np.float32(random.uniform(-0.8, 0.8, (4000, 2)) @ along + 0.03 * np.array(normal))
    found = gathered(PhotonMap((photons, photons), 0.1), points, 1, 1, normal=normal, by_kernel=False).irradiance
    assert np.array(found).mean() == pytest.approx(2.5, rel=0.015)


def test_nothing_is_brought_by_no_photons_and_to_lanes_that_do_not_ask():
    from lippmann.rendering.transport.photon_map import PhotonMap, Photons

    points = np.zeros((3, 3), np.float32)
    assert (looked_up(PhotonMap((Photons.dark(0), Photons.dark(0)), 1.0), points, 0, 9) == 0).all()
    some = PhotonMap((scattered(99, 1), scattered(99, 2)), 1.0)
    assert (looked_up(some, points, 0, 9) > 0).all()
    assert (looked_up(some, points, 0, 9, active=False) == 0).all()


def test_a_narrow_lobe_keeps_what_it_reflects_sharply():
    """That light is seen in the surface, not gathered on it."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.photon_map import PhotonMap, Photons

    up = np.float32([[0, 0, 1]])
    straight = Photons(np.zeros((1, 3), np.float32), up, up, np.ones((1, 3), np.float32), np.ones(1, np.uint32))
    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.sh_frame = mi.Frame3f(mi.Vector3f(0, 0, 1))
    for wi, kept in (((0.0, 0.0, 1.0), 0.0), ((0.6, 0.0, 0.8), 2 / np.pi)):
        si.wi = mi.Vector3f(*wi)
        found = PhotonMap((straight, straight), 1.0).gather(
            si,
            mi.Vector3f(0, 0, 1),
            mi.Vector3f(0, 0, 1),
            mi.UInt32(0),
            mi.UInt32(9),
            mi.Float(0.5),
            mi.Bool(True),
            mi.Bool(True),
        )
        np.testing.assert_allclose(np.array(found.irradiance).ravel(), kept, rtol=1e-6)


def test_the_kernel_keeps_the_flux():
    """Of photons spread evenly over a plane the irradiance is their flux over its area."""
    from lippmann.rendering.transport.photon_map import PhotonMap, Photons

    random = np.random.default_rng(5)
    count = 200_000
    position = np.float32(np.stack([*random.uniform(-1, 1, (2, count)), np.zeros(count)], axis=1))
    up = np.tile(np.float32([0, 0, 1]), (count, 1))
    power = np.full((count, 3), 4 * 2.5 / count, np.float32)
    photons = Photons(position, up, up, power, np.ones(count, np.uint32))
    points = np.float32(np.stack([*random.uniform(-0.8, 0.8, (2, 2000)), np.zeros(2000)], axis=1))
    found = looked_up(PhotonMap((photons, photons), 0.05), points, 1, 1)
    assert found.mean() == pytest.approx(2.5, rel=0.01)


@pytest.mark.parametrize(("count", "most"), [(1, 0.3), (300, 0.05), (20_000, 0.05)])  # one is met at once
def test_points_without_photons_are_not_looked_up(engine, count, most):
    """A small patch of photons in a world ten thousand times as wide; all points in reach are looked up."""
    import mitsuba as mi

    from lippmann.rendering.transport.photon_map import PhotonMap, Photons

    random = np.random.default_rng(5)
    spot = np.float32([31.7, -0.3, 8.1])
    photons = Photons.dark(count)
    position = spot + random.normal(0, 0.02, (count, 3)).astype(np.float32) * np.float32([1, 0, 1])
    half = Photons(position, photons.normal, photons.toward, photons.power, photons.surfaces)
    radius = 0.004
    found = PhotonMap((half, half), radius)

    def share(points):
        return np.array(found.may_reach(mi.Point3f(points.astype(np.float32).T), mi.Bool(True))).mean()

    way = random.normal(size=(count, 3))
    way *= random.uniform(0, radius, (count, 1)) / np.linalg.norm(way, axis=1, keepdims=True)
    assert share(position + way) == 1
    assert share(spot + random.uniform(-200, 200, (50_000, 3)) * [1, 0, 1]) < most
