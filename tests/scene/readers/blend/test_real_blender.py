"""Files of a real Blender: lights in physical units, visibility, instances, the world, units, motion."""

import math

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.blend import read_blend
from lippmann.scene.readers.blend.find_blender import VARIABLE
from lippmann.scene.readers.load import load_scene
from lippmann.sequences.motion import open_motion


@pytest.fixture
def everything(read_real):
    return read_real("everything.blend")


@pytest.fixture
def moving(read_real):
    return read_real("moving.blend")


def lamp(description, name):
    return next(light for light in description.lights if light.name == name)


def glow(description, name):
    """Radiance and area of a glowing surface, and the direction that it shines along."""
    (instance,) = (each for each in description.instances if description.meshes[each.mesh].name == name)
    mesh = description.meshes[instance.mesh]
    corners = (mesh.positions @ instance.world_from_mesh[:3, :3].T)[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1).sum() / 2
    return description.materials[mesh.material].emission, area, normals.sum(axis=0) / (2 * area)


def test_a_point_light_sends_its_watts_all_around(everything):
    bulb = lamp(everything, "Bulb")
    assert bulb.kind == "point"
    assert bulb.color == pytest.approx(np.array([1.0, 0.5, 0.25]) * 100.0 / (4.0 * math.pi), rel=1e-4)
    assert bulb.world_from_light[:3, 3] == pytest.approx([1.0, 3.0, -2.0])


def test_a_spot_is_as_strong_as_a_point_light_along_its_axis(everything):
    cone = lamp(everything, "Cone")
    assert (cone.kind, cone.color) == ("spot", pytest.approx([50.0 / (4.0 * math.pi)] * 3, rel=1e-4))
    assert cone.outer_angle == pytest.approx(0.5)
    assert 0.2 < cone.inner_angle < 0.4
    assert -cone.world_from_light[:3, 2] == pytest.approx([0.0, -1.0, 0.0])


def test_a_sun_is_an_irradiance(everything):
    assert (lamp(everything, "Sky").kind, lamp(everything, "Sky").color) == (
        "directional",
        pytest.approx([3.0] * 3, rel=1e-4),
    )


@pytest.mark.parametrize(("name", "area"), [("Panel", 4.0), ("Disc", math.pi)])
def test_area_lights_keep_their_power(everything, name, area):
    emission, own, along = glow(everything, name)
    assert own == pytest.approx(area, rel=1e-3)
    assert np.array(emission) * own * math.pi == pytest.approx([10.0] * 3, rel=1e-3)
    assert along == pytest.approx([0.0, -1.0, 0.0], abs=1e-6)


def test_the_world_of_one_colour(everything):
    pixels = everything.environment.pixels
    assert pixels.reshape(-1, 3) == pytest.approx(np.tile([0.05, 0.1, 0.2], (pixels.size // 3, 1)), rel=1e-3)
    assert not everything.physical_lights


def test_the_active_camera_comes_first(everything):
    assert [camera.name for camera in everything.cameras] == ["Active", "Spare"]
    assert everything.cameras[0].focus_distance == pytest.approx(4.0)
    assert everything.cameras[0].world_from_camera[:3, 3] == pytest.approx([0.0, 1.0, 5.0])
    assert everything.cameras[1].focus_distance is None


def test_what_renders_show_is_read(everything):
    names = {mesh.name for mesh in everything.meshes}
    assert "seen" in names
    assert "unseen" not in names
    # Two triangles on each of six sides that are halved twice, as in renders; in the viewport it stays a cube.
    assert 2 * 6 * 4**2 in [len(mesh.faces) for mesh in everything.meshes]


def test_instances_share_their_mesh(everything):
    (member,) = (index for index, mesh in enumerate(everything.meshes) if mesh.name == "member")
    assert sorted(everything.placements[member][:, 0, 3]) == pytest.approx([1.0, 2.0, 3.0])


def test_what_is_left_out_is_named(everything):
    said = "\n".join(everything.notes)
    for line in (
        "object 'Fog': a volume is left out",
        "material 'noisy': its base color is shown in its mean: glTF has no word for its nodes (Noise Texture)",
        "light 'Disc': an area light's narrower spread is not honoured",
        "raises its pictures by 1.5 stops: exposure=1.5 does so here",
        "their shadows are sharp",
    ):
        assert line in said
    assert "Smooth" not in said


def test_the_picture_of_the_world_is_upright_and_not_mirrored(moving):
    pixels = moving.environment.pixels
    height, width = pixels.shape[:2]
    assert (height, width) == (32, 64)
    assert pixels[height // 2, width // 2].argmax() == 1  # green ahead, along -z
    assert pixels[height // 2, 3 * width // 4].argmax() == 0  # red to the right
    assert pixels[0, width // 2].argmax() == 2  # blue straight up
    assert pixels[height // 2, width // 4].max() < 0.01


def test_lengths_are_metres_and_light_falls_the_same(moving):
    (cube,) = (mesh for mesh in moving.meshes if mesh.name == "cube")
    (place,) = moving.placements[moving.meshes.index(cube)]
    reach = cube.positions @ place[:3, :3].T
    assert np.ptp(reach, axis=0) == pytest.approx([1.0, 1.0, 1.0])
    bulb = lamp(moving, "Bulb")
    assert bulb.world_from_light[1, 3] == pytest.approx(3.0)
    # 300 units from the cube's middle in Blender, 3 m here.
    assert np.array(bulb.color) / 3.0**2 == pytest.approx([4.0e4 / (4.0 * math.pi) / 300.0**2] * 3, rel=1e-4)
    assert moving.cameras[0].focus_distance == pytest.approx(5.0)
    assert any("shown at its frame" in note for note in moving.notes)


def test_a_moving_scene(real_blender, real_scenes, monkeypatch):
    monkeypatch.setenv(VARIABLE, real_blender)
    motion = open_motion(real_scenes / "moving.blend", fps=10.0)
    assert motion.count == 11
    heights = []
    for frame in (0, 5, 10):
        description = motion.scene(frame).physical
        assert description.environment is not None
        (cube,) = (index for index, mesh in enumerate(description.meshes) if mesh.name == "cube")
        heights.append(description.placements[cube][0, 1, 3])
    assert heights == pytest.approx([0.0, 1.0, 2.0], abs=0.01)


def test_files_that_blender_cannot_give(real_blender, real_scenes, monkeypatch, tmp_path):
    monkeypatch.setenv(VARIABLE, real_blender)
    with pytest.raises(
        SceneError, match=r"^outside\.blend: names the file '.*secret\.png' outside its folder; pack it"
    ):
        read_blend(real_scenes / "outside.blend")
    assert read_blend(real_scenes / "outside.blend", files=NamedFiles(real_scenes, True)).meshes
    with pytest.raises(SceneError, match=r"^empty\.blend: the file shows no triangles"):
        load_scene(real_scenes / "empty.blend")
    cut = tmp_path / "cut.blend"
    cut.write_bytes(b"BLENDER-v405" + bytes(100))
    with pytest.raises(SceneError, match=r"^cut\.blend: Blender fails at the file \("):
        read_blend(cut)


def test_collections_put_aside_are_not_shown_but_by_their_instances(read_real):
    scene = read_real("aside.blend")
    assert sorted(mesh.name for mesh in scene.meshes) == ["cube", "shown member"]
    assert sum(len(places) for places in scene.placements.values()) == 2


def test_pictures_are_codes_for_colours_and_numbers_for_the_rest(read_real):
    materials = {material.name: material for material in read_real("pictures.blend").materials}
    for name in ("float", "linear", "codes"):
        codes = materials[name].base_color_texture.image.pixels[0, 0, :3]
        assert codes / 255 == pytest.approx([0.735, 0.484, 0.349], abs=0.006), name
    for name in ("rough", "rough codes"):
        green = materials[name].metallic_roughness_texture.image.pixels[0, 0, 1]
        assert green / 255 == pytest.approx(0.5, abs=0.01), name


def test_surfaces_of_one_node(read_real):
    scene = read_real("surfaces.blend")
    diffuse, glossy, glass = (
        next(each for each in scene.materials if each.name == name) for name in ("Diffuse", "Glossy", "Glass")
    )
    assert diffuse.base_color_texture is not None
    assert (diffuse.metallic, diffuse.roughness, diffuse.specular) == (0.0, 1.0, 0.0)
    assert (glossy.metallic, glossy.roughness) == (1.0, pytest.approx(0.25))
    assert (glass.transmission, glass.roughness) == (1.0, pytest.approx(0.25))
    assert glass.thickness > 0.0
    assert glossy.base_color == glass.base_color == pytest.approx((0.8, 0.2, 0.1), abs=1e-3)
    assert not any("glTF has no word" in note for note in scene.notes)


def test_surfaces_of_several_nodes(read_real):
    scene = read_real("mixed.blend")
    materials = {material.name: material for material in scene.materials}
    assert materials["half"].base_color == pytest.approx((0.45, 0.45, 0.1), abs=1e-3)
    plastic = materials["plastic"]
    assert (plastic.base_color, plastic.metallic) == (pytest.approx((0.8, 0.1, 0.1), abs=1e-3), 0.0)
    assert (plastic.roughness, plastic.ior) == pytest.approx((0.25, 1.4), abs=1e-3)
    red, green = (row[:, :3] / 255 for row in materials["masked"].base_color_texture.image.pixels[0].reshape(2, 2, -1))
    assert red == pytest.approx(np.tile([0.906, 0.349, 0.349], (2, 1)), abs=0.01)
    assert green == pytest.approx(np.tile([0.349, 0.906, 0.349], (2, 1)), abs=0.01)
    dull, metal = materials["masked"].metallic_roughness_texture.image.pixels[0, [0, -1]] / 255
    assert (*dull[1:3], *metal[1:3]) == pytest.approx((1.0, 0.0, 0.25, 1.0), abs=0.01)
    leaf = materials["leaf"]
    assert leaf.alpha_mode == "blend"
    assert leaf.base_color_texture.image.pixels[0, :, 3].tolist() == [0, 0, 255, 255]
    glow = materials["glow"]
    assert glow.emission == pytest.approx((0.4, 3.2, 0.4), rel=1e-3)
    assert glow.base_color == pytest.approx((0.8, 0.1, 0.1), abs=1e-3)
    assert materials["grouped"].base_color == pytest.approx((0.8, 0.1, 0.1), abs=0.01)


def test_nodes_between_a_picture_and_a_surface(read_real):
    scene = read_real("mixed.blend")
    materials = {material.name: material for material in scene.materials}
    codes = materials["inverted"].base_color_texture.image.pixels[0, [0, -1], :3]
    assert codes == pytest.approx(np.array([[0, 255, 255], [255, 255, 0]]), abs=5)
    # The picture's steps are slopes of the surface.
    steepest = np.abs(materials["bumped"].normal_texture.image.pixels[..., :2].astype(float) - 127.5).max(axis=(0, 1))
    assert steepest[0] > 20.0 > 3.0 > steepest[1]
    assert materials["noise"].base_color == pytest.approx((0.5, 0.5, 0.5), abs=0.1)
    mean = "material 'noise': its base color is shown in its mean: glTF has no word for its nodes (Noise Texture)"
    assert scene.notes == ("material 'lost': its picture 'lost' is not found and left out", mean)


def test_a_still_shows_the_pose_of_an_armature_at_the_present_frame(read_real):
    scene = read_real("posed.blend")
    (place,) = scene.placements[0]
    middle = (scene.meshes[0].positions @ place[:3, :3].T + place[:3, 3]).mean(axis=0)
    # Three units up at rest; turned about x, towards Blender's -y.
    assert middle == pytest.approx([0.0, 0.0, 3.0], abs=1e-4)


def test_lights_with_a_temperature_or_the_strength_of_their_surface(read_real):
    scene = read_real("lights.blend")
    warm, sized = lamp(scene, "warm"), lamp(scene, "sized")
    assert warm.color[0] > 1.3 * warm.color[1] > 1.3 * warm.color[2]
    assert sized.color == pytest.approx([100.0 * 4.0 * math.pi * 0.25 / (4.0 * math.pi)] * 3, rel=1e-3)


def test_shifted_lenses(read_real):
    cameras = {camera.name: camera for camera in read_real("shifted.blend").cameras}
    # Shares of the sensor's width, 36 mm in front of a lens of 50 mm; of the 6 units that a flat camera sees.
    assert cameras["lens"].shift == pytest.approx((0.1 * 36 / 50, -0.05 * 36 / 50), rel=1e-4)
    assert cameras["flat"].shift == pytest.approx((0.6, -0.3), rel=1e-4)


def test_what_renders_show_otherwise_is_named(read_real):
    scene = read_real("otherwise.blend")
    said = "\n".join(scene.notes)
    for line in (
        "pictures are transparent where the world is shown",
        "object 'Hole': a holdout is shown as any object",
        "object 'Catcher': a shadow catcher is shown as any object",
        "object 'Ghost': cameras do not see it: it is left out, and so are its shadows",
        "the material 'clay' that overrides the view layer's is not applied",
        "light 'Oval': its scale, which makes its cone wider or narrower, is not honoured",
        "light 'Oval': it is linked to some objects, and lights all",
        "material 'mixed': its picture, clipped at its edges in Blender, goes on with the last pixels",
        "the nodes of the compositor are not applied",
    ):
        assert line in said, line
    assert "ghost" not in [mesh.name for mesh in scene.meshes]


def test_a_flat_camera_of_a_file_in_centimetres(read_real):
    (camera,) = read_real("flat.blend").cameras
    # Twice as wide as high: its 3 m are the longer side.
    assert (camera.height, camera.aspect) == (pytest.approx(1.5), pytest.approx(2.0))


@pytest.mark.parametrize("space", ["Rec.2020", "ACEScg"])
def test_colours_of_other_working_spaces(read_real, space):
    def colors(name):
        scene = read_real(f"{name}.blend")
        (material,) = (each for each in scene.materials if each.name == "red")
        return [
            *material.base_color,
            *material.emission,
            *np.array(scene.lights[0].color) * (4.0 * math.pi / 100.0),
            *scene.environment.pixels[0, 0] / 2,
        ]

    assert colors("Rec.709")[:3] == pytest.approx([0.8, 0.1, 0.1], abs=1e-3)
    assert colors(space) == pytest.approx(colors("Rec.709"), abs=0.01)
