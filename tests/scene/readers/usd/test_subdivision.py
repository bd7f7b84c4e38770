"""Catmull-Clark against hand calculations, and what holds of every cage."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.scene.readers.usd import subdivision
from lippmann.scene.readers.usd.subdivision import Cage, refine, refine_each, smooth_groups

CUBE = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float64)
CUBE_FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])


def cage(points, faces, creases=(), sharpness=(), corners=()):
    counts = np.array([len(face) for face in faces])
    keen = np.zeros(len(points))
    for point, value in corners:
        keen[point] = value
    edges = np.array(creases, np.int64).reshape(-1, 2)
    return Cage(len(points), counts, np.concatenate(faces), edges, np.array(sharpness, np.float64), keen)


def grid(width, height):
    """Flat quadrilaterals of unit size."""
    points = np.array([(x, y, 0.0) for y in range(height + 1) for x in range(width + 1)])
    row = width + 1
    faces = [
        [y * row + x, y * row + x + 1, (y + 1) * row + x + 1, (y + 1) * row + x]
        for y in range(height)
        for x in range(width)
    ]
    return points, np.array(faces)


def test_a_cubes_corner_comes_to_its_limit():
    """Halstead: (9 v + 4 (sum of edge neighbours) + (sum of diagonal ones)) / 24 of the refined cube, by hand."""
    # Refined once, a corner lies at 2/9 ((F + 2 R) / 3, mean of faces F = 1/3, mean of edge middles R = 1/6); its edge
    # points at (1/2, 1/8, 1/8), the face points at (1/2, 1/2, 0).
    refined = refine(cage(CUBE, CUBE_FACES), 1)
    expected = (9 * 2 / 9 + 4 * (1 / 2 + 1 / 8 + 1 / 8) + (1 / 2 + 1 / 2)) / 24
    limit = refined.from_points @ CUBE
    assert limit[0] == pytest.approx([expected] * 3)
    # The limit of the cage itself is the same surface.
    assert (refine(cage(CUBE, CUBE_FACES), 0).from_points @ CUBE)[0] == pytest.approx([expected] * 3)
    assert (refine(cage(CUBE, CUBE_FACES), 3).from_points @ CUBE)[0] == pytest.approx([expected] * 3)


def test_sharp_creases_keep_a_cube():
    creases = sorted({tuple(sorted(pair)) for face in CUBE_FACES for pair in zip(face, np.roll(face, -1), strict=True)})
    sharp = cage(CUBE, CUBE_FACES, creases, [10.0] * 12)
    refined = refine(sharp, 2)
    points = refined.from_points @ CUBE
    on_side = np.isclose(points, 0.0) | np.isclose(points, 1.0)
    assert on_side.any(axis=1).all()
    assert points[:8] == pytest.approx(CUBE)
    # Corners of faces are parted along the creases: six sides of 5x5 points each.
    assert len(np.unique(smooth_groups(refined.cage))) == 6 * 25


def test_without_creases_all_corners_at_a_point_are_one_group():
    refined = refine(cage(CUBE, CUBE_FACES), 1)
    groups = smooth_groups(refined.cage)
    assert len(np.unique(groups)) == refined.cage.points
    for group in np.unique(groups):
        assert len(np.unique(refined.cage.indices[groups == group])) == 1


def test_a_half_sharp_crease_lies_between():
    edge = [(0, 1)]
    height = []
    for sharpness in (0.0, 0.5, 1.0):
        refined = refine(cage(CUBE, CUBE_FACES, edge, [sharpness]), 1)
        place = np.flatnonzero((refined.from_points_linear @ CUBE == (0.5, 0, 0)).all(1))[0]
        height.append(float((refined.from_points @ CUBE)[place, 1]))
    assert height[0] > height[1] > height[2]


def test_a_flat_grid_stays_flat_and_keeps_its_corners():
    points, faces = grid(3, 2)
    refined = refine(cage(points, faces), 2)
    limit = refined.from_points @ points
    assert limit[:, 2] == pytest.approx(0.0)
    assert limit.min(axis=0) == pytest.approx([0, 0, 0])
    assert limit.max(axis=0) == pytest.approx([3, 2, 0])
    assert limit[0] == pytest.approx([0, 0, 0])


def test_boundaries_without_sharp_corners_are_rounded():
    points, faces = grid(1, 1)
    limit = refine(cage(points, faces), 2, sharp_corners=False).from_points @ points
    assert limit[0, 0] > 0.1


def test_values_at_corners_are_linear_over_faces():
    points, faces = grid(2, 1)
    values = points[faces.ravel(), :2] * 3.0 + 1.0
    refined = refine(cage(points, faces), 2)
    taken = refined.from_corners @ values
    places = (refined.from_points_linear @ points)[refined.cage.indices]
    assert taken == pytest.approx(places[:, :2] * 3.0 + 1.0)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 2), st.sampled_from(["cube", "grid", "mixed"]))
def test_refinement_keeps_what_every_surface_has(seed, levels, kind):
    """Weights add up to 1, so that it moves with its points; faces are whole; each has a parent."""
    rng = np.random.default_rng(seed)
    if kind == "cube":
        points, faces = CUBE, list(CUBE_FACES)
    elif kind == "grid":
        points, faces = grid(*rng.integers(1, 4, 2))
        faces = list(faces)
    else:
        points, faces = rng.normal(size=(6, 3)), [np.array([0, 1, 2]), np.array([2, 1, 3, 4, 5])]
    edges = [faces[0][:2]] if rng.random() < 0.5 else []
    start = cage(points, faces, edges, [rng.uniform(0, 3)] * len(edges), [(0, rng.uniform(0, 2))])
    refined = refine(start, levels)
    for matrix in (refined.from_points, refined.from_points_linear, refined.from_corners):
        assert np.asarray(matrix.sum(axis=1)).ravel() == pytest.approx(1.0)
    assert len(refined.cage.indices) == 4 * len(refined.cage.counts) == len(refined.faces) * 4
    assert len(refined.faces) == sum(len(face) for face in faces) * 4 ** (levels - 1)
    assert refined.cage.indices.max() < refined.cage.points == refined.from_points.shape[0]
    assert set(refined.faces) == set(range(len(faces)))


def test_cages_refined_together_are_as_each_by_itself(monkeypatch):
    flat, faces = grid(2, 1)
    cages = [
        cage(CUBE, CUBE_FACES, [(0, 1), (1, 3)], [2.5, 0.5], [(7, 1.5)]),
        cage(np.zeros((7, 3)), [np.array([0, 1, 2]), np.array([2, 1, 3, 4, 5])]),  # and a point that no face uses
        cage(flat, faces, [(1, 4)], [3.0]),
    ]
    expected = [refine(each, 2) for each in cages]
    calls = []
    monkeypatch.setattr(subdivision, "refine", lambda *given, **named: calls.append(1) or refine(*given, **named))
    for one, alone in zip(refine_each(cages, 2), expected, strict=True):
        for name in ("from_points", "from_points_linear", "from_corners"):
            assert getattr(one, name).toarray() == pytest.approx(getattr(alone, name).toarray())
        for name in ("counts", "indices", "edges", "sharpness", "corners"):
            np.testing.assert_array_equal(getattr(one.cage, name), getattr(alone.cage, name))
        assert one.cage.points == alone.cage.points
        np.testing.assert_array_equal(one.faces, alone.faces)
        np.testing.assert_array_equal(one.corner_groups, alone.corner_groups)
    assert len(calls) == 1  # many small cages take hardly longer than one
