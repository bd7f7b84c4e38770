"""Tachyon scene files: every item of the grammar, and what is said about files that are wrong."""

import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.tachyon.reader import read_cam, read_tachyon
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import ClassicMaterial

TEXTURE = "TEXTURE AMBIENT 0 DIFFUSE 1 SPECULAR 0 OPACITY 1 COLOR 1 0 0 TEXFUNC 0"
SPHERE = f"SPHERE CENTER 0 0 0 RAD 1 {TEXTURE}\n"
CAMERA = "CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 4 CENTER 0 0 -6 VIEWDIR 0 0 1 UPDIR 0 1 0 {} END_CAMERA\n"


@pytest.fixture
def read(tmp_path):
    def reads(items: str, **options) -> ClassicScene:
        path = tmp_path / "scene.dat"
        path.write_text(f"BEGIN_SCENE RESOLUTION 8 6\n{items}\nEND_SCENE\n")
        return read_tachyon(path, **options)

    return reads


def test_numbers_of_the_shared_scenes(shared_scenes):
    """The counts that the program itself prints (it counts lights, and no planes)."""
    expected = {
        "2balls": 5, "attenuation": 1, "clipplanes": 5, "fisheye": 5, "fog": 5, "gears_s2": 4583, "imagedef": 6,
        "lscapes": 206, "polycyl": 17, "room": 22, "smallballs": 94, "spotlight": 4, "teapot": 2330, "texfree": 5,
        "transtest": 5, "tree_fcyl": 8199,
    }  # fmt: skip
    found = {}
    for path in (shared_scenes / "tachyon").glob("*.dat"):
        if path.stem != "texture":
            scene = read_tachyon(path)
            counts = scene.counts()
            found[path.stem] = sum(counts.values()) - counts["plane"] - counts["cylinder"] + len(scene.lights)
    assert found == expected


def test_the_erroneous_shared_scene_is_refused_with_its_line(shared_scenes):
    with pytest.raises(SceneError, match=r"^texture\.dat:37: found 'PLANE'; expected the name of an image$"):
        read_tachyon(shared_scenes / "tachyon" / "texture.dat")


def test_tree(shared_scenes):
    scene = read_tachyon(shared_scenes / "tachyon" / "tree_fcyl.dat")
    assert scene.counts() == {
        "sphere": 4095, "tube": 4095, "cylinder": 0, "ring": 0, "box": 0, "plane": 0, "triangle": 2
    }  # fmt: skip
    assert (len(scene.lights), len(scene.materials), scene.notes) == (7, 2, ())
    assert scene.tubes.apex_radius.tolist() == scene.tubes.base_radius.tolist()
    assert scene.resolution == (512, 512)
    assert scene.camera.ray_depth == 5
    assert (scene.rules, scene.handedness) == ("tachyon", "left")


def test_big_files_are_read_fast(shared_scenes):
    path = shared_scenes / "tachyon" / "tree_fcyl.dat"
    assert any(_cpu_seconds(read_tachyon, path) < 0.5 for _ in range(3))


def _cpu_seconds(function, *arguments) -> float:
    start = time.process_time()
    function(*arguments)
    return time.process_time() - start


def test_numbers_are_single_precision(read):
    scene = read(f"SPHERE CENTER 0.1 0 0 RAD 0.3 {TEXTURE}")
    assert scene.spheres.centers[0, 0] == np.float32(0.1)
    assert scene.spheres.radii[0] == np.float32(0.3)


def test_keywords_in_any_case_names_as_they_are(read):
    scene = read(f"texdef A {TEXTURE[8:]}\nsphere Center 0 0 0 Rad 1 A\nsphere Center 0 0 0 Rad 1 a")
    assert len(scene.materials) == 2
    assert scene.notes[0].startswith("'a' (scene.dat:4): textures are not defined before they are used")


def test_comments(read):
    assert read(f"# a # b\n{SPHERE}# SPHERE\n#\n").counts()["sphere"] == 1
    for comment in ("## two", "#glued"):
        with pytest.raises(SceneError, match=r"scene\.dat:2: found '#"):
            read(f"{comment}\n{SPHERE}")


def test_comments_before_the_scene(tmp_path):
    (tmp_path / "c.dat").write_text(f"# made by hand\nBEGIN_SCENE RESOLUTION 1 2 {SPHERE} END_SCENE")
    assert read_tachyon(tmp_path / "c.dat").resolution == (1, 2)


def test_camera(read):
    scene = read(CAMERA.format("") + CAMERA.format("FRUSTUM -1 2 -3 4").replace("CAMERA Z", "CAMERA\nZ") + SPHERE)
    assert scene.camera.center == (0.0, 0.0, -6.0)
    assert scene.camera.frustum == (-1.0, 2.0, -3.0, 4.0)
    assert read(SPHERE).notes == ("no CAMERA: seen from the origin along +z",)


def test_camera_without_projection_keeps_the_one_before(read):
    first = CAMERA.format("").replace("CAMERA Z", "CAMERA PROJECTION ORTHOGRAPHIC Z", 1)
    assert read(first + CAMERA.format("") + SPHERE).camera.projection == "orthographic"


def test_depth_of_field(read):
    dof = CAMERA.format("").replace("CAMERA Z", "CAMERA PROJECTION PERSPECTIVE_DOF FOCALLENGTH 7 APERTURE 0.5 Z", 1)
    scene = read(dof + SPHERE)
    assert (scene.camera.projection, scene.camera.aperture) == ("perspective-dof", 0.5)
    assert "FOCALLENGTH has no effect" in scene.notes[0]


def test_lights(read):
    scene = read(
        "LIGHT CENTER 1 2 3 RAD 0.5 ATTENUATION CONSTANT 1 LINEAR 0.5 QUADRATIC 0.25 COLOR 1 0.5 0\n"
        "SPOTLIGHT CENTER 0 0 0 RAD 0 DIRECTION 0 -2 0 FALLOFF_START 20 FALLOFF_END 45 COLOR 1 1 1\n"
        f"DIRECTIONAL_LIGHT DIRECTION 0 0 4 COLOR 0 1 0\nSKY_LIGHT NUMSAMPLES 16 COLOR 0.5 0.5 0.5\n{SPHERE}"
    )
    point, spot, sun = scene.lights
    assert (point.kind, point.radius, point.attenuation, point.color) == ("point", 0.5, (1, 0.5, 0.25), (1, 0.5, 0))
    assert (spot.kind, spot.direction, spot.falloff_start, spot.falloff_end) == ("spot", (0, -1, 0), 20, 45)
    assert (sun.kind, sun.direction) == ("directional", (0, 0, 1))
    assert (scene.ambient_occlusion.samples, scene.ambient_occlusion.color) == (16, (0.5, 0.5, 0.5))


def test_background_and_fog(read):
    scene = read(
        "BACKGROUND_GRADIENT SKY_ORTHO_PLANE UPDIR 0 2 0 TOPVAL 1 BOTTOMVAL -1 TOPCOLOR 0 0 1 BOTTOMCOLOR 0 1 0\n"
        f"BACKGROUND 1 0 0\nFOG EXP2 START 1 END 2 DENSITY 0.5 COLOR 1 1 1\n{SPHERE}"
    )
    sky = scene.background
    assert (sky.kind, sky.color, sky.up, sky.top_value, sky.bottom_value) == ("sky-plane", (1, 0, 0), (0, 2, 0), 1, -1)
    assert (sky.top_color, sky.bottom_color) == ((0, 0, 1), (0, 1, 0))
    assert (scene.fog.kind, scene.fog.start, scene.fog.end, scene.fog.density) == ("exp2", 1, 2, 0.5)
    fog = "FOG EXP START 1 END 2 DENSITY 0.5 COLOR 1 1 1\n"
    assert read(fog + fog.replace("EXP", "OFF") + SPHERE).fog is None


def test_shader_mode(read):
    scene = read(
        "SHADER_MODE MEDIUM SHADOW_FILTER_OFF TRANS_MAX_SURFACES 3 TRANS_RASTER3D TRANS_ORIG TRANS_VMD FOG_VMD\n"
        "AMBIENT_OCCLUSION AMBIENT_COLOR 1 0.5 0 RESCALE_DIRECT 0.75 SAMPLES 12 END_SHADER_MODE\n"
        f"FOG LINEAR START 1 END 2 DENSITY 0 COLOR 1 1 1\n{SPHERE}"
    )
    shading = scene.shading
    assert (shading.mode, shading.shadow_filter, shading.max_transparent_surfaces) == ("medium", False, 3)
    assert (shading.raster3d, shading.local_times_opacity, shading.light_scale) == (False, True, 0.75)
    assert scene.fog.planar
    assert scene.ambient_occlusion.samples == 12
    assert read(SPHERE).shading.mode == "full"


def test_primitives(read):
    scene = read(
        f"PLANE CENTER 0 -1 0 NORMAL 0 2 0 {TEXTURE}\nCYLINDER CENTER 1 2 3 AXIS 0 0 5 RAD 2 {TEXTURE}\n"
        f"FCYLINDER BASE 0 0 0 APEX 0 0 2 RAD 0.5 {TEXTURE}\n"
        f"POLYCYLINDER POINTS 3 0 0 0 1 0 0 1 1 0 RAD 0.25 {TEXTURE}\n"
        f"RING CENTER 0 0 0 NORMAL 0 3 0 INNER 0 OUTER 2 {TEXTURE}\nBOX MIN 0 0 0 MAX 1 2 3 {TEXTURE}\n"
        f"TRI V0 0 0 0 V1 1 0 0 V2 0 1 0 {TEXTURE}\n"
        f"STRI V0 0 0 0 V1 1 0 0 V2 0 1 0 N0 0 0 1 N1 0 0 2 N2 0 0 3 {TEXTURE}\n{SPHERE}"
    )
    assert list(scene.counts().values()) == [4, 3, 1, 1, 1, 1, 2]
    assert scene.planes.normals.tolist() == [[0, 1, 0]]
    assert scene.triangles.smooth.tolist() == [False, True]
    assert scene.triangles.normals[1].tolist() == [[0, 0, 1], [0, 0, 2], [0, 0, 3]]
    assert len(scene.materials) == 1


def test_vertex_colours(read):
    scene = read(
        "VCSTRI V0 0 0 0 V1 1 0 0 V2 0 1 0 N0 0 0 1 N1 0 0 1 N2 0 0 1 C0 1 0 0 C1 0 1 0 C2 0 0 1\n"
        "AMBIENT 0.25 DIFFUSE 0.5 SPECULAR 0 OPACITY 1 PHONG METAL 0.5 PHONG_SIZE 8 VCST\n"
        "VERTEXARRAY NUMVERTS 4 COORDS 0 0 0 1 0 0 0 1 0 1 1 0 NORMALS 0 0 1 0 0 1 0 0 1 0 0 1\n"
        "TRIMESH 1 0 1 2 COLORS 1 0 0 0 1 0 0 0 1 1 1 1\n"
        f"{TEXTURE} TRISTRIP 4 0 1 2 3 END_VERTEXARRAY"
    )
    colored = scene.triangles.colored
    assert colored.sum() == 3
    single = scene.materials[scene.triangles.material[colored][-1]]
    assert single == ClassicMaterial((1, 1, 1), 0.25, 0.5, phong=0.5, phong_size=8, phong_kind="metal")
    plain = scene.materials[scene.triangles.material[~colored][0]]
    assert plain == ClassicMaterial()  # a vertex array before its first TEXTURE
    strip = scene.triangles.positions[colored][:2]
    winding = np.cross(strip[:, 1] - strip[:, 0], strip[:, 2] - strip[:, 0])
    assert (winding[:, 2] > 0).all()
    assert scene.triangles.colors[colored][1].tolist() == [[0, 0, 1], [0, 1, 0], [1, 1, 1]]


def test_texture_bodies(read):
    scene = read(
        "SPHERE CENTER 0 0 0 RAD 1 TEXTURE AMBIENT 0.5 DIFFUSE 0.25 SPECULAR 0.125 OPACITY 0.75 TRANSMODE R3D\n"
        "OUTLINE 0.5 OUTLINE_WIDTH 0.25 PHONG PLASTIC 0.5 PHONG_SIZE 40 COLOR 1 0.5 0\n"
        "TEXFUNC 4 CENTER 1 2 3 ROTATE 4 5 6 SCALE 7 8 9"
    )
    (material,) = scene.materials
    assert (material.ambient, material.diffuse, material.specular, material.opacity) == (0.5, 0.25, 0.125, 0.75)
    assert (material.raster3d, material.outline, material.outline_width) == (True, 0.5, 0.25)
    assert (material.phong, material.phong_size, material.phong_kind) == (0.5, 40, "plastic")
    texture = material.texture
    assert (texture.kind, texture.center, texture.rotate, texture.scale) == ("wood", (1, 2, 3), (4, 5, 6), (7, 8, 9))


def test_named_textures(read):
    body = TEXTURE[8:]
    scene = read(
        f"TEXDEF red {body}\nTEXALIAS rouge red\nTEXDEF red {body.replace('1 0 0', '0 1 0')}\n"
        "SPHERE CENTER 0 0 0 RAD 1 red SPHERE CENTER 0 0 0 RAD 1 rouge SPHERE CENTER 0 0 0 RAD 1 rot"
    )
    colors = [scene.materials[m].color for m in scene.spheres.material]
    assert colors == [(1, 0, 0), (1, 0, 0), (1, 1, 1)]
    assert scene.notes[0] == "'red' (scene.dat:4): textures are defined again; the first ones are kept"
    assert scene.notes[1].startswith("'rot' (scene.dat:5): textures are not defined before they are used")


def test_many_undefined_textures_are_one_note(read):
    scene = read(" ".join(f"SPHERE CENTER 0 0 0 RAD 1 t{i}" for i in range(20000)))
    (note,) = (note for note in scene.notes if "textures" in note)
    assert note.startswith("'t0' (scene.dat:2), 't1' (scene.dat:2)")
    assert " and 19995 more: " in note


def test_inline_images(read):
    use = "TEXFUNC 10 {} CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1 UAXIS 1 0 0 VAXIS 0 1 0 WAXIS 0 0 1"
    scene = read(
        "IMAGEDEF ::pic FORMAT RGB24 RESOLUTION 2 1 2 ENCODING HEX 1f0 12F0ab 123456789 123456789abc\n"
        + SPHERE.replace("TEXFUNC 0", use.format("::pic"))
        + SPHERE.replace("TEXFUNC 0", use.format("::nix"))
    )
    assert scene.images[0].texels.tolist() == [
        [[[0x11, 0xFF, 0x00], [0x12, 0xF0, 0xAB]]],
        [[[0x12, 0x45, 0x78], [0x12, 0x56, 0x9A]]],
    ]
    assert (scene.images[1].texels == 255).all()
    assert scene.notes[0].startswith("'::nix' (scene.dat:4): images are not defined before they are used")


def test_clip_groups(read):
    scene = read(
        f"START_CLIPGROUP NUMPLANES 2 1 0 0 3 -1 0 0 2\n{SPHERE}LIGHT CENTER 0 0 0 RAD 1 COLOR 1 1 1\n"
        f"START_CLIPGROUP NUMPLANES 1 0 1 0 0\n{SPHERE}TRI V0 0 0 0 V1 1 0 0 V2 0 1 0 {TEXTURE}\n"
        f"END_CLIPGROUP\n{SPHERE}"
    )
    assert [group.tolist() for group in scene.clip_groups] == [[[1, 0, 0, 3], [-1, 0, 0, 2]], [[0, 1, 0, 0]]]
    assert scene.spheres.clip_group.tolist() == [0, 1, -1]
    assert scene.triangles.clip_group.tolist() == [1]
    assert scene.lights[0].clip_group == 0


def test_what_cannot_be_seen_is_left_out_and_said(read):
    scene = read(
        f"SPHERE CENTER 0 0 0 RAD 0 {TEXTURE}\nFCYLINDER BASE 1 1 1 APEX 1 1 1 RAD 1 {TEXTURE}\n"
        f"TRI V0 0 0 0 V1 0 0 1e-10 V2 0 1 0 {TEXTURE}\nTRI V0 0 0 0 V1 0 0 1 V2 0 1 0 {TEXTURE}\n"
        f"RING CENTER 0 0 0 NORMAL 0 1 0 INNER 2 OUTER 1 {TEXTURE}"
    )
    assert {kind: n for kind, n in scene.counts().items() if n} == {"triangle": 1}
    assert set(scene.notes) == {
        "no CAMERA: seen from the origin along +z",
        "1 spheres of radius 0 cannot be seen and are left out",
        "1 cylinders of radius or length 0 cannot be seen and are left out",
        "1 triangles with corners that coincide cannot be seen and are left out",
        "1 rings with no width cannot be seen and are left out",
    }


def test_text_after_the_end_is_said(read):
    assert "scene.dat:4: what follows END_SCENE is not read" in read(f"{SPHERE}END_SCENE\nmore").notes


@pytest.mark.parametrize(
    ("items", "message"),
    [
        ("SPHERE CENTER 0 0 0 RAD -1 x", "2: found '-1'; expected a number of 0 or more"),
        ("SPHERE CENTER 0 nan 0 RAD 1 x", "2: found 'nan'; expected a finite number"),
        ("SPHERE CENTER 0 0\n1e60 RAD 1 x", "3: found '1e60'; expected a finite number"),
        ("SPHERE CENTER 0 0 0 RAD inf x", "2: found 'inf'; expected a finite number"),
        ("SPHERE RAD 1 CENTER 0 0 0 x", "2: found 'RAD'; expected CENTER"),
        ("SPHERE CENTER 0 0 0 RAD 1\nPLANE", "3: found 'PLANE'; expected the name of a texture, or TEXTURE"),
        ("CONE", "2: found 'CONE'; expected the keyword of an item, such as SPHERE, or END_SCENE"),
        ("SCALARVOL MIN 0 0 0", "2: SCALARVOL cannot be rendered; volumes are not rendered"),
        ("MGFFILE x", "2: MGFFILE cannot be rendered"),
        ("PLANE CENTER 0 0 0 NORMAL 0 0 0 x", "2: found '0'; expected a direction, not 0 0 0"),
        ("BOX MIN 0 0 0 MAX 1 -1 1 x", "2: found '1'; expected a corner that is not below MIN"),
        ("CAMERA ZOOM 0", "2: found '0'; expected a number above 0"),
        ("CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 1.5", "2: found '1.5'; expected a whole number from 0 to"),
        (CAMERA.format("").replace("UPDIR 0 1 0", "UPDIR 0 0 5"), "2: camera looks along .* not parallel"),
        (CAMERA.format("FRUSTUM 1 1 0 1"), "2: frustum .* left is not right"),
        ("CAMERA PROJECTION ROUND", "2: found 'ROUND'; expected PERSPECTIVE or "),
        ("LIGHT CENTER 0 0 0 RAD 1 ATTENUATION CONSTANT 0 LINEAR 0 QUADRATIC 0", "expected factors of attenuation"),
        ("FOG THICK", "2: found 'THICK'; expected LINEAR or EXP or EXP2 or OFF"),
        ("FOG LINEAR START 1 END 1", "expected an end of the fog that differs"),
        ("SHADER_MODE FULL FAST", "2: found 'FAST'; expected an option of SHADER_MODE, or END_SHADER_MODE"),
        ("SKY_LIGHT NUMSAMPLES 99999999", "expected a whole number from 0 to 65535"),
        ("TEXDEF t AMBIENT 1 DIFFUSE 1 SPECULAR 1 OPACITY 1 COLOR 1 1 1 TEXFUNC 11", "from 0 to 10"),
        ("TEXDEF t AMBIENT 1 DIFFUSE 1 SPECULAR 1 OPACITY 1 PHONG MATT", "2: found 'MATT'; expected PLASTIC"),
        ("VERTEXARRAY NUMVERTS 1000000000 COORDS", "2: found '1000000000'; expected a count that the file can hold"),
        ("VERTEXARRAY NUMVERTS 0 COORDS NORMALS TRIMESH 1 0 0 0", "found '0'; expected a whole number from 0 to -1"),
        ("POLYCYLINDER POINTS 2000000000 0 0 0", "expected a count that the file can hold"),
        ("START_CLIPGROUP NUMPLANES 2000000000 0 0 0", "expected a count that the file can hold"),
        ("IMAGEDEF a FORMAT RGB24 RESOLUTION 60000 60000 60000", "expected a resolution that the file can fill"),
        ("IMAGEDEF a FORMAT RGB24 RESOLUTION 1 1 1 ENCODING HEX 12345", "expected a colour of 3, 6, 9 or 12"),
        ("SCAPE RES 100000 100000", "2: found '100000'; expected a whole number from 2 to 1024"),
        pytest.param(
            f"SCAPE RES 1000 500 SCALE 1 1 CENTER 0 0 0 {TEXTURE} SCAPE RES 1000 500",
            "2: found '500'; expected at most 524288 samples in all landscapes together",
            marks=pytest.mark.long,
        ),
        ("SCAPE RES 1 2", "2: found '1'; expected a whole number from 2"),
        ("", "the scene has no geometry"),
        (CAMERA.format(""), "the scene has no geometry"),
    ],
)
def test_errors_name_file_line_word_and_expectation(read, items, message):
    with pytest.raises(SceneError, match=rf"^scene\.dat:.*{message}|^scene\.dat: {message}"):
        read(items)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("BEGIN_SCENE RESOLUTION 0 5 END_SCENE", "x.dat:1: found '0'; expected a whole number from 1 to 65536"),
        ("BEGIN_SCENE\nCAMERA", "x.dat:2: found 'CAMERA'; expected RESOLUTION"),
        ("v from 0 0 0", "x.dat:1: found 'v'; expected BEGIN_SCENE"),
        (f"BEGIN_SCENE RESOLUTION 8 8\n{SPHERE}", "x.dat:2: the file ends without END_SCENE; is it cut short?"),
        (f"BEGIN_SCENE RESOLUTION 8 8\n{SPHERE[:24]}", "x.dat:2: the file ends too early; expected"),
        ("   \n ", "x.dat:1: the file ends too early; expected BEGIN_SCENE"),
        ("BEGIN_SCENE\0\0", "x.dat: is not a text file"),
        ("", "x.dat: the file is empty"),
    ],
)
def test_files_that_are_none(tmp_path, text, message):
    (tmp_path / "x.dat").write_text(text)
    with pytest.raises(SceneError, match=f"^{message}"):
        read_tachyon(tmp_path / "x.dat")


def test_missing_file(tmp_path):
    with pytest.raises(SceneError, match="no such file"):
        read_tachyon(tmp_path / "none.dat")


def test_wrong_counts_cost_neither_time_nor_memory(tmp_path):
    path = tmp_path / "x.dat"
    path.write_text("BEGIN_SCENE RESOLUTION 8 8 VERTEXARRAY NUMVERTS 2000000000 COORDS 0 0 0 END_SCENE")
    tracemalloc.start()
    with pytest.raises(SceneError):
        read_tachyon(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6


def test_camera_path(tmp_path):
    path = tmp_path / "path.cam"
    path.write_text("0 0 1 0 1 0 0 0 -6\n0 0 1 0 1 0 0.5 0 -6\n")
    poses = read_cam(path)
    assert [pose.center for pose in poses] == [(0, 0, -6), (0.5, 0, -6)]
    assert (poses[0].view, poses[0].up) == ((0, 0, 1), (0, 1, 0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0 0 1 0 1 0 0 0 -6\n0 0 1 0 1 0 0 0\n", r"path\.cam:2: the file ends too early"),
        ("0 0 0 0 1 0 0 0 -6", r"path\.cam:1: found '0'; expected a direction"),
        ("0 0 1 0 0 2 0 0 -6", r"path\.cam:1: .*expected an up direction that is not the view direction"),
        ("# nothing", "no frame of a camera path"),
    ],
)
def test_camera_path_errors(tmp_path: Path, text, message):
    (tmp_path / "path.cam").write_text(text)
    with pytest.raises(SceneError, match=message):
        read_cam(tmp_path / "path.cam")
