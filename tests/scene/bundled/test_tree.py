"""The tree grows from branch to branch without a gap."""

import dataclasses

import numpy as np
import pytest

from lippmann.scene.bundled import tree


@pytest.fixture(scope="module")
def branches():
    return tree.grow()


def test_twelve_generations(branches):
    assert len(branches.base) == 2**12 - 1
    assert len(tree.grow(dataclasses.replace(tree.LAYOUT, generations=1)).base) == 1


def test_each_branch_begins_where_its_parent_ends(branches):
    child = np.arange(1, len(branches.base))
    parent = (child - 1) // 2
    np.testing.assert_array_equal(branches.base[child], branches.apex[parent])
    np.testing.assert_array_equal(branches.base_radius[child], branches.apex_radius[parent])


def test_branches_taper_and_shorten(branches):
    length = np.linalg.norm(branches.apex - branches.base, axis=1)
    child = np.arange(1, len(length))
    ratio = length[child] / length[(child - 1) // 2]
    np.testing.assert_allclose(ratio, np.resize(tree.LAYOUT.lengths, len(child)), rtol=1e-9)
    np.testing.assert_allclose(branches.apex_radius / branches.base_radius, tree.LAYOUT.taper)
    assert np.all(length > branches.base_radius)


def test_forks_open_by_their_angles(branches):
    direction = branches.apex - branches.base
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    child = np.arange(1, len(direction))
    cosine = np.einsum("bk,bk->b", direction[child], direction[(child - 1) // 2])
    np.testing.assert_allclose(np.degrees(np.arccos(cosine)), np.resize(tree.LAYOUT.forks, len(child)), atol=1e-6)
    # To either side: both children and the parent lie in one plane.
    first, second = direction[1::2], direction[2::2]
    between = np.degrees(np.arccos(np.einsum("bk,bk->b", first, second)))
    np.testing.assert_allclose(between, sum(tree.LAYOUT.forks), atol=1e-6)


def test_no_two_boughs_are_alike(branches):
    depth = 7
    tips = np.arange(2**depth - 1, 2 ** (depth + 1) - 1)
    assert len(np.unique(branches.apex[tips].round(3), axis=0)) == len(tips)
    heights = branches.apex[tips][:, 1]
    assert len(np.unique(heights.round(3))) > 0.9 * len(tips)


def test_crown_is_round(branches):
    spread = np.ptp(branches.apex, axis=0)
    assert spread[2] > 0.5 * spread[0]


def test_stands_upright_on_the_lawn(branches):
    np.testing.assert_array_equal(branches.base[0], 0)
    assert branches.apex[0] == pytest.approx((0, tree.LAYOUT.trunk, 0))
    assert branches.apex[:, 1].min() > 5
    (x0, z0), (x1, z1) = tree.LAYOUT.lawn
    assert x0 < 0 < x1
    assert z0 < 0 < z1


def test_joints_close_the_branches():
    scene = tree.make()
    np.testing.assert_array_equal(scene.spheres.centers, scene.tubes.apex)
    np.testing.assert_array_equal(scene.spheres.radii, scene.tubes.apex_radius)
    assert len(scene.materials) == 2
