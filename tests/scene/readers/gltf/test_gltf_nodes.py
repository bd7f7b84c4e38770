"""Node trees: transformations, instances, scenes, skins."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf.nodes import normal_matrices, rigid

HALF = 0.5**0.5
TURN_Z = [0, 0, HALF, HALF]  # a quarter turn that takes x to y


def _refusal(read, writer):
    with pytest.raises(SceneError) as caught:
        read(writer)
    return str(caught.value)


def test_scale_then_rotation_then_translation_down_the_tree(writer, read, world_points):
    mesh = writer.mesh()
    writer.node(children=[1], translation=[10, 0, 0], rotation=TURN_Z)
    writer.node(mesh=mesh, scale=[2, 3, 4], translation=[1, 0, 5])
    # scaled (0,0,0) (2,0,0) (0,3,0); moved by (1,0,5); turned (x,y) -> (-y,x); moved by (10,0,0)
    np.testing.assert_allclose(world_points(read(writer)), [[10, 1, 5], [10, 3, 5], [7, 1, 5]], atol=1e-12)


def test_a_node_scales_along_its_own_axes(writer, read, world_points):
    writer.node(mesh=writer.mesh(), rotation=TURN_Z, scale=[2, 3, 1])
    np.testing.assert_allclose(world_points(read(writer)), [[0, 0, 0], [0, 2, 0], [-3, 0, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("quaternion", "image_of_x"),
    [
        ([HALF, 0, 0, HALF], [1, 0, 0]),
        ([0, HALF, 0, HALF], [0, 0, -1]),
        ([0, 0, 5, 5], [0, 1, 0]),
        ([0, 1, 0, 0], [-1, 0, 0]),
    ],
)
def test_rotations(writer, read, world_points, quaternion, image_of_x):
    writer.node(mesh=writer.mesh(), rotation=quaternion)
    np.testing.assert_allclose(world_points(read(writer))[1], image_of_x, atol=1e-12)


def test_a_matrix_is_stored_by_columns(writer, read, world_points):
    writer.node(mesh=writer.mesh(), matrix=[0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1])
    np.testing.assert_allclose(world_points(read(writer)), [[7, 8, 9], [7, 9, 9], [6, 8, 9]])


def test_a_mesh_shown_by_many_nodes_is_kept_once(writer, read, world_points):
    mesh = writer.mesh()
    for x in range(3):
        writer.node(mesh=mesh, translation=[x, 0, 0])
    scene = read(writer)
    assert len(scene.meshes) == 1
    assert [instance.mesh for instance in scene.instances] == [0, 0, 0]
    np.testing.assert_array_equal(world_points(scene)[::3, 0], [0, 1, 2])


def test_meshes_of_the_same_data_and_material_are_one(writer, read):
    first = writer.mesh()
    writer.node(mesh=first)
    writer.node(mesh=writer.add("meshes", primitives=writer.json["meshes"][first]["primitives"]))
    scene = read(writer)
    assert len(scene.meshes) == 1
    assert [instance.mesh for instance in scene.instances] == [0, 0]


def test_the_default_scene_is_shown(writer, read):
    for name in "abc":
        writer.json["meshes"] = writer.json.get("meshes", [])
        writer.json["meshes"][writer.mesh()]["name"] = name
        writer.node(mesh=len(writer.json["meshes"]) - 1)
    writer.json["scenes"] = [{"nodes": [0]}, {"nodes": [1, 2], "name": "second"}]
    assert [mesh.name for mesh in read(writer).meshes] == ["a"]
    writer.json["scene"] = 1
    del writer.json["buffers"]
    scene = read(writer)
    assert [mesh.name for mesh in scene.meshes] == ["b", "c"]
    assert scene.notes == ("of 2 scenes 'second' is shown",)


def test_without_a_scene_all_nodes_are_shown(writer, read):
    writer.triangle().json["scenes"] = []
    scene = read(writer)
    assert len(scene.instances) == 1
    assert scene.notes == ("the file has no scene; all its nodes are shown",)


def test_a_child_that_the_scene_lists_too_is_placed_once(writer, read, world_points):
    mesh = writer.mesh()
    writer.node(children=[1], translation=[1, 0, 0])
    writer.node(mesh=mesh, translation=[0, 1, 0])
    writer.json["scenes"] = [{"nodes": [1, 0]}]
    scene = read(writer)
    assert len(scene.instances) == 1
    np.testing.assert_array_equal(world_points(scene)[0], [1, 1, 0])


def test_hidden_nodes_hide_what_is_below_them_but_no_cameras(writer, read):
    mesh = writer.mesh()
    camera = writer.add("cameras", type="perspective", perspective={"yfov": 1.0, "znear": 0.1})
    writer.node(mesh=mesh)
    writer.node(mesh=mesh, children=[2], extensions={"KHR_node_visibility": {"visible": False}})
    writer.node(mesh=mesh, camera=camera, extensions={"KHR_node_visibility": {"visible": True}})
    scene = read(writer)
    assert len(scene.instances) == 1
    assert len(scene.cameras) == 1


def test_deep_trees_are_walked(writer, read, world_points):
    mesh = writer.mesh()
    depth = 5000
    for i in range(depth):
        writer.node(children=[i + 1], translation=[1, 0, 0])
    writer.node(mesh=mesh)
    assert world_points(read(writer))[0, 0] == depth


@pytest.mark.parametrize(
    ("children", "roots", "words"),
    [
        ([[0]], [0], "nodes[0] is its own ancestor"),
        ([[1], [2], [0]], [0], "is its own ancestor"),
        ([[1], [2], [1]], [0], "nodes[1] is a child of nodes[0] and of nodes[2]"),
        ([[1, 1], []], [0], "nodes[1] is a child of nodes[0] and of nodes[0]"),
        ([[5]], [0], "nodes[0].children is [5]; there are 1 nodes"),
        ([[]], [3], "scenes[0].nodes is [3]; there are 1 nodes"),
        ([[]], [-1], "whole number"),
        ([["a"]], [0], "whole number"),
    ],
)
def test_what_is_no_tree_is_refused(writer, read, children, roots, words):
    mesh = writer.mesh()
    for listed in children:
        writer.node(mesh=mesh, children=listed)
    writer.json["scenes"] = [{"nodes": roots}]
    assert words in _refusal(read, writer)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"mesh": 1}, "nodes[0].mesh is 1; there are 1 meshes"),
        ({"camera": 0}, "nodes[0].camera is 0; there are 0 cameras"),
        ({"skin": 0}, "nodes[0].skin is 0; there are 0 skins"),
        ({"rotation": [0, 0, 0, 0]}, "a quaternion of length 0"),
        ({"rotation": [0, 0, 1]}, "4 numbers belong here"),
        ({"scale": [1, 1, "1"]}, "a number belongs here"),
        ({"scale": [1, 1, 1e300]}, "up to 1e+18"),
        ({"scale": [1, 1, float("nan")]}, "up to 1e+18"),
        ({"translation": 3}, "a list belongs here"),
        ({"matrix": [1] * 15}, "16 numbers belong here"),
        ({"matrix": [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}, "its last row must be 0, 0, 0, 1"),
        ({"extensions": 3}, "an object belongs here"),
    ],
)
def test_bad_nodes_are_refused(writer, read, values, words):
    writer.triangle().json["nodes"][0].update(values)
    assert words in _refusal(read, writer)


def test_scene_index_out_of_range_is_refused(writer, read):
    writer.triangle().json["scene"] = 1
    assert "scene is 1; there are 1 scenes" in _refusal(read, writer)


def test_transformations_that_overflow_are_refused(writer, read):
    mesh = writer.mesh()
    writer.node(children=[1], scale=[1e17] * 3)
    writer.node(children=[2], scale=[1e17] * 3)
    writer.node(mesh=mesh)
    assert "transformation of nodes[1] overflows" in _refusal(read, writer)


def test_vertices_that_leave_single_precision_are_refused(writer, read):
    writer.node(mesh=writer.mesh([[0, 0, 0], [1e30, 0, 0], [0, 1, 0]]), scale=[1e17] * 3)
    assert "beyond all bounds" in _refusal(read, writer)


def test_a_flattened_mesh_is_flattened_in_its_vertices(writer, read, world_points):
    mesh = writer.mesh([[0, 0, 3], [1, 0, 4], [0, 1, 5]])
    writer.node(mesh=mesh, scale=[2, 2, 0], translation=[0, 0, 7])
    writer.node(mesh=mesh, scale=[0, 1, 1])
    scene = read(writer)
    np.testing.assert_allclose(world_points(scene, 0), [[0, 0, 7], [2, 0, 7], [0, 2, 7]])
    np.testing.assert_allclose(world_points(scene, 1), [[0, 0, 3], [0, 0, 4], [0, 1, 5]])
    assert np.linalg.det(scene.instances[0].world_from_mesh) == 1.0


def test_a_mesh_scaled_to_nothing_is_noted(writer, read):
    writer.triangle().node(mesh=0, scale=[0, 0, 1])
    scene = read(writer)
    assert len(scene.instances) == 1
    assert scene.notes == ("a mesh that is scaled to nothing is left out (nodes[1])",)


def test_gpu_instances(writer, read, world_points):
    attributes = {
        "TRANSLATION": writer.accessor([[0, 0, 1], [0, 0, 2]]),
        "ROTATION": writer.accessor([[0, 0, 0, 127], [0, 0, 90, 90]], "i1", normalized=True),
        "SCALE": writer.accessor([[1, 1, 1], [2, 2, 2]]),
        "_ID": 99,
    }
    writer.node(
        mesh=writer.mesh(), translation=[10, 0, 0], extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    )
    scene = read(writer)
    assert len(scene.meshes) == 1
    np.testing.assert_allclose(world_points(scene, 0), [[10, 0, 1], [11, 0, 1], [10, 1, 1]], atol=1e-6)
    np.testing.assert_allclose(world_points(scene, 1), [[10, 0, 2], [10, 2, 2], [8, 0, 2]], atol=1e-6)


def test_colours_of_copies_are_noted(writer, read):
    attributes = {"TRANSLATION": writer.accessor([[0, 0, 1]]), "_COLOR_0": 99}
    writer.node(mesh=writer.mesh(), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    assert read(writer).notes[0].startswith("colours of copies are left out")


@pytest.mark.parametrize(
    ("key", "values", "words"),
    [
        ("ROTATION", [[0, 0, 0, 1]], "differ in length"),
        ("ROTATION", [[0, 0, 0, 1], [0, 0, 0, 0]], "a quaternion of length 0"),
        ("SCALE", [[1, 1, 1], [1, np.nan, 1]], "its values must be finite"),
    ],
)
def test_bad_gpu_instances_are_refused(writer, read, key, values, words):
    attributes = {"TRANSLATION": writer.accessor([[0, 0, 1], [0, 0, 2]]), key: writer.accessor(values)}
    writer.node(mesh=writer.mesh(), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    assert words in _refusal(read, writer)


def test_a_list_of_no_copies_shows_none(writer, read):
    attributes = {"TRANSLATION": writer.accessor(np.zeros((0, 3)))}
    writer.triangle().node(mesh=0, extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    assert len(read(writer).instances) == 1


def test_copies_of_copies_are_limited(writer, read, monkeypatch):
    monkeypatch.setattr("lippmann.scene.readers.gltf.reader._MOST_INSTANCES", 25)
    attributes = {"TRANSLATION": writer.accessor(np.zeros((10, 3)))}
    mesh = writer.mesh()
    for _ in range(3):
        writer.node(mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    assert "nodes[2] brings the copies of meshes to more than 25" in _refusal(read, writer)


def _skinned(writer, joints=((0, 1, 0, 0),) * 3, weights=((0.25, 0.75, 0, 0),) * 3, **skin):
    attributes = {
        "JOINTS_0": writer.accessor(joints, "u1"),
        "WEIGHTS_0": writer.accessor(weights),
        "NORMAL": writer.accessor([[1, 0, 0]] * 3),
    }
    mesh = writer.mesh(attributes=attributes)
    writer.node(children=[1, 2], translation=[0, 0, 100])
    writer.node(translation=[4, 0, 0])
    writer.node(children=[3])
    writer.node(translation=[0, 8, 0], rotation=TURN_Z)
    inverse = np.tile(np.eye(4), (2, 1, 1))
    inverse[1, 0, 3] = -1.0  # the second joint was bound at x = 1
    bind = writer.accessor(inverse.transpose(0, 2, 1).reshape(2, 16))
    writer.add("skins", **{"joints": [1, 3], "inverseBindMatrices": bind, **skin})
    writer.node(mesh=mesh, skin=0, translation=[1000, 0, 0])
    return writer


def test_a_skin_places_its_mesh_by_the_joints(writer, read, world_points):
    scene = read(_skinned(writer))
    # joint 1 takes (x, y, z) to (x + 4, y, z + 100); joint 3 takes it to (-y, x - 1 + 8, z + 100)
    by_first = np.array([[4, 0, 100], [5, 0, 100], [4, 1, 100]])
    by_second = np.array([[0, 7, 100], [0, 8, 100], [-1, 7, 100]])
    np.testing.assert_allclose(world_points(scene), 0.25 * by_first + 0.75 * by_second, rtol=1e-6)
    np.testing.assert_allclose(scene.meshes[0].normals, [[0.1**0.5, 0.9**0.5, 0]] * 3, atol=1e-6)


def test_weights_are_brought_to_one_and_none_means_the_first_joint(writer, read, world_points):
    weights = ((0, 3, 0, 0), (0, 0, 0, 0), (2, 0, 0, 0))
    scene = read(_skinned(writer, weights=weights))
    np.testing.assert_allclose(world_points(scene), [[0, 7, 100], [5, 0, 100], [4, 1, 100]], atol=1e-5)


def test_a_skin_without_inverse_bind_matrices(writer, read, world_points):
    weights = ((1, 0, 0, 0),) * 3
    scene = read(_skinned(writer, weights=weights, inverseBindMatrices=None))
    np.testing.assert_allclose(world_points(scene)[0], [4, 0, 100])


def test_joints_that_mirror_turn_the_triangles_round(writer, read):
    _skinned(writer).json["nodes"][0]["scale"] = [-1, 1, 1]
    tangents = writer.accessor(np.float32([[1, 0, 0, 1]] * 3))
    writer.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = tangents
    mesh = read(writer).meshes[0]
    np.testing.assert_array_equal(mesh.faces, [[2, 1, 0]])
    # joint 1 takes (1, 0, 0) to (-1, 0, 0), joint 3 to (0, 1, 0); they hold a quarter and three.
    np.testing.assert_allclose(mesh.tangents, [[-(0.1**0.5), 0.9**0.5, 0, -1]] * 3, atol=1e-6)


def test_unused_joints_may_be_out_of_range(writer, read):
    scene = read(_skinned(writer, joints=((0, 1, 77, 0),) * 3))
    assert len(scene.meshes) == 1


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"joints": []}, "a skin has at least one"),
        ({"joints": [1, 77]}, "skins[0].joints is [1, 77]; there are 5 nodes"),
        ({"joints": [1, 2, 3]}, "2 matrices for 3 joints"),
        ({"inverseBindMatrices": 77}, "there are 5 accessors"),
        ({"inverseBindMatrices": 0}, "MAT4 belongs here"),
    ],
)
def test_bad_skins_are_refused(writer, read, values, words):
    _skinned(writer).json["skins"][0].update(values)
    assert words in _refusal(read, writer)


def test_a_joint_in_use_that_does_not_exist_is_refused(writer, read):
    assert "it names joint 7 of 2" in _refusal(read, _skinned(writer, joints=((0, 7, 0, 0),) * 3))


@pytest.mark.parametrize(("key", "words"), [("JOINTS_0", "needs it"), ("WEIGHTS_0", "joints need weights")])
def test_a_skinned_mesh_needs_joints_and_weights(writer, read, key, words):
    del _skinned(writer).json["meshes"][0]["primitives"][0]["attributes"][key]
    assert words in _refusal(read, writer)


def test_normals_turn_by_the_inverse_transpose():
    matrix = np.array([[2.0, 1.0, 0.0], [0.0, 3.0, 0.0], [0.5, 0.0, -1.0]])  # mirrors
    expected = np.linalg.inv(matrix).T
    found = normal_matrices(matrix)
    np.testing.assert_allclose(found / np.linalg.norm(found), expected / np.linalg.norm(expected))


@pytest.mark.parametrize("scale", [(2, 3, 4), (-1, 1, 1), (0, 1, 1), (1, 0, 1), (0, 0, 0)])
def test_rigid_leaves_a_right_handed_frame_that_looks_the_same_way(scale):
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) * scale
    matrix[:3, 3] = [1, 2, 3]
    frame = rigid(matrix)
    np.testing.assert_allclose(frame[:3, :3] @ frame[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    np.testing.assert_allclose(frame[:3, 2], [0, 0, 1])
    np.testing.assert_array_equal(frame[:, 3], [1, 2, 3, 1])
    if scale[1]:
        np.testing.assert_allclose(frame[:3, 1], [-1, 0, 0])


def test_avatars_of_vrm_0_turn_to_the_viewer(writer, read, world_points):
    """Version 0 has them face -z, version 1 +z."""
    writer.node(children=[1], translation=[0, 0, 1])
    writer.node(mesh=writer.mesh(), translation=[1, 2, 0])
    writer.json["extensions"] = {"VRMC_vrm": {}}
    ahead = world_points(read(writer))
    writer.json["extensions"] = {"VRM": {}}
    scene = read(writer)
    np.testing.assert_allclose(world_points(scene), ahead * (-1, 1, -1), atol=1e-12)
    assert scene.notes == ("turned by 180 degrees: avatars of VRM 0 stand with their backs to the viewer",)
