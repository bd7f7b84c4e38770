"""Clouds of plain points: fitted to their bulk, cropped."""

import numpy as np
import pytest

from lippmann.errors import UsageError
from lippmann.scene.readers.load import load_scene


def cloud(tmp_path, points, colors=None):
    path = tmp_path / "cloud.ply"
    head = "property float x\nproperty float y\nproperty float z\n"
    if colors is not None:
        head += "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    rows = [" ".join(map(str, row)) for row in (points if colors is None else np.hstack([points, colors]).tolist())]
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n{head}end_header\n" + "\n".join(rows) + "\n")
    return path


def middles(scene):
    """The points that are shown, and their colours."""
    meshes = scene.description.meshes
    points = [mesh.positions.reshape(-1, mesh.points, 3).mean(axis=1) for mesh in meshes]
    colors = [mesh.colors[:: mesh.points] for mesh in meshes if mesh.colors is not None]
    return np.concatenate(points), np.concatenate(colors) if colors else None


@pytest.fixture
def points():
    return np.random.default_rng(5).uniform(-1.0, 1.0, (3000, 3)).round(4)


def test_a_stray_point_does_not_count(tmp_path, points):
    alone = load_scene(cloud(tmp_path, points), up="y")
    strayed = load_scene(cloud(tmp_path, [*points, (400.0, 0.0, 0.0), (0.0, -90.0, 3.0)]), up="y")
    assert np.abs(strayed.bounds).max() < 1.1
    assert strayed.bounds == pytest.approx(alone.bounds, abs=0.01)
    assert strayed.extreme_points.max() == pytest.approx(alone.extreme_points.max(), abs=0.01)
    assert len(middles(strayed)[0]) == 3002  # it is drawn all the same


def test_tails_that_thin_out_count(tmp_path):
    """Arms of a spiral, of which few points lie at the ends, and a normal distribution; but none of its strays."""
    random = np.random.default_rng(1)
    radius, arm = 6.0 * random.random(4000), np.pi * random.integers(0, 2, 4000)
    spiral = np.stack([radius * np.cos(radius + arm), radius * np.sin(radius + arm), random.normal(0.0, 0.2, 4000)], 1)
    scene = load_scene(cloud(tmp_path, [*spiral.round(4), (90.0, 0.0, 0.0)]), up="y")
    extent = np.ptp(scene.bounds, axis=0)
    assert extent[:2] == pytest.approx(np.ptp(spiral[:, :2], axis=0), rel=0.05)
    assert 4.5 * 0.2 < extent[2] < 7.0 * 0.2


def test_few_points_all_count(tmp_path):
    corners = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 5.0)]
    scene = load_scene(cloud(tmp_path, corners), up="y")
    assert len(scene.description.meshes) == 1
    assert np.ptp(scene.bounds, axis=0) == pytest.approx([1.0, 2.0, 5.0], abs=0.12)


def test_crop_keeps_the_points_in_a_box_with_their_colours(tmp_path, points):
    colors = np.where(points[:, :1] > 0.0, 255, 0) * np.ones((1, 3), int)
    path = cloud(tmp_path, points, colors)
    cropped = load_scene(path, up="y", crop=(-1.0, -0.5, -1.0, 0.5, 0.5, 0.25))
    inside = ((points >= (-1.0, -0.5, -1.0)) & (points <= (0.5, 0.5, 0.25))).all(axis=1)
    shown, colored = middles(cropped)
    order, expected = np.lexsort(shown.T), points[inside]
    assert shown[order] == pytest.approx(expected[np.lexsort(expected.T)], abs=1e-5)
    assert (colored[:, 0] == (shown[:, 0] > 0.0)).all()
    whole = load_scene(path, up="y")
    assert np.ptp(cropped.bounds, axis=0).max() < np.ptp(whole.bounds, axis=0).max() * 0.8


def test_crop_counts_in_the_upright_scene(tmp_path, points):
    cropped = load_scene(cloud(tmp_path, points), up="z", crop=(-2.0, 0.0, -2.0, 2.0, 2.0, 2.0))
    assert len(middles(cropped)[0]) == np.count_nonzero(points[:, 2] >= 0.0)


def test_bad_crops(tmp_path, points):
    path = cloud(tmp_path, points)
    with pytest.raises(UsageError, match="leaves no point"):
        load_scene(path, crop=(5.0, 5.0, 5.0, 6.0, 6.0, 6.0))
    with pytest.raises(UsageError, match="holds no Gaussian splats"):
        load_scene(path, min_opacity=0.5)
    with pytest.raises(UsageError, match="no Gaussian splats or cloud of points"):
        load_scene("gears", crop=(0.0, 0.0, 0.0, 1.0, 1.0, 1.0))
