"""Balls and rods that stand for points and lines."""

import numpy as np
import pytest

from lippmann.scene.parsing.points_lines import as_mesh, balls, rods, width_of_lines, width_of_points
from lippmann.scene.values.description import Mesh

POINTS = np.array([[0.0, 0.0, 0.0], [5.0, 1.0, -2.0], [5.0, 1.0, 7.0]])


def volume(positions, faces):
    a, b, c = positions[faces].astype(np.float64).transpose(1, 0, 2)
    return (np.cross(a, b) * c).sum() / 6.0


@pytest.mark.parametrize("copies", [1, pytest.param(20_001, marks=pytest.mark.long)])
def test_balls_lie_about_their_points_and_face_outwards(copies):
    elements = np.tile([[2], [1]], (copies, 1))
    drawn = balls(POINTS, elements, 0.25)
    assert set(drawn.sources) == {1, 2}
    away = drawn.positions - POINTS[drawn.sources]
    assert np.linalg.norm(away, axis=1) == pytest.approx(np.full(len(away), 0.25), abs=1e-6)
    assert drawn.normals == pytest.approx(away / 0.25, abs=1e-5)
    one = drawn.faces[: len(drawn.faces) // len(elements)]
    share = volume(drawn.positions - POINTS[2], one) / (4.0 / 3.0 * np.pi * 0.25**3)
    assert 0.3 < share < 1.0  # of an octahedron 0.32, of a ball of 32 triangles 0.7


def test_rods_lie_about_their_lines_and_face_outwards():
    drawn = rods(POINTS, np.array([[0, 1], [1, 2], [2, 2]]), 0.1)
    assert len(drawn.faces) == 2 * 12  # none for the line of no length
    ends = np.stack([POINTS[[0, 1]], POINTS[[1, 2]]])[np.repeat([0, 1], 12)]
    along = ends[:, 1] - ends[:, 0]
    away = drawn.positions - ends[:, 0]
    assert np.linalg.norm(np.cross(away, along), axis=1) / np.linalg.norm(along, axis=1) == pytest.approx(
        np.full(24, 0.1), abs=1e-6
    )
    assert (drawn.positions - POINTS[drawn.sources]) / 0.1 == pytest.approx(drawn.normals, abs=1e-5)
    a, b, c = (drawn.positions[drawn.faces[:, corner]] for corner in range(3))
    assert ((np.cross(b - a, c - a) * drawn.normals[drawn.faces[:, 0]]).sum(axis=1) > 0.0).all()


def test_copies_keep_their_colours_and_coordinates():
    colors = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    uvs = np.array([[0, 0], [0.5, 0], [1, 0]], np.float32)
    thin = Mesh("thin", POINTS.astype(np.float32), np.array([[1], [2]], np.uint32), 0, None, (uvs,), colors)
    worlds = np.tile(np.eye(4), (2, 1, 1))
    worlds[1, :3, 3] = (0, 100, 0)
    mesh = as_mesh(thin, worlds, 0.01, 7)
    assert mesh.material == 7
    for color, uv, place in zip(colors[1:], uvs[1:], POINTS[1:], strict=True):
        mine = (mesh.colors == color).all(axis=1)
        assert (mesh.uvs[0][mine] == uv).all()
        assert mesh.positions[mine].mean(axis=0) == pytest.approx(place + np.array([0, 50, 0]), abs=1e-3)


def test_radii_follow_the_extent_and_shrink_in_crowds():
    assert width_of_lines(200.0, 9).radius == pytest.approx(1.0)
    assert width_of_lines(200.0, 1_000_000).radius == pytest.approx(0.05)
    assert width_of_points(POINTS, 200.0).radius == pytest.approx([2.0] * 3)
    assert width_of_points(POINTS[:1], 0.0).radius == pytest.approx([0.01])
    assert width_of_points(np.zeros((40_000, 3)), 200.0).radius == pytest.approx(np.full(40_000, 0.5))


@pytest.mark.parametrize("spread", ["random", "even"])
def test_balls_close_the_surface_on_which_points_lie(spread):
    generator = np.random.default_rng(2)
    flat = np.stack(np.meshgrid(*[(np.arange(150) + 0.5) / 150] * 2), axis=-1).reshape(-1, 2)
    flat = flat if spread == "even" else generator.uniform(size=flat.shape)
    points = np.pad(flat, ((0, 0), (0, 1)))
    radii = width_of_points(points, 2**0.5).radius
    assert radii.max() < 3.0 / 150  # and no more than that: neighbours in a grid are 1/150 away
    seen = generator.uniform(0.05, 0.95, (2000, 2))
    away = np.abs(seen[:, None] - flat).sum(axis=2)  # as wide as octahedra are
    assert (away < radii).any(axis=1).mean() > 0.985


def test_radii_follow_the_density():
    generator = np.random.default_rng(3)
    dense, sparse = generator.uniform(size=(2, 40_000, 3)) * np.array([[[0.2, 0.2, 0.0]], [[1.0, 1.0, 0.0]]])
    radii = width_of_points(np.concatenate([dense - 1.0, sparse]), 1.8).radius
    assert np.median(radii[:40_000]) < 0.5 * np.median(radii[40_000:])
