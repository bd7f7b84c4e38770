"""Shadows by the light buffer are those of a walk through all shapes, from wherever the light comes."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.device.whitted.light_buffer import MOST_GRIDS, make_light_buffer
from lippmann.device.whitted.shape_table import make_shape_table
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import ClassicLight, ClassicMaterial
from lippmann.scene.whitted.builder import ClassicSceneBuilder

pytestmark = pytest.mark.usefixtures("engine")

OPAQUE = ClassicMaterial(ambient=1.0, diffuse=0.0)
PANE = ClassicMaterial(ambient=1.0, diffuse=0.0, opacity=0.5)
#: Outside, far outside, among the shapes, and inside of one of them (see ``crowd``).
SOURCES = {
    "outside": ClassicLight("point", center=(30, 20, -25)),
    "far outside": ClassicLight("point", center=(-4000, 9000, 2000)),
    "on an axis": ClassicLight("spot", center=(0, 0, 40)),
    "near by": ClassicLight("point", center=(11, 11, 11)),
    "among": ClassicLight("point", center=(1, -2, 3)),
    "inside a shape": ClassicLight("point", center=(4, 4, 4)),
    "parallel": ClassicLight("directional", direction=(0.36, -0.8, 0.48)),
    "parallel to an axis": ClassicLight("directional", direction=(0, 0, -1)),
}


def crowd(lights, material=OPAQUE, groups=0, seed=1, middle=(0, 0, 0)) -> ClassicScene:
    """Spheres, tubes, cones, rings and boxes in a cube of 20 about the middle, a great sphere about (4, 4, 4)."""
    rng = np.random.default_rng(seed)
    builder = ClassicSceneBuilder("crowd", handedness="right")
    index = builder.material(material)
    for _ in range(groups):
        builder.clip_group(np.append(rng.normal(size=3), rng.normal() * 3))

    def common(count):
        return {"clip_group": rng.integers(-1, groups, count) if groups else -1}

    def points(count):
        return rng.uniform(-10, 10, (count, 3)) + middle

    builder.spheres(np.array([(4, 4, 4)]) + middle, 2.5, index)
    builder.spheres(points(60), rng.uniform(0.1, 0.8, 60), index, **common(60))
    base = points(40)
    tips = np.where(rng.random(40) < 0.5, 0.0, 0.3)
    builder.tubes(base, base + rng.normal(size=(40, 3)) * 2, 0.3, index, apex_radius=tips, **common(40))
    builder.rings(points(30), rng.normal(size=(30, 3)), 0.2, rng.uniform(0.3, 1, 30), index, **common(30))
    low = points(30)
    builder.boxes(low, low + rng.uniform(0.05, 1, (30, 3)), index, **common(30))
    for light in lights:
        builder.light(light)
    return builder.build()


def toward(light, o):
    """Directions and distances from points ``o (n, 3)`` to a light source."""
    if light.kind == "directional":
        return np.tile(-np.asarray(light.direction), (len(o), 1)), np.full(len(o), 1e18)
    away = np.asarray(light.center) - o
    distance = np.linalg.norm(away, axis=1)
    return away / distance[:, None], distance


def both(scene, o, number, buffer=True):
    """Light that gets from source ``number`` to points ``o``: by the light buffer and by a walk."""
    import mitsuba as mi

    from lippmann.device.whitted.geometry import Geometry

    geometry = Geometry(scene)
    assert (geometry._shapes._light_buffer is not None) == buffer
    d, t = toward(scene.lights[number], o)
    ray = mi.Point3f(o.T.astype(np.float32)), mi.Vector3f(d.T.astype(np.float32)), mi.Float(t.astype(np.float32))
    source = mi.UInt32(np.full(len(o), number, np.uint32))
    return (np.array(geometry.passing(*ray, mi.Bool(True), of)) for of in (source, None))


@pytest.mark.parametrize("material", [OPAQUE, PANE], ids=["opaque", "panes"])
@pytest.mark.parametrize("name", SOURCES)
def test_the_same_shadows_as_by_a_walk(name, material):
    scene = crowd([SOURCES[name]], material)
    o = np.random.default_rng(2).uniform(-13, 13, (20000, 3))
    found, expected = both(scene, o, 0)
    assert 0.002 < (expected == 1).mean() < 0.98
    assert material is OPAQUE or len(np.unique(expected)) > 4
    # Factors of a half, in whatever order, have no rounding.
    assert found.tolist() == expected.tolist()


def test_several_sources_of_all_kinds_at_once():
    scene = crowd(list(SOURCES.values()), PANE)
    o = np.random.default_rng(3).uniform(-13, 13, (5000, 3))
    for number in range(len(SOURCES)):
        found, expected = both(scene, o, number)
        assert found.tolist() == expected.tolist()


@pytest.mark.parametrize("seed", range(4))
def test_clipped_shapes(seed):
    scene = crowd([SOURCES["outside"], SOURCES["among"]], groups=3, seed=seed)
    o = np.random.default_rng(4).uniform(-13, 13, (5000, 3))
    for number in range(2):
        found, expected = both(scene, o, number)
        assert found.tolist() == expected.tolist()


def test_far_from_the_origin():
    """Single precision leaves steps of 1/128 there: what hardly touches may be missed by either."""
    middle = np.array([1e5, -1e5, 5e4])
    scene = crowd([ClassicLight("point", center=tuple(middle + np.array([30, 20, -25])))], middle=middle)
    o = middle + np.random.default_rng(5).uniform(-13, 13, (5000, 3))
    found, expected = both(scene, o, 0)
    assert (found != expected).mean() < 2e-3


def test_each_cell_is_sorted_by_depth():
    scene = crowd([SOURCES["outside"], SOURCES["among"]])
    buffer = make_light_buffer(make_shape_table(scene), scene.lights)
    assert buffer.of_light.tolist() == [[0, 1], [1, 6]]
    depths = np.ascontiguousarray(buffer.entries[:, 0]).view(np.float32)
    assert buffer.starts[-1] == len(buffer.entries)
    cell = np.repeat(np.arange(len(buffer.starts) - 1), np.diff(buffer.starts))
    assert (np.diff(depths) >= 0)[np.diff(cell) == 0].all()


def test_shapes_lie_in_few_cells():
    """Not in all: the buffer would be a list."""
    scene = crowd([SOURCES["outside"], SOURCES["parallel"]])
    buffer = make_light_buffer(make_shape_table(scene), scene.lights)
    assert buffer.side == 256
    walked = make_shape_table(scene).walked
    assert len(buffer.entries) < 0.02 * 2 * walked * buffer.side**2


def test_no_buffer_where_it_does_not_pay():
    few = crowd([])
    assert make_light_buffer(make_shape_table(few), few.lights) is None
    many = crowd([ClassicLight("point", center=(x, 0, 0)) for x in range(MOST_GRIDS // 6 + 1)])
    o = np.random.default_rng(6).uniform(-13, 13, (1000, 3))
    found, expected = both(many, o, 3, buffer=False)
    assert found.tolist() == expected.tolist()
    builder = ClassicSceneBuilder("heap", handedness="right")
    builder.spheres(np.random.default_rng(7).uniform(-1, 1, (400, 3)), 5.0, builder.material(OPAQUE))
    builder.boxes((0, 0, 0), (1, 1, 1), 0)
    builder.rings(np.zeros((60, 3)), (0, 0, 1), 0.0, 9.0, 0)
    builder.light(SOURCES["outside"])
    heap = builder.build()
    assert make_light_buffer(make_shape_table(heap), heap.lights) is None
