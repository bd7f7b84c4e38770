"""What all bundled scenes have in common, and how they stand in front of the display."""

import dataclasses
import subprocess
import sys
from math import radians, tan

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.errors import SceneError
from lippmann.scene import bundled
from lippmann.scene.bundled import primitives, room, stage, textures
from lippmann.scene.bundled.stage import Stage
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.whitted_scene import ClassicScene

COUNTS = {
    "teapot": {"triangle": 16376},
    "room": {"sphere": 46, "tube": 31, "ring": 5, "plane": 6, "triangle": 8},
    "small-balls": {"sphere": 91, "plane": 1},
    "primitives": {"sphere": 20, "tube": 19, "cylinder": 1, "ring": 3, "box": 1, "plane": 1, "triangle": 1158},
    "tree": {"sphere": 4095, "tube": 4095, "triangle": 2},
    "gears": {"triangle": 36610},
}
LIGHTS = {"teapot": 2, "room": 1, "small-balls": 3, "primitives": 3, "tree": 7, "gears": 5}


@pytest.fixture(scope="module")
def scenes():
    return {name: bundled.make_classic(name) for name in bundled.names()}


def in_display(place: Stage, points) -> np.ndarray:
    """Points ``(..., 3)`` of the scene in the display frame: z > 0 lies in front of the lens plane."""
    return (np.asarray(points) - place.target) @ place.rotation * place.unit


def finite_points(scene: ClassicScene) -> np.ndarray:
    """Points that lie on the finite primitives, among them the extreme ones in any direction up to a rod's radius."""
    points = [
        scene.spheres.centers + offset * scene.spheres.radii[:, None]
        for offset in np.concatenate([np.eye(3), -np.eye(3)])
    ]
    points += [scene.tubes.base, scene.tubes.apex, scene.rings.centers, scene.triangles.positions.reshape(-1, 3)]
    points += [scene.boxes.minimum, scene.boxes.maximum]
    return np.concatenate(points)


def same(first: object, second: object) -> bool:
    """Equality through dataclasses, sequences and arrays, to the last bit."""
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and np.array_equal(first, second)
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if dataclasses.is_dataclass(first):
        return all(same(getattr(first, f.name), getattr(second, f.name)) for f in dataclasses.fields(first))
    return first == second


def test_names_are_the_papers():
    assert bundled.names() == ("teapot", "room", "small-balls", "primitives", "tree", "gears")


@pytest.mark.parametrize("ask", [bundled.make, bundled.make_classic, bundled.stage_of])
def test_unknown_name_is_an_error_that_lists_the_known(ask):
    with pytest.raises(
        SceneError,
        match=r"'teapott', did you mean 'teapot'\?; known are teapot, room, small-balls, primitives, tree, gears",
    ):
        ask("teapott")


@pytest.mark.parametrize("name", bundled.names())
def test_counts_and_lamps(scenes, name):
    counted = {kind: count for kind, count in scenes[name].counts().items() if count}
    assert counted == COUNTS[name]
    assert len(scenes[name].lights) == LIGHTS[name]
    assert scenes[name].name == name


@pytest.mark.slow
@pytest.mark.parametrize("name", bundled.names())
def test_made_twice_is_the_same(scenes, name):
    assert same(scenes[name], bundled.make_classic(name))
    assert same(bundled.make(name), bundled.make(name))


def test_make_gives_the_form_that_the_scene_was_made_for():
    forms = {name: type(bundled.make(name)) for name in bundled.names()}
    assert forms.pop("teapot") is SceneDescription
    assert set(forms.values()) == {ClassicScene}


@pytest.mark.parametrize("name", bundled.names())
def test_straddles_the_lens_plane_within_the_depth_of_the_papers_display(scenes, name):
    display = load_display("seed-lenticular")
    near, far = display.depth_budget
    z = in_display(bundled.stage_of(name), finite_points(scenes[name]))[:, 2]
    assert 0 < z.max() < near
    assert far < z.min() < 0.75 * far


@pytest.mark.parametrize("name", bundled.names())
def test_fills_the_picture_and_stays_in_it(scenes, name):
    half = stage.PICTURE_HEIGHT / 2
    across = in_display(bundled.stage_of(name), finite_points(scenes[name]))[:, :2]
    inside = (np.abs(across) < half).all(axis=1)
    assert inside.mean() > 0.95
    assert np.ptp(across[inside], axis=0).max() > half


def test_depth_range_is_that_of_the_papers_display():
    display = load_display("seed-lenticular")
    assert display.size_mm[1] == pytest.approx(stage.PICTURE_HEIGHT, abs=0.01)


@pytest.mark.parametrize("name", bundled.names())
def test_camera_sees_the_display(name):
    place = bundled.stage_of(name)
    camera = place.camera()
    half = stage.PICTURE_HEIGHT / 2
    corners = np.array([(x, y, 0, 1) for x in (-half, half) for y in (-half, half)])
    seen = corners @ place.world_from_display.T @ np.linalg.inv(camera.world_from_camera).T
    np.testing.assert_allclose(-seen[:, 2], camera.focus_distance, rtol=1e-12)
    np.testing.assert_allclose(np.abs(seen[:, :2]), camera.focus_distance * tan(camera.fov_y / 2), rtol=1e-12)
    assert np.all(np.sign(seen[:, :2]) == np.sign(corners[:, :2]))


@pytest.mark.parametrize("name", bundled.names())
def test_classic_camera_is_the_same_camera(scenes, name):
    place, classic = bundled.stage_of(name), scenes[name].camera
    camera = place.camera()
    right, up, view = classic.frame()
    np.testing.assert_allclose(np.stack([right, up, -view], axis=1), camera.world_from_camera[:3, :3], atol=1e-12)
    np.testing.assert_allclose(classic.center, camera.world_from_camera[:3, 3], rtol=1e-12)
    assert classic.window(512, 512)[3] == pytest.approx(tan(camera.fov_y / 2), rel=1e-12)
    assert scenes[name].handedness == classic.handedness == "right"


@pytest.mark.parametrize(("elevation", "azimuth", "unit"), [(0, 0, 1), (30, 0, 20), (16, -75, 1), (90, 200, 0.5)])
def test_stage_is_a_similarity(elevation, azimuth, unit):
    place = Stage((1.0, 2.0, 3.0), elevation, azimuth, unit=unit)
    matrix = place.world_from_display
    np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3) / unit**2, atol=1e-12 / unit**2)
    assert np.linalg.det(matrix) > 0
    points = np.array([(4.0, -5.0, 6.0), (0.0, 0.0, 10.0)])
    there = points @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(in_display(place, there), points, atol=1e-9)
    assert in_display(place, place.eye) == pytest.approx((0, 0, 400), abs=1e-9)


def test_stage_turns_the_eye_as_it_says():
    assert Stage((0, 0, 0), 0).eye == pytest.approx((0, 0, 400))
    assert Stage((0, 0, 0), 90).eye == pytest.approx((0, 400, 0))
    assert Stage((0, 0, 0), 0, azimuth=90).eye == pytest.approx((400, 0, 0))


@pytest.mark.parametrize("name", ["room", "primitives", "small-balls"])
def test_rays_of_any_display_layout_begin_before_all_planes(scenes, name):
    scene, place = scenes[name], bundled.stage_of(name)
    display = load_display("seed-lenticular")
    start = display.aperture_distance
    reach = stage.PICTURE_HEIGHT / 2 + start * tan(radians(display.field_of_view / 2))
    corners = [(x, y, start) for x in (-reach, reach) for y in (-reach, reach)]
    points = np.array(corners) @ place.rotation.T / place.unit + place.target
    distances = np.einsum("pck,pk->pc", points[None] - scene.planes.centers[:, None], scene.planes.normals)
    assert distances.min() > 0


@pytest.mark.parametrize("name", bundled.names())
def test_normals_lie_on_the_side_of_the_winding(scenes, name):
    triangles = scenes[name].triangles
    corners = triangles.positions
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(facing, axis=1) / 2
    assert np.all(area > 0)
    assert np.all(np.einsum("tk,tck->tc", facing, triangles.normals) > 0)


def test_lamps_of_the_classic_scenes_stay_out_of_the_picture(scenes):
    for name, scene in scenes.items():
        place = bundled.stage_of(name)
        for light in scene.lights:
            if light.kind != "directional" and light.radius > 0:
                x, y, z = in_display(place, light.center)
                shrink = 1 - z / place.eye_distance  # how far the pyramid of view has narrowed there
                assert z > 20  # mm, twice as far as the scenes reach forward
                assert max(abs(x), abs(y)) - light.radius > shrink * stage.PICTURE_HEIGHT / 2


class TestRoom:
    def test_pictures_cover_their_frames_once(self, scenes):
        scene = scenes["room"]
        pictures = np.unique(scene.triangles.material)
        assert len(pictures) == 4
        for index in pictures:
            texture = scene.materials[index].texture
            corners = scene.triangles.positions[scene.triangles.material == index].reshape(-1, 3) - texture.center
            u = corners @ texture.u_axis * texture.scale[0] + texture.rotate[0]
            v = corners @ texture.v_axis * texture.scale[1] + texture.rotate[1]
            for share in (u, v):
                assert share.min() == pytest.approx(0, abs=1e-9)
                assert 0.999 < share.max() < 1
            # The top row of the picture is up, its left side to the left of who stands before it.
            assert corners[v < 0.5][:, 1].min() > corners[v > 0.5][:, 1].max()
            normal = scene.triangles.normals[scene.triangles.material == index][0, 0]
            assert normal @ bundled.stage_of("room").rotation[:, 2] > 0.5
            to_the_right = np.cross((0, 1, 0), normal)
            assert (corners @ to_the_right)[u > 0.5].min() > (corners @ to_the_right)[u < 0.5].max()

    def test_four_balls_lie_on_the_table_and_one_is_a_mirror(self, scenes):
        scene = scenes["room"]
        radius, height, _, z = room.LAYOUT.table
        on_table = np.isclose(scene.spheres.centers[:, 1] - scene.spheres.radii, height)
        assert on_table.sum() == 4
        across = scene.spheres.centers[on_table][:, [0, 2]] - (0, z)
        assert np.all(np.hypot(*across.T) < radius)
        mirrors = [scene.materials[index].specular > 0.5 for index in scene.spheres.material[on_table]]
        assert mirrors.count(True) == 1

    def test_parquet_repeats_on_the_floor(self, scenes):
        scene = scenes["room"]
        floor = scene.materials[scene.planes.material[0]].texture
        assert scene.images[floor.image].name == "parquet"
        step = np.array([room.LAYOUT.parquet, 0, 0])
        assert step @ floor.u_axis * floor.scale[0] == pytest.approx(1)
        assert step @ floor.v_axis == pytest.approx(0)


class TestPrimitives:
    def test_every_kind_of_everything(self, scenes):
        scene = scenes["primitives"]
        assert min(scene.counts().values()) >= 1
        assert {light.kind for light in scene.lights} == {"point", "spot", "directional"}
        kinds = {material.texture.kind for material in scene.materials}
        assert kinds == {
            *("constant", "checker", "marble", "wood", "noise", "cylindrical-checker"),
            *("cylindrical-image", "spherical-image", "planar-image"),
        }
        assert {material.phong_kind for material in scene.materials} == {"plastic", "metal"}
        assert min(material.opacity for material in scene.materials) < 1
        assert scene.triangles.smooth.any()
        assert not scene.triangles.smooth.all()
        assert scene.triangles.colored.any()
        assert np.any(scene.tubes.apex_radius == 0)

    def test_box_is_a_cube(self, scenes):
        # Tachyon's normals are right on cubes alone.
        boxes = scenes["primitives"].boxes
        assert np.ptp(boxes.maximum - boxes.minimum, axis=1) == pytest.approx(0)

    def test_endless_cylinder_stays_at_its_depth(self, scenes):
        rotation = bundled.stage_of("primitives").rotation
        cylinders = scenes["primitives"].cylinders
        assert cylinders.axes @ rotation[:, 2] == pytest.approx(0, abs=1e-12)
        depth = in_display(bundled.stage_of("primitives"), cylinders.centers)[:, 2]
        assert -54.4 < depth[0] < 0

    def test_height_field_has_the_normals_of_its_surface(self):
        fine = primitives.height_field((0.0, 0.0), size=1.0, cells=200)[0:3]
        vertices, faces, normals = fine
        corners = vertices[faces]
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing /= np.linalg.norm(facing, axis=1, keepdims=True)
        assert np.einsum("tk,tck->tc", facing, normals[faces]).min() > 0.99
        assert vertices[:, 1].min() == pytest.approx(0.005, abs=1e-12)


class TestTextures:
    @pytest.mark.parametrize(
        "paint", [textures.parquet, textures.moonrise, textures.planet, textures.composition, textures.hills]
    )
    def test_painted_twice_is_the_same_and_has_contrast(self, paint):
        pixels = paint(64)
        assert pixels.shape == (64, 64, 3)
        assert pixels.dtype == np.uint8
        np.testing.assert_array_equal(pixels, paint(64))
        assert pixels.std() > 20

    def test_parquet_weaves(self):
        blocks = textures.parquet(128).astype(float).mean(axis=2).reshape(2, 64, 2, 64).swapaxes(1, 2)
        # Planks along x: rows differ more than columns, and the other way round in the next block.
        along_x = blocks.mean(axis=3).std(axis=2) > blocks.mean(axis=2).std(axis=2)
        np.testing.assert_array_equal(along_x, [[True, False], [False, True]])

    def test_noise_is_smooth_and_bounded(self):
        x = np.linspace(-3, 3, 6001)
        values = textures.noise(x, 0.3, seed=5)
        assert values.min() >= 0
        assert values.max() <= 1
        assert np.ptp(values) > 0.3
        assert np.abs(np.diff(values)).max() < 2 * (x[1] - x[0])
        assert not np.allclose(values, textures.noise(x, 0.3, seed=6))


def test_scenes_need_no_engine():
    program = (
        "import sys; from lippmann.scene import bundled as library; "
        "[library.make_classic(name) for name in library.names()]; library.make('teapot'); "
        "sys.exit('mitsuba' in sys.modules or 'drjit' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
