"""Any scene, from a file, a name or an object."""

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import SceneError, UsageError
from lippmann.scene import bundled
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.registry import READERS
from lippmann.scene.scene import STUDIO_NOTE
from lippmann.scene.studio_light import BACKDROP, studio
from lippmann.scene.values.description import Environment, Instance, Material, Mesh, SceneDescription
from lippmann.scene.values.splats import Splats

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
STL = b"\0" * 80 + struct.pack("<I12fH", 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
XML = '<scene version="3.0.0"><shape type="sphere"/></scene>'
FILES = {"a.obj": OBJ.encode(), "a.PLY": PLY.encode(), "a.stl": STL, "a.xml": XML.encode()}


@pytest.fixture
def save(tmp_path):
    def save(name, data):
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return save


def triangle(**fields):
    mesh = Mesh("t", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32), 0)
    return SceneDescription("thing", [mesh], [Material()], [Instance(0, np.eye(4))], **fields)


@pytest.mark.parametrize("name", ["a.obj", "a.PLY", "a.stl"])
@pytest.mark.parametrize("kind", [str, Path])
def test_files_by_ending(save, name, kind):
    scene = load_scene(kind(save(name, FILES[name])))
    assert scene.name == "a"
    assert scene.bounds.tolist() == ([[0, 0, -1], [1, 0, 0]] if name.endswith("stl") else [[0, 0, 0], [1, 1, 0]])
    assert STUDIO_NOTE in scene.notes


@pytest.mark.parametrize(("name", "usual"), [("a.obj", "y"), ("a.ply", "y"), ("a.stl", "z")])
def test_up_is_taken_as_it_mostly_is_or_as_it_is_said(save, name, usual):
    path = save(name, FILES["a.PLY" if name == "a.ply" else name])
    bounds = {up: load_scene(path, up=up).bounds.tolist() for up in ("y", "z")}
    assert bounds == {"y": [[0, 0, 0], [1, 1, 0]], "z": [[0, 0, -1], [1, 0, 0]]}
    assert load_scene(path).bounds.tolist() == bounds[usual]
    said = [note for note in load_scene(path).notes if note.startswith("up is taken as")]
    assert len(said) == (name != "a.obj")
    assert not any(note.startswith("up is taken as") for note in load_scene(path, up="z").notes)


def test_up_of_what_says_it_itself_is_refused():
    with pytest.raises(UsageError, match=r"up: teapot says itself which way is up; y, z or -y, for \.obj, \.ply,"):
        load_scene("teapot", up="z")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("car.fbx", "open it in Blender, then File > Export > glTF"),
        ("part.STEP", "FreeCAD"),
        ("cup.zae", "unzip it"),
        ("cup.obj.gz", "unpack it"),
        ("water.cube", "obabel in.cube"),
        ("room.ksplat", "SuperSplat"),
        ("tower.e57", "CloudCompare"),
        ("points3D.txt", "COLMAP.s by its model_converter"),
        ("scan.xyzrgb", "CloudCompare"),
        ("brain.mgz", "mri_convert"),
        ("car.mtl", "name that"),
        ("virus.mrc", "mrcfile"),
        ("house.ifc", "IfcConvert in.ifc out.glb"),
        ("lamp.wrl", "MeshLab"),
        ("kettle.pbrt", r"its meshes, mostly \.ply files"),
        ("cage.pqr", r"obabel in\.pqr -O out\.pdb"),
        ("ring.3dm", "Rhino"),
        ("turn.mp4", "ffmpeg"),
        ("turn.m4v", "ffmpeg"),
        ("dancer.pmx", "MMD Tools"),
        ("house.rvt", "FBX"),
        ("chair.reality", r"\.usdz"),
        ("shed.kmz", "SketchUp"),
        ("brain.mnc", r"nibabel\.load\('a\.mnc'\)"),
        ("hero.ms3d", r"assimp export in\.ms3d out\.glb"),
        ("town.i3dm", r"i3dmToGlb -i in\.i3dm"),
        ("gear.sldprt", "STEP"),
        ("wing.cgns", "ParaView"),
        ("party.lfp", "lippmann weave"),
        ("sky.exr", "environment="),
        ("sky.hdr", "environment="),
    ],
)
def test_files_of_other_programs_are_told_how_to_become_gltf(save, name, said):
    with pytest.raises(SceneError, match="is no scene file: .*" + said):
        load_scene(save(name, b"ISO-10303-21;"))


def test_mitsuba_files_are_not_loaded_yet(save):
    scene = load_scene(save("a.xml", XML.encode()), background=(0, 0, 1))
    assert isinstance(scene.description, MitsubaSource)
    assert scene.background == (0, 0, 1)
    sky = Environment(np.ones((2, 4, 3), np.float32))
    assert load_scene(scene, environment=sky).environment is sky


def test_gltf_is_read_by_its_own_reader(shared_scenes):
    scene = load_scene(shared_scenes / "gltf" / "clearcoat_test" / "ClearCoatTest.gltf")
    assert len(scene.description.meshes) > 3


def test_content_counts_where_the_name_says_nothing(save):
    assert load_scene(save("model.data", PLY.encode())).bounds[1].tolist() == [1, 1, 0]
    assert load_scene(save("model", PLY.encode())).name == "model"


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.glb", PLY.encode(), r"a\.glb: is no \.glb file; it begins like a \.ply file"),
        ("a.obj", b"glTF....", r"a\.obj: is no \.obj file; it begins like a \.glb file"),
        ("a.ply", XML.encode(), r"a\.ply: is no \.ply file; it begins like a \.xml file"),
        ("a.ply", b"\n<!DOCTYPE html><title>404", r"a\.ply: is a web page, no scene; download the file itself"),
        ("transforms_train.json", b'{"frames": []}', r"transforms_train\.json: lists photographs and their cameras"),
        ("a.vtp", b"<html>", r"a\.vtp: is a web page"),
        ("a.stl", b"PK\3\4....", r"a\.stl: is a ZIP archive; unpack it, and name the scene file inside"),
        ("a.usdz", b"PK\3\4....", r"a\.usdz: is no USDZ package"),
        ("a.ply", OBJ.encode(), r"a\.ply: is no PLY file"),
        ("a.stl", OBJ.encode(), r"a\.stl: is no STL file"),
        ("a.xml", b"<mujoco><default class='a'/></mujoco>", r"a\.xml: is XML of a 'mujoco'; a Mitsuba file holds a"),
        ("a.xml", b"<list></list>", r"a\.xml: is XML of a 'list'"),
        ("a.xml", XML.encode()[:-3], r"a\.xml:1: is no well-formed XML"),
        (
            "a.fbx",
            b"Kaydara FBX",
            r"a\.fbx: is no scene file: \.fbx; open it in Blender, ",
        ),
        (
            "a.dae",
            b"<?xml version='1.0'?><COLLADA/>",
            r"a\.dae: is no scene file: \.dae; convert it by Assimp: assimp export in\.dae out\.glb",
        ),
        ("a.obj", b"", r"a\.obj: the file is empty"),
        ("a.glb", b"", r"a\.glb: the file is empty"),
        ("a.glb", b"glTF", r"a\.glb"),
        ("a.gltf", b"{", r"a\.gltf"),
    ],
)
def test_foreign_and_damaged_files(save, name, data, message):
    with pytest.raises(SceneError, match=message) as caught:
        load_scene(save(name, data))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("mtl", "seen"), [("d 0", False), ("Tr 0\nd 0", False), ("d 0.01", True), ("Tr 1", True), ("d 0\nillum 7", True)]
)
def test_a_material_that_makes_its_mesh_vanish_is_named(save, mtl, seen):
    save("m.mtl", f"newmtl film\n{mtl}\n".encode())
    scene = load_scene(save("a.obj", ("mtllib m.mtl\n" + OBJ.replace("f ", "usemtl film\nf ", 1)).encode()))
    expected = "material 'film': opacity 0, so that nothing is seen of what has it"
    assert (expected in scene.notes) == (not seen)


@pytest.mark.parametrize("suffix", READERS.own_claims)
def test_files_that_are_missing_or_unreadable(tmp_path, suffix):
    with pytest.raises(SceneError, match="no such file"):
        load_scene(tmp_path / f"none{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(SceneError, match="is a folder"):
        load_scene(tmp_path / f"folder{suffix}")


def test_a_description_is_checked_whoever_made_it(save):
    bad = PLY.replace("1 0 0\n", "inf 0 0\n")
    with pytest.raises(SceneError, match=r"a\.ply: vertex 1 is \[inf, 0\.0, 0\.0\]"):
        load_scene(save("a.ply", bad.encode()))
    with pytest.raises(SceneError, match="the scene has no geometry"):
        load_scene(SceneDescription("nothing"))
    with pytest.raises(SceneError, match=r"a\.stl: mesh 'a' has 1 vertices that are not finite"):
        load_scene(save("a.stl", STL[:96] + struct.pack("<f", np.nan) + STL[100:]))


def test_a_bundled_scene_by_name():
    assert "teapot" in bundled.names()
    scene = load_scene("teapot")
    assert scene.name == "teapot"
    assert scene.home_camera == scene.cameras[0].name
    assert scene.camera() is scene.cameras[0]


def test_an_unknown_name_suggests_the_likely_one():
    with pytest.raises(
        SceneError, match=r"unknown bundled scene or file 'taepot', did you mean 'teapot'\?; known are "
    ):
        load_scene("taepot")
    with pytest.raises(SceneError, match=r"file 'zzz'; known are [a-z, -]+$"):
        load_scene("zzz")


def test_objects():
    description = triangle()
    assert load_scene(description).description is description
    assert load_scene(load_scene(description)).description is description
    assert isinstance(load_scene({"type": "scene"}).description, MitsubaSource)
    with pytest.raises(SceneError, match="a dictionary of type 'sphere'; Mitsuba scenes have type 'scene'"):
        load_scene({"type": "sphere"})
    with pytest.raises(UsageError, match=r"^3 is no scene; a path"):
        load_scene(3)


def test_light_and_background():
    scene = load_scene(triangle(), background=(0, 0.5, 1))
    assert (scene.background, scene.environment) == ((0, 0.5, 1), studio())
    for kind in (str, Path):
        scene = load_scene(triangle(), environment=kind("studio"))
        assert scene.environment is studio()
        assert scene.notes == ()
        scene = load_scene(triangle(), environment=kind("none"))
        assert (scene.environment, scene.notes) == (None, ())
        assert load_scene(scene).environment is None
    assert load_scene(triangle()).background == BACKDROP
    sky = Environment(np.ones((2, 4, 3), np.float32))
    assert load_scene(triangle(environment=studio()), environment=sky).environment is sky


def test_single_scattering_is_noted(save):
    assert load_scene(triangle()).physical.multiple_scattering
    scene = load_scene(triangle(), single_scattering=True)
    assert not scene.physical.multiple_scattering
    assert any("single scattering" in note for note in scene.notes)
    classic = load_scene("teapot", single_scattering=True)
    assert not classic.is_classic
    with pytest.raises(UsageError, match=r"single_scattering: .*leave it out"):
        load_scene(save("a.xml", XML.encode()), single_scattering=True)


@pytest.mark.parametrize("background", [(1, 2), (0, 0, -1), (0, 0, np.nan), (1.01, 0, 0), (1, 1, 1, 1), 0.5, "red"])
def test_backgrounds_that_are_no_colour(background):
    with pytest.raises(UsageError, match=r"background: .*three numbers from 0 to 1"):
        load_scene(triangle(), background=background)


def test_an_environment_that_is_not_there(tmp_path):
    with pytest.raises(SceneError, match="no such file"):
        load_scene(triangle(), environment=tmp_path / "none.exr")


def test_outside_files_need_leave(save, tmp_path):
    (tmp_path / "sub").mkdir()
    save("m.mtl", b"newmtl red\nKd 1 0 0\n")
    path = save("sub/a.obj", b"mtllib ../m.mtl\n" + OBJ.replace("f", "usemtl red\nf").encode())
    with pytest.raises(SceneError, match=r"a\.obj:1: material library '\.\./m\.mtl' lies outside"):
        load_scene(path)
    assert load_scene(path, allow_outside=True).description.materials[0].base_color == (1, 0, 0)


@pytest.mark.parametrize("is_unlit", [True, False])
def test_light_that_changes_nothing_is_said(is_unlit):
    splats = Splats(*(np.ones((1, *shape), np.float32) for shape in ((3,), (3,), (4,), (), (1, 3))))
    unlit = replace(triangle(), materials=[Material(unlit=True)])
    thing = unlit if is_unlit else SceneDescription("cloud", splats=splats)
    scene = load_scene(thing, single_scattering=True, light={"light_turn": (30, 0)})
    assert scene.notes[-1] == (
        "the scene keeps its own colours, whatever light is given: single_scattering, light_turn"
    )
    assert not any("microfacets" in note for note in scene.notes)
    assert not any("whatever light" in note for note in load_scene(thing, environment="none").notes)


def test_exact_microfacets_are_those_of_the_physical_form():
    assert load_scene("small-balls").is_classic
    scene = load_scene("small-balls", single_scattering=True)
    assert not scene.is_classic
    assert scene.description.multiple_scattering is False
