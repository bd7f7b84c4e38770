"""Boxes by hulls are those of all vertices, in every frame, or near to them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lippmann.scene import hull_bounds
from lippmann.scene.hull_bounds import bounds_by_hull
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription


def scene_of(seed, count, spread):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(30, 3)).astype(np.float32)
    places = np.tile(np.eye(4), (count, 1, 1))
    places[:, :3, :3] = Rotation.random(count, random_state=seed).as_matrix() * rng.uniform(0.05, 0.5, (count, 1, 1))
    places[:, :3, 3] = rng.normal(scale=8.0, size=(count, 3)) * spread
    mesh = Mesh("copied", points, np.arange(30, dtype=np.uint32).reshape(10, 3), 0)
    return Scene("copies", SceneDescription("copies", [mesh], [Material()], [Instance(0, places)])), points, places


SPREADS = [(1, 1, 1), (1, 1, 0), (1, 0, 0)]


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 400), spread=st.sampled_from(SPREADS))
def test_boxes_are_those_of_all_vertices(seed, count, spread):
    scene, _, _ = scene_of(seed, count, spread)
    bounds_in = bounds_by_hull(scene)
    for turn in Rotation.random(5, random_state=seed).as_matrix():
        frame = np.eye(4)
        frame[:3, :3] = turn
        np.testing.assert_allclose(bounds_in(frame), scene.bounds_in(frame), atol=1e-5)


def test_very_many_vertices_are_stood_for_by_the_farthest(monkeypatch):
    """On their side of the true box by a hundredth of the scene's radius at most."""
    scene, _, _ = scene_of(1, 3000, (1, 1, 1))
    monkeypatch.setattr(hull_bounds, "_MOST_VERTICES", 1000)
    bounds_in = bounds_by_hull(scene)
    frame = np.eye(4)
    frame[:3, :3] = Rotation.random(random_state=3).as_matrix()
    radius = np.linalg.norm(scene.bounds[1] - scene.bounds[0]) / 2
    np.testing.assert_allclose(bounds_in(frame), scene.bounds_in(frame), atol=0.01 * radius)
