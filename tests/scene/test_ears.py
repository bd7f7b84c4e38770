"""Concave outlines are cut into triangles that cover them once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.scene.ears import cut_ears


def area(outline: np.ndarray) -> float:
    x, y = outline[..., 0], outline[..., 1]
    return 0.5 * (x * np.roll(y, -1, axis=-1) - y * np.roll(x, -1, axis=-1)).sum(axis=-1)


def star(radii: list[float]) -> np.ndarray:
    """Counter-clockwise and simple: every corner at its own angle about the origin."""
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    return np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


@settings(deadline=None, max_examples=60)
@given(st.integers(4, 20).flatmap(lambda n: st.lists(st.lists(st.floats(0.1, 10), min_size=n, max_size=n), min_size=1)))
def test_triangles_cover_the_outline_once(radii):
    outlines = np.stack([star(each) for each in radii[:5]])
    triangles = cut_ears(outlines)
    assert triangles.shape == (len(outlines), outlines.shape[1] - 2, 3)
    for outline, faces in zip(outlines, triangles, strict=True):
        pieces = area(outline[faces])
        assert pieces.min() > -1e-9
        assert pieces.sum() == pytest.approx(area(outline), rel=1e-9)
        edges = {
            tuple(sorted((int(a), int(b)))) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)
        }
        assert {(i, i + 1) for i in range(len(outline) - 1)} <= edges


def test_dart():
    dart = np.array([[0.0, 0.0], [4.0, 2.0], [0.0, 4.0], [1.0, 2.0]])
    assert {frozenset(face) for face in cut_ears(dart[None])[0].tolist()} == {
        frozenset({0, 1, 3}),
        frozenset({1, 2, 3}),
    }


def test_corner_on_the_rim_of_an_ear():
    notched = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.5], [0.0, 4.0]])
    faces = cut_ears(notched[None])[0]
    assert area(notched[faces]).min() >= 0
    assert area(notched[faces]).sum() == pytest.approx(area(notched))


def test_outline_that_crosses_itself_still_gives_triangles():
    bow = np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    assert cut_ears(bow[None]).shape == (1, 2, 3)


def test_points_in_one_place():
    assert cut_ears(np.zeros((2, 5, 2))).shape == (2, 3, 3)
