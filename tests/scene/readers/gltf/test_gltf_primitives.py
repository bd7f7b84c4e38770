"""Primitives: modes, attributes, morph targets."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.errors import SceneError

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]]


def _refusal(read, writer):
    with pytest.raises(SceneError) as caught:
        read(writer)
    return str(caught.value)


@pytest.mark.parametrize(
    ("mode", "count", "faces"),
    [
        (4, 3, [[0, 1, 2]]),
        (5, 5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, 5, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]),
    ],
)
def test_modes_of_triangles(writer, read, mode, count, faces):
    writer.triangle(positions=SQUARE[:count], mode=mode)
    np.testing.assert_array_equal(read(writer).meshes[0].faces, faces)


@pytest.mark.parametrize("mode", [5, 6])
@pytest.mark.parametrize("count", [1, 2])
def test_strips_and_fans_too_short_for_a_triangle_hold_none(writer, read, mode, count):
    writer.triangle(positions=SQUARE[:count], mode=mode)
    assert "shows no triangles" in _refusal(read, writer)


@pytest.mark.parametrize(
    ("mode", "lines"), [(1, [(0, 1), (2, 3)]), (2, [(0, 1), (1, 2), (2, 3), (3, 0)]), (3, [(0, 1), (1, 2), (2, 3)])]
)
def test_lines_are_rods(writer, read, mode, lines):
    scene = read(writer.triangle(positions=SQUARE[:4], mode=mode))
    (mesh,) = scene.meshes
    radius = 0.005 * 2**0.5  # of the diagonal of the square
    assert scene.notes == ("lines are drawn as rods of a radius of 0.50 % of the scene's diagonal",)
    for rod, (start, end) in zip(np.split(mesh.positions, len(lines)), lines, strict=True):
        np.testing.assert_allclose(rod.mean(axis=0), np.mean([SQUARE[start], SQUARE[end]], axis=0), atol=1e-6)
        near = np.linalg.norm(rod - SQUARE[start], axis=1) < 0.5
        np.testing.assert_allclose(np.linalg.norm(rod[near] - SQUARE[start], axis=1), radius, rtol=1e-4)


def test_points_are_balls_with_the_colours_of_their_vertices(writer, read):
    colors = writer.accessor([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    scene = read(writer.triangle(mode=0, attributes={"COLOR_0": colors}))
    (mesh,) = scene.meshes
    assert mesh.faces.shape == (3 * 512, 3)
    for color, place in zip(np.eye(3), [[0, 0, 0], [1, 0, 0], [0, 1, 0]], strict=True):
        mine = mesh.positions[(mesh.colors == color).all(axis=1)]
        np.testing.assert_allclose(np.linalg.norm(mine - place, axis=1), 0.01 * 2**0.5, rtol=1e-4)
    assert scene.notes == ("points are drawn as balls of a radius of up to 1.00 % of the scene's diagonal",)


def test_points_stand_where_all_nodes_place_them_at_one_size(writer, read):
    mesh = writer.mesh(mode=0)
    writer.node(mesh=mesh, scale=[10, 1, 1])
    writer.node(mesh=mesh, translation=[0, 5, 0])
    flat = writer.node(mesh=writer.mesh(), scale=[100, 0, 1])
    scene = read(writer)
    (place,) = {instance.mesh for instance in scene.instances} - {len(scene.meshes) - 1}
    balls = np.split(scene.meshes[place].positions, 6)
    places = [[0, 0, 0], [10, 0, 0], [0, 1, 0], [0, 5, 0], [1, 5, 0], [0, 6, 0]]
    np.testing.assert_allclose([ball.mean(axis=0) for ball in balls], places, atol=1e-5)
    for ball, middle in zip(balls, places, strict=True):
        radius = 0.01 * (100**2 + 6**2) ** 0.5
        np.testing.assert_allclose(np.linalg.norm(ball - middle, axis=1), radius, rtol=1e-5)
    assert flat == 2


@pytest.mark.parametrize("lit", [False, True])
def test_points_without_normals_show_colour_and_emission_unshaded(writer, read, lit):
    writer.add("materials", pbrMetallicRoughness={"baseColorFactor": [0.5, 0.25, 0, 1]}, emissiveFactor=[0, 0.5, 0.75])
    attributes = {"NORMAL": writer.accessor([[0, 0, 1]] * 3)} if lit else {}
    writer.triangle(material=0, mode=0, attributes=attributes).triangle(material=0)
    scene = read(writer)
    points, triangle = (scene.materials[mesh.material] for mesh in scene.meshes)
    assert (triangle.unlit, triangle.base_color) == (False, (0.5, 0.25, 0))
    assert (points.unlit, points.base_color) == (not lit, (0.5, 0.25, 0) if lit else (0.5, 0.75, 0.75))


def test_lines_of_no_length_are_nothing_to_see(writer, read):
    said = _refusal(read, writer.triangle(positions=[[1, 1, 1]] * 2, mode=1))
    assert "shows no triangles, lines, points or splats" in said


def test_of_too_many_points_some_are_drawn(writer, read, monkeypatch):
    monkeypatch.setattr("lippmann.scene.readers.gltf.points_lines.MOST", 2)
    colors = writer.accessor(np.eye(4, dtype="f4")[[0, 1, 2, 3, 0]])
    scene = read(writer.triangle(positions=SQUARE, mode=0, attributes={"COLOR_0": colors}))
    assert scene.notes[0] == "of 5 points one in 3 is drawn"
    balls = np.split(scene.meshes[0].positions, 2)
    np.testing.assert_allclose([ball.mean(axis=0) for ball in balls], [SQUARE[0], SQUARE[3]], atol=1e-6)
    assert {tuple(color) for color in scene.meshes[0].colors.tolist()} == {(1, 0, 0, 0), (0, 0, 0, 1)}


def test_of_too_many_lines_some_are_drawn(writer, read, monkeypatch):
    """The Khronos group's test of modes has half a million of them."""
    monkeypatch.setattr("lippmann.scene.readers.gltf.points_lines.MOST", 2)
    scene = read(writer.triangle(positions=[*SQUARE, SQUARE[0]], mode=3))
    assert scene.notes[0] == "of 5 lines one in 3 is drawn"
    rods = [rod.mean(axis=0) for rod in np.split(scene.meshes[0].positions, 2)]
    np.testing.assert_allclose(rods, [np.mean(SQUARE[:2], axis=0), np.mean(SQUARE[3:5], axis=0)], atol=1e-6)


def test_too_many_copies_of_points_are_refused(writer, read, monkeypatch):
    monkeypatch.setattr("lippmann.scene.readers.gltf.points_lines.MOST", 2)
    writer.triangle(mode=0)
    places = writer.accessor([[0, 0, 0]] * 3)
    writer.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}
    assert "the file shows 9 points; up to 2 copies are drawn" in _refusal(read, writer)


def test_strips_lose_the_triangles_that_only_turn_corners(writer, read):
    writer.triangle(positions=SQUARE, mode=5, indices=writer.accessor([0, 1, 2, 2, 3, 4], "u1"))
    np.testing.assert_array_equal(read(writer).meshes[0].faces, [[0, 1, 2], [2, 4, 3]])


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4"])
def test_indices_of_all_widths(writer, read, dtype):
    writer.triangle(positions=SQUARE, indices=writer.accessor([0, 1, 2, 0, 2, 3, 3, 2, 4], dtype))
    np.testing.assert_array_equal(read(writer).meshes[0].faces, [[0, 1, 2], [0, 2, 3], [3, 2, 4]])


def test_vertices_that_no_triangle_uses_are_left_out(writer, read):
    far = [*SQUARE[:4], [100, 100, 100]]
    writer.triangle(
        positions=far, indices=writer.accessor([1, 2, 3], "u2"), attributes={"NORMAL": writer.accessor(far)}
    )
    mesh = read(writer).meshes[0]
    np.testing.assert_array_equal(mesh.positions, SQUARE[1:4])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2]])
    assert len(mesh.normals) == 3


def test_missing_normals_mean_flat_triangles(writer, read):
    assert read(writer.triangle()).meshes[0].normals is None


def test_normals_get_unit_length(writer, read):
    writer.triangle(attributes={"NORMAL": writer.accessor([[0, 0, 2], [3, 0, 4], [0, 1, 0]])})
    np.testing.assert_allclose(read(writer).meshes[0].normals, [[0, 0, 1], [0.6, 0, 0.8], [0, 1, 0]], atol=1e-7)


@pytest.mark.parametrize("bad", [[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0]])
def test_normals_without_direction_come_from_the_triangles(writer, read, bad):
    writer.triangle(attributes={"NORMAL": writer.accessor([bad, [1, 0, 0], [0, 1, 0]])})
    scene = read(writer)
    np.testing.assert_allclose(scene.meshes[0].normals, [[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    assert scene.notes == ("normals without a direction were taken from the triangles (meshes[0].primitives[0])",)


@pytest.mark.parametrize(
    ("dtype", "values"),
    [
        ("f4", [[1, 0.5, 0], [0, 1, 0], [0, 0, 0.2]]),
        ("u1", [[255, 127.5, 0], [0, 255, 0], [0, 0, 51]]),
        ("u2", [[65535, 32767.5, 0], [0, 65535, 0], [0, 0, 13107]]),
    ],
)
@pytest.mark.parametrize("normalized", [True, False])
def test_vertex_colours(writer, read, dtype, values, normalized):
    color = writer.accessor(values, dtype, normalized=normalized)
    colors = read(writer.triangle(attributes={"COLOR_0": color})).meshes[0].colors
    np.testing.assert_allclose(colors, [[1, 0.5, 0], [0, 1, 0], [0, 0, 0.2]], atol=0.003)


def test_vertex_colours_with_alpha_and_out_of_range(writer, read):
    color = writer.accessor([[2, 0.5, -1, 0.25], [np.nan, 1, 0, 1], [0, 0, 0, 1]])
    scene = read(writer.triangle(attributes={"COLOR_0": color}))
    np.testing.assert_allclose(scene.meshes[0].colors, [[1, 0.5, 0, 0.25], [0, 1, 0, 1], [0, 0, 0, 1]])
    assert scene.notes == ("colours that are not finite were set to 0 (meshes[0].primitives[0])",)


def test_sets_of_texture_coordinates(writer, read):
    sets = [[[0, 0], [1, 0], [0, 1]], [[0, 0], [0.5, 0], [0, 0.5]]]
    attributes = {f"TEXCOORD_{i}": writer.accessor(uvs) for i, uvs in enumerate(sets)}
    mesh = read(writer.triangle(attributes=attributes)).meshes[0]
    np.testing.assert_array_equal(np.array(mesh.uvs), np.array(sets, np.float32))


@pytest.mark.parametrize(("named", "given"), [(1, 1), (-1, 0)])
def test_a_texture_without_its_coordinates_gets_one_texel(writer, read, named, given):
    """The set -1 is Blender's word for there being none."""
    info = {"index": writer.texture([[[1, 2, 3]]]), "texCoord": named}
    writer.add("materials", normalTexture=info)
    uvs = writer.accessor([[0, 0], [1, 0], [0, 1]])
    scene = read(writer.triangle(material=0, attributes={f"TEXCOORD_{index}": uvs for index in range(given)}))
    assert len(scene.meshes[0].uvs) == given + 1
    assert not scene.meshes[0].uvs[given].any()
    assert "lacks" in scene.notes[0]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertices_must_be_finite(writer, read, value):
    writer.triangle(positions=[[0, 0, 0], [1, value, 0], [0, 1, 0]])
    assert "vertex 1 of meshes[0].primitives[0] is not finite" in _refusal(read, writer)


def test_index_beyond_the_vertices_is_refused(writer, read):
    writer.triangle(indices=writer.accessor([0, 1, 3], "u4"))
    assert "name vertex 3; there are 3" in _refusal(read, writer)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mode": 7}, "primitives[0].mode is 7"),
        ({"mode": "TRIANGLES"}, "whole number"),
        ({"indices": 9}, "primitives[0].indices is 9; there are 1 accessors"),
        ({"indices": 0}, 'accessors[0].type is "VEC3"; SCALAR belongs here'),
        ({"material": 0}, "primitives[0].material is 0; there are 0 materials"),
        ({"attributes": {"POSITION": 5}}, "attributes.POSITION is 5; there are 1 accessors"),
        ({"attributes": {"POSITION": 0, "NORMAL": 1}}, "attributes.NORMAL is 1; there are 1 accessors"),
        ({"attributes": []}, "an object belongs here"),
    ],
)
def test_bad_primitives_are_refused(writer, read, changes, words):
    writer.triangle().json["meshes"][0]["primitives"][0].update(changes)
    assert words in _refusal(read, writer)


def test_indices_must_make_whole_triangles_and_be_unsigned(writer, read):
    writer.triangle(indices=writer.accessor([0, 1, 2, 0], "u2"))
    assert "has 4 corners; triangles have 3 each" in _refusal(read, writer)
    writer.json["meshes"][0]["primitives"][0] |= {"mode": 1, "indices": writer.accessor([0, 1, 2], "u2")}
    del writer.json["buffers"]
    assert "has 3 corners; lines have 2 each" in _refusal(read, writer)
    writer.json["meshes"][0]["primitives"][0]["indices"] = writer.accessor([0, 1, 2], "i2")
    del writer.json["buffers"]
    assert "UNSIGNED_SHORT" in _refusal(read, writer)


def test_attributes_of_different_length_are_refused(writer, read):
    writer.triangle(attributes={"NORMAL": writer.accessor([[0, 0, 1]] * 2)})
    assert "2 elements for 3 vertices" in _refusal(read, writer)


def test_a_primitive_without_positions_is_noted(writer, read):
    writer.triangle().node(mesh=writer.add("meshes", primitives=[{"attributes": {}}]))
    assert "without vertex positions" in read(writer).notes[0]


def _morphing(writer, weights, **node):
    targets = [
        {"POSITION": writer.accessor([[0, 0, 1]] * 3), "NORMAL": writer.accessor([[1, 0, 0]] * 3)},
        {"POSITION": writer.accessor([[0, 2, 0]] * 3), "COLOR_0": writer.accessor([[0, 0.5, 0]] * 3)},
    ]
    attributes = {"NORMAL": writer.accessor([[0, 0, 1]] * 3), "COLOR_0": writer.accessor([[0.25, 0, 0]] * 3)}
    mesh = writer.mesh(attributes=attributes, targets=targets)
    writer.json["meshes"][mesh]["weights"] = weights
    writer.node(mesh=mesh, **node)
    return writer


def test_morph_targets_at_their_default_weights(writer, read):
    mesh = read(_morphing(writer, [1.0, 0.25])).meshes[0]
    np.testing.assert_allclose(mesh.positions, [[0, 0.5, 1], [1, 0.5, 1], [0, 1.5, 1]])
    np.testing.assert_allclose(mesh.normals, [[0.5**0.5, 0, 0.5**0.5]] * 3, rtol=1e-6)
    np.testing.assert_allclose(mesh.colors, [[0.25, 0.125, 0]] * 3)


TANGENTS = [[2, 0, 0, 1], [0, 3, 0, -1], [0, 0, 0, 1]]


def _with_tangents(writer, tangents=TANGENTS, normals=((0, 0, 1),) * 3, **primitive):
    attributes = {"TANGENT": writer.accessor(np.float32(tangents))}
    if normals is not None:
        attributes["NORMAL"] = writer.accessor(np.float32(normals))
    return writer.triangle(attributes=attributes, **primitive)


def test_tangents_have_unit_length_or_none(writer, read):
    mesh = read(_with_tangents(writer)).meshes[0]
    np.testing.assert_array_equal(mesh.tangents, [[1, 0, 0, 1], [0, 1, 0, -1], [0, 0, 0, 0]])


def test_without_normals_tangents_do_not_count(writer, read):
    assert read(_with_tangents(writer, normals=None)).meshes[0].tangents is None


def test_morph_targets_move_tangents_and_leave_their_side(writer, read):
    changes = writer.accessor(np.float32([[-2, 1, 0]] * 3))
    _with_tangents(writer, targets=[{"TANGENT": changes}]).json["meshes"][0]["weights"] = [1.0]
    expected = [[0, 1, 0, 1], [-(0.2**0.5), 0.8**0.5, 0, -1], [-(0.8**0.5), 0.2**0.5, 0, 1]]
    np.testing.assert_allclose(read(writer).meshes[0].tangents, expected, rtol=1e-6)


def test_weights_of_a_node_go_before_those_of_its_mesh(writer, read, world_points):
    _morphing(writer, [1.0, 0.25]).node(mesh=0, weights=[0.0, 1.0])
    scene = read(writer)
    assert len(scene.meshes) == 2
    np.testing.assert_allclose(world_points(scene, 1), [[0, 2, 0], [1, 2, 0], [0, 3, 0]])


@pytest.mark.parametrize(
    ("weights", "words"),
    [([1.0], "2 morph targets; its mesh has 1 weights"), (["a", 1], "a number"), ({}, "a list belongs here")],
)
def test_bad_morph_weights_are_refused(writer, read, weights, words):
    assert words in _refusal(read, _morphing(writer, weights))
