"""Exact shapes: where rays meet them, against the same worked out in double precision, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.device.whitted.bvh import GRID, LEAF, make_bvh
from lippmann.device.whitted.shape_table import MOST_LISTED_SHAPES, Column, Kind, make_shape_table
from lippmann.scene.values.whitted_scene import ClassicCamera, ClassicScene
from lippmann.scene.values.whitted_surfaces import ClassicLight, ClassicMaterial
from lippmann.scene.whitted.builder import ClassicSceneBuilder

pytestmark = pytest.mark.usefixtures("engine")

OPAQUE = ClassicMaterial(ambient=1.0, diffuse=0.0)
PANE = ClassicMaterial(ambient=1.0, diffuse=0.0, opacity=0.5)


def random_shapes(count, seed, material=OPAQUE, groups=0) -> ClassicScene:
    """So many spheres, tubes, cones, rings and boxes in a cube of 20, some seen from within alone."""
    rng = np.random.default_rng(seed)
    builder = ClassicSceneBuilder("random", handedness="right")
    index = builder.material(material)
    for _ in range(groups):
        builder.clip_group(np.append(rng.normal(size=3), rng.normal() * 3))

    def common():
        return {"clip_group": rng.integers(-1, groups, count) if groups else -1}

    def points():
        return rng.uniform(-10, 10, (count, 3))

    def sizes():
        return rng.uniform(0.2, 1.5, count)

    hollow = rng.random(count) < 0.2
    builder.spheres(points(), sizes(), index, inside_only=hollow, **common())
    base = points()
    builder.tubes(base, base + rng.normal(size=(count, 3)) * 2, sizes(), index, inside_only=hollow, **common())
    base = points()
    tips = np.where(rng.random(count) < 0.3, 0.0, sizes())
    builder.tubes(base, base + rng.normal(size=(count, 3)) * 2, sizes(), index, apex_radius=tips, **common())
    inner = np.where(rng.random(count) < 0.5, 0.0, sizes() * 0.3)
    builder.rings(points(), rng.normal(size=(count, 3)), inner, inner + sizes(), index, **common())
    low = points()
    builder.boxes(low, low + rng.uniform(0.1, 2, (count, 3)), index, **common())
    return builder.build()


def random_rays(count, seed):
    rng = np.random.default_rng(seed)
    o = rng.uniform(-15, 15, (count, 3)).astype(np.float32).astype(np.float64)
    d = rng.uniform(-10, 10, (count, 3)) - o
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    return o, d


def roots(a, b, c):
    """Of a t^2 + 2 b t + c, NaN where there are none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.sqrt(b * b - a * c)
        return np.sort(np.stack([(-b - half) / a, (-b + half) / a]), axis=0)


def crossings(scene, o, d):
    """Distances of all crossings ``(shapes, 2, rays)``, NaN where there is none; from the definitions of the shapes."""
    found = []

    def keep(t, good, group):
        good = good & (t > 0)
        if group >= 0:
            for a, b, c, e in scene.clip_groups[group]:
                p = o + d * t[..., None]
                good &= p @ np.array([a, b, c]) <= e
        found.append(np.where(good, t, np.nan))

    with np.errstate(invalid="ignore", divide="ignore"):
        for center, radius, inside, group in zip(
            scene.spheres.centers, scene.spheres.radii, scene.spheres.inside_only, scene.spheres.clip_group, strict=True
        ):
            q = o - center
            t = roots(np.ones(len(o)), (q * d).sum(axis=1), (q * q).sum(axis=1) - radius**2)
            keep(t, np.array([[not inside], [True]]) & np.isfinite(t), group)
        tubes = scene.tubes
        for base, apex, r0, r1, inside, group in zip(
            *(tubes.base, tubes.apex, tubes.base_radius, tubes.apex_radius, tubes.inside_only, tubes.clip_group),
            strict=True,
        ):
            axis = apex - base
            length = np.linalg.norm(axis)
            axis = axis / length
            slope = (r1 - r0) / length
            q = o - base
            qa, da = q @ axis, d @ axis
            qp, dp = q - qa[:, None] * axis, d - da[:, None] * axis
            r = r0 + slope * qa
            a = (dp * dp).sum(axis=1) - (slope * da) ** 2
            b = (qp * dp).sum(axis=1) - slope * da * r
            t = roots(a, b, (qp * qp).sum(axis=1) - r * r)
            h = qa + t * da
            leaving = a * t + b > 0
            keep(t, (h > 0) & (h < length) & (leaving if inside else True), group)
        rings = scene.rings
        for center, normal, inner, outer, group in zip(
            *(rings.centers, rings.normals, rings.inner, rings.outer, rings.clip_group), strict=True
        ):
            t = ((center - o) @ normal / (d @ normal))[None].repeat(2, axis=0)
            away = np.linalg.norm(o + d * t[0][:, None] - center, axis=1)
            keep(t, (away < outer) & ((away > inner) | (inner == 0)) & np.array([[True], [False]]), group)
        for low, high, group in zip(scene.boxes.minimum, scene.boxes.maximum, scene.boxes.clip_group, strict=True):
            a, b = (low - o) / d, (high - o) / d
            t = np.stack([np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)])
            keep(t, t[:1] <= t[1:], group)
    return np.stack(found)


def rays_of(o, d):
    import mitsuba as mi

    return mi.Vector3f(o.T.astype(np.float32)), mi.Vector3f(d.T.astype(np.float32))


def closest(scene, o, d):
    import mitsuba as mi

    from lippmann.device.whitted.geometry import NONE, Geometry

    geometry = Geometry(scene)  # lives until its results are evaluated
    hit = geometry.closest(*rays_of(o, d), mi.Bool(True))
    return np.where(np.array(hit.index) == NONE, np.inf, np.array(hit.t))


def passing(scene, o, d, reach):
    import mitsuba as mi

    from lippmann.device.whitted.geometry import Geometry

    geometry = Geometry(scene)
    return np.array(geometry.passing(*rays_of(o, d), mi.Float(reach), mi.Bool(True)))


def agree(actual, expected, tolerance):
    """All but a few: at a rim single precision may see the shape or not."""
    both = np.isfinite(actual) & np.isfinite(expected)
    apart = np.abs(np.where(both, actual, 0) - np.where(both, expected, 0))
    wrong = (np.isfinite(actual) != np.isfinite(expected)) | (apart > tolerance)
    assert wrong.mean() < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("count", [8, 60])
@pytest.mark.parametrize("groups", [0, 3])
def test_the_nearest_crossing(count, groups):
    """Few shapes are listed in the kernel, many walked in a hierarchy."""
    scene = random_shapes(count, seed=count, groups=groups)
    table = make_shape_table(scene)
    assert (table.walked > 0) == (5 * count > MOST_LISTED_SHAPES)
    o, d = random_rays(4000, 1)
    expected = np.nanmin(np.where(np.isnan(each := crossings(scene, o, d)), np.inf, each), axis=(0, 1))
    assert 0.02 < np.isfinite(expected).mean() < 0.98
    agree(closest(scene, o, d), expected, 2e-4)


@pytest.mark.parametrize("count", [8, 40])
def test_light_that_passes(count):
    scene = random_shapes(count, seed=3, material=PANE)
    o, d = random_rays(3000, 2)
    reach = 12.0
    expected = 0.5 ** (crossings(scene, o, d) < reach).sum(axis=(0, 1))
    assert len(np.unique(expected)) > 4
    actual = passing(scene, o, d, reach)
    assert (np.abs(actual - expected) > 1e-6).mean() < 3e-3


def test_spheres_traced_by_the_engine():
    rng = np.random.default_rng(5)
    builder = ClassicSceneBuilder("balls", handedness="right")
    builder.spheres(rng.uniform(-10, 10, (40, 3)), rng.uniform(0.2, 2, 40), builder.material(OPAQUE))
    scene = builder.build()
    assert make_shape_table(scene).traced == 40
    o, d = random_rays(4000, 6)  # some begin inside a ball
    each = crossings(scene, o, d)
    agree(closest(scene, o, d), np.nanmin(np.where(np.isnan(each), np.inf, each), axis=(0, 1)), 2e-4)
    blocked = (each < 12).any(axis=(0, 1))
    assert ((passing(scene, o, d, 12.0) == 0) != blocked).mean() < 2e-3


@pytest.mark.parametrize("far", [1.0, 1000.0])
def test_endless_shapes(far):
    builder = ClassicSceneBuilder("endless", handedness="right")
    index = builder.material(OPAQUE)
    builder.planes((0, far, 0), (0, 1, 0), index)
    builder.cylinders((far, 0, 3), (0, 2, 0), 0.5, index)
    o = np.array([(0.0, 0, 0), (far, 0, 0), (far, 5, 10), (far, 0, 3), (0, 0, 0)])
    d = np.array([(0.0, 1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0)])
    np.testing.assert_allclose(closest(builder.build(), o, d), [far, 2.5, 6.5, 0.5, np.inf], rtol=1e-5)


def test_a_ray_along_the_face_of_a_box_meets_it():
    builder = ClassicSceneBuilder("box", handedness="right")
    builder.boxes((-1, -1, -1), (0, 1, 1), builder.material(OPAQUE))
    o, d = np.array([(0.0, 0, 5), (1e-3, 0, 5)]), np.array([(0.0, 0, -1)] * 2)
    np.testing.assert_array_equal(closest(builder.build(), o, d), [4, np.inf])


def test_many_endless_shapes_and_lamps_are_looped_over():
    builder = ClassicSceneBuilder("many", handedness="right")
    index = builder.material(OPAQUE)
    for number in range(80):
        builder.planes((0, 0, -number - 1), (0, 0, 1), index)
        builder.light(ClassicLight("point", center=(number, 0, 3), radius=0.25))
    o, d = np.array([(0.0, 0, 0), (79, 0, 0), (0, 0, -79.5)]), np.array([(0.0, 0, -1), (0, 0, 1), (0, 0, -1)])
    scene = builder.build()
    np.testing.assert_allclose(closest(scene, o, d), [1, 2.75, 0.5], rtol=1e-6)
    assert passing(scene, o, d, 0.75).tolist() == [1, 1, 0]


def random_triangles(count, seed, material, groups=0):
    rng = np.random.default_rng(seed)
    builder = ClassicSceneBuilder("triangles", handedness="right")
    indices = np.array([builder.material(OPAQUE), builder.material(material)])
    for _ in range(groups):
        builder.clip_group(np.append(rng.normal(size=3), rng.normal() * 3))
    corners = rng.uniform(-10, 10, (count, 1, 3)) + rng.normal(size=(count, 3, 3)) * 2
    chosen = indices[rng.integers(0, 2, count)]
    group = rng.integers(-1, groups, count) if groups else -1
    builder.triangles(corners, chosen, clip_group=group)
    return builder.build()


def triangle_crossings(scene, o, d):
    """Distances ``(triangles, rays)`` by Cramer's rule, NaN where missed or clipped away."""
    found = []
    for (a, b, c), group in zip(scene.triangles.positions, scene.triangles.clip_group, strict=True):
        system = np.stack([np.broadcast_to(b - a, d.shape), np.broadcast_to(c - a, d.shape), -d], axis=-1)
        u, v, t = np.linalg.solve(system, (o - a)[..., None])[..., 0].T
        good = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        if group >= 0:
            planes = scene.clip_groups[group]
            good &= ((o + d * t[:, None]) @ planes[:, :3].T <= planes[:, 3]).all(axis=1)
        found.append(np.where(good, t, np.nan))
    return np.stack(found)


@pytest.mark.parametrize("groups", [0, 3])
def test_triangles_of_all_kinds(groups):
    scene = random_triangles(60, 7, PANE, groups)
    o, d = random_rays(3000, 8)
    each = triangle_crossings(scene, o, d)
    agree(closest(scene, o, d), np.nanmin(np.where(np.isnan(each), np.inf, each), axis=0), 2e-4)
    # Tachyon clips the shadows of what is opaque alone.
    unclipped = random_triangles(60, 7, PANE, groups)
    object.__setattr__(
        unclipped.triangles, "clip_group", np.where(scene.triangles.material == 1, -1, scene.triangles.clip_group)
    )
    crossed = triangle_crossings(unclipped, o, d) < 12
    expected = np.prod(np.where(crossed, np.array([0.0, 0.5])[scene.triangles.material][:, None], 1), axis=0)
    assert len(np.unique(expected)) >= 4
    assert (np.abs(passing(scene, o, d, 12.0) - expected) > 1e-6).mean() < 3e-3


def test_tubes_are_rows_about_their_middle():
    builder = ClassicSceneBuilder("tube", handedness="right")
    builder.tubes((0, 0, 0), (0, 0, 4), 1.0, builder.material(PANE), apex_radius=3.0)
    (row,) = make_shape_table(builder.build()).rows
    assert row[:3].tolist() == [0, 0, 2]
    assert [row[c] for c in (Column.K0, Column.K1, Column.K2)] == [4, 1, 1.25]
    assert (row[Column.LOW], row[Column.HIGH], row[Column.PASSES]) == (-2, 2, 0.5)


@pytest.mark.parametrize("others", [5, 100])
def test_a_sphere_that_dwarfs_the_scene_is_listed_as_huge(others):
    """It would spread the hierarchy's grid so far that all others fall into one cell."""
    rng = np.random.default_rng(3)
    builder = ClassicSceneBuilder("sky", handedness="right")
    material = builder.material(OPAQUE)
    builder.spheres(np.array([(0, 0, 0)]), 2e6, material)
    builder.tubes(rng.uniform(-5, 5, (others, 3)), rng.uniform(6, 9, (others, 3)), 0.3, material)
    builder.spheres(rng.uniform(-5, 5, (others, 3)), 1.0, material)
    table = make_shape_table(builder.build())
    huge = np.flatnonzero(table.rows[:, Column.KIND] == Kind.HUGE_SPHERE)
    assert huge.tolist() == [table.listed_rows.start if others == 100 else 2 * others]
    assert table.rows[huge[0], Column.K1] == 2e6
    assert np.abs(table.boxes).max(initial=0) < 20


def test_a_planet_alone_is_huge_for_who_stands_on_it():
    for height, is_huge in ((10.0, True), (3e6, False)):
        builder = ClassicSceneBuilder("planet", handedness="right")
        builder.spheres(np.array([(0, -2e6, 0)]), 2e6, builder.material(OPAQUE))
        camera = ClassicCamera(center=(0.0, height, 0.0), view=(0.0, 0.0, -1.0), up=(0.0, 1.0, 0.0))
        (row,) = make_shape_table(builder.build(camera=camera)).rows
        assert (row[Column.KIND] == Kind.HUGE_SPHERE) == is_huge


def boxes_in_cube(count):
    rng = np.random.default_rng(count)
    low = rng.uniform(-5, 5, (count, 3))
    return np.stack([low, low + rng.uniform(0, 1, (count, 3)) ** 4], axis=1)


@pytest.mark.parametrize("count", [2, 3, 17, 500])
def test_every_layout_of_a_hierarchy_holds_each_box_once(count):
    boxes = boxes_in_cube(count)
    bvh = make_bvh(boxes)
    assert bvh.nodes.shape == (8, count - 1, 8)
    for octant, layout in enumerate(bvh.nodes):
        down = octant >> np.arange(3) & 1 == 1
        found = []

        def leaves_below(place, layout=layout, down=down, found=found):
            """Visit all entries below one; return the end of its run and the members below it."""
            below, following = [], place + 1
            for node in layout[place].reshape(2, 4):
                if node[3] >= LEAF:
                    members = [int(node[3]) - LEAF]
                    found.extend(members)
                else:
                    end, members = leaves_below(following)
                    assert end - following == node[3]
                    following = end
                near, far = ((node[:3] >> shift & GRID - 1) * bvh.step + bvh.origin for shift in (0, 16))
                low, high = np.where(down, far, near), np.where(down, near, far)
                assert (low <= boxes[members, 0].min(axis=0)).all()
                assert (high >= boxes[members, 1].max(axis=0)).all()
                below += members
            return following, below

        assert leaves_below(0)[0] == count - 1
        assert sorted(found) == list(range(count))


def test_rays_of_an_octant_come_to_the_nearer_node_first():
    """Boxes in a row along an axis: both directions meet them in their own order."""
    boxes = np.array([[(2.0 * n, 0, 0), (2.0 * n + 1, 1, 1)] for n in range(40)])
    for octant, expected in ((0, range(40)), (1, reversed(range(40)))):
        last = make_bvh(boxes).nodes[octant].reshape(-1, 2, 4)[:, :, 3].astype(np.int64)
        order = []

        def visit(place, last=last, order=order):
            following = place + 1
            for word in last[place]:
                if word >= LEAF:
                    order.append(word - LEAF)
                else:
                    visit(following)
                    following += word

        visit(0)
        assert order == list(expected)


def test_nodes_are_split_along_the_axis_that_pays():
    """Two long rows side by side: the longest axis would mix them."""
    x = np.arange(32) * 1.0
    low = np.concatenate([np.stack([x, 0 * x + y, 0 * x], axis=1) for y in (0.0, 25.0)])
    bvh = make_bvh(np.stack([low, low + np.array([40.0, 1.0, 1.0])], axis=1))
    root = bvh.nodes[0, 0].reshape(2, 4)
    height = ((root[:, 1] >> 16).astype(float) - (root[:, 1] & GRID - 1)) * bvh.step[1]
    assert (height < 2).all()


def test_equal_boxes_do_not_make_the_tree_deep():
    boxes = np.zeros((300, 2, 3))
    boxes[:, 1] = 1
    assert make_bvh(boxes).count == 299
