"""The flake: nine children each, touching their parent and nothing else."""

import dataclasses

import numpy as np
import pytest

from lippmann.scene.bundled import small_balls


def test_generations():
    centers, radii = small_balls.flake()
    r = small_balls.LAYOUT.radius
    assert len(centers) == 91
    np.testing.assert_allclose(radii, np.repeat([r, r / 3, r / 9], [1, 9, 81]))
    assert len(small_balls.flake(dataclasses.replace(small_balls.LAYOUT, generations=1))[1]) == 1
    assert len(small_balls.flake(dataclasses.replace(small_balls.LAYOUT, generations=4))[1]) == 820


def test_children_touch_their_parent_and_no_two_balls_meet():
    centers, radii = small_balls.flake()
    distance = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    reach = radii[:, None] + radii[None]
    child = np.arange(1, 91)
    np.testing.assert_allclose(distance[child, (child - 1) // 9], reach[child, (child - 1) // 9], rtol=1e-12)
    np.fill_diagonal(distance, np.inf)
    assert np.all(distance > reach * (1 - 1e-12))


def test_hovers_above_the_ground():
    centers, radii = small_balls.flake()
    gap = centers[:, 1] - radii
    assert gap.min() > 0
    assert gap.min() < 6
    assert centers[0] == pytest.approx((0, small_balls.LAYOUT.height, 0))


def test_crown_leans_toward_the_viewer():
    centers, _ = small_balls.flake()
    crown = centers[7:10].mean(axis=0) - centers[0]
    lean = np.degrees(np.arctan2(crown[2], crown[1]))
    assert lean == pytest.approx(small_balls.LAYOUT.lean)
    assert crown[0] == pytest.approx(0, abs=1e-9)
