"""Linear blend skinning: what normals and tangents stay to a surface that is stretched."""

import numpy as np
import pytest

from lippmann.scene.readers.gltf.skinning import deform


@pytest.mark.parametrize("mirrored", [False, True])
def test_normals_stay_upright_on_a_surface_that_is_stretched(mirrored):
    stretch = np.diag([-1.0 if mirrored else 1.0, 2.0, 4.0, 1.0])
    along, normal = np.array([1.0, -1.0, 0.0]), np.array([1.0, 1.0, 0.0])
    points = np.array([[0, 0, 0], along, [0, 0, 1]], np.float32)
    positions, normals, tangents, is_mirrored = deform(
        points,
        np.tile(normal, (3, 1)).astype(np.float32),
        np.tile([*along, 1.0], (3, 1)).astype(np.float32),
        np.zeros((3, 1), np.uint32),
        np.ones((3, 1), np.float32),
        stretch[None],
    )
    sides = positions[1] - positions[0], positions[2] - positions[0]
    assert normals @ np.transpose(sides) == pytest.approx(np.zeros((3, 2)), abs=1e-6)
    assert tangents[0, :3] == pytest.approx(sides[0])
    assert (is_mirrored, tangents[0, 3]) == (mirrored, -1 if mirrored else 1)


def test_weights_share_a_vertex_and_one_without_any_follows_its_first_joint():
    joints = np.stack([np.eye(4), np.eye(4)])
    joints[1, :3, 3] = 4, 0, 0
    points, which = np.zeros((2, 3), np.float32), np.array([[0, 1], [1, 0]], np.uint32)
    weights = np.array([[3.0, 1.0], [0.0, 0.0]], np.float32)
    positions, *_ = deform(points, None, None, which, weights, joints)
    assert positions[:, 0] == pytest.approx([1.0, 4.0])
