"""Points on casters: spread evenly over their area."""

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def a_mesh(flip=False):
    """Two triangles, one thrice as large as the other, and one without area between them."""
    import mitsuba as mi

    properties = mi.Properties()
    properties["flip_normals"] = flip
    mesh = mi.Mesh("mesh", 7, 3, props=properties)
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (5, 0, 0), (5, 3, 0), (5, 0, 1), (2, 2, 2)]
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.array(corners, np.float32).ravel()
    parameters["faces"] = np.array([(0, 1, 2), (6, 6, 6), (3, 4, 5)], np.uint32).ravel()
    parameters.update()
    return mesh


@pytest.mark.parametrize("flip", [False, True])
def test_points_of_a_mesh_are_spread_evenly(flip):
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.pbr.even_points import Triangles

    triangles = Triangles(a_mesh(flip))
    assert triangles.area == pytest.approx(2.0)
    side = 256
    y, x = (np.mgrid[0:side, 0:side] + 0.5) / side
    point, normal = triangles.point(mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel())))
    p, n = np.array(point).T, np.array(normal).T
    assert dr.all(dr.isfinite(point.x))
    is_small = p[:, 0] < 2
    assert is_small.mean() == pytest.approx(0.25, abs=2e-3)
    sign = -1 if flip else 1
    for chosen, direction, middle in (
        (is_small, (0, 0, sign), (1 / 3, 1 / 3, 0)),
        (~is_small, (sign, 0, 0), (5, 1, 1 / 3)),
    ):
        np.testing.assert_allclose(n[chosen], np.tile(direction, (chosen.sum(), 1)), atol=1e-6)
        assert p[chosen].mean(axis=0) == pytest.approx(middle, abs=5e-3)
    assert np.all(p[is_small, :2].sum(axis=1) <= 1 + 1e-5)
    assert np.all(p[~is_small, 1] / 3 + p[~is_small, 2] <= 1 + 1e-5)


def test_points_of_a_single_triangle_are_spread_evenly():
    import mitsuba as mi

    from lippmann.device.pbr.even_points import Triangles

    mesh = mi.Mesh("mesh", 3, 1)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.float32([0, 0, 0, 3, 0, 0, 0, 3, 0])
    parameters["faces"] = np.uint32([0, 1, 2])
    parameters.update()
    y, x = (np.mgrid[0:64, 0:64] + 0.5) / 64
    point, normal = Triangles(mesh).point(mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel())))
    p = np.array(point).T
    assert p.mean(axis=0) == pytest.approx([1, 1, 0], abs=0.02)
    assert np.unique(np.array(normal).T, axis=0).tolist() == [[0, 0, 1]]


def test_triangles_are_those_that_mitsuba_draws():
    """Of a ball: as large as its surface, and every point lies on it."""
    import mitsuba as mi

    from lippmann.device.pbr.even_points import Triangles

    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(3, 2.0)
    mesh = mi.Mesh("ball", len(ball.vertices), len(ball.faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = ball.vertices.astype(np.float32).ravel()
    parameters["faces"] = ball.faces.astype(np.uint32).ravel()
    parameters.update()
    triangles = Triangles(mesh)
    assert triangles.area == pytest.approx(ball.area, rel=1e-6)
    sample = np.random.default_rng(3).random((2, 4096))
    point, normal = triangles.point(mi.Point2f(mi.Float(sample[0]), mi.Float(sample[1])))
    p, n = np.array(point).T, np.array(normal).T
    assert np.linalg.norm(p, axis=1) == pytest.approx(np.full(4096, 2.0), rel=0.01)
    assert np.sum(p * n, axis=1) == pytest.approx(np.full(4096, 2.0), rel=0.02)
