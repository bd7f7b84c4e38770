"""Classic scenes in the right-handed world, and in the terms of physically based light."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import SceneError, UsageError
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.extent import bounds_of
from lippmann.scene.readers.load import load_scene
from lippmann.scene.values.whitted_scene import ClassicCamera
from lippmann.scene.values.whitted_surfaces import (
    Background,
    ClassicImage,
    ClassicLight,
    ClassicMaterial,
    ClassicTexture,
    Fog,
)
from lippmann.scene.whitted.builder import ClassicSceneBuilder
from lippmann.scene.whitted.tessellation import icosphere, patches
from lippmann.scene.whitted.to_pbr import to_physical
from lippmann.scene.whitted.world_frame import world_bounds, world_camera


def every_shape(handedness="left", material=None):
    builder = ClassicSceneBuilder("all", handedness=handedness)
    index = builder.material(material or ClassicMaterial())
    builder.spheres((1, 2, 3), 0.5, index)
    builder.tubes((4, 0, 1), (4, 2, 5), 0.25, index, apex_radius=0.75)
    builder.rings((-2, 1, 7), (1, 1, 0), 0.5, 1.0, index)
    builder.boxes((-3, -1, 2), (-2, 0, 3), index)
    builder.triangles([[(0, 0, 1), (1, 0, 1), (0, 1, 2)]], index)
    return builder


@pytest.mark.slow
@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_bounds_in_a_frame_hold_every_point_and_touch_it(seed):
    rng = np.random.default_rng(seed)
    frame = np.eye(4)
    frame[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.1, 10)
    frame[:3, 3] = rng.normal(size=3)
    scene = every_shape("right").build()
    found = np.stack(world_bounds(scene, frame))
    points = [patch.positions @ frame[:3, :3].T + frame[:3, 3] for patch in patches(scene, scene.bounds())]
    points = np.concatenate(points)
    size = (found[1] - found[0]).max()
    assert (points.min(axis=0) >= found[0] - 1e-9 * size).all()
    assert (points.max(axis=0) <= found[1] + 1e-9 * size).all()
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], found, atol=0.01 * size)


def test_a_left_handed_scene_has_its_z_negated():
    left, right = (np.stack(world_bounds(every_shape(hand).build())) for hand in ("left", "right"))
    np.testing.assert_allclose(left[:, :2], right[:, :2])
    np.testing.assert_allclose(left[:, 2], -right[::-1, 2])


def test_a_scene_of_planes_has_no_bounds():
    builder = ClassicSceneBuilder("flat")
    builder.planes((0, 0, 0), (0, 1, 0), builder.material(ClassicMaterial()))
    with pytest.raises(SceneError, match="no extent"):
        world_bounds(builder.build())


def test_the_camera_of_a_left_handed_scene_looks_the_same_way_in_the_world():
    builder = every_shape()
    scene = builder.build(camera=ClassicCamera(center=(1, 2, -6), zoom=2.0), resolution=(200, 100))
    camera = world_camera(scene)
    rotation = camera.world_from_camera[:3, :3]
    assert np.linalg.det(rotation) == pytest.approx(1)
    np.testing.assert_allclose(camera.world_from_camera[:3, 3], (1, 2, 6))
    np.testing.assert_allclose(rotation[:, 2], (0, 0, 1))  # it looks along -z
    np.testing.assert_allclose(rotation[:, 0], (1, 0, 0))  # +x to the right, as in the file
    assert camera.fov_y == pytest.approx(2 * np.arctan(0.25))
    assert camera.aspect == pytest.approx(2)


def test_orthographic_and_fisheye_cameras():
    flat = every_shape().build(camera=ClassicCamera(projection="orthographic", zoom=0.5))
    assert world_camera(flat).height == pytest.approx(2)
    wide = every_shape().build(camera=ClassicCamera(projection="fisheye", frustum=(-3.1, 3.1, -1.5, 1.5)))
    assert world_camera(wide).fov_y == pytest.approx(2 * np.pi / 3)


@pytest.mark.parametrize("handedness", ["left", "right"])
def test_meshes_face_outward_and_lie_in_the_world(handedness):
    scene = every_shape(handedness).build()
    made = to_physical(scene)
    found = bounds_of(made)
    np.testing.assert_allclose(found, world_bounds(scene), atol=0.01)
    for mesh in made.meshes:
        corners = np.asarray(mesh.positions, np.float64)[mesh.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        if mesh.normals is not None:
            assert ((mesh.normals[mesh.faces].mean(axis=1) * cross).sum(axis=1) > 0).all()
        if mesh.name in ("sphere", "box"):
            middle = corners.reshape(-1, 3).mean(axis=0)
            assert ((corners.mean(axis=1) - middle) * cross).sum(axis=1).min() > 0


@pytest.mark.parametrize("level", [0, 1, 3])
def test_an_icosphere_is_closed(level):
    points, faces = icosphere(level)
    assert len(faces) == 20 * 4**level
    assert len(points) == 2 + 10 * 4**level
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert {tuple(edge) for edge in edges.tolist()} == {tuple(edge) for edge in edges[:, ::-1].tolist()}


def material_of(material, rules="tachyon"):
    scene = ClassicSceneBuilder("one", rules=rules)
    scene.spheres((0, 0, 0), 1, scene.material(material))
    return to_physical(scene.build()).materials[0]


def test_materials():
    matt = material_of(ClassicMaterial(color=(1, 1, 1), diffuse=0.8))
    assert (matt.metallic, matt.base_color, matt.roughness) == (0, (0.8, 0.8, 0.8), 1)
    mirror = material_of(ClassicMaterial(color=(1, 1, 1), diffuse=0.25, specular=0.75))
    assert (mirror.metallic, mirror.roughness) == (0.75, 0)
    pane = material_of(ClassicMaterial(opacity=0.25))
    assert (pane.alpha, pane.alpha_mode) == (0.25, "blend")
    glass = material_of(ClassicMaterial(opacity=0.25, ior=1.5), "nff")
    assert (glass.transmission, glass.ior, glass.thickness) == (0.75, 1.5, 1)
    picture = material_of(ClassicMaterial(color=(1, 1, 1), ambient=0.5, diffuse=0))
    assert picture.emission == (0.5, 0.5, 0.5)
    grey = material_of(ClassicMaterial(color=(0.5, 0.5, 0.5), diffuse=1.0))
    assert grey.base_color[0] == pytest.approx(0.2140, abs=1e-4)  # sRGB 0.5


def test_lamps_light_the_middle_as_before():
    builder = ClassicSceneBuilder("lamp", handedness="left")
    builder.spheres((0, 0, 0), 1, builder.material(ClassicMaterial()))
    builder.light(ClassicLight("point", center=(0, 0, 10), color=(1, 0.5, 0.25)))
    builder.light(ClassicLight("directional", direction=(0, 0, 1.0), color=(1, 1, 1)))
    point, sun = to_physical(builder.build()).lights
    # Irradiance pi times the classic strength gives a matt surface of albedo a the radiance a times that strength.
    np.testing.assert_allclose(np.array(point.color) / 10**2, np.pi * np.array([1, 0.5, 0.25]))
    assert point.radius == pytest.approx(0.2)
    np.testing.assert_allclose(point.world_from_light[:3, 3], (0, 0, -10))
    np.testing.assert_allclose(-sun.world_from_light[:3, 2], (0, 0, -1))
    np.testing.assert_allclose(sun.color, np.pi)


def test_planar_pictures_keep_their_place():
    builder = ClassicSceneBuilder("picture", handedness="left")
    image = builder.image(ClassicImage("dots", np.zeros((1, 4, 4, 3), np.uint8)))
    texture = ClassicTexture("planar-image", center=(1, 0, 0), scale=(0.5, 0.25, 1), rotate=(0.1, 0.2, 0), image=image)
    builder.triangles([[(1, 0, 0), (3, 0, 0), (1, 4, 0)]], builder.material(ClassicMaterial(texture=texture)))
    made = to_physical(builder.build())
    np.testing.assert_allclose(made.meshes[0].uvs[0], [(0.1, 0.2), (1.1, 0.2), (0.1, 1.2)], atol=1e-6)
    assert made.materials[0].base_color_texture.srgb


def test_what_is_left_out_is_said():
    builder = every_shape(material=ClassicMaterial(texture=ClassicTexture("marble")))
    fog = Fog("exp", 0.0, 1.0, 1.0, (1, 1, 1))
    builder.clip_group([(1, 0, 0, 0)])
    notes = " ".join(to_physical(builder.build(fog=fog)).notes)
    assert all(word in notes for word in ("marble", "fog", "clip"))


def test_a_sky_becomes_the_surroundings():
    sky = Background(
        "sky-sphere", up=(0, 1, 0), top_value=1.0, bottom_value=-1.0, top_color=(1, 0, 0), bottom_color=(0, 0, 1)
    )
    made = to_physical(every_shape().build(background=sky))
    assert made.background is None
    assert made.environment.pixels[0, 0, 0] > 0.9  # the top row lies at +y
    assert made.environment.pixels[-1, 0, 2] > 0.9
    across = Background(
        "sky-sphere", up=(1, 0, 0), top_value=1.0, bottom_value=-1.0, top_color=(1, 0, 0), bottom_color=(0, 0, 1)
    )
    pixels = to_physical(every_shape().build(background=across)).environment.pixels
    rows, columns = pixels.shape[:2]
    assert pixels[rows // 2, 3 * columns // 4, 0] > 0.9  # +x lies right of the middle


def test_defaults_follow_the_scene(tmp_path):
    (tmp_path / "one.dat").write_text(
        "BEGIN_SCENE RESOLUTION 4 4 CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 3 RAYDEPTH 7 CENTER 0 0 -6 VIEWDIR 0 0 1 "
        "UPDIR 0 1 0 END_CAMERA SPHERE CENTER 0 0 0 RAD 1 TEXTURE AMBIENT 1 DIFFUSE 0 SPECULAR 0 OPACITY 1 COLOR 1 1 1 "
        "TEXFUNC 0 END_SCENE"
    )
    scene = load_scene(tmp_path / "one.dat")
    assert scene.is_classic
    shown = resolve(RenderRequest(), scene)
    assert (shown.integrator, shown.depth, shown.spp, shown.pixel_filter) == ("classic", 7, 1, "point")
    own = resolve(RenderRequest(), scene, form="preview")
    assert (own.spp, own.pixel_filter) == (4, "box")
    path = resolve(RenderRequest(integrator="path"), scene)
    assert (path.integrator, path.depth, path.spp, path.pixel_filter) == ("path", 8, 16, "box")
    assert resolve(RenderRequest(), load_scene("teapot")).integrator == "path"
    assert resolve(RenderRequest(integrator="classic"), load_scene("teapot")).depth == 2
    assert resolve(RenderRequest(), load_scene("tree")).integrator == "classic"
    with pytest.raises(UsageError, match=r"has no form for the classic"):
        resolve(RenderRequest(integrator="classic"), load_scene(to_physical(every_shape().build())))


def test_surroundings_asked_for_give_the_physical_form():
    scene = load_scene("small-balls", environment="studio")
    assert not scene.is_classic
    assert resolve(RenderRequest(), scene).integrator == "path"
    black = load_scene("small-balls", background=(0, 0, 0))
    assert black.classic.background == Background(color=(0, 0, 0))
