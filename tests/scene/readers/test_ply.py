"""PLY meshes, text and binary."""

import struct

import numpy as np
import pytest
from PIL import Image as Pillow

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.readers.ply import read_ply

VERTICES = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0.5, 0)]
FACES = [(0, 1, 2, 3), (1, 4, 2)]


def header(form, vertex="", face="", vertices=5, faces=2, comment=""):
    return (
        f"ply\nformat {form} 1.0\n{comment}element vertex {vertices}\nproperty float x\nproperty float y\n"
        f"property float z\n{vertex}element face {faces}\nproperty list uchar int vertex_indices\n{face}end_header\n"
    )


def text_file(faces=FACES):
    rows = [" ".join(map(str, vertex)) for vertex in VERTICES]
    rows += [f"{len(face)} " + " ".join(map(str, face)) for face in faces]
    return (header("ascii", faces=len(faces)) + "\n".join(rows) + "\n").encode()


def binary_file(order="<", faces=FACES):
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    data = b"".join(struct.pack(f"{order}3f", *vertex) for vertex in VERTICES)
    data += b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces)
    return header(form, faces=len(faces)).encode() + data


@pytest.fixture
def read(tmp_path):
    def read(data):
        path = tmp_path / "model.ply"
        path.write_bytes(data)
        return read_ply(path)

    return read


@pytest.mark.parametrize("data", [text_file(), binary_file("<"), binary_file(">")])
def test_triangles_and_larger_polygons_together(read, data):
    (mesh,) = read(data).meshes
    assert mesh.positions.tolist() == [list(map(float, vertex)) for vertex in VERTICES]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    assert mesh.normals is None


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_lines_that_end_as_on_the_old_mac_os(read, form):
    start, end, body = (text_file() if form == "ascii" else binary_file()).partition(b"end_header\n")
    body = body.replace(b"\n", b"\r") if form == "ascii" else body
    (mesh,) = read((start + end).replace(b"\n", b"\r") + body).meshes
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]


@pytest.mark.parametrize("order", ["<", ">"])
def test_equal_polygons_take_the_short_way(read, order):
    faces = [(0, 1, 2), (1, 4, 2)]
    assert read(binary_file(order, faces)).meshes[0].faces.tolist() == [[0, 1, 2], [1, 4, 2]]


def test_faces_without_finite_coordinates_are_left_out(read):
    """Depth cameras save a grid of places, those without a measurement as NaN."""
    scene = read(text_file().replace(b"2 0.5 0", b"nan nan nan"))
    assert scene.meshes[0].faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert "1 faces without finite coordinates are left out" in scene.notes
    assert np.isfinite(scene.meshes[0].positions).all()


def test_a_normal_without_length_is_taken_from_the_triangles_about_it(read):
    names = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz"))
    rows = "\n".join(f"{x} {y} {z} 0 {0 if x == 2 else 3} 0" for x, y, z in VERTICES)
    (mesh,) = read((header("ascii", names, faces=1) + rows + "\n3 1 4 2\n").encode()).meshes
    assert mesh.normals.tolist() == [[0, 1, 0]] * 4 + [[0, 0, 1]]
    (flat,) = read((header("ascii", names, faces=1) + rows.replace(" 3 ", " 0 ") + "\n3 1 4 2\n").encode()).meshes
    assert flat.normals is None


def test_attributes_of_vertices(read, tmp_path):
    Pillow.new("RGB", (4, 2), (9, 8, 7)).save(tmp_path / "my skin.png")
    extra = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz", "s", "t"))
    extra += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
    rows = "\n".join(f"{x} {y} {z} 0 0 2 {x / 2} {y} 255 0 188 51" for x, y, z in VERTICES)
    comment = "comment TextureFile my skin.png\n"
    scene = read((header("ascii", extra, faces=1, comment=comment) + rows + "\n3 0 1 2\n").encode())
    (mesh,), (material,) = scene.meshes, scene.materials
    assert (mesh.normals == (0, 0, 1)).all()
    assert mesh.uvs[0][2].tolist() == [0.5, 0.0]  # v counts upwards in PLY and downwards in a description
    assert mesh.colors[0] == pytest.approx([1, 1, 1, 0.2], abs=1e-6)  # the texture has the colour
    assert "colours of vertices are not shown where a texture has the colour" in scene.notes
    assert material.base_color_texture.image.pixels.shape == (2, 4, 3)
    assert material.base_color == (1, 1, 1)


def test_colours_of_any_type(read):
    for kind, top in (("float", 1), ("ushort", 65535), ("ushort", 255), ("int", 255)):
        extra = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
        rows = "\n".join(f"{x} {y} {z} {top} 0 0" for x, y, z in VERTICES)
        (mesh,) = read((header("ascii", extra, faces=1) + rows + "\n3 0 1 2\n").encode()).meshes
        assert (mesh.colors == (1, 0, 0)).all()


@pytest.mark.parametrize("names", ["red green blue", "diffuse_red diffuse_green diffuse_blue", "r g b"])
def test_names_of_colours_and_what_is_not_shown(read, names):
    head = "".join(f"property uchar {name}\n" for name in names.split())
    scene = read(
        f"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{head}"
        "property float intensity\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0 255 0 0 1\n1 0 0 255 0 0 1\n0 1 0 255 0 0 1\n3 0 1 2\n".encode()
    )
    assert scene.meshes[0].colors[:, :3].tolist() == [[1, 0, 0]] * 3
    assert "of vertices not shown: intensity" in scene.notes


def test_colours_and_uvs_of_faces_part_the_vertices(read):
    face = "property list uchar float texcoord\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    rows = "\n".join(" ".join(map(str, vertex)) for vertex in VERTICES)
    rows += "\n4 0 1 2 3 8 0 0 1 0 1 1 0 1 255 0 0\n3 1 4 2 6 0 0 1 0 0 1 0 255 0\n"
    (mesh,) = read((header("ascii", face=face) + rows).encode()).meshes
    assert len(mesh.positions) == 9
    assert mesh.positions[mesh.faces][2].tolist() == [[1, 0, 0], [2, 0.5, 0], [1, 1, 0]]
    assert mesh.colors[mesh.faces][:, 0].tolist() == [[1, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert mesh.uvs[0][mesh.faces][2].tolist() == [[0, 1], [1, 1], [0, 0]]


def test_alpha_hides_what_it_is_less_than_full_of(read):
    """Opaque throughout, or 0 throughout as programs fill it in that have none: no colour is transparent."""
    vertex = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
    for alphas, mode in (([0, 51, 255, 255, 255], "blend"), ([255] * 5, "opaque"), ([0] * 5, "opaque")):
        rows = [" ".join(map(str, (*place, 255, 0, 0, alpha))) for place, alpha in zip(VERTICES, alphas, strict=True)]
        scene = read((header("ascii", vertex) + "\n".join(rows) + "\n4 0 1 2 3\n3 1 4 2\n").encode())
        colors = scene.meshes[0].colors
        assert (colors.shape[1] == 4, scene.materials[0].alpha_mode) == (mode == "blend", mode)
        if mode == "blend":
            assert colors[:, 3] == pytest.approx([0, 0.2, 1, 1, 1])


@pytest.mark.parametrize("top", [1.0, 255.0])
def test_real_colours_count_to_1_or_to_255(read, top):
    vertex = "".join(f"property float {name}\n" for name in ("red", "green", "blue"))
    rows = [" ".join(map(str, (*place, top, 0.5 * top, 0))) for place in VERTICES]
    (mesh,) = read((header("ascii", vertex) + "\n".join(rows) + "\n4 0 1 2 3\n3 1 4 2\n").encode()).meshes
    assert mesh.colors[0] == pytest.approx([1, float(decode_srgb(0.5)), 0], abs=1e-6)


def test_colours_of_faces_beside_those_of_vertices_are_named(read):
    colors = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    rows = [" ".join(map(str, (*place, 255, 0, 0))) for place in VERTICES]
    faces = "\n4 0 1 2 3 0 255 0\n3 1 4 2 0 255 0\n"
    scene = read((header("ascii", colors, colors) + "\n".join(rows) + faces).encode())
    assert scene.meshes[0].colors[0].tolist() == [1, 0, 0]
    assert "colours of faces are not shown: vertices have their own" in scene.notes


def test_elements_between_are_stepped_over(read):
    text = text_file().decode()
    edges = text.replace("element face", "element edge 2\nproperty int vertex1\nproperty int vertex2\nelement face")
    edges = edges.replace("2 0.5 0\n", "2 0.5 0\n0 1\n1 2\n")
    scene = read(edges.encode())
    assert len(scene.meshes[0].faces) == 3
    assert "elements not shown: edge" in scene.notes


def test_faces_without_area_in_their_list(read):
    assert len(read(text_file([(0, 1), (0, 1, 2), ()])).meshes[0].faces) == 1
    assert len(read(binary_file("<", [(0, 1), (0, 1, 2), ()])).meshes[0].faces) == 1


@pytest.mark.parametrize(
    "data",
    [
        text_file().replace(b"2 0.5 0", b"# the last one:\n2 0.5 0 # here"),
        text_file().replace(b"2 0.5 0", b"comment the last one:\n\n2 0.5 0"),
        text_file().replace(b"\n", b"\r\n"),
    ],
)
def test_text_with_remarks(read, data):
    assert read(data).meshes[0].positions.tolist() == [list(map(float, vertex)) for vertex in VERTICES]


def test_a_foreign_line_before_the_elements_is_noted(read):
    scene = read(text_file().replace(b"element vertex", b"Created by a program, source file: \nelement vertex"))
    line = "model.ply:3: 'Created by a program, source file:' is no line of a PLY header, and is passed over"
    assert line in scene.notes
    with pytest.raises(SceneError, match=r"model\.ply:4: header line 'proprety float x'"):
        read(text_file().replace(b"property float x", b"proprety float x"))


def test_properties_that_fill_gaps_may_share_a_name(read):
    gap = "property uchar gap\n"
    data = header("ascii", vertex=gap + gap, faces=1).encode() + b"0 0 0 7 8\n1 0 0 7 8\n0 1 0 7 8\n" * 2
    mesh = read(data.replace(b"vertex 5", b"vertex 6") + b"3 0 1 2\n").meshes[0]
    assert mesh.positions.tolist()[:3] == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    with pytest.raises(SceneError, match="'vertex' has a property twice"):
        read(text_file().replace(b"property float y", b"property float x"))


def test_an_element_that_comes_twice_is_refused(read):
    again = b"element vertex 1\nproperty float x\nend_header"
    with pytest.raises(SceneError, match="has element 'vertex' twice"):
        read(text_file().replace(b"end_header", again))


def strips(*lists):
    rows = "\n".join(" ".join(map(str, vertex)) for vertex in VERTICES)
    lines = "\n".join(f"{len(one)} " + " ".join(map(str, one)) for one in lists)
    return (header("ascii", faces=len(lists)).replace("face", "tristrips") + rows + "\n" + lines + "\n").encode()


@pytest.mark.parametrize(
    ("lists", "faces"),
    [
        ([[0, 1, 3, 2, 4]], [[0, 1, 3], [3, 1, 2], [3, 2, 4]]),
        ([[0, 1, 3, -1, 1, 2, 3, 4]], [[0, 1, 3], [1, 2, 3], [3, 2, 4]]),
        ([[0, 1, 3], [1, 2, 3, 4]], [[0, 1, 3], [1, 2, 3], [3, 2, 4]]),
        ([[], [0, 1], [0, 1, 1, 2, 3, -1]], [[1, 2, 3]]),
    ],
)
def test_triangle_strips(read, lists, faces):
    assert read(strips(*lists)).meshes[0].faces.tolist() == faces


def test_strips_name_vertices_that_there_are(read):
    for wrong in (5, -2):
        with pytest.raises(SceneError, match=f"a face uses vertex {wrong}"):
            read(strips([0, 1, wrong]))


@pytest.mark.parametrize("colored", [False, True])
def test_a_cloud_of_points_is_drawn_as_balls(read, colored):
    colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n" if colored else ""
    rows = "".join(f"{x} {y} {z}{' 255 0 0' if colored else ''}\n" for x, y, z in VERTICES)
    scene = read((header("ascii", vertex=colors, faces=0) + rows).encode())
    (mesh,) = scene.meshes
    balls = np.split(mesh.positions, 5)
    diagonal = 5**0.5
    for ball, vertex in zip(balls, VERTICES, strict=True):
        assert np.linalg.norm(ball - vertex, axis=1) == pytest.approx(np.full(len(ball), 0.01 * diagonal), rel=1e-4)
    assert scene.notes[0] == "points are drawn as balls of a radius of up to 1.00 % of the scene's diagonal"
    assert scene.materials[0].unlit == colored
    assert (mesh.colors is not None) == colored


@pytest.mark.parametrize("owner", ["vertex", "edge"])
def test_edges_without_faces_are_drawn_as_rods(read, owner):
    """As line sets of Open3D, and loose edges of Blender."""
    colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    head = header("ascii", vertex=colors if owner == "vertex" else "", faces=0)
    edges = "element edge 2\nproperty int vertex1\nproperty int vertex2\n" + (colors if owner == "edge" else "")
    rows = [f"{x} {y} {z}" + " 255 0 0" * (owner == "vertex") for x, y, z in VERTICES]
    rows += [f"{ends}" + " 255 0 0" * (owner == "edge") for ends in ("0 1", "1 2")]
    text = head.replace("end_header\n", edges + "end_header\n") + "\n".join(rows) + "\n"
    scene = read(text.encode())
    (mesh,) = scene.meshes
    assert mesh.positions.max(axis=0) == pytest.approx([1.0, 1.0, 0.0], abs=0.02)  # without vertices of no edge
    assert (mesh.colors[:, :3] == [1.0, 0.0, 0.0]).all()
    assert [note[:18] for note in scene.notes] == ["lines are drawn as"]
    with pytest.raises(SceneError, match="an edge uses a vertex that is not there"):
        read(text.replace("\n0 1", "\n0 5").encode())


def test_points_without_coordinates_are_left_out(read):
    colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    rows = "".join(f"{'nan' if x == 0 else x} {y} {z} {100 * x} 255 0\n" for x, y, z in VERTICES)
    scene = read((header("ascii", vertex=colors, faces=0) + rows).encode())
    assert "2 points without finite coordinates are left out" in scene.notes
    (mesh,) = scene.meshes
    balls = np.split(np.c_[mesh.positions[:, 0], mesh.colors[:, 0]], 3)
    red = [float(decode_srgb(np.array(100 * x / 255))) for x in (1, 2)]
    assert sorted({round(float(ball[:, 1].mean()), 4) for ball in balls}) == [round(value, 4) for value in red]


def test_of_too_many_points_some_are_drawn(read, monkeypatch):
    monkeypatch.setattr("lippmann.scene.parsing.points_lines.MOST", 2)
    scene = read((header("ascii", faces=0) + "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)).encode())
    assert scene.notes[0] == "of 5 points one in 3 is drawn"
    balls = np.split(scene.meshes[0].positions, 2)
    middles = np.array([ball.mean(axis=0) for ball in balls])
    assert middles == pytest.approx(np.array([VERTICES[0], VERTICES[3]], float), abs=1e-6)


@pytest.mark.parametrize("data", [text_file(), binary_file()])
def test_every_cut_short_file_is_refused(read, data):
    last = data.rstrip(b"\n")
    for end in range(1, len(last)):
        if data.startswith(b"ply\nformat ascii") and end == len(last):
            continue
        with pytest.raises(SceneError):
            read(last[:end])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"solid x", r"model\.ply: is no PLY file"),
        (b"ply\nformat ascii 1.0\n", r"model\.ply: the header has no end"),
        (b"ply\nformat zip 1.0\nend_header\n", r"format 'zip'; known are ascii, binary_little"),
        (b"ply\nformat ascii 1.0\nelement vertex x\nend_header\n", r"model\.ply:3: header line 'element vertex x'"),
        (b"ply\nformat ascii 1.0\nproperty float x\nend_header\n", r"model\.ply:3: header line 'property float x'"),
        (b"ply\nformat ascii 1.0\nend_header\n", r"holds no vertices with x, y and z"),
        (header("ascii", faces=0, vertices=0).encode(), r"model\.ply: holds no vertices$"),
        (header("ascii", faces=0).encode() + b"0 0 inf\n" * 5, r"vertex 0 is \[0\.0, 0\.0, inf\]"),
        (text_file([(0, 1, 5)]), r"a face uses vertex 5; the file has 0 to 4"),
        (text_file([(0, 1, -1)]), r"a face uses vertex -1"),
        (text_file([(0, 1)]), r"holds no faces with three corners"),
        (
            text_file([(1, 4, 2)]).replace(b"2 0.5 0", b"2 nan 0"),
            r"vertex 4 is \[2\.0, nan, 0\.0\]; coordinates must be finite",
        ),
        (text_file().replace(b"2 0.5 0", b"2 x 0"), r"element 'vertex': could not convert"),
        (text_file().replace(b"2 0.5 0", b"2 0"), r"entry 4 of 'vertex' has too few numbers"),
        (binary_file()[:-1], r"ends after 1 of 2 entries of 'face'; is it cut short\?"),
        (binary_file().replace(b"\x04\0\0\0\0", b"\xff\0\0\0\0"), r"ends after 0 of 2 entries of 'face'"),
        (header("ascii", faces=1).replace("float z", "list uchar float z").encode() + b"0 0 1 0\n" * 6, "x, y and z"),
    ],
)
def test_bad_files(read, data, message):
    with pytest.raises(SceneError, match=message) as caught:
        read(data)
    assert "\n" not in str(caught.value)


def test_a_missing_texture(read):
    comment = "comment TextureFile none.png\n"
    data = text_file().replace(b"element vertex", comment.encode() + b"element vertex")
    scene = read(data)
    assert "model.ply: texture 'none.png' not found: shown without it" in scene.notes
    assert [material.base_color_texture for material in scene.materials] == [None]


@pytest.mark.parametrize("numbered", [True, False])
def test_faces_choose_their_texture_by_texnumber(read, tmp_path, numbered):
    """As MeshLab writes files of several textures; -1 is no texture."""
    for name, color in (("red.png", (255, 0, 0)), ("blue.png", (0, 0, 255))):
        Pillow.new("RGB", (2, 2), color).save(tmp_path / name)
    comments = "comment TextureFile red.png\ncomment TextureFile blue.png\n"
    head = header("ascii", "property float s\nproperty float t\n", faces=3, comment=comments)
    if numbered:
        head = head.replace("end_header", "property int texnumber\nend_header")
    rows = "\n".join(f"{x} {y} {z} 0 0" for x, y, z in VERTICES)
    numbers = (" 1", " -1", " 0") if numbered else ("", "", "")
    faces = "".join(f"\n3 {face}{number}" for face, number in zip(("0 1 2", "0 2 3", "1 4 2"), numbers, strict=True))
    scene = read((head + rows + faces + "\n").encode())
    looks = {}
    for instance in scene.instances:
        mesh = scene.meshes[instance.mesh]
        texture = scene.materials[mesh.material].base_color_texture
        color = None if texture is None else tuple(texture.image.pixels[0, 0].tolist())
        looks |= {tuple(face): color for face in mesh.faces.tolist()}
    if numbered:
        assert looks == {(0, 1, 2): (0, 0, 255), (0, 2, 3): None, (1, 4, 2): (255, 0, 0)}
    else:
        assert set(looks.values()) == {(255, 0, 0)}
        assert "only the first of 2 textures is used: no face says its texnumber" in scene.notes


@pytest.mark.parametrize("is_named", [True, False])
def test_textures_of_artec_s_programs(read, tmp_path, is_named):
    comments = "comment TextureFile model_0.png\ncomment TextureFile model_1.png\n" if is_named else ""
    for number, color in enumerate([(255, 0, 0), (0, 0, 255)]):
        Pillow.new("RGB", (1, 1), color).save(tmp_path / f"model_{number}.png")
    head = header("ascii", faces=2, comment=comments).replace(
        "end_header",
        "element multi_texture_vertex 4\nproperty uchar tx\nproperty float u\nproperty float v\n"
        "element multi_texture_face 2\nproperty uchar tx\nproperty uint tn\n"
        "property list uchar int texture_vertex_indices\nend_header",
    )
    rows = [" ".join(map(str, vertex)) for vertex in VERTICES] + ["3 0 1 2", "3 1 4 2"]
    rows += ["0 0 0", "0 0.25 0", "0 0.25 0.5", "0 0 0.5"]
    rows += ["1 1 3 0 1 2", "0 0 3 3 2 1"]  # the second face first
    scene = read((head + "\n".join(rows) + "\n").encode())
    color = {}
    for mesh in scene.meshes[:2]:
        texture = scene.materials[mesh.material].base_color_texture
        for corner, uv in zip(mesh.positions[mesh.faces[0]], mesh.uvs[0][mesh.faces[0]], strict=True):
            color[tuple(corner)] = (*texture.image.pixels[0, 0].tolist(), *uv.tolist())
    assert color[0, 0, 0] == (255, 0, 0, 0.0, 0.5)
    assert color[2, 0.5, 0] == (0, 0, 255, 0.25, 1.0)
    assert scene.notes == []
