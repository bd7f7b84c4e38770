"""The teapot's two forms stand on the same floor in the same place."""

import numpy as np
import pytest

from lippmann.errors import UsageError
from lippmann.scene.bundled import copper_teapot, teapot


def facing_and_vertex_normals(mesh):
    corners = mesh.positions[mesh.faces]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return facing / np.linalg.norm(facing, axis=1, keepdims=True), mesh.normals[mesh.faces]


def directed_edges(faces):
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)


def open_edges(faces):
    """Edges that have no opposite, as pairs (from, to)."""
    edges = {tuple(edge) for edge in directed_edges(faces)}
    return [edge for edge in edges if edge[::-1] not in edges]


def test_the_published_control_points():
    patches = teapot.patches()
    assert patches.shape == (32, 4, 4, 3)
    # 306 are printed; 4 of them are used by no patch, and the bottom repeats the 12 of the body's last ring.
    distinct = np.unique(patches.reshape(-1, 3).round(9), axis=0)
    assert len(distinct) == 306 - 4 - 12
    for printed in [
        (1.4, -0.784, 2.4),
        (0.749, -1.3375, 2.53125),
        (-0.98, 1.75, 1.875),
        (-2.0, 0.0, 0.9),
        (0.45, -0.8, 3.15),
        (0.0, 0.0, 2.85),
        (-0.112, 0.2, 2.7),
        (0.728, 1.3, 2.55),
        (-2.65, -0.3, 0.9375),
        (3.1, 0.66, 0.825),
        (3.525, -0.25, 2.49375),
        (3.45, 0.15, 2.5125),
        (0.798, -1.425, 0.0),
    ]:
        assert np.isclose(distinct, printed, atol=1e-9).all(axis=1).any(), printed


def test_same_points_as_the_standard_procedural_databases(shared_scenes):
    rows = (shared_scenes / "spd" / "teapot.nff").read_text().splitlines()
    numbers = [row.split() for row in rows]
    points = np.array([[float(x) for x in row] for row in numbers if len(row) == 6 and row[0][0] in "-.0123456789"])
    points = np.unique(points[:, :3], axis=0)
    pot = teapot.tessellate(6)
    ours = pot.positions[:, [0, 2, 1]] * (1, -1, 1)
    distances = np.linalg.norm(points[:, None] - ours[None], axis=2)
    assert distances.min(axis=1).max() < 2e-5  # the file has six digits
    assert distances.min(axis=0).max() < 2e-5


@pytest.mark.parametrize("n", [1, 2, 7])
def test_size_of_the_mesh(n):
    mesh = teapot.tessellate(n)
    assert len(mesh.faces) == 2 * 32 * n * n - 8 * n  # a cell at a pole is one triangle, on 8 patches
    assert mesh.faces.dtype == np.uint32
    assert mesh.faces.max() == len(mesh.positions) - 1
    assert len(np.unique(mesh.faces)) == len(mesh.positions)


def test_stands_on_the_floor_with_its_spout_along_x():
    mesh = teapot.tessellate(16)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    np.testing.assert_allclose(low, (-3.0, 0.0, -2.0), atol=1e-12)
    np.testing.assert_allclose(high, (3.434, 3.15, 2.0), atol=1e-3)
    spout = teapot.tessellate(4, ["spout"])
    assert spout.positions[:, 0].min() > 0


@pytest.mark.parametrize("n", [2, 5, 8])
@pytest.mark.parametrize(("part", "rims"), [("body", [2.4]), ("lid", [2.4]), ("handle", None), ("spout", None)])
def test_seams_are_closed(part, rims, n):
    mesh = teapot.tessellate(n, [part])
    edges = directed_edges(mesh.faces)
    assert len(np.unique(edges, axis=0)) == len(edges)  # no edge twice in one direction: two faces agree on it
    border = open_edges(mesh.faces)
    ends = np.array(border)
    np.testing.assert_array_equal(np.sort(ends[:, 0]), np.sort(ends[:, 1]))  # closed loops
    if rims is None:
        assert len(border) == 2 * 2 * n
    else:
        assert len(border) == 4 * n
        np.testing.assert_allclose(mesh.positions[ends, 1], rims[0])


def test_no_vertex_is_doubled():
    for part in teapot.PARTS:
        positions = teapot.tessellate(6, [part]).positions
        assert len(np.unique(positions.round(9), axis=0)) == len(positions)


def test_normals_are_the_surfaces():
    mesh = teapot.tessellate(24)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-12)
    facing, normals = facing_and_vertex_normals(mesh)
    agreement = np.einsum("tk,tck->tc", facing, normals)
    assert agreement.min() > 0.8  # the lip of the spout is the tightest bend
    assert np.median(agreement) > 0.998


def test_normals_point_outward():
    mesh = teapot.tessellate(12, ["body"])
    belly = (mesh.positions[:, 1] > 0.5) & (mesh.positions[:, 1] < 2.2)
    outward = mesh.positions[belly] * (1, 0, 1)
    assert np.all(np.einsum("vk,vk->v", mesh.normals[belly], outward) > 0)
    bottom = mesh.positions[:, 1] == mesh.positions[:, 1].min()
    assert np.all(mesh.normals[bottom][:, 1] < -0.99)
    lid = teapot.tessellate(12, ["lid"])
    np.testing.assert_allclose(lid.normals[np.argmax(lid.positions[:, 1])], (0, 1, 0), atol=1e-12)
    for part, axis in (("handle", -2.0), ("spout", 2.4)):
        tube = teapot.tessellate(12, [part])
        cut = np.abs(tube.positions[:, 2]) == np.abs(tube.positions[:, 2]).max()
        assert cut.any(), axis
        assert np.all(tube.normals[cut][:, 2] * tube.positions[cut][:, 2] > 0)


@pytest.mark.slow
def test_volume_of_the_body():
    """Divergence theorem over the triangles and the flat lid on its rim, against the integral along the profile."""
    mesh = teapot.tessellate(32, ["body"])
    a, b, c = (mesh.positions[mesh.faces[:, k]] for k in range(3))
    volume = np.einsum("tk,tk->", a, np.cross(b, c)) / 6
    top = np.array((0.0, 2.4, 0.0))
    rim = mesh.positions[np.array(open_edges(mesh.faces))]
    volume += np.einsum("ek,k->", np.cross(rim[:, 1], rim[:, 0]), top) / 6

    t, weights = np.polynomial.legendre.leggauss(12)
    t, weights = (t + 1) / 2, weights / 2
    basis = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3])
    slope = np.stack([-3 * (1 - t) ** 2, 3 * (1 - t) * (1 - 3 * t), 3 * t * (2 - 3 * t), 3 * t * t])
    quarter = np.array([(1, 0), (1, 0.56), (0.56, 1), (0, 1)])
    (x, y), (dx, dy) = quarter.T @ basis, quarter.T @ slope
    circle = 4 * np.sum(weights * (x * dy - y * dx)) / 2
    expected = 0.0
    profile = np.array(teapot._BODY_PROFILE)
    for first in range(0, len(profile) - 1, 3):
        radius = profile[first : first + 4, 0] @ basis
        expected -= circle * np.sum(weights * radius**2 * (profile[first : first + 4, 1] @ slope))
    assert circle == pytest.approx(np.pi, rel=0.01)
    assert volume == pytest.approx(expected, rel=1e-3)


def test_bad_requests():
    with pytest.raises(UsageError, match="at least 1"):
        teapot.tessellate(0)
    with pytest.raises(UsageError, match="body, lid, handle, spout"):
        teapot.tessellate(2, ["cup"])


def test_tiles_are_a_checkerboard_that_faces_up():
    layout = teapot.LAYOUT
    light, dark = teapot.tiles(light=True), teapot.tiles(light=False)
    assert len(light[1]) + len(dark[1]) == 2 * layout.rows * layout.columns
    for positions, faces in (light, dark):
        corners = positions[faces]
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        np.testing.assert_allclose(facing, np.tile((0, layout.tile**2, 0), (len(faces), 1)), atol=1e-9)

    def cells(tiles):
        middles = tiles[0].reshape(-1, 4, 3).mean(axis=1)
        low = np.array([-layout.columns, -layout.rows]) * layout.tile / 2 + (0, layout.floor_shift)
        return {tuple(cell) for cell in np.floor((middles[:, [0, 2]] - low) / layout.tile).astype(int)}

    every = {(column, row) for column in range(layout.columns) for row in range(layout.rows)}
    assert cells(light) == {(column, row) for column, row in every if (column + row) % 2 == 0}
    assert cells(dark) == every - cells(light)


def test_spout_turns_toward_the_viewer():
    tip = np.array([3.4, 2.4, 0, 1])
    x, _, z, _ = teapot.pot_from_newell() @ tip
    assert x > 0
    assert z > 0


def test_both_forms_share_their_geometry():
    scene, classic = teapot.describe(), copper_teapot.make()
    described = []
    for instance in scene.instances:
        mesh, matrix = scene.meshes[instance.mesh], instance.world_from_mesh
        world = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
        described.append(world[mesh.faces])
    described = np.concatenate(described)
    ours = classic.triangles.positions
    assert described.shape == ours.shape
    tiles = len(described) - len(teapot.tessellate(teapot.LAYOUT.subdivisions).faces)
    # The classic scene lays the floor first.
    np.testing.assert_allclose(np.concatenate([described[-tiles:], described[:-tiles]]), ours, atol=1e-4)
    assert len(scene.cameras) == 1
    np.testing.assert_allclose(scene.cameras[0].world_from_camera[:3, 3], classic.camera.center)


def test_pot_stands_on_the_floor_and_within_it():
    scene = copper_teapot.make()
    pot = scene.triangles.positions[scene.triangles.smooth].reshape(-1, 3)
    floor = scene.triangles.positions[~scene.triangles.smooth].reshape(-1, 3)
    assert pot[:, 1].min() == 0
    assert np.all(floor[:, 1] == 0)
    foot = pot[pot[:, 1] < 0.2 * teapot.LAYOUT.unit]
    assert np.all(foot.min(axis=0)[[0, 2]] > floor.min(axis=0)[[0, 2]])
    assert np.all(foot.max(axis=0)[[0, 2]] < floor.max(axis=0)[[0, 2]])


def test_normals_are_turned_with_the_pot():
    scene = copper_teapot.make()
    smooth = scene.triangles.smooth
    np.testing.assert_allclose(np.linalg.norm(scene.triangles.normals[smooth], axis=-1), 1, atol=1e-12)
    corners = scene.triangles.positions[smooth]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    assert np.median(np.einsum("tk,tck->tc", facing, scene.triangles.normals[smooth])) > 0.997


def test_studio_shines_from_above():
    sky = teapot.describe().environment.pixels
    assert sky.dtype == np.float32
    assert sky.shape[1] == 2 * sky.shape[0]
    assert sky.min() > 0
    half = len(sky) // 2
    assert sky[:half].mean() > 4 * sky[half:].mean()
