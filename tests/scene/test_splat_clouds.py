"""Clouds of splats: what a move does to Gaussians and colours, and an extent that floaters do not spoil."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lippmann.errors import SceneError, UsageError
from lippmann.scene.cloud_selection import SplatSelection
from lippmann.scene.readers.load import load_scene
from lippmann.scene.scene import Scene
from lippmann.scene.splat_clouds import check_splats, crop, move, typical_points
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import Splats, join, real_harmonics


def random_splats(count=20, degree=3, seed=0):
    random = np.random.default_rng(seed)
    return Splats(
        random.uniform(-1, 1, (count, 3)).astype(np.float32),
        np.exp(random.normal(-3, 1, (count, 3))).astype(np.float32),
        Rotation.random(count, rng=random).as_quat().astype(np.float32),
        random.uniform(0, 1, count).astype(np.float32),
        random.normal(size=(count, (degree + 1) ** 2, 3)).astype(np.float32),
    )


def covariances(splats):
    axes = Rotation.from_quat(splats.rotations.astype(float)).as_matrix() * splats.scales.astype(float)[:, None, :]
    return axes @ axes.transpose(0, 2, 1)


def colors(splats, directions):
    basis = np.stack(real_harmonics(*directions.T), axis=1)[:, : splats.harmonics.shape[1]]
    return np.einsum("dj,njc->ndc", basis, splats.harmonics)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 4), st.booleans(), st.booleans())
def test_a_move_takes_places_shapes_and_colors_along(seed, degree, stretches, mirrors):
    random = np.random.default_rng(seed)
    splats = random_splats(degree=degree, seed=seed)
    turn = Rotation.random(rng=random).as_matrix() @ np.diag([-1 if mirrors else 1, 1, 1])
    stretch = np.diag(random.uniform(0.2, 3, 3)) if stretches else random.uniform(0.2, 3) * np.eye(3)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn @ stretch, random.normal(size=3)
    found = move(splats, matrix)
    np.testing.assert_allclose(found.centers, splats.centers @ matrix[:3, :3].T + matrix[:3, 3], atol=1e-5)
    true = matrix[:3, :3] @ covariances(splats) @ matrix[:3, :3].T
    np.testing.assert_allclose(covariances(found), true, atol=2e-5 * np.abs(true).max())
    np.testing.assert_allclose(np.linalg.norm(found.rotations, axis=1), 1, atol=1e-5)
    directions = random.normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    left, _, right = np.linalg.svd(matrix[:3, :3])
    np.testing.assert_allclose(colors(found, directions @ (left @ right).T), colors(splats, directions), atol=2e-4)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 0.04), st.floats(10.0, 1e4))
def test_floaters_do_not_change_the_extent(seed, share, far):
    random = np.random.default_rng(seed)
    cloud = random_splats(4000, 0, seed)
    floating = random.uniform(size=4000) < share
    centers = np.where(floating[:, None], far * random.normal(size=(4000, 3)), cloud.centers).astype(np.float32)
    alone, with_floaters = (
        np.ptp(typical_points(each), axis=0) for each in (cloud.select(~floating), replace(cloud, centers=centers))
    )
    assert (alone > 1.8).all()
    assert (alone < 2.8).all()
    assert (with_floaters > 0.9 * alone).all()
    assert (with_floaters < 1.4 * alone).all()


def test_one_splat_has_an_extent():
    one = replace(random_splats(1, 0), scales=np.float32([[1, 2, 3]]), rotations=np.float32([[0, 0, 0, 1]]))
    assert np.ptp(typical_points(one), axis=0) == pytest.approx([4, 8, 12])
    bounds = Scene("one", SceneDescription("one", splats=one)).bounds
    assert np.ptp(bounds, axis=0) == pytest.approx([4, 8, 12])


def test_clouds_are_joined_with_the_higher_degree():
    low, high = random_splats(3, 0), random_splats(2, 2)
    both = join([low, high])
    assert (both.count, both.degree) == (5, 2)
    np.testing.assert_array_equal(both.harmonics[:3, 0], low.harmonics[:, 0])
    assert not both.harmonics[:3, 1:].any()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"scales": np.zeros((20, 2), np.float32)}, "scales are"),
        ({"harmonics": np.zeros((20, 5, 3), np.float32)}, "harmonics are"),
        ({"opacities": np.full(20, 1.5, np.float32)}, "out of range"),
        ({"centers": np.full((20, 3), np.nan, np.float32)}, "20 splats have centers that are not finite"),
        ({"centers": np.full((20, 3), 1e20, np.float32)}, "beyond all bounds"),
    ],
)
def test_splats_that_cannot_be_are_refused(change, said):
    with pytest.raises(SceneError, match=said):
        check_splats(replace(random_splats(), **change), "cloud")


def test_no_splats_are_refused():
    with pytest.raises(SceneError, match="cloud: holds no Gaussian splats"):
        check_splats(random_splats(0), "cloud")


def test_a_choice_of_splats_is_made_in_order():
    splats = random_splats(200)
    scene = Scene("cloud", SceneDescription("cloud", splats=splats))
    chosen = SplatSelection((-5.0, -20.0, -20.0, 20.0, 20.0, 20.0), 10.0, 0.5).of(scene).description.splats
    keep = (splats.centers[:, 0] >= -0.5) & (splats.opacities >= 0.5)
    assert 0 < keep.sum() < 200
    np.testing.assert_allclose(chosen.centers, 10 * splats.centers[keep], rtol=1e-6)
    np.testing.assert_allclose(chosen.scales, 10 * splats.scales[keep], rtol=1e-6)
    assert SplatSelection().of(scene) is scene
    assert crop(splats, np.array([[-1, -1, -1], [1, 1, 1]])).count == 200


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"crop": (0, 0, 0, 1, 0, 1)}, "crop: .*lowest corner"),
        ({"crop": (9, 9, 9, 10, 10, 10)}, "crop: leaves no Gaussian splat"),
        ({"unit_scale": 0.0}, "unit_scale: 0; must be a factor from "),
        ({"unit_scale": float("nan")}, "unit_scale: nan"),
        ({"unit_scale": 1e9}, None),
        ({"min_opacity": 1.5}, "min_opacity: 1.5; a number from 0 to 1"),
        ({"min_opacity": 1.0}, "min_opacity: leaves no Gaussian splat"),
    ],
)
def test_choices_that_leave_nothing_are_refused(options, said):
    source = SceneDescription("cloud", splats=random_splats())
    if said is None:
        assert load_scene(source, **options).has_splats
        return
    with pytest.raises(UsageError, match=said):
        load_scene(source, **options)


@pytest.mark.parametrize("options", [{"crop": (0, 0, 0, 1, 1, 1)}, {"unit_scale": 2.0}, {"min_opacity": 0.5}])
def test_choices_of_splats_are_refused_for_scenes_without_any(options):
    with pytest.raises(UsageError, match=f"{next(iter(options))}: 'teapot' holds no Gaussian splats"):
        load_scene("teapot", **options)


def test_nothing_lights_splats():
    scene = load_scene(SceneDescription("cloud", splats=random_splats()))
    assert not scene.in_studio
    assert scene.background is None
    assert not scene.notes
