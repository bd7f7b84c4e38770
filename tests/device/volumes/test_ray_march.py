"""Rays through volumes, against a slow twin in small steps without tables, bricks or early ends."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from lippmann.color.transfer import encode_srgb
from lippmann.device.volumes import ray_march
from lippmann.device.volumes.table import make_table
from lippmann.errors import MemoryLimitError
from lippmann.scene.values.volume import TransferFunction, Volume

MATRIX = np.array([[0.9, 0.2, 0.0, -9.0], [-0.1, 1.1, 0.3, -12.0], [0.1, -0.2, 2.0, -14.0], [0.0, 0.0, 0.0, 1.0]])
SOFT = TransferFunction(
    np.array([100.0, 180.0, 400.0]),
    np.array([[0.9, 0.2, 0.1], [0.2, 0.8, 0.3], [0.9, 0.9, 1.0]]),
    np.array([0.0, 0.1, 0.7]),
    shading=0.0,
)
#: A shell of values, which is passed in a few steps.
SHELL = TransferFunction(
    np.array([150.0, 200.0, 220.0, 270.0]), np.ones((4, 3)) * [1.0, 0.5, 0.2], np.array([0.0, 0.5, 0.5, 0.0]), shading=0
)
LIGHT = np.array([0.0, 0.0, 1.0])


def blobs(shape=(20, 24, 28), seed=0):
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=shape), 3)
    grid = 600 * (noise - noise.min()) / np.ptp(noise)
    grid[:, :, :9] = 0  # bricks with nothing in them
    return np.round(grid).astype(np.int16)


def rays(count, seed=1):
    random = np.random.default_rng(seed)
    aim = random.uniform(-8, 8, (count, 3))
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return (aim - 60 * directions).astype(np.float32), directions.astype(np.float32)


def twin(volume, origins, directions, ends=np.inf, steps=3000):
    """Colour and transmittance by the midpoint rule in ``steps`` steps, float64."""
    inverse = np.linalg.inv(volume.world_from_voxel)
    origins, directions = origins.astype(float), directions.astype(float)
    o, d = origins @ inverse[:3, :3].T + inverse[:3, 3], directions @ inverse[:3, :3].T
    size = np.array(volume.size)
    a, b = (-0.5 - o) / d, (size - 0.5 - o) / d
    near = np.maximum(np.minimum(a, b).max(axis=1), 0)
    far = np.minimum(np.maximum(a, b).min(axis=1), ends)
    length = np.maximum(far - near, 0) / steps
    colors, left = np.zeros((len(o), 3)), np.ones(len(o))
    transfer = volume.transfer
    for step in range(steps):
        at = np.clip(o + (near + (step + 0.5) * length)[:, None] * d, 0, size - 1)
        value = map_coordinates(volume.grid.astype(float), at.T[::-1], order=1)
        value = value * volume.slope + volume.intercept
        unit = 1.0 if transfer.per == "mm" else volume.longest_side / 100
        extinction = -np.log1p(-np.interp(value, transfer.values, transfer.opacities)) / unit
        color = np.stack([np.interp(value, transfer.values, transfer.colors[:, c]) for c in range(3)], axis=1)
        alpha = 1 - np.exp(-extinction * length)
        colors += (left * alpha)[:, None] * color
        left *= 1 - alpha
    return colors, left


def psnr(found, true):
    return -10 * np.log10(np.mean((encode_srgb(np.float64(found)) - encode_srgb(true)) ** 2))


@pytest.mark.parametrize(
    ("transfer", "least"), [(SOFT, 50), pytest.param(SHELL, 45, marks=pytest.mark.long)], ids=["soft", "shell"]
)
def test_rays_are_those_of_the_twin(transfer, least):
    volume = Volume(blobs(), MATRIX, transfer)
    origins, directions = rays(300)
    found, left = ray_march.composite(
        make_table(volume, 1 << 30), origins, directions, np.full(300, np.inf, np.float32), LIGHT, 1
    )
    true, true_left = twin(volume, origins, directions)
    assert (true_left < 0.9).mean() > 0.1
    assert psnr(found, true) > least
    assert np.abs(left - true_left).mean() < 3e-3
    assert not make_table(volume, 1 << 30).occupied.all()


def test_empty_bricks_change_nothing():
    table = make_table(Volume(blobs(), MATRIX, SOFT), 1 << 30)
    origins, directions = rays(300, seed=2)
    ends = np.full(300, np.inf, np.float32)
    found, _ = ray_march.composite(table, origins, directions, ends, LIGHT, 1)
    every = replace(table, occupied=np.ones_like(table.occupied))
    assert np.abs(found - ray_march.composite(every, origins, directions, ends, LIGHT, 1)[0]).max() < 1e-5
    none = replace(table, occupied=np.zeros_like(table.occupied))
    passed_over = ray_march.composite(none, origins, directions, ends, LIGHT, 1)[0]
    assert passed_over.mean() < 0.6 * found.mean()  # what is left are the steps from brick to brick


@pytest.mark.long
def test_slope_and_intercept_stand_for_the_values():
    grid = blobs()
    origins, directions = rays(50)
    ends = np.full(50, np.inf, np.float32)
    plain = make_table(Volume(grid, MATRIX, SOFT), 1 << 30)
    scaled = make_table(Volume((grid - np.int16(1000)), MATRIX, SOFT, 1.0, 1000.0), 1 << 30)
    halves = make_table(Volume((grid / 2).astype(np.float32), MATRIX, SOFT, 2.0, 0.0), 1 << 30)
    true = ray_march.composite(plain, origins, directions, ends, LIGHT, 1)[0]
    assert np.abs(ray_march.composite(scaled, origins, directions, ends, LIGHT, 1)[0] - true).max() < 1e-5
    assert np.abs(ray_march.composite(halves, origins, directions, ends, LIGHT, 1)[0] - true).max() < 1e-5


def test_a_slab_absorbs_by_its_thickness_alone():
    """One slice, finely or coarsely cut: opacity counts over millimetres."""
    for shape, spacing in (((1, 4, 4), (5, 5, 10.0)), ((10, 40, 40), (0.5, 0.5, 1.0))):
        matrix = np.diag([*spacing, 1.0])
        matrix[:3, 3] = (np.array(spacing) - np.array(spacing) * shape[::-1]) / 2
        flat = TransferFunction(np.array([0.0, 1.0]), np.full((2, 3), 0.5), np.array([0.2, 0.2]), shading=0.0)
        table = make_table(Volume(np.zeros(shape, np.int16), matrix, flat), 1 << 30)
        origins = np.float32([[0.3, 0.2, 50], [0, 0, 50], [50, 0, 50]])
        directions = np.float32([[0, 0, -1]] * 3)
        color, left = ray_march.composite(table, origins, directions, np.float32([np.inf, 50, np.inf]), LIGHT, 1)
        assert left == pytest.approx([0.8**10, 0.8**5, 1.0], rel=1e-5)
        assert color[:, 0] == pytest.approx(0.5 * (1 - left), rel=1e-5)


@pytest.mark.long
def test_surfaces_are_lit_from_the_light():
    z, y, x = np.mgrid[:24, :24, :24] - 11.5
    ball = (1000 - 60 * np.sqrt(x * x + y * y + z * z)).astype(np.float32)
    transfer = TransferFunction(np.array([500.0, 560.0]), np.full((2, 3), 0.8), np.array([0.0, 0.9]))
    matrix = np.eye(4)
    matrix[:3, 3] = -11.5
    table = make_table(Volume(ball, matrix, transfer), 1 << 30)
    origins = np.float32([[5, 0, 50], [-5, 0, 50], [0, 0, 50]])
    directions = np.float32([[0, 0, -1]] * 3)
    ends = np.full(3, np.inf, np.float32)
    right = ray_march.composite(table, origins, directions, ends, np.array([0.8, 0.0, 0.6]), 1)[0][:, 0]
    assert right[0] > 1.4 * right[1]
    front = ray_march.composite(table, origins, directions, ends, LIGHT, 1)[0][:, 0]
    assert front[0] == pytest.approx(front[1], rel=1e-3)
    assert front[2] > front[0]


def test_a_grid_beyond_the_memory_is_refused():
    with pytest.raises(MemoryLimitError, match="28 x 24 x 20 voxels"):
        make_table(Volume(blobs(), MATRIX, SOFT), 1000)
