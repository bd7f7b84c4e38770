"""Mitsuba XML files: parameters, includes, search paths, and what they may name."""

import numpy as np
import pytest
import trimesh

from lippmann.errors import SceneError
from lippmann.scene.mitsuba_xml import MOST_INCLUDE_LEVELS, MOST_LEVELS, MitsubaXml, read_mitsuba_xml
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.load import load_scene

MESH = '<shape type="ply"><string name="filename" value="{}"/></shape>'


@pytest.fixture
def save(tmp_path):
    """``save(body, name)``: a scene file in the folder ``scene``."""
    (tmp_path / "scene").mkdir()

    def save(body, name="room.xml", *, version="3.0.0"):
        path = tmp_path / "scene" / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(f'<scene version="{version}">\n{body}\n</scene>')
        return path

    return save


def put(path, text="x"):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def elements(document: MitsubaXml):
    """Every element with its attributes, in order."""
    stack, found = [document.root], []
    while stack:
        element = stack.pop()
        found.append((element.tag, dict(element.attributes)))
        stack += reversed(element.children)
    return found


def values(document, tag):
    return [attributes["value"] for name, attributes in elements(document) if name == tag]


class TestParameters:
    def test_defaults_count_from_where_they_stand(self, save):
        document = read_mitsuba_xml(
            save('<default name="n" value="4"/><integer name="a" value="$n"/><string name="b" value="x$n"/>')
        )
        assert values(document, "integer") == ["4"]
        assert values(document, "string") == ["x4"]
        assert "default" not in dict(elements(document))
        with pytest.raises(SceneError, match=r"room\.xml:2: parameter '\$n' has no value; a parameter is declared"):
            read_mitsuba_xml(save('<integer name="a" value="$n"/><default name="n" value="4"/>'))

    def test_the_longest_name_wins_and_the_first_value_stays(self, save):
        body = '<default name="n" value="1"/><default name="nn" value="2"/><default name="n" value="3"/>'
        assert values(read_mitsuba_xml(save(f'{body}<string name="a" value="$nn $n $nnn"/>')), "string") == ["2 1 2n"]

    def test_a_dollar_sign_of_its_own(self, save, engine):
        document = read_mitsuba_xml(save('<string name="a" value="\\$5"/>'))
        assert values(document, "string") == ["$5"]
        assert 'value="\\$5"' in document.text()

    def test_files_by_parameter(self, save, tmp_path):
        put(tmp_path / "scene" / "d" / "a.ply")
        document = read_mitsuba_xml(save('<default name="d" value="d"/>' + MESH.format("$d/a.ply")))
        assert dict(document.files) == {"d/a.ply": tmp_path / "scene" / "d" / "a.ply"}

    def test_nameless(self, save):
        with pytest.raises(SceneError, match=r"room\.xml:2: declares a parameter without a name"):
            read_mitsuba_xml(save('<default name="" value="d"/>'))


class TestIncludes:
    def test_objects_of_a_scene_take_the_place_of_the_include(self, save):
        save('<integer name="left_out" value="1"/><shape type="cube"/><bsdf type="diffuse" id="b"/>', "inner.xml")
        document = read_mitsuba_xml(save('<include filename="inner.xml"/><shape type="sphere"/>'))
        assert [attributes.get("type") for _, attributes in elements(document)] == [None, "cube", "diffuse", "sphere"]

    def test_one_object_is_named_by_the_include(self, save, tmp_path):
        put(tmp_path / "scene" / "red.xml", '<bsdf version="3.0.0" type="diffuse" name="own" id="red"/>')
        document = read_mitsuba_xml(save('<shape type="cube"><include filename="red.xml" name="b"/></shape>'))
        assert elements(document)[2] == ("bsdf", {"type": "diffuse", "id": "red", "name": "b"})

    def test_parameters_reach_included_files_and_come_back(self, save):
        save('<default name="back" value="7"/><shape type="cube" id="$there"/>', "inner.xml")
        document = read_mitsuba_xml(
            save('<default name="there" value="c"/><include filename="inner.xml"/><shape type="cube" id="s$back"/>')
        )
        assert [attributes.get("id") for _, attributes in elements(document)][1:] == ["c", "s7"]

    @pytest.mark.parametrize(
        ("there", "mesh", "spectrum"),
        [
            (("", "sub", "sub/deep", "sub/own"), "m.ply", ["sub/own/r.spd", "sub/r.spd"]),
            (("", "sub", "sub/deep"), "m.ply", ["r.spd", "sub/r.spd"]),
            (("", "sub/deep", "sub/own"), "m.ply", ["sub/own/r.spd", "sub/own/r.spd"]),
            (("", "sub/deep"), "m.ply", ["r.spd", "r.spd"]),
        ],
    )
    def test_of_files_of_one_name_mitsubas_is_read(self, save, tmp_path, engine, there, mesh, spectrum):
        """Meshes from the scene's folder; spectra from those of the files that include the one which names them."""
        import mitsuba as mi

        shape = (
            '<shape type="ply"><string name="filename" value="m.ply"/><bsdf type="diffuse">'
            '<spectrum name="reflectance" filename="r.spd"/></bsdf></shape>'
        )
        scene = save('<include filename="sub/inner.xml"/>')
        for folder in ("sub/deep", "sub/own"):
            (scene.parent / folder).mkdir(parents=True)
        inner = f'<scene version="3.0.0"><path value="own"/>{shape}<include filename="deep/leaf.xml"/></scene>'
        (scene.parent / "sub/inner.xml").write_text(inner)
        (scene.parent / "sub/deep/leaf.xml").write_text(f'<scene version="3.0.0">{shape}</scene>')
        for number, folder in enumerate(there, 1):
            (scene.parent / folder / "r.spd").write_text(f"400 {number / 10}\n700 {number / 10}\n")
            box = trimesh.creation.box([number] * 3)
            box.export(scene.parent / folder / "m.ply")
        document = read_mitsuba_xml(scene)
        names = [attributes.get("value") or attributes.get("filename") for _, attributes in elements(document)]
        found = [name for name in names if name and name.endswith((".ply", ".spd"))]
        assert found == [mesh, spectrum[0], mesh, spectrum[1]]

        def light(loaded):
            return {
                (round(float(np.ravel(shape.bbox().max.x)[0]), 4), round(float(np.ravel(value)[0]), 4))
                for shape in loaded.shapes()
                for key, value in mi.traverse(shape)
                if "reflectance" in key
            }

        theirs = light(mi.load_file(str(scene)))
        assert len(theirs) == len(set(spectrum))
        assert light(load_scene(scene).description.scene()) == theirs

    def test_a_search_path_of_an_included_file_may_start_at_the_scene(self, save, tmp_path):
        """As with Mitsuba: from the folder of the file that names it, else from that of the scene."""
        (tmp_path / "scene" / "common").mkdir(parents=True)
        (tmp_path / "scene" / "common" / "ball.ply").touch()
        (tmp_path / "scene" / "parts").mkdir()
        (tmp_path / "scene" / "parts" / "inner.xml").write_text(
            '<scene version="3.0.0"><path value="common"/>'
            '<shape type="ply"><string name="filename" value="ball.ply"/></shape></scene>'
        )
        document = read_mitsuba_xml(save('<include filename="parts/inner.xml"/>'))
        assert list(document.files) == ["common/ball.ply"]

    def test_files_of_an_included_file(self, save, tmp_path):
        """Mitsuba looks for them from the scene's folder; beside the file that names them they are found, too."""
        save(MESH.format("a.ply") + MESH.format("b.ply"), "sub/inner.xml")
        top, both = put(tmp_path / "scene" / "a.ply"), put(tmp_path / "scene" / "sub" / "a.ply")
        beside = put(tmp_path / "scene" / "sub" / "b.ply")
        scene = save('<include filename="sub/inner.xml"/>')
        assert dict(read_mitsuba_xml(scene).files) == {"a.ply": top, "sub/b.ply": beside}
        top.unlink()
        assert dict(read_mitsuba_xml(scene).files) == {"sub/a.ply": both, "sub/b.ply": beside}

    @pytest.mark.slow
    def test_circles_and_crowds_end(self, save):
        save('<include filename="room.xml"/>', "b.xml")
        with pytest.raises(SceneError, match=rf"includes too many files; at most {MOST_INCLUDE_LEVELS} files inside"):
            read_mitsuba_xml(save('<include filename="b.xml"/>'))
        for level in range(6):
            save(f'<include filename="{level + 1}.xml"/>' * 10, f"{level}.xml")
        save("", "6.xml")
        with pytest.raises(SceneError, match="includes too many files"):
            read_mitsuba_xml(save('<include filename="0.xml"/>'))

    @pytest.mark.parametrize(
        ("color", "value"),
        [
            ('<srgb name="reflectance" value="0.5, 0.04045, 1"/>', (0.214041, 0.0031308, 1)),
            ('<srgb name="reflectance" value="#8000ff"/>', (0.215861, 0, 1)),
            ('<srgb name="reflectance" value="0.5"/>', (0.214041,)),
            ('<rgb name="reflectance" value="#8000ff"/>', (0.501961, 0, 1)),
        ],
    )
    def test_colours_of_before_version_2_become_linear(self, save, color, value):
        scene = read_mitsuba_xml(save(f'<bsdf type="diffuse">{color}</bsdf>', version="0.6.0"))
        (child,) = scene.root.children[0].children
        assert (child.tag, child.get("name")) == ("rgb", "reflectance")
        assert [float(word) for word in child.get("value").split()] == pytest.approx(value, abs=1e-6)

    def test_a_colour_that_is_none_is_refused(self, save):
        with pytest.raises(
            SceneError, match=r"room\.xml:2: the colour '#80' is not understood; one number, three, or #RR"
        ):
            read_mitsuba_xml(save('<bsdf type="diffuse"><srgb name="reflectance" value="#80"/></bsdf>'))

    def test_films_samplers_and_integrators_that_are_no_more_do_not_matter(self, save):
        film = '<film type="ldrfilm"><integer name="width" value="4"/><boolean name="banner" value="true"/></film>'
        sampler = '<sampler type="halton" id="s"><integer name="sampleCount" value="64"/></sampler>'
        camera = f'<sensor type="perspective">{sampler}{film}</sensor>'
        scene = read_mitsuba_xml(save(f'<integrator type="bdpt"/>{camera}', version="0.6.0"))
        integrator, sensor = scene.root.children
        sampler, film = sensor.children
        assert [each.get("type") for each in (integrator, sampler, film)] == ["path", "independent", "hdrfilm"]
        assert (sampler.get("id"), sampler.children) == ("s", ())
        assert [child.get("name") for child in film.children] == ["width"]

    def test_versions_do_not_mix(self, save):
        save("", "old.xml", version="0.6.0")
        with pytest.raises(SceneError, match=r"old\.xml: is of version 0\.6\.0, the scene of 3\.0\.0"):
            read_mitsuba_xml(save('<include filename="old.xml"/>'))


def test_elements_are_counted_as_often_as_they_are_included(save, monkeypatch):
    """Some short files that include each other would stand for more than fits in memory."""
    monkeypatch.setattr("lippmann.scene.mitsuba_xml.MOST_ELEMENTS", 40)
    save('<shape type="sphere"/>' * 12, "many.xml")
    assert read_mitsuba_xml(save('<include filename="many.xml"/>' * 2)).root.children
    with pytest.raises(SceneError, match=r"many.xml:\d: the scene has too many elements; at most 40 are read"):
        read_mitsuba_xml(save('<include filename="many.xml"/>' * 4))


class TestSearchPaths:
    def test_the_last_path_is_searched_first(self, save, tmp_path):
        first, last = put(tmp_path / "scene" / "one" / "a.ply"), put(tmp_path / "scene" / "two" / "a.ply")
        scene = save('<path value="one"/><path value="two"/>' + MESH.format("a.ply"))
        assert dict(read_mitsuba_xml(scene).files) == {"two/a.ply": last}
        last.unlink()
        assert dict(read_mitsuba_xml(scene).files) == {"one/a.ply": first}

    def test_paths_by_parameter_and_after_what_they_serve(self, save, tmp_path):
        there = put(tmp_path / "scene" / "one" / "a.ply")
        scene = save(MESH.format("a.ply") + '<default name="d" value="one"/><path value="$d"/>')
        assert dict(read_mitsuba_xml(scene).files) == {"one/a.ply": there}

    def test_paths_stand_in_the_root(self, save, tmp_path):
        (tmp_path / "scene" / "one").mkdir()
        with pytest.raises(SceneError, match=r"room\.xml:2: holds a search path; 'path' stands in the root alone"):
            read_mitsuba_xml(save('<shape type="cube"><path value="one"/></shape>'))

    def test_missing(self, save):
        with pytest.raises(SceneError, match=r"room\.xml:2: search path 'none' not found; it must be a folder"):
            read_mitsuba_xml(save('<path value="none"/>'))


OUTSIDE = [
    '<path value=".."/>' + MESH.format("secret.ply"),
    '<path value="{folder}"/>' + MESH.format("secret.ply"),
    '<default name="f" value="../secret.ply"/>' + MESH.format("$f"),
    '<default name="d" value=".."/>' + MESH.format("$d/secret.ply"),
    '<texture type="bitmap"><string name="filename" value="../secret.ply"/></texture>',
    '<emitter type="constant"><spectrum name="radiance" filename="../secret.ply"/></emitter>',
    '<include filename="../secret.ply"/>',
    MESH.format("link.ply"),
]


class TestFolders:
    @pytest.mark.parametrize("body", OUTSIDE)
    def test_nothing_outside_the_scenes_folder(self, save, tmp_path, body):
        put(tmp_path / "secret.ply", "root:x:0")
        (tmp_path / "scene" / "link.ply").symlink_to(tmp_path / "secret.ply")
        with pytest.raises(SceneError, match="lies outside the scene's folder") as caught:
            read_mitsuba_xml(save(body.format(folder=tmp_path)))
        assert "root:" not in str(caught.value)

    @pytest.mark.parametrize("body", OUTSIDE[:6])
    def test_unless_the_file_is_trusted(self, save, tmp_path, body):
        secret = put(tmp_path / "secret.ply")
        document = read_mitsuba_xml(save(body.format(folder=tmp_path)), NamedFiles(tmp_path / "scene", True))
        assert [path.resolve() for path in document.files.values()] == [secret]
        assert list(document.files) == ["../secret.ply"]

    def test_names_outside_are_not_told(self, save, tmp_path):
        put(tmp_path / "secret.ply")
        with pytest.raises(SceneError) as caught:
            read_mitsuba_xml(save(MESH.format("../secrets.ply")))
        assert "secret.ply" not in str(caught.value).replace("secrets.ply", "")
        with pytest.raises(SceneError) as caught:
            read_mitsuba_xml(save(MESH.format("../none/secrets.ply")))
        assert "there is no folder" not in str(caught.value)


class TestPlugins:
    @pytest.mark.parametrize("kind", ["../../x", "/elsewhere/x", "sphere.so", "nothing", "plugins/sphere", "Sphere"])
    @pytest.mark.parametrize("tag", ["shape", "bsdf", "spectrum", "emitter", "volume"])
    def test_unknown_ones_are_refused(self, save, tag, kind):
        with pytest.raises(SceneError, match=rf"room\.xml:2: unknown plugin '{kind}'.*; scene files name plugins"):
            read_mitsuba_xml(save(f'<{tag} type="{kind}"/>'))

    def test_by_parameter(self, save):
        with pytest.raises(SceneError, match=r"unknown plugin '\.\./x'"):
            read_mitsuba_xml(save('<default name="t" value="../x"/><shape type="$t"/>'))

    def test_in_included_files(self, save, tmp_path):
        put(tmp_path / "scene" / "red.xml", '<bsdf version="3.0.0" type="../x"/>')
        with pytest.raises(SceneError, match=r"red\.xml:1: unknown plugin '\.\./x'"):
            read_mitsuba_xml(save('<include filename="red.xml"/>'))

    def test_a_slip_of_the_pen(self, save):
        with pytest.raises(SceneError, match="did you mean 'sphere'"):
            read_mitsuba_xml(save('<shape type="spere"/>'))

    def test_tables_of_refractive_indices(self, save):
        metal = '<bsdf type="conductor"><string name="material" value="{}"/></bsdf>'
        read_mitsuba_xml(save(metal.format("Au")))
        read_mitsuba_xml(save(metal.format("none")))
        with pytest.raises(SceneError, match=r"unknown material '\.\./\.\./x'"):
            read_mitsuba_xml(save(metal.format("../../x")))


class TestText:
    def test_deep_files_end(self, save):
        depth = MOST_LEVELS + 1
        with pytest.raises(SceneError, match=rf"room\.xml:2: .*more than {MOST_LEVELS} deep"):
            read_mitsuba_xml(save('<shape type="cube">' * depth + "</shape>" * depth))

    def test_entities_are_refused(self, tmp_path):
        text = '<!DOCTYPE scene [\n<!ENTITY a "b">\n]>\n<scene version="3.0.0"><shape type="&a;"/></scene>'
        with pytest.raises(SceneError, match=r"room\.xml:2: declares an entity"):
            read_mitsuba_xml(put(tmp_path / "room.xml", text))

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("<scene", r"room\.xml:1: is no well-formed XML"),
            ("\n<bsdf version='3.0.0' type='diffuse'/>", "is XML of a 'bsdf'"),
            ('<?xml version="1.0" encoding="klingon"?><scene/>', r"room\.xml: cannot be decoded"),
        ],
    )
    def test_other_files(self, tmp_path, text, message):
        with pytest.raises(SceneError, match=message):
            read_mitsuba_xml(put(tmp_path / "room.xml", text))

    def test_complaints_name_the_line_of_the_file(self, save, engine):
        save('\n\n<shape type="cube"><float name="size" value="x"/></shape>', "inner.xml")
        scene = load_scene(save('<shape type="sphere"/>\n\n<include filename="inner.xml"/>'))
        with pytest.raises(SceneError, match=r"room: Mitsuba refuses the scene: .*inner\.xml:4: could not parse"):
            _ = scene.bounds


def test_mitsuba_sees_the_same_scene(save, tmp_path, engine):
    """What is read here loads to what Mitsuba's own parser makes of the file."""
    import mitsuba as mi

    mesh = mi.load_dict({"type": "cube"})
    mesh.write_ply(str(tmp_path / "cube.ply"))
    (tmp_path / "scene" / "meshes").mkdir()
    (tmp_path / "cube.ply").rename(tmp_path / "scene" / "meshes" / "cube.ply")
    put(tmp_path / "scene" / "grey.spd", "400 0.5\n700 0.5\n")
    put(
        tmp_path / "scene" / "sub" / "inner.xml",
        '<scene version="3.0.0"><default name="r" value="9"/>'
        '<bsdf type="diffuse" id="grey"><spectrum name="reflectance" filename="grey.spd"/></bsdf>'
        '<shape type="ply"><string name="filename" value="cube.ply"/>'
        '<transform name="to_world"><scale value="$r"/><translate x="$x" y="1"/></transform><ref id="grey"/></shape>'
        "</scene>",
    )
    path = save(
        '<default name="x" value="3"/><default name="r" value="2"/><path value="meshes"/>\n'
        '<!-- "a" & $b -->\n<include filename="sub/inner.xml"/>\n'
        '<shape type="sphere" id="&quot;ball&quot; &amp; \\$5"><bsdf type="conductor"/></shape>\n'
        '<emitter type="constant"/>'
    )
    theirs, ours = mi.load_file(str(path)), load_scene(path).description.scene()
    assert str(ours.bbox()) == str(theirs.bbox())
    assert sorted(shape.id() for shape in ours.shapes()) == sorted(shape.id() for shape in theirs.shapes())
    assert '"ball" & $5' in [shape.id() for shape in ours.shapes()]
    for one, other in zip(ours.shapes(), theirs.shapes(), strict=True):
        assert str(one) == str(other)
    integrator = mi.load_dict({"type": "path"})
    sensor = mi.load_dict(
        {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at([12, 9, 30], [1, 1, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 16, "height": 16},
        }
    )
    pictures = [np.array(mi.render(scene, sensor=sensor, integrator=integrator, spp=4)) for scene in (ours, theirs)]
    np.testing.assert_allclose(*pictures, rtol=1e-5)  # the film adds samples in the order in which threads come
    assert pictures[0].std() > 0.01
