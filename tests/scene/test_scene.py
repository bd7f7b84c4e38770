"""The frozen scene: bounds, lights, cameras, and what is refused."""

import dataclasses

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene import extent
from lippmann.scene.extent import bounds_of, box_corners, thin_axis
from lippmann.scene.scene import (
    MIRROR_NOTE,
    STUDIO_NOTE,
    Scene,
    check_description,
    find_camera,
    framing_camera,
    override_light,
)
from lippmann.scene.studio_light import BACKDROP, studio
from lippmann.scene.values.description import (
    Camera,
    Environment,
    Image,
    Instance,
    Light,
    Material,
    Mesh,
    SceneDescription,
    Texture,
)


def triangle(positions=((0, 0, 0), (2, 0, 0), (0, 1, 0)), **fields):
    faces = np.array([[0, 1, 2]], np.uint32)
    return Mesh("t", np.array(positions, np.float32), **({"faces": faces, "material": 0} | fields))


HERE = np.eye(4)


def describe(mesh=None, material=None, matrices=(HERE,), **fields):
    instances = [Instance(0, np.asarray(matrix, float)) for matrix in matrices]
    return SceneDescription("s", [mesh or triangle()], [material or Material()], instances, **fields)


def moved(x, y, z):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


QUARTER_TURN = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], float)


def test_bounds_span_all_instances():
    assert bounds_of(describe()).tolist() == [[0, 0, 0], [2, 1, 0]]
    found = bounds_of(describe(matrices=[moved(10, 0, 0), QUARTER_TURN, moved(0, 0, -3)]))
    assert found.tolist() == [[-1, 0, -3], [12, 2, 0]]


def test_bounds_leave_out_unused_vertices_and_meshes():
    mesh = triangle([(0, 0, 0), (1, 0, 0), (0, 1, 0), (99, 99, 99)])
    description = describe(mesh)
    spare = dataclasses.replace(description, meshes=[mesh, triangle([(7, 7, 7)] * 3)])
    assert bounds_of(spare).tolist() == [[0, 0, 0], [1, 1, 0]]


def test_bounds_of_a_turned_mesh_are_exact_until_there_are_very_many(monkeypatch):
    eighth = np.eye(4)
    eighth[:2, :2] = np.array([[1, -1], [1, 1]]) / np.sqrt(2)
    exact = bounds_of(describe(matrices=[eighth]))
    assert exact[1] == pytest.approx([np.sqrt(2), np.sqrt(2), 0])
    monkeypatch.setattr(extent, "_EXACT_VERTICES", 2)
    loose = bounds_of(describe(matrices=[eighth]))
    assert (loose[0] <= exact[0] + 1e-12).all()
    assert (loose[1] >= exact[1] - 1e-12).all()
    assert loose[1] == pytest.approx([np.sqrt(2), 1.5 * np.sqrt(2), 0])


def test_a_dark_scene_is_lit_by_the_studio():
    scene = Scene("s", describe())
    assert not scene.has_lights
    assert scene.environment is studio()
    assert scene.background == BACKDROP
    assert scene.notes == (STUDIO_NOTE,)


def test_the_studio_may_be_kept_out():
    scene = Scene("s", describe(), studio=False)
    assert (scene.environment, scene.background, scene.notes) == (None, None, ())


@pytest.mark.parametrize(
    "description",
    [
        describe(material=Material(emission=(0, 2, 0))),
        describe(material=Material(unlit=True)),
        describe(lights=[Light("point", (1, 1, 1), np.eye(4))]),
        describe(environment=Environment(np.ones((2, 4, 3), np.float32))),
    ],
)
def test_a_scene_with_light_keeps_its_own(description):
    scene = Scene("s", description)
    assert scene.has_lights
    assert scene.environment is description.environment
    assert scene.background is None
    assert scene.notes == ()


def test_a_note_names_the_studio_where_mirrors_would_show_black():
    bulb = [Light("point", (1, 1, 1), np.eye(4))]

    def notes(environment=None, **surface):
        lit = describe(material=Material(**surface), lights=bulb, environment=environment)
        return Scene("s", dataclasses.replace(lit, physical_lights=True)).notes

    assert notes(metallic=1.0, roughness=0.1) == notes(transmission=1.0, roughness=0.0) == (MIRROR_NOTE,)
    assert notes(metallic=1.0, roughness=0.9) == notes(metallic=0.0, roughness=0.1) == ()
    assert notes(studio(), metallic=1.0, roughness=0.1) == ()
    # Texels of roughness 0.2, one of five and five of nine of them metal.
    for count, expected in ((1, ()), (5, (MIRROR_NOTE,))):
        pixels = np.array([[(0, 51, 255)] * count + [(0, 51, 0)] * 4], np.uint8)
        smooth = Texture(Image("smooth", pixels), srgb=False)
        assert notes(metallic=1.0, roughness=1.0, metallic_roughness_texture=smooth) == expected


def test_mirrors_that_lights_alone_light_mirror_a_studio_a_quarter_as_bright():
    sun = [Light("directional", (6.0, 2.0, 1.0), np.eye(4))]
    lit = dataclasses.replace(
        describe(material=Material(metallic=1.0, roughness=0.1), lights=sun), physical_lights=True
    )
    scene = Scene("s", lit)
    assert scene.background == (0, 0, 0)
    assert scene.environment.follows_viewer
    # A white surface that faces the sun has a radiance of 3 / pi, in the studio of strength 1 one of 1.
    np.testing.assert_allclose(scene.environment.pixels, studio().pixels * (0.25 * 3 / np.pi), rtol=1e-5)
    dark = Scene("s", lit, studio=False)
    assert (dark.environment, dark.background, dark.notes) == (None, None, ())


def test_light_that_does_not_count():
    assert not Scene("s", describe(material=Material(emission=(1, 1, 1)))).has_lights  # a label, a screen
    assert not Scene("s", describe(lights=[Light("point", (0, 0, 0), np.eye(4))])).has_lights
    unused = dataclasses.replace(describe(), materials=[Material(), Material(emission=(9, 9, 9))])
    assert not Scene("s", unused).has_lights


def test_surfaces_too_small_to_light_a_scene_do_not_count():
    """Landing lights of an aircraft: without the studio all but these would be black."""

    def aircraft(emission, size):
        meshes = [triangle(), triangle(((0, 0, 0), (size, 0, 0), (0, size, 0)), material=1)]
        lamp = Material(emission=(emission,) * 3)
        return Scene("s", SceneDescription("s", meshes, [Material(), lamp], [Instance(0, HERE), Instance(1, HERE)]))

    # The diagonal of the whole is sqrt(5): 0.02 pi 5 is what has to be emitted.
    least = np.sqrt(2 * 0.1 * np.pi / 4)
    assert aircraft(4.0, least * 1.01).has_lights
    assert not aircraft(4.0, least * 0.99).has_lights


def test_the_callers_light_takes_the_place_of_the_files():
    sky = Environment(np.ones((2, 4, 3), np.float32))
    scene = Scene("s", override_light(describe(environment=studio(), background=(1, 0, 0)), sky, (0, 0, 0)))
    assert scene.environment is sky
    assert scene.background == (0, 0, 0)
    scene = Scene("s", override_light(describe(), None, (0, 1, 0)))
    assert (scene.background, scene.environment) == ((0, 1, 0), studio())


def test_cameras_by_name():
    cameras = [Camera("front", np.eye(4), fov_y=1.0), Camera("side", moved(1, 0, 0), fov_y=1.0)]
    scene = Scene("s", describe(cameras=cameras))
    assert scene.camera("side") is cameras[1]
    assert scene.camera() is cameras[0]
    assert Scene("s", scene.description, home_camera="side").camera() is cameras[1]
    with pytest.raises(
        SceneError, match=r"camera: unknown camera 'sied', did you mean 'side'\?; known are front, side"
    ):
        scene.camera("sied")
    with pytest.raises(SceneError, match="unknown camera 'front'; there is none"):
        find_camera([], "front")


@pytest.mark.parametrize("size", [(2, 1, 4), (1, 0, 0), (0, 0, 3), (1, 5, 0)])
def test_a_scene_without_cameras_is_framed(size):
    low = np.array([3.0, -1.0, 2.0])
    camera = framing_camera(np.stack([low, low + size]))
    corners = np.array(np.meshgrid(*zip(low, low + size, strict=True))).reshape(3, -1).T
    seen = corners - camera.world_from_camera[:3, 3]
    assert (seen[:, 2] < 0).all()
    slopes = np.abs(seen[:, :2]) / -seen[:, 2:]
    assert slopes.max() <= np.tan(camera.fov_y / 2)
    assert slopes.max() >= 0.85 * np.tan(camera.fov_y / 2) or size[0] == size[1] == 0


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ([[1, 2, 3], [1, 2, 3]], r"a single point at \(1, 2, 3\)"),
        ([[0, 0, 0], [np.nan, 1, 1]], "no extent"),
        ([[np.inf] * 3, [-np.inf] * 3], "no extent"),
        ([[1, 0, 0], [0, 1, 1]], "no extent"),
    ],
)
def test_boxes_that_are_none(bounds, message):
    with pytest.raises(SceneError, match=message):
        framing_camera(np.array(bounds, float))


@pytest.mark.parametrize(
    ("description", "message"),
    [
        (SceneDescription("s"), "the scene has no geometry"),
        (describe(matrices=()), "the scene has no geometry"),
        (describe(triangle(faces=np.zeros((0, 3), np.uint32))), "the scene has no geometry"),
        (describe(triangle([(0, 0, np.nan), (1, 0, 0), (0, 1, 0)])), r"f: mesh 't' has 1 vertices that are not finite"),
        (describe(triangle(normals=np.full((3, 3), np.inf, np.float32))), "3 normals that are not finite"),
        (describe(triangle(uvs=(np.zeros((2, 2), np.float32),))), "2 uv set 0 for 3 vertices"),
        (describe(triangle(faces=np.array([[0, 1, 3]], np.uint32))), "uses vertex 3 of 3"),
        (describe(triangle(material=1)), "uses material 1 of 1"),
        (describe(matrices=[np.eye(4) * np.nan]), "instance 0 has a matrix"),
        (describe(matrices=[np.eye(3)]), "instance 0 has a matrix"),
        (dataclasses.replace(describe(), instances=[Instance(3, np.eye(4))]), "instance 0 uses mesh 3 of 1"),
        (describe(material=Material("m", base_color=(0, -1, 0))), "material 'm' has a factor that is negative"),
        (describe(material=Material("m", roughness=np.nan)), "material 'm' has a factor"),
    ],
)
def test_unsound_descriptions(description, message):
    with pytest.raises(SceneError, match=message) as caught:
        check_description(description, "f")
    assert "\n" not in str(caught.value)


def test_a_scene_is_frozen_and_short_to_print():
    scene = Scene("s", describe())
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.name = "t"
    assert repr(scene) == "Scene(name='s', home_camera=None, studio=True)"


def test_bounds_in_another_frame_are_those_of_the_vertices():
    eighth = np.eye(4)
    eighth[:2, :2] = np.array([[1, -1], [1, 1]]) / np.sqrt(2)
    eighth[:3, 3] = (0, 0, 5)
    scene = Scene("triangle", describe())
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0]]) @ eighth[:3, :3].T + eighth[:3, 3]
    assert scene.bounds_in(eighth) == pytest.approx(np.stack([corners.min(axis=0), corners.max(axis=0)]))


@pytest.mark.parametrize("share", [0.0, 0.03])
@pytest.mark.parametrize(("thin", "toward"), [(0, (1, 0, 0)), (1, (0, 1, 0)), (2, (0, 0, 1))])
def test_a_flat_scene_is_framed_from_its_face(thin, toward, share):
    size = np.array([2.0, 3.0, 4.0])
    size[thin] *= share
    bounds = np.stack([-size / 2, size / 2]) + np.array([1.0, -2.0, 0.5])
    camera = framing_camera(bounds)
    frame = camera.world_from_camera
    np.testing.assert_allclose(frame[:3, 2], toward, atol=1e-12)
    assert np.linalg.det(frame[:3, :3]) == pytest.approx(1.0)
    corners = (box_corners(bounds) - frame[:3, 3]) @ frame[:3, :3]
    assert (np.abs(corners[:, :2]) / -corners[:, 2:] <= np.tan(camera.fov_y / 2)).all()
    assert thin_axis(bounds) == (None if thin == 2 else thin)


def test_scenes_with_a_depth_are_framed_from_the_front():
    for size in ((2.0, 3.0, 4.0), (0.2, 3.0, 4.0), (0.0, 0.0, 2.0), (0.0, 1.0, 0.001)):
        bounds = np.stack([-np.array(size) / 2, np.array(size) / 2])
        np.testing.assert_allclose(framing_camera(bounds).world_from_camera[:3, 2], (0, 0, 1))
