"""Polygons into triangles: areas add up, windings stay."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.scene.parsing.triangulation import triangulate


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


@settings(deadline=None, max_examples=30)
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
    *_, triangles, owners = cut([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0), (0.5, 2, 0)])
    assert len(triangles) == len(owners) <= 3
    assert set(triangles.ravel()) <= set(range(5))


@pytest.mark.slow
def test_a_polygon_of_a_hundred_thousand_corners_takes_no_time_to_speak_of():
    """A comb of ears that grows with the square of the corners would take hours."""
    angles = np.linspace(0, 2 * np.pi, 100_000, endpoint=False)
    radii = 1 + 0.3 * np.sin(400 * angles)
    outline = np.stack([radii * np.cos(angles), radii * np.sin(angles), 0 * angles], axis=-1)
    points, corners, triangles, _ = cut(outline)
    assert areas(points, corners, triangles)[:, 2].sum() == pytest.approx(area(outline[:, :2]), rel=1e-6)


def test_nothing_gives_nothing():
    triangles, owners = triangulate(np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int))
    assert triangles.shape == (0, 3)
    assert owners.shape == (0,)


def area(outline: np.ndarray) -> float:
    x, y = outline[..., 0], outline[..., 1]
    return 0.5 * (x * np.roll(y, -1, axis=-1) - y * np.roll(x, -1, axis=-1)).sum(axis=-1)


def cut_flat(outline: np.ndarray) -> np.ndarray:
    return cut(np.column_stack([outline, np.zeros(len(outline))]))[2]


def flat_star(radii: list[float]) -> np.ndarray:
    """Counter-clockwise and simple: every corner at its own angle about the origin."""
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    return np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(st.integers(4, 20).flatmap(lambda n: st.lists(st.lists(st.floats(0.1, 10), min_size=n, max_size=n), min_size=1)))
def test_triangles_cover_the_outline_once(radii):
    outlines = np.stack([flat_star(each) for each in radii[:5]])
    for outline in outlines:
        faces = cut_flat(outline)
        pieces = area(outline[faces])
        assert pieces.min() > -1e-9
        assert pieces.sum() == pytest.approx(area(outline), rel=1e-9)
        edges = {
            tuple(sorted((int(a), int(b)))) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)
        }
        assert {(i, i + 1) for i in range(len(outline) - 1)} <= edges


def test_dart():
    dart = np.array([[0.0, 0.0], [4.0, 2.0], [0.0, 4.0], [1.0, 2.0]])
    assert {frozenset(face) for face in cut_flat(dart).tolist()} == {
        frozenset({0, 1, 3}),
        frozenset({1, 2, 3}),
    }


def test_corner_on_the_rim_of_an_ear():
    notched = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.5], [0.0, 4.0]])
    faces = cut_flat(notched)
    assert area(notched[faces]).min() >= 0
    assert area(notched[faces]).sum() == pytest.approx(area(notched))


def test_points_in_one_place_do_no_harm():
    *_, triangles, owners = cut(np.zeros((5, 3)), [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    assert owners[-1] == 1
    assert triangles[-1].tolist() == [5, 6, 7]
