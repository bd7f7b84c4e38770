"""Gaussians along rays, against a slow twin: all Gaussians of a ray, sorted by their peaks, in NumPy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.special import sph_harm_y

from lippmann.device.splats.bvh import make_bvh
from lippmann.device.splats.compositing import composite
from lippmann.device.splats.table import make_table
from lippmann.errors import MemoryLimitError
from lippmann.scene.values.splats import Splats

PLENTY = 1 << 30


def random_splats(count, degree, seed=0, size=0.1, spread=1.0):
    """Gaussians of all shapes and turns in the box from -1 to 1."""
    random = np.random.default_rng(seed)
    return Splats(
        random.uniform(-1, 1, (count, 3)).astype(np.float32),
        (size * np.exp(spread * random.normal(size=(count, 3)))).astype(np.float32),
        Rotation.random(count, rng=random).as_quat().astype(np.float32),
        random.uniform(0.05, 1, count).astype(np.float32),
        (0.5 * random.normal(size=(count, (degree + 1) ** 2, 3))).astype(np.float32),
    )


def random_rays(count, seed=1, distance=4.0):
    random = np.random.default_rng(seed)
    origins = np.column_stack([random.uniform(-1, 1, (count, 2)), np.full(count, distance)])
    directions = np.column_stack([0.1 * random.normal(size=(count, 2)), np.full(count, -1.0)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return origins.astype(np.float32), directions.astype(np.float32)


def harmonics(direction, degree):
    """Real spherical harmonics by SciPy's complex ones, with the Condon-Shortley phase."""
    polar, azimuth = math.acos(direction[2]), math.atan2(direction[1], direction[0])
    found = []
    for own in range(degree + 1):
        for order in range(-own, own + 1):
            value = complex(sph_harm_y(own, abs(order), polar, azimuth))
            part = value.imag if order < 0 else value.real
            found.append(part if order == 0 else math.sqrt(2) * part)
    return np.array(found)


def twin(splats, origins, directions, end=np.inf):
    """Colours and transmittances, float64, by inverse covariances."""
    axes = Rotation.from_quat(splats.rotations.astype(float)).as_matrix() * splats.scales.astype(float)[:, None, :]
    inverse = np.linalg.inv(axes @ axes.transpose(0, 2, 1))
    colors, left = np.zeros((len(origins), 3)), np.ones(len(origins))
    for ray, (o, d) in enumerate(zip(origins.astype(float), directions.astype(float), strict=True)):
        offset = splats.centers - o
        peak = np.einsum("i,nij,nj->n", d, inverse, offset) / np.einsum("i,nij,j->n", d, inverse, d)
        nearest = o + peak[:, None] * d - splats.centers
        alpha = splats.opacities * np.exp(-0.5 * np.einsum("ni,nij,nj->n", nearest, inverse, nearest))
        color = np.maximum(0, 0.5 + np.einsum("j,njc->nc", harmonics(d, splats.degree), splats.harmonics))
        for number in np.argsort(peak):
            if 0 <= peak[number] <= end and alpha[number] >= 1 / 255:
                colors[ray] += left[ray] * min(alpha[number], 0.99) * color[number]
                left[ray] *= 1 - min(alpha[number], 0.99)
    return colors, left


def traced(splats, origins, directions, end=np.inf, threads=1):
    table = make_table(splats, PLENTY)
    return composite(table, origins, directions, np.full(len(origins), end, np.float32), threads)


def psnr(found, true):
    return -10 * np.log10(np.mean((np.clip(found, 0, 1) - np.clip(true, 0, 1)) ** 2))


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_splats_of_every_degree_are_those_of_the_twin(degree):
    splats, (origins, directions) = random_splats(300, degree, seed=degree), random_rays(120)
    colors, left = traced(splats, origins, directions)
    true, true_left = twin(splats, origins, directions)
    assert 0.02 < true_left.mean() < 0.5  # the scene is neither empty nor a wall
    assert psnr(colors, true) > 70
    # What lies behind the last thousandth of a percent of light is not looked for.
    assert np.abs(colors - true).max() < 5e-4
    assert np.abs(left - true_left).max() < 1.1e-4


@pytest.mark.long
def test_small_and_flat_splats_far_away_are_met():
    random = np.random.default_rng(2)
    count = 200
    sizes = np.exp(random.uniform(np.log(1e-4), np.log(1e-2), (count, 1)))
    flat = np.exp(random.uniform(np.log(1e-4), 0, (count, 1)))
    splats = random_splats(count, 0)
    splats = Splats(
        splats.centers,
        np.hstack([sizes, sizes, sizes * flat]).astype(np.float32),
        splats.rotations,
        np.full(count, 0.9, np.float32),
        splats.harmonics,
    )
    # Through a point within a standard deviation of each.
    axes = Rotation.from_quat(splats.rotations).as_matrix() * splats.scales[:, None, :]
    targets = splats.centers.astype(float) + np.einsum("nij,nj->ni", axes, random.uniform(-0.5, 0.5, (count, 3)))
    origins = np.array([20.0, 15.0, 30.0]) + random.uniform(-1, 1, (count, 3))
    origins = origins.astype(np.float32)
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    colors, left = composite(make_table(splats, PLENTY), origins, directions, np.full(count, np.inf, np.float32), 1)
    true, true_left = twin(splats, origins, directions)
    assert (left < 0.9).all()
    assert np.abs(left - true_left).max() < 2e-3
    assert psnr(colors, true) > 60


@settings(max_examples=12, deadline=None)
@given(st.integers(1, 60), st.integers(0, 10**6), st.floats(0.0, 5.0))
def test_order_threads_and_ends_change_nothing_but_what_they_should(count, seed, end):
    splats, (origins, directions) = random_splats(count, 1, seed=seed), random_rays(20, seed=seed)
    shuffled = splats.select(np.random.default_rng(seed).permutation(count))
    if (splats.opacities > 1 / 255).any():
        colors, left = traced(splats, origins, directions, end)
        again, left_again = traced(shuffled, origins, directions, end, threads=2)
        np.testing.assert_allclose(again, colors, atol=1e-6)
        np.testing.assert_allclose(left_again, left, atol=1e-6)
        np.testing.assert_allclose(left, twin(splats, origins, directions, end)[1], atol=2e-4)


def test_peaks_behind_the_origin_are_not_seen():
    splats = random_splats(100, 0)
    origins, directions = np.zeros((1, 3), np.float32), np.array([[0, 0, -1]], np.float32)
    colors, left = traced(splats, origins, directions)
    true, true_left = twin(splats, origins, directions)
    assert np.abs(colors - true).max() < 5e-4
    assert abs(left[0] - true_left[0]) < 1.1e-4
    assert (
        abs(left[0] - twin(splats, origins + np.float32([0, 0, 4]), directions)[1][0]) > 1e-3
    )  # something lies behind it


def test_thousands_of_faint_splats_lie_on_one_ray():
    count = 5000
    z = np.random.default_rng(3).uniform(-1, 1, count)
    splats = Splats(
        np.column_stack([np.zeros((count, 2)), z]).astype(np.float32),
        np.full((count, 3), 0.5, np.float32),
        np.tile(np.float32([0, 0, 0, 1]), (count, 1)),
        np.full(count, 1.02 / 255, np.float32),
        np.zeros((count, 1, 3), np.float32),
    )
    _, left = traced(splats, np.float32([[0, 0, 4]]), np.float32([[0, 0, -1]]))
    assert left[0] < 1e-4
    few = splats.select(np.arange(1500))
    _, left = traced(few, np.float32([[0, 0, 4]]), np.float32([[0, 0, -1]]))
    assert left[0] == pytest.approx((1 - 1.02 / 255) ** 1500, rel=1e-3)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 300), st.integers(0, 10**6), st.sampled_from([0.0, 1e-3, 1.0, 1e6]))
def test_hierarchies_hold_every_box_once(count, seed, spread):
    random = np.random.default_rng(seed)
    low = (spread * random.normal(size=(count, 3))).astype(np.float32)
    boxes = np.stack([low, low + random.uniform(0, 1, (count, 3)).astype(np.float32)], axis=1)
    bvh = make_bvh(boxes)
    seen = []
    waiting = [(0, bvh.boxes[0])]
    while waiting:
        node, around = waiting.pop()
        own = bvh.boxes[node]
        assert (own[0] >= around[0]).all()
        assert (own[1] <= around[1]).all()
        first, size = bvh.first[node], bvh.size[node]
        if size == 0:
            waiting += [(first, own), (first + 1, own)]
            continue
        for number in bvh.order[first : first + size]:
            assert (boxes[number, 0] >= own[0]).all()
            assert (boxes[number, 1] <= own[1]).all()
            seen.append(number)
    assert sorted(seen) == list(range(count))


def test_faint_splats_are_left_out_and_memory_is_asked_for():
    splats = random_splats(50, 0)
    faint = Splats(splats.centers, splats.scales, splats.rotations, np.full(50, 1 / 256, np.float32), splats.harmonics)
    assert make_table(faint, PLENTY) is None
    with pytest.raises(MemoryLimitError, match=r"cloud: 50 Gaussian splats take .* are left"):
        make_table(splats, 50 * 100, name="cloud")
