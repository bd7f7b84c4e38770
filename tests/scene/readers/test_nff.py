"""NFF files: entities, light rule, triangulation, handedness, errors."""

import math
import time

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.nff import read_nff
from lippmann.scene.values.whitted_scene import ClassicScene

VIEW = "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 512 256\n"
FILL = "f 1 0.5 0.25 0.8 0.2 30 0 1\n"


@pytest.fixture
def read(tmp_path):
    def reads(entities: str, head: str = VIEW + FILL) -> ClassicScene:
        path = tmp_path / "scene.nff"
        path.write_text(head + entities)
        return read_nff(path)

    return reads


def test_numbers_of_the_shared_scenes(shared_scenes):
    """Spheres, cones, triangles and lights as the table of the databases has them."""
    found = {}
    for path in (shared_scenes / "spd").glob("*.nff"):
        scene = read_nff(path)
        counts = scene.counts()
        found[path.stem] = (counts["sphere"], counts["tube"], counts["triangle"], len(scene.lights))
        assert scene.notes == ()
    assert found == {
        "balls_s2": (91, 0, 2, 3),
        "gears": (0, 0, 36610, 5),
        "gears_s1": (0, 0, 574, 5),
        "gears_s2": (0, 0, 4578, 5),
        "sample": (0, 1, 880, 1),
        "teapot": (0, 0, 2256 + 2 * 36, 2),
        "tree": (4095, 4095, 2, 7),
        "tree_s8": (511, 511, 2, 7),
    }


def test_gears_are_cut_without_overlap_and_keep_their_winding(shared_scenes):
    scene = read_nff(shared_scenes / "spd" / "gears_s1.nff")
    corners = scene.triangles.positions
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    lines = (shared_scenes / "spd" / "gears_s1.nff").read_text().splitlines()
    start = lines.index("p 144")
    face = np.array([line.split() for line in lines[start + 1 : start + 145]], float)
    outline = np.cross(face, np.roll(face, -1, axis=0)).sum(axis=0) / 2
    assert areas.min() > 0
    assert areas[2 : 2 + 142].sum() == pytest.approx(np.linalg.norm(outline), rel=1e-6)
    up = scene.triangles.normals[2 : 2 + 142, 0]
    np.testing.assert_allclose(up, np.tile(outline / np.linalg.norm(outline), (142, 1)), atol=1e-6)


def test_big_files_are_read_fast(shared_scenes):
    path = shared_scenes / "spd" / "gears.nff"

    def seconds():
        start = time.process_time()
        read_nff(path)
        return time.process_time() - start

    assert any(seconds() < 1.0 for _ in range(3))


def test_viewpoint(read):
    scene = read("s 0 0 0 1")
    camera = scene.camera
    assert (scene.rules, scene.handedness, camera.handedness) == ("nff", "right", "right")
    assert (camera.center, camera.view, camera.up) == ((0, 0, 5), (0, 0, -5), (0, 1, 0))
    assert (camera.angle, camera.ray_depth, camera.pixel_point) == (45, 5, "center")
    right, up, _ = camera.frame()
    np.testing.assert_allclose([right, up], [[1, 0, 0], [0, 1, 0]], atol=1e-15)
    assert scene.resolution == (512, 256)
    assert scene.shading.highlight == "phong"


def test_lights_share_the_recommended_intensity(read):
    scene = read("l 1 2 3\nl 4 5 6 1 0.5 0\nl 0 0 9\nl 0 9 0\ns 0 0 0 1")
    intensity = math.sqrt(4) / 8
    assert scene.lights[0].color == (intensity,) * 3
    assert scene.lights[1].color == (intensity, intensity / 2, 0)
    assert all(light.radius == 0 for light in scene.lights)
    assert scene.materials[0].ambient == pytest.approx(0.8 * intensity)


def test_without_lights_there_is_ambient_light(read):
    scene = read("s 0 0 0 1")
    assert scene.materials[0].ambient == pytest.approx(0.4)
    assert scene.notes == ("no lights: seen by ambient light of 0.5 alone",)


def test_materials(read):
    scene = read(
        "s 0 0 0 1\nf 0 0 1 0.2 0.1 100 0.7 1.5\ns 1 0 0 1\nf 0 0 1 0.2 0.1 100 0 0\nc 0 0 0 1 0 0 1 1\nl 0 0 1",
        VIEW + FILL,
    )
    first, glass, opaque = scene.materials
    assert (first.color, first.diffuse, first.specular) == ((1, 0.5, 0.25), 0.8, 0.2)
    assert (first.phong, first.phong_size, first.phong_kind) == (0.2, 30, "plastic")
    assert (first.opacity, first.ior) == (1, 1)
    assert glass.opacity == pytest.approx(0.3)
    assert glass.ior == 1.5
    assert (opaque.opacity, opaque.ior) == (1, 1)
    assert scene.spheres.material.tolist() == [0, 1]
    assert scene.tubes.material.tolist() == [2]


def test_spheres_and_cones(read):
    scene = read("s 1 2 3 -0.5\ns 1 2 3 0.5\nc 0 0 0 2\n0 0 4 1\nc 0 0 0 -2 0 0 4 -1\nc 0 0 0 1 0 0 1 0")
    assert scene.spheres.radii.tolist() == [0.5, 0.5]
    assert scene.spheres.inside_only.tolist() == [True, False]
    assert scene.tubes.base_radius.tolist() == [2, 2, 1]
    assert scene.tubes.apex_radius.tolist() == [1, 1, 0]
    assert scene.tubes.inside_only.tolist() == [False, True, False]


def test_concave_polygon(read):
    scene = read("p 4\n0 0 0\n4 2 0\n0 4 0\n1 2 0")
    faces = {tuple(sorted(map(tuple, triangle[:, :2].tolist()))) for triangle in scene.triangles.positions}
    assert faces == {((0, 0), (1, 2), (4, 2)), ((0, 4), (1, 2), (4, 2))}
    np.testing.assert_allclose(scene.triangles.normals, np.tile([0, 0, 1.0], (2, 3, 1)), atol=1e-12)


def test_patch_keeps_its_normals(read):
    scene = read("pp 3\n0 0 0 0 0 1\n1 0 0 0 0.6 0.8\n0 1 0 0.6 0 0.8\np 3 0 0 0 1 0 0 0 1 0")
    smooth = scene.triangles.smooth
    assert smooth.tolist() == [False, True]
    assert scene.triangles.normals[smooth].tolist() == [[[0, 0, 1], [0, 0.6, 0.8], [0.6, 0, 0.8]]]


def test_polygons_without_area_are_left_out(read):
    scene = read("p 3\n0 0 0\n1 0 0\n2 0 0\ns 0 0 0 1")
    assert scene.counts()["triangle"] == 0
    assert "1 triangles without area cannot be seen and are left out" in scene.notes


def test_comments_and_background(read):
    scene = read("# whole line\ns 0 0 0 1 # rest\nb 0.1 0.2 0.3#glued\n")
    assert scene.background.color == (0.1, 0.2, 0.3)


@pytest.mark.parametrize(
    ("entities", "message"),
    [
        ("t 1", "scene.nff:9: found 't'; expected an entity: v, b, l, f, s, c, p or pp"),
        ("S 0 0 0 1", "scene.nff:9: found 'S'; expected an entity"),
        ("s 0 0 0 0", "scene.nff:9: found '0'; expected a radius other than 0"),
        ("s 0 0 0 nan", "scene.nff:9: found 'nan'; expected a finite number"),
        ("c 0 0 0 1 0 0 1 -1", "scene.nff:9: found '-1'; expected a radius of the same sign"),
        ("c 0 0 0 1 0 0 0 1", "scene.nff:9: found '0'; expected an apex away from the base"),
        ("p 2 0 0 0 1 1 1", "scene.nff:9: found '2'; expected 3 to 16384 corners"),
        ("p 2000000000 0 0 0", "scene.nff:9: found '2000000000'; expected a count that the file can hold"),
        ("p 3\n0 0 0\n1 0 x\n0 0 0", "scene.nff:11: found 'x'; expected a finite number"),
        ("p 3\n0 0 0\n", "scene.nff:9: found '3'; expected a count that the file can hold"),
        ("f 1 1 1 0 0 0 1.5 1", "scene.nff:9: found '1.5'; expected a transmittance from 0 to 1"),
        ("f 1 1 1 0 0 0 0.5 0", "scene.nff:9: found '0'; expected an index of refraction above 0"),
        ("f 1 1 1 -1 0 0 0 1", "scene.nff:9: found '-1'; expected a number of 0 or more"),
        ("v from 0 0 0 at 0 0 0 up 0 0 1 angle 45 hither 1 resolution 1 1", "scene.nff:9: .*camera looks along"),
        ("v from 0 0 0 at 0 0 1 up 1 0 0 angle 180", "scene.nff:9: found '180'; expected an angle between"),
        ("v from 0 0 0 to 0 0 1", "scene.nff:9: found 'to'; expected AT"),
        ("", "scene.nff: the scene has no geometry"),
    ],
)
def test_errors_name_file_line_word_and_expectation(read, entities, message):
    with pytest.raises(SceneError, match=f"^{message}"):
        read(entities)


def test_order_of_entities(read):
    with pytest.raises(
        SceneError, match=r"^scene\.nff:1: found 's'; expected a material \(f\) before the first object"
    ):
        read("s 0 0 0 1", head="")
    with pytest.raises(SceneError, match=r"^scene\.nff: there is no viewpoint; an NFF file has a v block"):
        read("s 0 0 0 1", head=FILL)
