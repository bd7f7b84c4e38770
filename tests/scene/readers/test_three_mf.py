"""3MF packages: units, transforms of what is built, components, colours, pictures, damage."""

import io
import zipfile

import numpy as np
import pytest
from PIL import Image

from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.three_mf.slicer_project import painted

RELATIONS = """<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel" Target="/3D/model.model"/>
</Relationships>"""
VERTICES = '<vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="0" z="1"/></vertices>'


def solid(number, triangle='v1="0" v2="1" v3="2"', more=""):
    return f'<object id="{number}" {more}><mesh>{VERTICES}<triangles><triangle {triangle}/></triangles></mesh></object>'


def model(resources, build='<item objectid="1"/>', unit="millimeter"):
    space = 'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"'
    space += ' xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
    return f'<model unit="{unit}" {space}><resources>{resources}</resources><build>{build}</build></model>'


@pytest.fixture
def read(tmp_path):
    def read(main, **files):
        path = tmp_path / "a.3mf"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("_rels/.rels", RELATIONS)
            archive.writestr("3D/model.model", main)
            for name, data in files.items():
                archive.writestr(name if "/" in name else f"3D/{name.replace('_', '.')}", data)
        return load_scene(path).description

    return read


def places(scene):
    """Corners ``(n, 3, 3)`` where they are placed, y up."""
    found = []
    for instance in scene.instances:
        mesh = scene.meshes[instance.mesh]
        for world in np.reshape(instance.world_from_mesh, (-1, 4, 4)):
            found.append(mesh.positions[mesh.faces] @ world[:3, :3].T + world[:3, 3])
    return np.concatenate(found)


def test_units_are_millimetres_and_z_is_up(read):
    (triangle,) = places(read(model(solid(1), unit="inch")))
    np.testing.assert_allclose(triangle, [[0, 0, 0], [25.4, 0, 0], [0, 25.4, 0]], atol=1e-5)


def test_what_is_built_is_moved_and_made_of_components(read):
    # Rows of the matrix act on row vectors: x to y, y to -x, then 10 along x.
    turn = "0 1 0 -1 0 0 0 0 1 10 0 0"
    both = '<object id="2"><components><component objectid="1"/>'
    both += '<component objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 5"/></components></object>'
    build = f'<item objectid="2" transform="{turn}"/><item objectid="1" printable="0"/>'
    first, second = places(read(model(solid(1) + both, build)))
    # z is up: (x, y, z) of the package is (x, z, -y) here.
    np.testing.assert_allclose(first, [[10, 0, 0], [10, 0, -1], [10, 1, 0]], atol=1e-6)
    np.testing.assert_allclose(second, first + np.array([0, 5, 0]), atol=1e-6)


def test_an_object_of_another_part(read):
    scene = read(model("", '<item objectid="7" p:path="/3D/other.model"/>'), other_model=model(solid(7), ""))
    assert len(places(scene)) == 1


def test_colours_of_corners_are_decoded(read):
    group = '<m:colorgroup id="5"><m:color color="#FF0000"/><m:color color="#00FF0080"/></m:colorgroup>'
    scene = read(model(group + solid(1, 'v1="0" v2="1" v3="2" pid="5" p1="0" p2="1" p3="0"')))
    (mesh,) = scene.meshes
    np.testing.assert_allclose(mesh.colors, [[1, 0, 0, 1], [0, 1, 0, 128 / 255], [1, 0, 0, 1]], atol=1e-6)
    assert scene.materials[mesh.material].alpha_mode == "blend"


def test_an_object_s_own_material(read):
    group = '<basematerials id="5"><base name="a" displaycolor="#000000"/>'
    group += '<base name="b" displaycolor="#0000FF"/></basematerials>'
    (mesh,) = read(model(group + solid(1, more='pid="5" pindex="1"'))).meshes
    assert (mesh.colors == [0, 0, 1, 1]).all()


def test_the_uppermost_of_several_properties(read):
    groups = '<basematerials id="5"><base name="a" displaycolor="#00FF00"/></basematerials>'
    groups += '<m:colorgroup id="6"><m:color color="#000000"/><m:color color="#FF0000"/></m:colorgroup>'
    groups += (
        '<m:multiproperties id="7" pids="5 6"><m:multi pindices="0 1"/><m:multi pindices="0"/></m:multiproperties>'
    )
    scene = read(model(groups + solid(1, 'v1="0" v2="1" v3="2" pid="7" p1="0" p2="1" p3="0"')))
    assert scene.meshes[0].colors.tolist() == [[1, 0, 0, 1], [0, 0, 0, 1], [1, 0, 0, 1]]
    assert "layers of colour below others are not shown" in scene.notes


def test_pictures(read):
    png = io.BytesIO()
    Image.new("RGB", (2, 2), (10, 20, 30)).save(png, "PNG")
    group = '<m:texture2d id="3" path="/3D/t.png" contenttype="image/png" tilestyleu="clamp"/>'
    group += (
        '<m:texture2dgroup id="4" texid="3"><m:tex2coord u="0" v="0"/><m:tex2coord u="1" v="0.25"/></m:texture2dgroup>'
    )
    scene = read(model(group + solid(1, 'v1="0" v2="1" v3="2" pid="4" p1="0" p2="1" p3="1"')), t_png=png.getvalue())
    (mesh,) = scene.meshes
    texture = scene.materials[mesh.material].base_color_texture
    assert (texture.image.pixels == (10, 20, 30)).all()
    assert texture.wrap_u == "clamp"
    assert mesh.uvs[0].tolist() == [[0, 1], [1, 0.75], [1, 0.75]]


def test_a_picture_that_lets_the_colour_below_through(read):
    png = io.BytesIO()
    Image.new("RGBA", (2, 2), (255, 255, 255, 51)).save(png, "PNG")
    groups = '<basematerials id="5"><base name="a" displaycolor="#00FF00"/></basematerials>'
    groups += '<m:texture2d id="3" path="/3D/t.png" contenttype="image/png"/>'
    groups += '<m:texture2dgroup id="4" texid="3"><m:tex2coord u="0" v="0"/></m:texture2dgroup>'
    groups += '<m:multiproperties id="7" pids="5 4"><m:multi pindices="0 0"/></m:multiproperties>'
    scene = read(model(groups + solid(1, 'v1="0" v2="1" v3="2" pid="7" p1="0"')), t_png=png.getvalue())
    texture = scene.materials[scene.meshes[0].material].base_color_texture
    np.testing.assert_allclose(texture.image.pixels[0, 0], [0.2, 1.0, 0.2], atol=1e-6)


def test_a_base_material_of_opacity_0_is_seen(read):
    """As SolidWorks writes them."""
    group = '<basematerials id="5"><base name="a" displaycolor="#0000FF00"/></basematerials>'
    scene = read(model(group + solid(1, more='pid="5" pindex="0"')))
    assert (scene.meshes[0].colors == [0, 0, 1, 1]).all()
    assert scene.notes == ["opacities of 0 of base materials are not shown"]


def test_slices_are_not_shown(read):
    """The mesh beside them may be no more than their box."""
    assert read(model('<s:slicestack id="3" zbottom="0"/>' + solid(1))).notes == ["slices are not shown"]


def lattice(beams, more='radius="0.1"', number=1):
    inside = f"<b:beamlattice {more}>{beams}</b:beamlattice>"
    return f'<object id="{number}"><mesh>{VERTICES}{inside}</mesh></object>'


def test_beams_are_as_thick_as_they_say(read):
    scene = read(
        model(lattice('<b:beams><b:beam v1="0" v2="1" r1="0.2" r2="0.05" cap1="butt" cap2="butt"/></b:beams>'))
    )
    (mesh,) = scene.meshes
    along, across = mesh.positions[:, 0], np.linalg.norm(mesh.positions[:, 1:], axis=1)
    np.testing.assert_allclose(across[along == 0.0], 0.2, rtol=1e-5)
    np.testing.assert_allclose(across[along == 1.0], 0.05, rtol=1e-5)
    assert scene.notes == []


def test_beams_end_round_and_balls_are_as_wide_as_the_widest(read):
    beams = '<b:beam v1="0" v2="1"/><b:beam v1="0" v2="2" r1="0.3" cap2="butt"/><b:ball vindex="2" r="0.5"/>'
    _, balls = read(model(lattice(beams, 'radius="0.1" cap="hemisphere" ballmode="mixed"'))).meshes
    middles = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]])
    away = np.linalg.norm(balls.positions.reshape(3, -1, 3) - middles[:, None], axis=2)
    np.testing.assert_allclose(away, np.broadcast_to([[0.3], [0.1], [0.5]], away.shape), rtol=1e-5)


def test_balls_at_all_beams(read):
    more = 'radius="0.1" cap="butt" ballmode="all" ballradius="0.4"'
    _, balls = read(model(lattice('<b:beam v1="0" v2="1"/>', more))).meshes
    np.testing.assert_allclose(np.linalg.norm(balls.positions[: len(balls.positions) // 2], axis=1), 0.4, rtol=1e-5)


def test_colours_of_beams(read):
    group = '<m:colorgroup id="5"><m:color color="#FF0000"/><m:color color="#00FF00"/></m:colorgroup>'
    beams = '<b:beam v1="0" v2="1" p1="1"/><b:beam v1="0" v2="2" pid="9"/>'
    rods, balls = read(model(group + lattice(beams, 'radius="0.1" pid="5" pindex="0"'))).meshes
    assert np.unique(rods.colors, axis=0).tolist() == [[0, 1, 0, 1], pytest.approx([0.7, 0.7, 0.7, 1])]
    assert len(balls.colors) == len(balls.positions)


def test_a_lattice_is_not_clipped(read):
    scene = read(model(lattice('<b:beam v1="0" v2="1"/>', 'radius="1" clippingmode="inside" clippingmesh="2"')))
    assert scene.notes == ["clippings of lattices of beams are not shown"]


def test_colours_of_functions_are_none_of_a_group(read):
    volume = '<v:volumedata id="4"><v:color functionid="3" channel="color"/></v:volumedata>'
    assert read(model(volume + solid(1))).notes == ["volumes of functions are not shown"]


@pytest.mark.parametrize(
    ("main", "line"),
    [
        (model(""), "has no object 1"),
        (model(solid(1, 'v1="0" v2="1" v3="9"')), "whose vertices are not there"),
        (model(solid(1, 'v1="0" v2="1"')), "'v3' is missing"),
        (model(solid(1), unit="parsec"), "'parsec' is missing or no value of its kind"),
        (model(solid(1))[:-9], "is no well-formed XML"),
        ("<!DOCTYPE model>" + model(solid(1)), "declares a document type"),
        (model('<object id="1"><components><component objectid="1"/></components></object>'), "without end"),
        (model(solid(1), ""), "has nothing to build"),
        (
            model('<object id="1"><v:levelset functionid="3"/></object>'),
            "has nothing to build that is made of triangles or beams; shapes of functions are not shown",
        ),
        (model(lattice('<b:beam v1="0" v2="3"/>')), "has a beam or a ball whose vertices are not there"),
        (model(lattice('<b:beam v1="0" v2="1"/><b:ball vindex="2"/>')), "has a beam or a ball whose vertices"),
        (model(lattice('<b:beam v1="0" v2="1" r1="nan"/>')), "has a beam whose places or radii are no numbers"),
        (model(lattice('<b:beam v1="0" v2="1"/>', "")), "'radius' is missing"),
        (model('<colorgroup id="5"/>' + lattice('<b:beam v1="0" v2="1" pid="5"/>')), "whose colours are not there"),
    ],
)
def test_what_cannot_be_read_is_named(read, main, line):
    with pytest.raises(SceneError, match=r"^a\.3mf: ") as caught:
        read(main)
    assert line in str(caught.value)


def test_an_encrypted_package(read):
    with pytest.raises(SceneError, match=r"^a\.3mf: '/3D/model\.model' is no well-formed XML") as caught:
        read("%3McF~", keystore_xml="<keystore/>")
    assert str(caught.value).endswith("; the package holds keys: save it unencrypted")


def test_what_is_no_package(tmp_path):
    (tmp_path / "a.3mf").write_bytes(b"solid nothing")
    with pytest.raises(SceneError, match=r"a\.3mf: is no 3MF package"):
        load_scene(tmp_path / "a.3mf")


PIECES = """<config><object id="3"><metadata key="extruder" value="2"/>
<part id="1" subtype="normal_part"><metadata key="name" value="body"/></part>
<part id="2" subtype="modifier_part"><metadata key="extruder" value="1"/></part></object>
<plate><metadata key="extruder" value="7"/></plate><plate/></config>"""
FILAMENTS = '{"filament_colour": ["#FF0000", "#00FF00", "#0000FF", "#FFFFFF"], "name": "a"}'
TWO_PARTS = (
    solid(1)
    + solid(2)
    + ('<object id="3"><components><component objectid="1"/><component objectid="2"/></components></object>')
)


def test_parts_have_the_colours_of_their_filaments_and_modifiers_are_not_shown(read):
    """As Bambu Studio and OrcaSlicer write their projects."""
    main = model(TWO_PARTS, '<item objectid="3"/>')
    settings = {"Metadata/project_settings.config": FILAMENTS, "Metadata/model_settings.config": PIECES}
    scene = read(main, **settings)
    (mesh,) = scene.meshes
    assert mesh.colors.tolist() == [[0, 1, 0, 1]] * 3
    assert scene.notes == [
        "the 2 plates of the slicer's project lie side by side",
        "modifiers, supports and parts that the slicer cuts away are not shown",
    ]
    own = model(solid(1, more='pid="5" pindex="0"') + '<m:colorgroup id="5"><m:color color="#FFFFFF"/></m:colorgroup>')
    assert read(own, **settings).meshes[0].colors.tolist() == [[1, 1, 1, 1]] * 3


@pytest.mark.parametrize(
    ("paint", "parts"),
    [
        ("8", [([[0, 0], [1, 0], [0, 1]], (0, 1, 0))]),
        ("0C", [([[0, 0], [1, 0], [0, 1]], (0, 0, 1))]),
        # One side is split: the last part comes first, and has no paint of its own.
        ("801", [([[0.5, 0.5], [0, 1], [0, 0]], (1, 0, 0)), ([[0, 0], [1, 0], [0.5, 0.5]], (0, 1, 0))]),
    ],
)
def test_painted_triangles(read, paint, parts):
    main = model(solid(1, f'v1="0" v2="1" v3="2" paint_color="{paint}"'))
    (mesh,) = read(main, **{"Metadata/project_settings.config": FILAMENTS}).meshes
    corners = mesh.positions[mesh.faces][..., ::2]
    assert corners.tolist() == [where for where, _ in parts]
    assert mesh.colors[::3, :3].tolist() == [[*color] for _, color in parts]


def test_the_parts_of_a_triangle_fill_it():
    for text in ("0000003", "84843", "84842", "84846", "8484A", "841", "845", "849", "0C480C3", "4448413"):
        areas = [np.linalg.det(weights) for weights, _ in painted(text)]
        assert sum(areas) == pytest.approx(1.0)
        assert min(areas) > 0.0


def test_runs_of_triangles_have_the_filaments_of_prusa_slicer(read):
    three = '<triangle v1="0" v2="1" v3="2"/>' * 3
    main = model(f'<object id="1"><mesh>{VERTICES}<triangles>{three}</triangles></mesh></object>')
    volumes = "".join(
        f'<volume firstid="{at}" lastid="{at}"><metadata type="volume" key="{key}" value="{value}"/></volume>'
        for at, (key, value) in enumerate([("extruder", 2), ("name", "a"), ("volume_type", "SupportBlocker")])
    )
    scene = read(
        main,
        **{
            "Metadata/Slic3r_PE.config": '; extruder_colour = #FF0000;""\n; filament_colour = #FFFFFF;#0000FF\n',
            "Metadata/Slic3r_PE_model.config": f'<config><object id="1">{volumes}</object></config>',
        },
    )
    (mesh,) = scene.meshes
    assert mesh.colors[::3, :3].tolist() == [[0, 0, 1], [1, 0, 0]]


@pytest.mark.parametrize("paint", ["3", "x"])
def test_damaged_paint(read, paint):
    main = model(solid(1, f'v1="0" v2="1" v3="2" paint_color="{paint}"'))
    with pytest.raises(SceneError, match="a painted triangle is damaged"):
        read(main, **{"Metadata/project_settings.config": FILAMENTS})


@pytest.mark.parametrize(
    "settings",
    ["{", "[]", "[" * 100_000, '{"filament_colour": 3}', '{"filament_colour": [3]}', '{"filament_colour": ["red"]}'],
)
def test_damaged_filaments(read, settings):
    with pytest.raises(SceneError, match=r"^a\.3mf: its slicer's filaments are damaged"):
        read(model(solid(1)), **{"Metadata/project_settings.config": settings})


def test_numbers_of_filaments_that_nobody_has(read):
    pieces = '<config><object id="1"><metadata key="extruder" value="{}"/></object></config>'
    for number in (9 * 10**30, -4, 99):
        settings = {"Metadata/project_settings.config": FILAMENTS}
        settings["Metadata/model_settings.config"] = pieces.format(number)
        assert read(model(solid(1)), **settings).meshes[0].colors[0].tolist() == [1, 0, 0, 1]
