"""Wheels: well-cut faces, closed bodies, teeth that mesh without touching."""

import numpy as np
import pytest

from lippmann.scene.bundled import gears


def areas(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def radius_at(outline, angle):
    """Distance from the middle to the outline along ``angle``: the outline is star-shaped."""
    angles = np.unwrap(np.arctan2(outline[:, 1], outline[:, 0]))
    start = np.append(outline, outline[:1], axis=0)
    edge = np.searchsorted(np.append(angles, angles[0] + 2 * np.pi), angles[0] + (angle - angles[0]) % (2 * np.pi)) - 1
    p, q = start[edge], start[edge + 1]
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    cross = lambda u, v: u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]  # noqa: E731
    return cross(p, q - p) / cross(ray, q - p)


@pytest.mark.parametrize("teeth", [3, 4, 7, 36])
def test_face_is_cut_exactly(teeth):
    outline = gears.outline(teeth, 10.0, 12.0)
    faces = gears.face_triangles(teeth)
    assert faces.shape == (4 * teeth - 2, 3)
    pieces = areas(outline, faces)
    assert pieces.min() > 0
    x, y = outline.T
    whole = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2
    assert pieces.sum() == pytest.approx(whole, rel=1e-12)
    # All triangles counter-clockwise, their areas adding up to the polygon's: none overlaps another or sticks out.
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges)


def test_face_has_no_slivers_as_a_fan_has():
    outline = gears.outline(36, 10.0, 12.0)

    def sharpest(faces):
        corners = outline[faces]
        to_next = np.roll(corners, -1, axis=1) - corners
        to_last = np.roll(corners, 1, axis=1) - corners
        cosine = np.sum(to_next * to_last, axis=2)
        cosine /= np.linalg.norm(to_next, axis=2) * np.linalg.norm(to_last, axis=2)
        return np.degrees(np.arccos(np.clip(cosine, -1, 1))).min(axis=1)

    roots = np.stack([4 * np.arange(36), 4 * np.arange(36) + 3], axis=1).reshape(-1)
    fan = np.stack([np.full(70, roots[0]), roots[1:-1], roots[2:]], axis=1)
    ours = sharpest(gears.face_triangles(36))
    assert np.median(ours) > 1.5 * np.median(sharpest(fan))


def test_wheel_is_closed_and_faces_outward():
    positions, faces = gears.wheel()
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    directed = {tuple(edge) for edge in edges}
    assert len(directed) == len(edges)
    assert all(edge[::-1] in directed for edge in directed)
    a, b, c = (positions[faces[:, k]] for k in range(3))
    volume = np.einsum("tk,tk->", a, np.cross(b, c)) / 6
    layout = gears.LAYOUT
    flat = positions[: len(positions) // 2, [0, 2]] * (1, -1)
    area = areas(flat, gears.face_triangles(layout.teeth)).sum()
    assert volume == pytest.approx(area * layout.thickness, rel=1e-12)
    assert area == pytest.approx(np.pi * (layout.pitch / 2) ** 2, rel=0.05)


def test_teeth_mesh_without_touching():
    layout = gears.LAYOUT
    scene = gears.make()
    wheels = scene.triangles.positions[2:].reshape(layout.layers, layout.rows, layout.columns, -1, 3)

    def outline(layer, row, column):
        corners = wheels[layer, row, column]
        flat = np.unique(corners[:, [0, 2]].round(9), axis=0)
        middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
        middle = flat.mean(axis=0) if layout.teeth % 2 else middle
        around = flat - middle
        return middle, around[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]

    for row, column, to_row, to_column in ((0, 0, 0, 1), (0, 1, 1, 1), (1, 2, 1, 3)):
        here, ours = outline(0, row, column)
        there, theirs = outline(0, to_row, to_column)
        assert np.hypot(*(there - here)) == pytest.approx(layout.pitch)
        for middle, corners, other, shape in ((here, ours, there, theirs), (there, theirs, here, ours)):
            seen = corners + middle - other
            distance = np.hypot(*seen.T)
            gap = distance - radius_at(shape, np.arctan2(seen[:, 1], seen[:, 0]))
            assert gap.min() > 0.02
        # They do reach into each other.
        assert np.hypot(*ours.T).max() + np.hypot(*theirs.T).max() > layout.pitch + 0.5 * layout.tooth


def test_layers_do_not_touch():
    layout = gears.LAYOUT
    assert layout.layer_rise > layout.thickness
    assert gears.make().triangles.positions[2:, :, 1].min() == pytest.approx(layout.lift)


def test_half_of_the_wheels_are_clear():
    scene = gears.make()
    opacity = np.array([material.opacity for material in scene.materials])[scene.triangles.material[2:]]
    assert np.mean(opacity < 0.5) == 0.5
    floor = scene.materials[scene.triangles.material[0]]
    assert floor.specular > 0.3
    assert len(scene.materials) == 65
