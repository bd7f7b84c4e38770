"""Balls and rods lie where their formulas say at every placement, and triangles stay where they must."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import lippmann
from lippmann.device.pbr.round_shapes import keeps_round
from lippmann.device.pbr.scene import build_description
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import SceneError
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

pytestmark = pytest.mark.usefixtures("engine")


def ball(material=0, *, detail=1):
    sphere = trimesh.creation.icosphere(subdivisions=detail)
    points = np.asarray(sphere.vertices, np.float32)
    return Mesh("ball", points, np.asarray(sphere.faces, np.uint32), material, points, stands_for="ball")


def rod(material=0, *, sides=64):
    pipe = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=sides)
    points = np.asarray(pipe.vertices, np.float32) + np.float32([0, 0, 0.5])
    return Mesh("rod", points, np.asarray(pipe.faces, np.uint32), material, stands_for="rod")


def scene_of(mesh, matrices, **material):
    return SceneDescription("round", [mesh], [Material(**material)], [Instance(0, np.asarray(matrices, float))])


def shapes_of(description):
    return [shape.class_name() for shape in build_description(description).mitsuba.shapes()]


def hits(description, origin, direction):
    """Distance and normal of the first hit of each ray; distance infinite where there is none."""
    import drjit as dr
    import mitsuba as mi

    scene = build_description(description).mitsuba
    ray = mi.Ray3f(mi.Point3f(*origin.T.astype(np.float32)), mi.Vector3f(*direction.T.astype(np.float32)))
    si = scene.ray_intersect(ray)
    found = si.is_valid(), si.t, si.sh_frame.n
    dr.eval(found)  # by one kernel, not one for each
    valid, t, normal = map(np.array, found)
    return np.where(valid, t, np.inf), normal.T


def placed(linear, offset):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, offset
    return matrix


@pytest.mark.parametrize(("body", "each"), [(ball, 640), (rod, 900)])
def test_more_bodies_than_the_memory_holds_are_refused_with_how_many_fit(body, each):
    places = np.tile(np.eye(4), (2000, 1, 1))
    description, fitting = scene_of(body(), places), 1500
    with pytest.raises(SceneError) as refusal:
        build_description(description, memory=fitting * each)
    assert str(refusal.value).startswith("round: memory: 2,000 balls and rods need 1.")
    assert f"about {fitting:,} such copies; allow more memory, or place fewer copies" in str(refusal.value)
    build_description(scene_of(body(), places[:fitting]), memory=fitting * each)


def rays(count, aim, spread, seed):
    rng = np.random.default_rng(seed)
    origin = rng.normal(size=(count, 3))
    origin *= 20 / np.linalg.norm(origin, axis=1, keepdims=True)
    direction = aim + rng.normal(scale=spread, size=(count, 3)) - origin
    return origin, direction / np.linalg.norm(direction, axis=1, keepdims=True)


@pytest.mark.slow
@settings(max_examples=30)
@given(st.integers(0, 1000))
def test_a_ball_is_the_ellipsoid_of_its_placement(seed):
    rng = np.random.default_rng(seed)
    linear = Rotation.random(random_state=seed).as_matrix() @ np.diag(rng.uniform(0.3, 3, 3)) @ rng.normal(size=(3, 3))
    if np.abs(np.linalg.det(linear)) < 0.05 or np.linalg.cond(linear) > 30:
        return
    center = rng.uniform(-2, 2, 3)
    origin, direction = rays(200, center, 1.0, seed)
    distance, normal = hits(scene_of(ball(), [placed(linear, center)]), origin, direction)
    # On the unit ball: |L^-1 (o + t d - c)| = 1.
    o, d = (values @ np.linalg.inv(linear).T for values in (origin - center, direction))
    a, b, c = (d * d).sum(1), (o * d).sum(1), (o * o).sum(1) - 1
    clear = np.abs(b * b - a * c) > 1e-3 * b * b  # grazing rays are a matter of rounding
    meets = clear & (b * b > a * c)
    assert np.isinf(distance[clear & ~meets]).all()
    expected = (-b - np.sqrt(np.maximum(b * b - a * c, 0))) / a
    np.testing.assert_allclose(distance[meets], expected[meets], rtol=2e-4)
    gradient = (o + expected[:, None] * d) @ np.linalg.inv(linear)
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert ((gradient * normal).sum(1)[meets] > 0.999).all()


def test_a_rod_has_its_radius_and_length():
    turn = Rotation.from_euler("xyz", (30, 50, 70), degrees=True).as_matrix()
    matrix = placed(turn @ np.diag([0.5, -0.5, 4.0]), (1.0, 2.0, 3.0))
    origin, direction = rays(3000, np.array([1.0, 2.0, 3.0]) + turn @ [0, 0, 2.0], 1.0, 1)
    distance, normal = hits(scene_of(rod(), [matrix]), origin, direction)
    met = np.isfinite(distance)
    assert met.mean() > 0.1
    local = ((origin + np.where(met, distance, 0)[:, None] * direction) - matrix[:3, 3])[met] @ turn
    z = np.clip(local[:, 2], 0, 4)
    assert np.linalg.norm(local - np.stack([0 * z, 0 * z, z], axis=1), axis=1) == pytest.approx(0.5, abs=2e-3)
    along = (local[:, 2] > 0) & (local[:, 2] < 4)
    assert along.mean() > 0.8
    assert local[:, 2].min() < 0.5
    assert local[:, 2].max() > 3.5
    radial = (normal[met] @ turn)[along]
    assert radial[:, 2] == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize(
    ("linear", "expected"),
    [
        (np.diag([2.0, 2.0, 7.0]), True),
        (np.diag([2.0, -2.0, 7.0]), True),
        (np.diag([2.0, 2.1, 7.0]), False),
        ([[1.0, 0.1, 0], [0, 1, 0], [0, 0, 1]], False),
        ([[1.0, 0, 0.1], [0, 1, 0], [0, 0, 1]], False),
    ],
)
def test_rods_of_oval_or_slanted_section_stay_triangles(linear, expected):
    matrix = placed(linear, (0, 0, 0))
    assert keeps_round("rod", matrix[None]).tolist() == [expected]
    assert shapes_of(scene_of(rod(), [matrix])) == ["LinearCurve" if expected else "Mesh"]


def test_a_body_may_be_round_at_one_place_and_not_at_another():
    kinds = shapes_of(scene_of(rod(), [np.eye(4), placed(np.diag([1.0, 3.0, 1.0]), (5, 0, 0)), np.eye(4)]))
    assert sorted(kinds) == ["LinearCurve", "Mesh"]


@pytest.mark.parametrize("material", [{"transmission": 1.0, "thickness": 1.0}, {"emission": (1.0, 1.0, 1.0)}])
def test_glass_and_lamps_stay_triangles(material):
    assert shapes_of(scene_of(ball(), [np.eye(4)], **material)) == ["Mesh"]
    assert shapes_of(scene_of(ball(), [np.eye(4)])) == ["Ellipsoids"]


@pytest.mark.parametrize("count", range(1, 6))
def test_balls_of_any_number_are_built_without_a_word(count, capfd):
    places = [placed(np.eye(3), (3.0 * number, 0, 0)) for number in range(count)]
    assert shapes_of(scene_of(ball(), places)) == ["Ellipsoids"]
    assert capfd.readouterr().err == ""


@pytest.mark.slow
def test_a_picture_of_round_bodies_is_that_of_fine_triangles():
    """Each of its own colour, by its material or its vertices, in every micro-image."""
    display = Display("square", Panel(60, 40, 0.5), LensArray("square", 2.5), 3.0, "", float("inf"), 20.0)
    colors = [(0.8, 0.1, 0.1), (0.1, 0.7, 0.1), (0.1, 0.1, 0.8)]
    places = np.stack([placed(np.diag([1.0, 0.7, 0.8]), (x, 0, 0)) for x in (-2.0, 0.0, 2.0)])
    meshes = [ball(number, detail=4) for number in (0, 1, 3)]
    meshes[2] = replace(meshes[2], colors=np.broadcast_to(np.float32(colors[2]), meshes[2].positions.shape))
    round_one = SceneDescription(
        "round",
        [*meshes, rod(0)],
        [Material(base_color=color, roughness=0.4) for color in (*colors, (1.0, 1.0, 1.0))],
        [
            *(Instance(number, places[number]) for number in range(3)),
            Instance(3, placed(Rotation.from_euler("y", 90, degrees=True).as_matrix() * [0.2, 0.2, 4.0], (-2, 0, 0))),
        ],
    )
    triangles = replace(round_one, meshes=[replace(mesh, stands_for=None) for mesh in round_one.meshes])
    assert sorted(shapes_of(round_one)) == ["Ellipsoids"] * 2 + ["LinearCurve"]
    options = {"method": "full", "denoise": "none", "spp": 64, "integrator": "direct", "tone_map": "none"}
    found, expected = (
        lippmann.render(Scene(name, each), display, **options).pixels
        for name, each in (("a", round_one), ("b", triangles))
    )
    blocks = [pixels.reshape(8, 5, 12, 5, 3).mean(axis=(1, 3)) for pixels in (found, expected)]
    assert np.ptp(blocks[1], axis=(0, 1)).min() > 0.2
    assert np.abs(blocks[0] - blocks[1]).max() < 0.03
    assert abs(found.mean() - expected.mean()) < 0.002


def test_a_ball_of_several_colours_stays_triangles():
    colors = np.tile(np.float32([1, 0, 0]), (len(ball().positions), 1))
    assert shapes_of(scene_of(replace(ball(), colors=colors), [np.eye(4)])) == ["Ellipsoids"]
    colors[0] = 0, 1, 0
    assert shapes_of(scene_of(replace(ball(), colors=colors), [np.eye(4)])) == ["Mesh"]


def test_a_rod_with_colours_stays_triangles():
    """Curves are read from files that hold no colours."""
    colors = np.ones((len(rod().positions), 3), np.float32)
    assert shapes_of(scene_of(replace(rod(), colors=colors), [np.eye(4)])) == ["Mesh"]
