"""The teapot's two forms stand on the same floor in the same place."""

import numpy as np

from lippmann.scene.bundled import teapot
from lippmann.scene.bundled.teapot_patches import tessellate


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
    scene, classic = teapot.describe(), teapot.make()
    described = []
    for instance in scene.instances:
        mesh, matrix = scene.meshes[instance.mesh], instance.world_from_mesh
        world = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
        described.append(world[mesh.faces])
    described = np.concatenate(described)
    ours = classic.triangles.positions
    assert described.shape == ours.shape
    tiles = len(described) - len(tessellate(teapot.LAYOUT.subdivisions).faces)
    # The classic scene lays the floor first.
    np.testing.assert_allclose(np.concatenate([described[-tiles:], described[:-tiles]]), ours, atol=1e-4)
    assert len(scene.cameras) == 1
    np.testing.assert_allclose(scene.cameras[0].world_from_camera[:3, 3], classic.camera.center)


def test_pot_stands_on_the_floor_and_within_it():
    scene = teapot.make()
    pot = scene.triangles.positions[scene.triangles.smooth].reshape(-1, 3)
    floor = scene.triangles.positions[~scene.triangles.smooth].reshape(-1, 3)
    assert pot[:, 1].min() == 0
    assert np.all(floor[:, 1] == 0)
    foot = pot[pot[:, 1] < 0.2 * teapot.LAYOUT.unit]
    assert np.all(foot.min(axis=0)[[0, 2]] > floor.min(axis=0)[[0, 2]])
    assert np.all(foot.max(axis=0)[[0, 2]] < floor.max(axis=0)[[0, 2]])


def test_normals_are_turned_with_the_pot():
    scene = teapot.make()
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
