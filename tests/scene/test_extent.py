"""Extreme points of many copies are those of all of them, though most are left out early."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lippmann.scene import extent
from lippmann.scene.extent import extreme_points_of
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 300), flat=st.booleans(), away=st.sampled_from([0.0, 1e3]))
def test_copies_within_others_change_nothing(seed, count, flat, away):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(20, 3)).astype(np.float32)
    places = np.tile(np.eye(4), (count, 1, 1))
    places[:, :3, :3] = Rotation.random(count, random_state=seed).as_matrix() * rng.uniform(0.01, 1, (count, 1, 1))
    places[:, :3, 3] = away + rng.normal(scale=3.0, size=(count, 3)) * (1, 1, 0 if flat else 1)
    mesh = Mesh("copied", points, np.arange(18, dtype=np.uint32).reshape(6, 3), 0)
    scene = SceneDescription("copies", [mesh], [Material()], [Instance(0, places)])
    whole = extreme_points_of(scene)
    kept, extent._MANY = extent._MANY, 0
    try:
        few = extreme_points_of(scene)
        left = extent._may_lie_outside(points[:18], places).mean()
    finally:
        extent._MANY = kept
    # Farthest in each direction, whichever of two equal ones was taken.
    directions = extent._directions(256).astype(np.float64)
    slack = 1e-6 * (1 + away)
    np.testing.assert_allclose((few @ directions.T).max(axis=0), (whole @ directions.T).max(axis=0), atol=slack)
    assert count < 300 or left < 0.9


def test_most_copies_are_left_out():
    rng = np.random.default_rng(1)
    places = np.tile(np.eye(4), (20_000, 1, 1))
    places[:, :3, :3] *= 0.4
    places[:, :3, 3] = rng.uniform(-40, 40, (20_000, 3))
    assert extent._may_lie_outside(np.eye(3), places).mean() < 0.2
