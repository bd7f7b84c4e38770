"""Wavefront OBJ: geometry."""

import numpy as np
import pytest
from PIL import Image

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.readers.obj import read_obj

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **files):
        for name, content in files.items():
            (tmp_path / name.replace("__", ".")).write_text(content)
        path = tmp_path / "model.obj"
        path.write_text(text)
        return read_obj(path)

    return read


def corner_positions(mesh):
    return mesh.positions[mesh.faces]


def test_a_square_becomes_two_triangles(read):
    scene = read(SQUARE + "f 1 2 3 4\n")
    (mesh,) = scene.meshes
    assert mesh.positions.dtype == np.float32
    assert mesh.faces.dtype == np.uint32
    assert corner_positions(mesh)[..., :2].tolist() == [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]
    assert mesh.normals is None
    assert mesh.uvs == ()
    assert mesh.colors is None
    assert scene.name == "model"
    assert [instance.mesh for instance in scene.instances] == [0]


def test_every_form_of_corner(read):
    tables = SQUARE + "vt 0.25 0.75\nvt 1 0\nvt 0 1\nvn 0 0 2\n"
    plain = corner_positions(read(SQUARE + "f 1 2 3\n").meshes[0])
    for face in ("f 1 2 3", "f 1/1 2/2 3/3", "f 1//1 2//1 3//1", "f 1/1/1 2/2/1 3/3/1", "f -4/-3/-1 -3/-2/-1 -2/-1/-1"):
        (mesh,) = read(tables + face + "\n").meshes
        assert (corner_positions(mesh) == plain).all()
        assert (mesh.normals is not None) == ("//" in face or face.count("/") == 6)
        assert bool(mesh.uvs) == ("/1" in face.replace("//1", "") or "/-" in face)
        if mesh.uvs:
            # v counts upwards in OBJ and downwards in a description
            assert mesh.uvs[0][mesh.faces][0, 0].tolist() == [0.25, 0.25]
        if mesh.normals is not None:
            assert (mesh.normals == (0, 0, 1)).all()


def test_mixed_corners_in_one_file(read):
    (mesh,) = read(SQUARE + "vt 0 0\nvn 0 0 -1\nf 1/1 2 3//1\nf 1/1/1 3/1/ 4\n").meshes
    assert len(mesh.faces) == 2
    by_corner = mesh.normals[mesh.faces]
    assert by_corner[0].tolist() == [[0, 0, 1], [0, 0, 1], [0, 0, -1]]  # flat where not given
    assert by_corner[1].tolist() == [[0, 0, -1], [0, 0, 1], [0, 0, 1]]


def test_negative_indices_count_from_the_face_itself(read):
    text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n"
    (mesh,) = read(text).meshes
    assert corner_positions(mesh)[:, :, 2].tolist() == [[0, 0, 0], [5, 5, 5]]


def test_vertices_are_shared_only_where_all_agrees(read):
    both = SQUARE + "vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/1 3/{} 4/1\n"
    assert len(read(both.format(1)).meshes[0].positions) == 4
    assert len(read(both.format(2)).meshes[0].positions) == 5


def test_unused_vertices_do_not_count(read):
    (mesh,) = read("v 99 99 99\n" + SQUARE + "f 2 3 4\n").meshes
    assert mesh.positions.max() == 1


def test_smoothing_groups_round_edges(read):
    roof = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 0 2 0\nv 1 2 0\n"
    faces = "f 1 2 3 4\nf 4 3 6 5\n"
    assert read(roof + faces).meshes[0].normals is None
    assert read(roof + "s off\n" + faces).meshes[0].normals is None
    (mesh,) = read(roof + "s 1\n" + faces).meshes
    ridge = mesh.positions[:, 1] == 1
    assert mesh.normals[ridge] == pytest.approx(np.tile((0, 0, 1), (2, 1)), abs=1e-6)
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(np.ones(6), abs=1e-6)
    (mesh,) = read(roof + "s 1\nf 1 2 3 4\ns 2\nf 4 3 6 5\n").meshes  # a crease between two groups
    ridge = mesh.positions[:, 1] == 1
    assert np.abs(mesh.normals[ridge][:, 1]) == pytest.approx(np.full(4, np.sqrt(0.5)), abs=1e-6)


def test_normals_of_no_length_count_as_absent(read):
    assert read(SQUARE + "vn 0 0 0\nf 1//1 2//1 3//1\n").meshes[0].normals is None


def test_vertex_colours_are_srgb(read):
    text = "v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0.5\nv 0 1 0 0 0 0.5\nf 1 2 3\n"
    (mesh,) = read(text).meshes
    assert mesh.colors[:2, :2].tolist() == [[1, 0], [0, 1]]
    assert mesh.colors[:, 2] == pytest.approx(np.full(3, decode_srgb(np.array(0.5))), abs=1e-6)


def test_a_texture_shows_its_colour_alone(read, tmp_path):
    """As MeshLab writes a mesh whose texture it made of the colours of its vertices."""
    Image.new("RGB", (2, 2), (9, 8, 7)).save(tmp_path / "skin.png")
    text = "mtllib m.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nvt 0 0\nf 1 2 3\nusemtl a\nf 1/1 2/1 3/1\n"
    scene = read(text, m__mtl="newmtl a\nmap_Kd skin.png\n")
    plain, textured = scene.meshes
    assert (plain.colors == (1, 0, 0)).all()
    assert textured.colors is None
    assert scene.notes[0] == "colours of vertices are not shown where a texture has the colour"


def test_polypaint_of_zbrush(read):
    """``#MRGB``: eight digits a vertex, mask first, in as many lines as it takes."""
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    painted = read(f"{triangle}#MRGB ffff000000ff8000\n#MRGB ff0000ff\n").meshes[0]
    assert painted.colors[:, 0].tolist() == [1, 1, 0]
    assert painted.colors[1, 1] == pytest.approx(decode_srgb(np.array(128 / 255)), abs=1e-6)
    for cut in ("#MRGB ffff0000\n", "#MRGB ffff00\n", "#MRGB mask\n"):
        scene = read(triangle + cut)
        assert scene.meshes[0].colors is None
        assert "colours of #MRGB are not shown" in scene.notes[0]


def test_vertices_without_colours_beside_coloured_ones_are_white(read):
    """The material's own grey shows there; weights are no colours."""
    text = "v 0 0 0\nv 1 0 0 1\nv 0 1 0\nf 1 2 3\nv 0 0 1 1 0 0\nv 1 0 1 0 1 0\nv 0 1 1 0 0 1\nf 4 5 6\n"
    (mesh,) = read(text).meshes
    assert mesh.colors.tolist() == [[1, 1, 1]] * 3 + np.eye(3).tolist()
    assert mesh.positions[:3].tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    (of_bytes,) = read(
        text.replace("1 0 0\nv 1 0 1", "255 0 0\nv 1 0 1")
        .replace("0 1 0\nv 0 1 1", "0 255 0\nv 0 1 1")
        .replace("0 0 1\nf 4", "0 0 255\nf 4")
    ).meshes
    np.testing.assert_array_equal(of_bytes.colors, mesh.colors)


@pytest.mark.parametrize("top", [1.0, 255.0])
def test_colours_count_to_1_or_to_255(read, top):
    (mesh,) = read(f"v 0 0 0 {top} 0 0\nv 1 0 0 0 {0.5 * top} 0\nv 0 1 0 0 0 0\nf 1 2 3\n").meshes
    assert mesh.colors[0].tolist() == [1, 0, 0]
    assert mesh.colors[1, 1] == pytest.approx(decode_srgb(np.array(0.5)), abs=1e-6)


def test_a_weight_is_no_colour(read):
    assert read("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n").meshes[0].colors is None


def test_rows_of_different_length(read):
    (mesh,) = read("v 0 0 0 1\nv 1 0 0\nv 0 1 0\nvt 1\nvt 0.5 0.5 0\nf 1/1 2/2 3/1\n").meshes
    assert mesh.positions.shape == (3, 3)
    assert mesh.uvs[0].tolist() == [[1, 1], [0.5, 1], [1, 1]]


def test_layout_of_lines(read):
    text = "\ufeff# a comment\r\nmtllib\r\nv 0 0 0 # origin\r\n\tv   1\t0 0\r\nv 0 1 \\\r\n0\r\n"
    (mesh,) = read(text + "g a b\no thing\nf 1 2 \\\n3").meshes
    assert corner_positions(mesh)[0].tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_what_cannot_be_drawn_is_counted_in_a_note(read):
    scene = read(SQUARE + "curv 0 1 1 2\ncurv 0 1 2 3\nmystery 3\nusemap wood\nf 1 2 3\n")
    statements = ["1 statements 'mystery' are not rendered", "1 statements 'usemap' are not rendered"]
    assert scene.notes == ["2 curves are not rendered", *statements]


def test_free_form_surfaces_alone_are_no_cloud_of_their_control_points(read):
    with pytest.raises(
        SceneError, match="holds curves and free-form surfaces alone; faces, lines and points are shown"
    ):
        read(SQUARE + "cstype bezier\ndeg 1 1\ncurv 0 1 1 2\nsurf 0 1 0 1 1 2 4 3\nparm u 0 1\nend\n")


def test_points_and_lines_are_drawn(read):
    text = "mtllib m.mtl\n" + SQUARE + "p 1 3\nusemtl red\nl 1/1 2 -1\nf 1 2 3\nusemtl blue\nl 2 2\nl 3 4\n"
    scene = read(text, m__mtl="newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    found = [(mesh.name, scene.materials[mesh.material]) for mesh in scene.meshes]
    assert [(name, material.base_color, material.unlit) for name, material in found] == [
        ("points", (0.7, 0.7, 0.7), True),
        ("red", (1, 0, 0), False),
        ("lines", (1, 0, 0), True),
        ("lines", (0, 0, 1), True),
    ]
    points, _, red, blue = (mesh.positions for mesh in scene.meshes)
    for ball, middle in zip(np.split(points, 2), [(0, 0, 0), (1, 1, 0)], strict=True):
        assert np.linalg.norm(ball - middle, axis=1) == pytest.approx(np.full(len(ball), 0.01 * 2**0.5), rel=1e-4)
    middles = [rod.mean(axis=0) for rod in [*np.split(red, 2), blue]]
    assert np.array(middles) == pytest.approx(np.array([(0.5, 0, 0), (0.5, 0.5, 0), (0.5, 1, 0)]), abs=1e-6)
    assert scene.notes == [
        "points are drawn as balls of a radius of up to 1.00 % of the scene's diagonal",
        "lines are drawn as rods of a radius of 0.50 % of the scene's diagonal",
    ]


def test_points_alone_make_a_scene_and_keep_their_colours(read):
    (mesh,) = read("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\np 1\np 2\n").meshes
    assert {tuple(color) for color in mesh.colors.tolist()} == {(1, 0, 0), (0, 1, 0)}


def test_faces_are_gathered_by_material(read):
    mtl = "newmtl red paint\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n"
    text = "mtllib my colours.mtl\n" + SQUARE + "f 1 2 3\nusemtl red paint\nf 1 2 4\nusemtl blue\nf 1 3 4\n"
    scene = read(text + "usemtl red paint\nf 2 3 4\n", **{"my colours__mtl": mtl})
    assert [(mesh.name, len(mesh.faces)) for mesh in scene.meshes] == [("model", 1), ("red paint", 2), ("blue", 1)]
    colors = [scene.materials[mesh.material].base_color for mesh in scene.meshes]
    assert colors == [(0.7, 0.7, 0.7), (1, 0, 0), (0, 0, 1)]


def test_several_libraries(read):
    files = {"a__mtl": "newmtl a\nKd 1 0 0\n", "b__mtl": "newmtl b\nKd 0 1 0\nnewmtl a\nKd 0 0 0\n"}
    scene = read("mtllib a.mtl b.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n", **files)
    assert [material.base_color for material in scene.materials] == [(1, 0, 0), (0, 1, 0)]


def test_an_unknown_material_is_noted(read):
    scene = read(SQUARE + "usemtl gold\nf 1 2 3\n")
    assert scene.notes == ["material 'gold' is in no material library: taken as plain grey"]
    assert scene.materials[0].name == "gold"


def test_a_missing_library_leaves_a_grey_model_and_a_note(read):
    scene = read("mtllib none.mtl\n" + SQUARE + "usemtl gold\nf 1 2 3\nusemtl tin\nf 1 3 4\n")
    assert scene.notes == ["model.obj:1: material library 'none.mtl' not found: its materials are plain grey"]
    assert [material.base_color for material in scene.materials] == [(0.7, 0.7, 0.7)] * 2
    scene = read("mtllib modle.mat red.mtl\n" + SQUARE + "usemtl red\nf 1 2 3\n", red__mtl="newmtl red\nKd 1 0 0\n")
    assert scene.materials[0].base_color == (1, 0, 0)
    assert scene.notes == ["model.obj:1: material library 'modle.mat' not found: its materials are plain grey"]


def test_the_note_on_a_missing_library_names_the_one_that_may_be_meant(read):
    (note,) = read("mtllib coluors.mtl\n" + SQUARE + "f 1 2 3\n", colours__mtl="newmtl a\n").notes
    assert note.endswith("not found (is 'colours.mtl' meant?): its materials are plain grey")


def test_comments_after_names(read):
    mtl = "newmtl red # not the other one\nKd 1 0 0\nnewmtl Material#2\nKd 0 1 0\n"
    text = (
        "mtllib my colours.mtl # of the house\n" + SQUARE + "usemtl red # here\nf 1 2 3\nusemtl Material#2\nf 1 3 4\n"
    )
    scene = read(text, **{"my colours__mtl": mtl})
    assert [material.base_color for material in scene.materials] == [(1, 0, 0), (0, 1, 0)]
    assert not scene.notes


def test_backslashes_before_the_spaces_of_libraries(read):
    text = "mtllib none.mtl first\\ half.mtl second\\ half.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n"
    libraries = {"first half.mtl": "newmtl a\nKd 1 0 0\n", "second half.mtl": "newmtl b\nKd 0 0 1\n"}
    scene = read(text, **libraries)
    assert {material.base_color for material in scene.materials} == {(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)}
    assert len(scene.notes) == 1  # of the first name alone


def test_quotes_around_a_library(read):
    scene = read(
        'mtllib "my colours.mtl"\n' + SQUARE + "usemtl a\nf 1 2 3\n", **{"my colours__mtl": "newmtl a\nKd 1 0 0\n"}
    )
    assert scene.materials[0].base_color == (1, 0, 0)


def test_a_library_with_a_number_sign_in_its_name(read):
    scene = read("mtllib a #1.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\n", **{"a #1__mtl": "newmtl a\nKd 1 0 0\n"})
    assert scene.materials[0].base_color == (1, 0, 0)


def test_text_in_utf_16(tmp_path):
    path = tmp_path / "model.obj"
    path.write_bytes(("\ufeff" + SQUARE + "f 1 2 3\n").encode("utf-16-be"))
    assert len(read_obj(path).meshes[0].faces) == 1


def test_indices_into_tables_that_the_file_lacks_are_dropped(tmp_path):
    path = tmp_path / "model.obj"
    path.write_text(SQUARE + "vt 0 0\nf 1/1/1 2/1/2 3/1/3\n")
    scene = read_obj(path)
    assert scene.notes == ["faces name normals up to 3 of the 0 in the file: taken without"]
    assert scene.meshes[0].normals is None
    assert len(scene.meshes[0].uvs) == 1
    path.write_text(SQUARE + "vn 1 0 0\nf 1//1 2//2 3//1\n")
    assert read_obj(path).meshes[0].normals is None  # the first is as little to be trusted as the second
    path.write_text(SQUARE + "f 1/1 2/2 3/3\n")
    scene = read_obj(path)
    assert scene.notes == ["faces name texture coordinates up to 3 of the 0 in the file: taken without"]
    assert not scene.meshes[0].uvs


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 0 0 nan\n" + SQUARE + "f 1 2 3\n", r"model\.obj:1: vertex '0 0 nan'; coordinates must be finite"),
        (SQUARE + "v inf 0 0\nf 1 2 3\n", r"model\.obj:5: vertex 'inf 0 0'"),
        (SQUARE + "v 1e300 0 0\nf 1 2 3\n", r"model\.obj:5: vertex '1e300 0 0'"),
        (SQUARE + "v 1 2\nf 1 2 3\n", r"model\.obj:5: vertex with 2 numbers; it takes 3"),
        (SQUARE + "v\nf 1 2 3\n", r"model\.obj:5: vertex with 0 numbers"),
        ("v 1 2\nv 1 2\nf 1 1 2\n", r"model\.obj:1: vertex with 2 numbers"),
        (SQUARE + "v 1 2 x\nf 1 2 3\n", r"model\.obj:5: vertex '1 2 x'; numbers only"),
        (SQUARE + "vn 1 2\nf 1//1 2//1 3//1\n", r"model\.obj:5: normal with 2 numbers"),
        (SQUARE + "f 1 2 5\n", r"model\.obj:5: face uses vertex 5; the file has 1 to 4"),
        (SQUARE + "f 1 2 3\nf 1 2 0\n", r"model\.obj:6: face uses vertex 0"),
        (SQUARE + "f -1 -2 -5\n", r"model\.obj:5: index -5 counts back beyond the first of 4 entries"),
        (SQUARE + "f 1 2\n", r"model\.obj:5: face with 2 corners"),
        (SQUARE + "f 1 2 3\nf 1 2 x\n", r"model\.obj:6: face corner 'x'; it is v, v/vt"),
        (SQUARE + "f 1 2 3\nf -1 2 x\n", r"model\.obj:6: face corner 'x'"),
        (SQUARE + "f 1 2 3/1/1/1\n", r"model\.obj:5: face corner '3/1/1/1'"),
        (SQUARE + "f 1/ 2 /3\n", r"model\.obj:5: face uses vertex 0"),
        (
            SQUARE + "f 1 2 99999999999999999999\n",
            r"model\.obj:5: face .*9{8}|model\.obj:5: face uses vertex 9223372036854775807",
        ),
        (SQUARE + "l 1 1\n", r"model\.obj: holds nothing but lines without length"),
        (SQUARE + "f 1 2 3\np 5\n", r"model\.obj:6: '5' is no vertex; the file has 1 to 4"),
        (SQUARE + "f 1 2 3\nl 1 x\n", r"model\.obj:6: 'x' is no vertex; the file has 1 to 4"),
        (SQUARE + "f 1 2 3\nl 1 -5\n", r"model\.obj:6: index -5 counts back beyond the first of 4 entries"),
        ("p 1\n", r"model\.obj:1: '1' is no vertex; the file has no vertex"),
        (SQUARE + "vt 0 0\n", r"model\.obj: holds no faces, lines or points; is it cut short\?"),
        ("# nothing\n", r"model\.obj: holds no faces, lines or points; is it an OBJ file\?"),
        ("<html>\n", r"model\.obj: holds no faces, lines or points; is it an OBJ file\?"),
        (SQUARE + "f 1 2 \\", r"model\.obj:5: the file ends in a continued line"),
        (SQUARE + "mtllib ../none.mtl\nf 1 2 3\n", r"model\.obj:5: material library '\.\./none\.mtl' lies outside"),
        ("\0\0\0\0", r"model\.obj: is not a text file"),
        ("", r"model\.obj: the file is empty"),
    ],
)
def test_bad_files(read, text, message):
    with pytest.raises(SceneError, match=message) as caught:
        read(text)
    assert "\n" not in str(caught.value)


def test_every_cut_short_file_is_refused_or_whole(read):
    """A file cut anywhere gives an error, its vertices as a cloud, or fewer whole faces: never a wild one."""
    text = SQUARE + "vt 0 0\nvn 0 0 1\n" + "f 1/1/1 2/1/1 3/1/1 4/1/1\n" * 3
    whole = corner_positions(read(text).meshes[0])
    outcomes = set()
    for end in range(len(text)):
        try:
            scene = read(text[:end])
        except SceneError:
            outcomes.add("refused")
            continue
        if any(note.startswith("points are drawn as balls") for note in scene.notes):
            outcomes.add("cloud")
            assert end <= len(SQUARE) + 1
        else:
            outcomes.add("shorter")
            found = corner_positions(scene.meshes[0])
            assert (found == whole[: len(found)]).all()
    assert outcomes == {"refused", "cloud", "shorter"}


@pytest.mark.parametrize("colored", [True, False])
def test_vertices_alone_are_a_cloud(tmp_path, colored):
    colors = [" 1 0 0", " 0 1 0"] if colored else ["", ""]
    path = tmp_path / "cloud.obj"
    path.write_text(f"v 0 0 0{colors[0]}\nv 1 2 3{colors[1]}\n")
    scene = read_obj(path)
    assert any(note.startswith("points are drawn as balls") for note in scene.notes)
    (material,) = scene.materials
    assert material.unlit == colored
    (mesh,) = scene.meshes
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    assert ((low < 0.0) & (high > (1.0, 2.0, 3.0))).all()
    if colored:
        assert {tuple(color) for color in mesh.colors.tolist()} == {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)}
