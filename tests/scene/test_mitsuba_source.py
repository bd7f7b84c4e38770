"""Scenes in Mitsuba's own terms."""

import subprocess
import sys

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.mitsuba_source import MitsubaSource, with_sky
from lippmann.scene.readers.load import load_scene
from lippmann.scene.scene import STUDIO_NOTE
from lippmann.scene.studio_light import studio

EMITTER = '<shape type="sphere"><emitter type="area"/></shape>'
CAMERA = (
    '<sensor type="thinlens" id="eye"><float name="aperture_radius" value="0.1"/>'
    '<float name="focus_distance" value="3"/><float name="fov" value="40"/><string name="fov_axis" value="y"/>'
    '<transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>'
    '<film type="hdrfilm"><integer name="width" value="200"/><integer name="height" value="100"/></film></sensor>'
)


@pytest.fixture
def save(tmp_path):
    def save(body, name="room.xml", head=""):
        path = tmp_path / name
        path.write_text(f'{head}<scene version="3.0.0">{body}</scene>')
        return path

    return save


def test_a_file(save, engine):
    scene = load_scene(save(EMITTER + CAMERA))
    assert scene.name == "room"
    assert scene.bounds == pytest.approx(np.array([[-1, -1, -1], [1, 1, 1]]))
    assert scene.has_lights
    assert scene.environment is None
    assert scene.notes == ()
    assert scene.description.scene() is scene.description.scene()


def test_cameras_look_as_ours_do(save, engine):
    tall = '<sensor type="orthographic"><transform name="to_world"><scale x="2" y="2"/></transform></sensor>'
    odd = '<sensor type="irradiancemeter"/>'
    first, second = load_scene(save(EMITTER.replace("/></shape>", f"/>{odd}</shape>") + CAMERA + tall)).cameras
    assert first.name == "eye"
    assert first.world_from_camera == pytest.approx(
        np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]), abs=1e-6
    )
    assert first.fov_y == pytest.approx(np.radians(40), rel=1e-5)
    assert (first.aspect, first.focus_distance) == (2.0, 3.0)
    assert second.name
    assert second.fov_y is None
    assert second.height == pytest.approx(4.0 / second.aspect)


def test_a_camera_sees_what_mitsuba_sees(save, engine):
    """A ray of our camera through a point of the picture is the ray of Mitsuba's."""
    import mitsuba as mi

    pinhole = CAMERA[CAMERA.index('<float name="fov"') :].replace("0,0,5", "4,3,5")
    scene = load_scene(save(f'{EMITTER}<sensor type="perspective">{pinhole}'))
    (camera,) = scene.cameras
    ray, _ = scene.description.scene().sensors()[0].sample_ray(0, 0.5, mi.Point2f(0.75, 0.1), mi.Point2f(0.5))
    top = np.tan(camera.fov_y / 2)
    ours = camera.world_from_camera[:3, :3] @ (0.5 * camera.aspect * top, 0.8 * top, -1)
    assert np.array(ray.d).ravel() == pytest.approx(ours / np.linalg.norm(ours), abs=1e-5)


def test_a_dark_scene_is_lit_by_the_studio(save, engine):
    scene = load_scene(save('<shape type="sphere"/>'))
    assert scene.environment is studio()
    assert scene.notes == (STUDIO_NOTE,)


def test_a_sky_joins_the_lamps_and_replaces_another_sky(engine):
    import mitsuba as mi

    parts = {
        "type": "scene",
        "body": {"type": "sphere", "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [2, 2, 2]}}},
        "emitter": {"type": "point", "position": [0, 5, 0]},
        "old": {"type": "constant", "radiance": 7.0},
    }
    scene = load_scene(parts).description.scene()
    sky = mi.load_dict({"type": "constant", "radiance": 0.5})
    found = with_sky(scene, sky)
    assert len(found.shapes()) == 1
    assert sorted(emitter.class_name() for emitter in found.emitters()) == [
        "AreaLight",
        "ConstantBackgroundEmitter",
        "PointLight",
    ]
    ray = mi.Ray3f(mi.Point3f(0, 0, 5), mi.Vector3f(0, 1, 0))
    radiance, _, _ = mi.load_dict({"type": "path"}).sample(found, mi.load_dict({"type": "independent"}), ray)
    assert np.array(radiance).ravel() == pytest.approx([0.5, 0.5, 0.5])


def test_a_loaded_scene_is_taken_as_it_is(engine):
    import mitsuba as mi

    loaded = mi.load_dict({"type": "scene", "body": {"type": "cube"}})
    scene = load_scene(loaded)
    assert scene.description.scene() is loaded
    assert scene.bounds == pytest.approx(np.array([[-1, -1, -1], [1, 1, 1]]))


@pytest.mark.parametrize("kind", ["rectangle", "cube"])
@pytest.mark.parametrize("is_loaded", [False, True])
def test_shapes_of_one_material_have_their_place(engine, kind, is_loaded):
    """Mitsuba merges them, and forgets the box of merged rectangles."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    paint = {"type": "diffuse"}
    content = {
        "type": "scene",
        **{f"wall {x}": {"type": kind, "to_world": place().translate([x, 0, 0]), "bsdf": paint} for x in (0, 5)},
        "ball": {"type": "sphere", "center": [1, 2, 3], "radius": 0.5},
        "sky": {"type": "constant"},
    }
    source = MitsubaSource("walls", mi.load_dict(content) if is_loaded else content)
    depth = 0.0 if kind == "rectangle" else -1.0
    np.testing.assert_allclose(source.bounds(), [[-1, -1, depth], [6, 2.5, 3.5]])
    assert source.scene().environment() is not None
    assert len(source.scene().emitters()) == 1


def test_a_loaded_scene_of_another_variant(engine):
    import mitsuba as mi

    ours = mi.variant()
    try:
        mi.set_variant("scalar_rgb")
        foreign = mi.load_dict({"type": "scene", "body": {"type": "cube"}})
    finally:
        mi.set_variant(ours)
    with pytest.raises(SceneError, match=r"loaded under 'scalar_rgb'; the engine runs 'llvm_ad_rgb'"):
        _ = load_scene(foreign).bounds


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ({"type": "scene", "body": {"type": "nothing"}}, "Mitsuba refuses the scene: .*nothing"),
        ({"type": "scene", "body": {}}, "Mitsuba refuses the scene: .*type"),
        ({"type": "scene"}, "the scene has no geometry"),
    ],
)
def test_scenes_that_mitsuba_refuses(engine, source, message):
    with pytest.raises(SceneError, match=message) as caught:
        _ = load_scene(source).bounds
    assert "\n" not in str(caught.value)


def test_a_file_that_mitsuba_refuses(save, engine):
    scene = load_scene(save('<shape type="sphere"><float name="nothing" value="1"/></shape>'))
    with pytest.raises(SceneError, match=r"room: Mitsuba refuses the scene: .*nothing"):
        _ = scene.bounds


def test_files_that_a_file_names(save, tmp_path):
    mesh = '<shape type="ply"><string name="filename" value="{}"/></shape>'
    with pytest.raises(SceneError, match=r"room\.xml:1: file 'none\.ply' not found"):
        load_scene(save(mesh.format("none.ply")))
    with pytest.raises(SceneError, match=r"room\.xml:1: file 'none\.xml' not found"):
        load_scene(save('<include filename="none.xml"/>'))
    (tmp_path / "there.ply").touch()
    load_scene(save(mesh.format("there.ply")))
    for name in ("../there.ply", "elsewhere/There.ply"):
        beside = load_scene(save(mesh.format(name))).description
        assert dict(beside.content.files) == {"there.ply": tmp_path / "there.ply"}


def test_outside_files_need_leave(save, tmp_path):
    (tmp_path / "far.ply").touch()
    (tmp_path / "sub").mkdir()
    path = save('<shape type="ply"><string name="filename" value="../far.ply"/></shape>', "sub/room.xml")
    with pytest.raises(SceneError, match=r"file '\.\./far\.ply' lies outside"):
        load_scene(path)
    load_scene(path, allow_outside=True)


@pytest.mark.long
def test_whoever_asks_for_cameras_starts_the_engine(save):
    code = (
        "from lippmann.scene.readers.load import load_scene\n"
        f"scene = load_scene({str(save(EMITTER + CAMERA))!r})\n"
        "print([camera.name for camera in scene.cameras], scene.bounds.tolist())"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "['eye'] [[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]\n"


def test_a_scene_that_brings_a_sensor_is_placed_by_it(save, engine):
    import mitsuba as mi

    with_sensor, without = load_scene(save(EMITTER + CAMERA)), load_scene(save(EMITTER, "plain.xml"))
    assert (with_sensor.display_camera, without.display_camera) == ("eye", None)
    parts = {"type": "scene", "body": {"type": "cube"}}
    assert load_scene(parts).display_camera is None
    assert load_scene({**parts, "view": {"type": "thinlens", "aperture_radius": 0.1}}).display_camera == "view"
    assert load_scene({**parts, "view": mi.load_dict({"type": "orthographic"})}).display_camera == "view"
    assert load_scene(mi.load_dict({**parts, "view": {"type": "perspective"}})).display_camera == "view"
    assert load_scene(mi.load_dict(parts)).display_camera is None
    assert load_scene(save(EMITTER + '<sensor type="irradiancemeter"/>', "meter.xml")).display_camera is None


@pytest.mark.slow
@pytest.mark.parametrize("scale", [(3.0, 3.0), (2.0, 1.0)])
def test_an_orthographic_sensor_with_a_scale_sees_what_mitsuba_sees(save, engine, scale):
    from lippmann import api

    x, y = scale
    sensor = (
        f'<sensor type="orthographic"><transform name="to_world"><scale x="{x}" y="{y}"/>'
        '<lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>'
        '<film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="96"/></film></sensor>'
    )
    square = '<shape type="rectangle"><emitter type="area"><rgb name="radiance" value="3"/></emitter></shape>'
    import mitsuba as mi

    scene = load_scene(save(square + sensor))
    loaded = scene.description.scene()
    reference = np.array(mi.render(loaded, integrator=mi.load_dict({"type": "path"}), spp=64))
    (camera,) = scene.cameras
    width = 96 * camera.aspect  # our pixels are square
    ours = api.preview(scene, size=(round(width), 96), spp=16, tone_map="none").pixels
    lit = (reference[..., 0] > 1.5).mean(), (ours[..., 0] > 1.5).mean()
    assert lit[1] == pytest.approx(lit[0], abs=0.02)
    assert lit[0] == pytest.approx(4 / (4 * x * y * 1.5), abs=0.02)


def test_a_source_is_a_plain_value():
    source = MitsubaSource("x", {"type": "scene"})
    assert repr(source) == "MitsubaSource(name='x', content={'type': 'scene'}, environment=None, background=None)"
