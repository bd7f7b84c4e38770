"""Material libraries: what is read, and what it comes to mean."""

import numpy as np
import pytest
from PIL import Image as Pillow

from lippmann.codecs.exr import write_exr
from lippmann.errors import SceneError
from lippmann.scene.readers.mtl import parse_mtl
from lippmann.scene.readers.obj import read_obj

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"


@pytest.fixture
def material(tmp_path):
    """The material that the given statements describe, and the notes."""

    def read(statements, notes=False):
        (tmp_path / "m.mtl").write_text("newmtl m\n" + statements)
        (tmp_path / "m.obj").write_text("mtllib m.mtl\n" + TRIANGLE + "usemtl m\nf 1/1 2/2 3/3\n")
        scene = read_obj(tmp_path / "m.obj")
        return scene.notes if notes else scene.materials[0]

    return read


@pytest.fixture
def picture(tmp_path):
    def save(name, pixels):
        Pillow.fromarray(np.asarray(pixels, np.uint8)).save(tmp_path / name)
        return name

    return save


def test_plain_diffuse(material):
    found = material("Kd 0.2 0.4 0.6\n")
    assert found.base_color == (0.2, 0.4, 0.6)
    assert (found.specular, found.metallic, found.roughness, found.alpha_mode) == (0.0, 0.0, 1.0, "opaque")
    assert found.double_sided


def test_one_number_is_grey(material):
    assert material("Kd 0.5\n").base_color == (0.5, 0.5, 0.5)
    assert material("Kd 0.5 0.1\n").base_color == (0.5, 0.5, 0.5)


@pytest.mark.parametrize(("exponent", "roughness"), [(0, 1.0), (2, 0.5**0.25), (30, 0.5), (510, 0.25)])
def test_an_exponent_becomes_a_roughness(material, exponent, roughness):
    assert material(f"Kd 0.5 0 0\nKs 0.5 0.5 0.5\nNs {exponent}\n").roughness == pytest.approx(roughness)


def test_highlights(material):
    found = material("Kd 0.5 0 0\nKs 0.25 0.125 0\n")
    assert found.specular == 0.5
    assert found.specular_color == (1.0, 0.5, 0.0)
    assert material("Kd 0.5 0 0\nKs 1 1 1\n").specular == 1.0
    assert material("Kd 0.5 0 0\nKs 1 1 1\nillum 1\n").specular == 0.0


def test_a_strong_highlight_alone_is_metal(material):
    found = material("Kd 0 0 0\nKs 0.9 0.7 0.3\nNs 100\nillum 3\n")
    assert (found.metallic, found.base_color) == (1.0, (0.9, 0.7, 0.3))
    assert material("Kd 0.3 0.2 0.1\nKs 0.9 0.7 0.3\n").metallic == 0.0


def test_physically_based_statements_win(material):
    found = material("Kd 0.5 0 0\nKs 0.5 0.5 0.5\nNs 900\nPr 0.3\nPm 0.7\nPs 0.2\nPc 0.8\nPcr 0.1\nillum 1\n")
    assert (found.roughness, found.metallic, found.specular) == (0.3, 0.7, 1.0)
    assert (found.clearcoat, found.clearcoat_roughness) == (0.8, 0.1)
    assert (found.sheen_color, found.sheen_roughness) == ((0.2, 0.2, 0.2), 0.5)


@pytest.mark.parametrize(
    ("library", "opacities"),
    [
        ("newmtl m\nTr 1\n", [1.0]),  # as MeshLab writes every opaque material
        ("newmtl m\nTr 0\n", [1.0]),
        ("newmtl m\nTr 0.25\n", [0.75]),
        ("newmtl m\nd 0\nTr 1\n", [0.0]),  # both agree
        ("newmtl m\nd 1\nTr 1\n", [1.0]),
        ("newmtl m\nTr 1\nnewmtl n\nTr 0.25\n", [1.0, 0.25]),  # one library speaks one language
        ("newmtl m\nTr 1\nnewmtl n\nTr 0\nnewmtl o\nTr 0\n", [0.0, 1.0, 1.0]),
        ("# Converted by Meshlab Group\nnewmtl m\nTr 0.25\n", [0.25]),
        ("# Converted by Meshlab Group\nnewmtl m\nTr 0\n", [1.0]),  # since its version 2023.12
        ("# Converted by Meshlab Group\nnewmtl m\nTr 0\nnewmtl n\nTr 0.25\n", [1.0, 0.75]),
    ],
)
def test_tr_is_what_its_writer_means(tmp_path, library, opacities):
    (tmp_path / "m.mtl").write_text(library)
    names = [line.split()[1] for line in library.splitlines() if line.startswith("newmtl")]
    faces = "".join(f"usemtl {name}\nf 1/1 2/2 3/3\n" for name in names)
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n" + TRIANGLE + faces)
    scene = read_obj(tmp_path / "m.obj")
    assert [material.alpha for material in scene.materials] == pytest.approx(opacities)


def test_the_other_meaning_of_tr_is_noted_once(material):
    assert material("Tr 1\nnewmtl n\nTr 1\n", notes=True) == ["m.mtl: Tr is taken as opacity, as MeshLab writes it"]
    assert material("Tr 0\n", notes=True) == []


def test_clear_glass_may_have_tr_of_one(material):
    found = material("Tr 1\nillum 7\nTf 1 1 1\n")
    assert (found.transmission, found.alpha) == (1.0, 1.0)


def test_a_comment_after_a_texture(material, picture):
    picture("wood.png", np.full((2, 2, 3), 100))
    assert material("map_Kd wood.png # of the door\n").base_color_texture.image.pixels[0, 0, 0] == 100


def test_textures_in_tiles_lie_where_their_coordinates_are(material, picture):
    picture("t.1002.png", [[[255, 0, 0]]])
    picture("t.1011.png", np.full((2, 2, 3), (0, 255, 0)))
    texture = material("map_Kd t.<UDIM>.png\n").base_color_texture
    pixels = texture.image.pixels
    assert pixels.shape == (4, 4, 3)  # two by two tiles, each as large as the largest
    for place, color in (((1.5, 0.5), (255, 0, 0)), ((0.25, 1.25), (0, 255, 0)), ((0.5, 0.5), (0, 0, 0))):
        u, v, _ = texture.uv_transform @ (place[0], 1.0 - place[1], 1.0)
        assert pixels[int(4 * v), int(4 * u)].tolist() == list(color)
    assert material("map_Kd none.<UDIM>.png\n", notes=True) == [
        "m.mtl:2: texture 'none.1001.png' not found: shown without it"
    ]


def test_quotes_around_a_texture(material, picture):
    picture("old wood.png", np.full((2, 2, 3), 100))
    found = material('map_Kd -s 1 1 1 "old wood.png" # of the door\n')
    assert found.base_color_texture.image.pixels[0, 0, 0] == 100


def test_a_dot_is_no_texture(material):
    """As Blender writes pictures that were never saved."""
    plain = material("Kd 0.2 0.4 0.6\nmap_Kd .\nmap_Bump . \n")
    assert (plain.base_color, plain.base_color_texture, plain.normal_texture) == ((0.2, 0.4, 0.6), None, None)


def test_emission_may_exceed_one(material):
    assert material("Ke 5 4 3\n").emission == (5.0, 4.0, 3.0)


def test_colour_only(material):
    assert material("Kd 1 0 0\nillum 0\n").unlit


def test_opacity(material):
    assert (material("d 0.25\n").alpha, material("d 0.25\n").alpha_mode) == (0.25, "blend")
    assert material("Tr 0.75\n").alpha == 0.25
    assert material("d 0.25\nTr 0.25\n").alpha == 0.25
    assert material("d 1\n").alpha_mode == "opaque"


def test_glass(material):
    found = material("Kd 0 0 0\nTf 0.9 1 0.9\nd 0.1\nNi 1.45\nillum 7\nKs 1 1 1\n")
    assert (found.transmission, found.thickness, found.ior) == (0.9, 1.0, 1.45)
    assert (found.base_color, found.alpha_mode, found.metallic) == ((0.9, 1.0, 0.9), "opaque", 0.0)
    assert material("Kd 0 0 0\nTf 0.8 0.8 0.8\nNi 1.5\nillum 6\n").transmission == 0.8
    assert material("d 0.2\nillum 4\n").thickness == 0.0
    assert material("Kd 0 0 0\nTf 1 1 1\nillum 4\n").transmission == 0.0
    assert material("Kd 0.5 0.5 0.5\nTf 1 1 1\nillum 7\n").transmission == 0.0
    assert material("Kd 0.5 0.5 0.5\nillum 4\nTf 1 1 1\nNi 1\n").transmission == 0.0  # what exporters write for plaster


def test_an_index_of_one_is_no_index(material):
    assert material("Ni 1\n").ior == 1.5


def test_texture_and_factor(material, picture):
    picture("wood.png", np.full((2, 3, 3), 200))
    found = material("Kd 0.5 0.5 0.5\nmap_Kd wood.png\n")
    assert found.base_color == (0.5, 0.5, 0.5)
    assert found.base_color_texture.srgb
    assert found.base_color_texture.image.pixels.shape == (2, 3, 3)
    assert material("Kd 0 0 0\nmap_Kd wood.png\n").base_color == (1.0, 1.0, 1.0)


def test_a_name_with_spaces_and_options(material, picture):
    picture("my wood 2.png", np.full((2, 2, 3), 9))
    texture = material("map_Kd -blendu off -s 2 3 -o 0.5 0.25 0 -clamp on my wood 2.png\n").base_color_texture
    assert (texture.wrap_u, texture.wrap_v) == ("clamp", "clamp")
    # A point (u, v up) = (0.1, 0.2) is looked up at (2 * 0.1 + 0.5, 3 * 0.2 + 0.25), counted from the bottom.
    assert texture.uv_transform @ (0.1, 1 - 0.2, 1) == pytest.approx((0.7, 1 - 0.85, 1))


def test_alpha_needs_its_own_statement(material, picture):
    pixels = np.full((2, 2, 4), 100)
    pixels[..., 3] = [[0, 255], [128, 255]]
    picture("leaf.png", pixels)
    found = material("map_Kd leaf.png\n")
    assert (found.alpha_mode, found.base_color_texture.image.pixels.shape) == ("opaque", (2, 2, 3))
    found = material("map_Kd leaf.png\nmap_d leaf.png\n")
    assert found.alpha_mode == "blend"
    assert (found.base_color_texture.image.pixels == pixels).all()


def test_a_mask_of_another_size(material, picture):
    picture("color.png", np.full((4, 4, 3), 50))
    picture("mask.png", [[0, 255]])
    found = material("map_Kd color.png\nmap_d mask.png\n").base_color_texture.image.pixels
    assert found.shape == (4, 4, 4)
    assert (found[:, 0, 3] == 0).all()
    assert (found[:, -1, 3] == 255).all()
    assert (found[..., :3] == 50).all()
    alone = material("map_d mask.png\n").base_color_texture.image.pixels
    assert alone[0].tolist() == [[255, 255, 255, 0], [255, 255, 255, 255]]
    turned = material("map_Tr mask.png\n").base_color_texture.image.pixels
    assert turned[0, :, 3].tolist() == [255, 0]


def test_roughness_and_metal_share_a_picture(material, picture):
    picture("r.png", [[51, 102]])
    picture("m.png", [[255]])
    found = material("map_Pr r.png\nmap_Pm m.png\nPm 0.5\n")
    pixels = found.metallic_roughness_texture.image.pixels
    assert pixels[0, :, 1] == pytest.approx([0.2, 0.4])
    assert pixels[0, :, 2] == pytest.approx([1, 1])
    assert (found.roughness, found.metallic) == (1.0, 0.5)
    assert not found.metallic_roughness_texture.srgb


def test_an_exponent_map(material, picture):
    picture("ns.png", [[0, 255]])
    found = material("Ks 1 1 1\nNs 30\nmap_Ns ns.png\n")
    assert found.metallic_roughness_texture.image.pixels[0, :, 1] == pytest.approx([1.0, 0.5])
    assert found.roughness == 1.0


def test_channel_choice(material, picture):
    picture("rgb.png", [[[10, 20, 30]]])
    found = material("map_Pr -imfchan g rgb.png\n").metallic_roughness_texture.image.pixels
    assert found[0, 0, 1] == pytest.approx(20 / 255)
    coat = material("Pc 1\nmap_Pc -imfchan b rgb.png\nmap_Pcr -imfchan r rgb.png\n")
    assert coat.clearcoat_texture.image.pixels[0, 0, 0] == pytest.approx(30 / 255)
    assert coat.clearcoat_roughness_texture.image.pixels[0, 0, 1] == pytest.approx(10 / 255)


def test_heights_become_normals(material, picture):
    ramp = np.tile(np.arange(8) * 10, (8, 1))  # rises to the right
    picture("height.png", ramp)
    pixels = material("map_Bump -clamp on -bm 2 height.png\n").normal_texture.image.pixels
    slope = 2 * 10 / 255
    expected = np.array([-slope, 0, 1]) / np.hypot(slope, 1)
    assert pixels[4, 4] * 2 - 1 == pytest.approx(expected, abs=1e-6)
    picture("height.png", ramp.T)  # rises downwards, so its slope faces up
    pixels = material("bump -clamp on height.png\n").normal_texture.image.pixels
    assert pixels[4, 4, 1] > 0.5


def test_normal_maps_are_known_under_any_name(material, picture):
    picture("n.png", np.tile([128, 128, 255], (4, 4, 1)))
    for statement in ("norm n.png", "map_Bump -bm 0.5 n.png"):
        found = material(statement + "\n")
        assert (found.normal_texture.image.pixels == [128, 128, 255]).all()
        assert found.normal_scale == (0.5 if "-bm" in statement else 1.0)
        assert not found.normal_texture.srgb


def test_a_picture_used_twice_is_read_once(material, picture):
    picture("x.png", np.full((2, 2, 3), 200))
    found = material("map_Kd x.png\nmap_Ke x.png\n")
    assert found.base_color_texture.image is found.emission_texture.image
    assert found.emission == (1.0, 1.0, 1.0)


@pytest.mark.parametrize(("space", "srgb"), [("sRGB", True), ("linear", False)])
def test_the_colour_space_of_a_texture(material, picture, space, srgb):
    """An option of tinyobjloader's."""
    picture("x.png", np.full((2, 2, 3), 200))
    assert material(f"map_Kd -colorspace {space} -s 2 2 x.png\n").base_color_texture.srgb == srgb


def test_what_is_not_honoured_is_noted(material, picture):
    picture("x.png", np.full((2, 2, 3), 200))
    notes = material("disp x.png\nrefl -type sphere x.png\nKd spectral a.rfl\naniso 0.5\nKa 1 1 1\n", notes=True)
    assert notes == ["material 'm': not honoured: disp, refl, Kd, aniso"]
    assert material("map_Kd -mm 0 2 x.png\n", notes=True) == ["m.mtl:2: not honoured: -mm"]
    assert material("Kd 2 0 0\n", notes=True) == ["material 'm': Kd above 1 is taken as 1"]
    assert material("Kd 1 0 0\nillum 2\n", notes=True) == []


@pytest.mark.parametrize(
    ("statements", "message"),
    [
        ("map_Kd\n", r"m\.mtl:2: map_Kd without a file"),
        ("bump -bm x y.png\n", r"m\.mtl:2: 'bump -bm x y\.png'; -bm takes"),
        ("bump -bm 1\n", r"m\.mtl:2: 'bump -bm 1'; -bm takes"),
        ("Kd 1 0 nan\n", r"m\.mtl:2: 'Kd 1 0 nan'; Kd takes finite numbers"),
        ("Kd red\n", r"m\.mtl:2: 'Kd red'"),
        ("Ns\n", r"m\.mtl:2: 'Ns '"),
        ("d inf\n", r"m\.mtl:2: 'd inf'"),
    ],
)
def test_bad_statements(material, statements, message):
    with pytest.raises(SceneError, match=message):
        material(statements)


@pytest.mark.parametrize(
    ("statements", "color"), [("Kd 1 0 0", (1.0, 0.0, 0.0)), ("Kd 0 0 0", (0.8, 0.8, 0.8)), ("Ns 1", (0.8, 0.8, 0.8))]
)
def test_missing_textures_are_named_and_left_out(material, statements, color):
    statements += "\nKe 0 0 0\nmap_Kd none.png\nmap_Ke none.png\nmap_d -s 1 1\nnorm none.png\n"
    left = material(statements)
    assert left.base_color == pytest.approx(color)
    assert left.emission == (0.0, 0.0, 0.0)
    assert left.alpha_mode == "opaque"
    assert left.base_color_texture is left.emission_texture is left.normal_texture is None
    notes = material(statements, notes=True)
    assert "m.mtl:4: texture 'none.png' not found: shown without it" in notes
    assert "m.mtl:6: texture '1' not found: shown without it" in notes


def test_a_damaged_texture_is_named_with_its_line(material, tmp_path):
    (tmp_path / "x.png").write_bytes(b"nothing")
    with pytest.raises(SceneError, match=r"m\.mtl:2: texture 'x\.png' is not a picture"):
        material("map_Kd x.png\n")


def test_no_library(tmp_path):
    path = tmp_path / "m.mtl"
    path.write_text("Kd 1 0 0\n")
    with pytest.raises(SceneError, match=r"m\.mtl:1: 'Kd' before any newmtl"):
        parse_mtl(path)


def test_pictures_of_linear_light(material, tmp_path):
    """As Meshroom writes textures of photographs; only what glows is brighter than white."""
    values = np.array([[0.25, 3.0]], np.float32)
    write_exr(tmp_path / "x.exr", dict.fromkeys("RGB", values), text={})
    found = material("map_Kd x.exr\nmap_Ke x.exr\nKe 1 1 1\n")
    assert not found.base_color_texture.srgb
    assert found.base_color_texture.image.pixels[0, :, 0].tolist() == [0.25, 1.0]
    assert found.emission_texture.image.pixels[0, :, 0].tolist() == [0.25, 3.0]
    assert material("map_Kd x.exr\n", notes=True) == []
