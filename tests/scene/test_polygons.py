"""Polygons into triangles: areas add up, windings stay."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.scene.polygons import triangulate


def areas(points, corners, triangles):
    a, b, c = (points[corners[triangles[:, k]]] for k in range(3))
    return np.cross(b - a, c - a) / 2.0


def cut(*outlines):
    points = np.concatenate([np.asarray(outline, float) for outline in outlines])
    sizes = np.array([len(outline) for outline in outlines])
    return points, np.arange(len(points)), *triangulate(points, np.arange(len(points)), sizes)


def test_a_convex_polygon_becomes_a_fan():
    points, corners, triangles, owners = cut([(0, 0, 0), (2, 0, 0), (3, 1, 0), (1, 2, 0), (0, 1, 0)])
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert owners.tolist() == [0, 0, 0]
    assert (areas(points, corners, triangles)[:, 2] > 0).all()


@pytest.mark.parametrize("first", range(4))
@pytest.mark.parametrize("flipped", [False, True])
def test_an_arrowhead_is_not_covered_twice(first, flipped):
    arrow = np.roll([(0, 0, 0), (4, -3, 0), (1, 0, 0), (4, 3, 0)], first, axis=0)
    arrow = arrow[::-1] if flipped else arrow
    points, corners, triangles, _ = cut(arrow)
    normals = areas(points, corners, triangles)[:, 2]
    assert normals.sum() == pytest.approx(-3.0 if flipped else 3.0)
    assert len(set(np.sign(normals))) == 1  # a fan from a wrong corner would fold one triangle over


def test_polygons_of_all_sizes_keep_their_order_and_owner():
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    points, corners, triangles, owners = cut(square, square[:3], [*square, (-1, 0.5, 0)], square)
    assert owners.tolist() == [0, 0, 1, 2, 2, 2, 3, 3]
    starts = np.array([0, 4, 7, 12])
    assert (triangles >= starts[owners][:, None]).all()
    assert (triangles < np.array([4, 7, 12, 16])[owners][:, None]).all()
    total = np.bincount(owners, areas(points, corners, triangles)[:, 2])
    assert total == pytest.approx([1, 0.5, 1.5, 1])


def star(radii, tilt):
    """A star-shaped outline in a tilted plane, and its normal."""
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    flat = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(len(radii))], axis=-1)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    return flat @ turn.T, turn[:, 2]


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0.2, 3.0), min_size=4, max_size=14), st.floats(0, 6.28))
def test_star_shaped_polygons_are_covered_once(radii, tilt):
    outline, normal = star(np.array(radii), tilt)
    points, corners, triangles, _ = cut(outline)
    assert len(triangles) == len(radii) - 2
    signed = areas(points, corners, triangles) @ normal
    relative = outline - outline[0]
    whole = np.cross(relative, np.roll(relative, -1, axis=0)).sum(axis=0) @ normal / 2
    assert signed.sum() == pytest.approx(whole, rel=1e-9)
    assert signed.min() >= -1e-9 * whole


def test_an_outline_that_crosses_itself_still_ends():
    *_, triangles, _ = cut([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0), (0.5, 2, 0)])
    assert triangles.shape == (3, 3)


def test_nothing_gives_nothing():
    triangles, owners = triangulate(np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int))
    assert triangles.shape == (0, 3)
    assert owners.shape == (0,)
