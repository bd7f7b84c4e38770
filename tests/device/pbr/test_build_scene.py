"""Whole scenes: read from files, made by code, or brought from Mitsuba."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from lippmann.device.pbr import build as build_scene
from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene
from lippmann.scene.values.description import Environment, Instance, Light, Material


def central_rays(built, scene, *, count=64):
    """Rays along -z over the scene's box, ``(hits, interactions)``."""
    import mitsuba as mi

    low, high = scene.bounds
    x, y = np.meshgrid(*(np.linspace(low[axis], high[axis], count) for axis in (0, 1)))
    start = float(high[2] + np.linalg.norm(high - low))
    origin = mi.Point3f(mi.Float(x.ravel().astype(np.float32)), mi.Float(y.ravel().astype(np.float32)), start)
    si = built.mitsuba.ray_intersect(mi.Ray3f(origin, mi.Vector3f(0, 0, -1)))
    return np.array(si.is_valid()), si


def test_scene_without_light_is_lit_by_the_studio(engine, parts):
    scene = load_scene(parts.describe([parts.square()], [Material()]))
    built = build_scene(scene, engine)
    assert built.background == scene.background is not None
    assert [emitter.is_environment() for emitter in built.mitsuba.emitters()] == [True]
    assert set(built.seconds) == {"materials", "shapes", "lights", "acceleration"}
    assert not built.notes
    with pytest.raises(FrozenInstanceError):
        built.background = None


def test_background_and_environment_of_the_caller(engine, parts):
    sky = Environment(np.full((4, 8, 3), 0.25, np.float32))
    scene = load_scene(parts.describe([parts.square()], [Material()]), environment=sky, background=(0.1, 0.2, 0.3))
    built = build_scene(scene, engine)
    assert built.background == (0.1, 0.2, 0.3)
    import mitsuba as mi

    si = built.mitsuba.ray_intersect(mi.Ray3f(mi.Point3f(0, 0, 3), mi.Vector3f(0, 0, 1)))
    np.testing.assert_allclose(np.array(si.emitter(built.mitsuba).eval(si)).ravel(), 0.25)


def test_engine_is_started_where_none_is_given(engine, parts):
    del engine
    assert len(build_scene(load_scene(parts.describe([parts.square()], [Material()]))).mitsuba.shapes()) == 1


def test_all_lamps_are_there(engine, parts):
    lights = [Light("point", (1.0, 1.0, 1.0), np.eye(4)), Light("directional", (1.0, 1.0, 1.0), np.eye(4))]
    scene = load_scene(parts.describe([parts.square()], [Material(), Material(emission=(1, 1, 1))], lights=lights))
    assert len(build_scene(scene, engine).mitsuba.emitters()) == 2


def test_nothing_to_see(build, parts):
    empty = replace(parts.square(), faces=np.zeros((0, 3), np.uint32))
    for description in (
        parts.describe([empty], [Material()]),
        parts.describe([parts.square()], [Material()], instances=[]),
        parts.describe([parts.square()], [Material()], instances=[Instance(0, np.diag([1.0, 0, 1, 1]))]),
    ):
        with pytest.raises(SceneError, match="no geometry"):
            build(description)


# ---- scenes from Mitsuba ----


def mitsuba_dict():
    return {
        "type": "scene",
        "ball": {"type": "sphere", "bsdf": {"type": "mask", "opacity": 0.5, "bsdf": {"type": "diffuse"}}},
        "light": {"type": "constant", "radiance": 0.5},
    }


def test_scene_of_mitsubas_own(engine):
    built = build_scene(load_scene(mitsuba_dict()), engine)
    assert len(built.mitsuba.shapes()) == 1
    assert built.has_null
    assert not built.absorption
    assert set(built.seconds) == {"load"}


def test_environment_replaces_that_of_a_mitsuba_scene(engine):
    sky = Environment(np.full((4, 8, 3), 2.0, np.float32))
    built = build_scene(load_scene(mitsuba_dict(), environment=sky, background=(0, 0, 1)), engine)
    import mitsuba as mi

    si = built.mitsuba.ray_intersect(mi.Ray3f(mi.Point3f(0, 0, 3), mi.Vector3f(0, 0, 1)))
    np.testing.assert_allclose(np.array(si.emitter(built.mitsuba).eval(si)).ravel(), 2)
    assert built.background == (0, 0, 1)


def test_mitsubas_complaint_is_one_line(engine, tmp_path):
    path = tmp_path / "odd.xml"
    path.write_text('<scene version="3.0.0"><shape type="dodecahedron"/></scene>')
    with pytest.raises(SceneError, match=r"odd.*dodecahedron") as caught:
        build_scene(load_scene(path), engine)
    assert "\n" not in str(caught.value)


# ---- real files ----


def test_teapot_made_by_others(engine, shared_scenes):
    scene = load_scene(shared_scenes / "gltf" / "fancy_teapot" / "scene.gltf")
    built = build_scene(scene, engine)
    assert not built.notes
    hit, si = central_rays(built, scene)
    assert 0.3 < hit.mean() < 0.9
    base = np.array(si.bsdf().eval_diffuse_reflectance(si)).T[hit]
    assert 0.2 < base.mean() < 0.9  # porcelain
    metal = np.array(si.bsdf().eval_attribute_1("metallic", si))[hit]
    assert 0.0 < (metal > 0.9).mean() < 0.3  # gilt rims


def test_clear_coat_grid_made_by_others(engine, shared_scenes):
    """Three columns: body, body with coat, coat alone. The coat shows in the second, the body not in the third."""
    scene = load_scene(shared_scenes / "gltf" / "clearcoat_test" / "ClearCoatTest.gltf", environment="studio")
    built = build_scene(scene, engine)
    hit, si = central_rays(built, scene, count=128)
    assert hit.mean() > 0.3
    color = np.array(si.bsdf().eval_diffuse_reflectance(si)).T
    tones = {"coat alone": (0, 0, 0), "red body": (0.5, 0.02, 0.01), "blue body": (0.013, 0.022, 0.109)}
    shares = {name: (np.abs(color - tone).max(1) < 0.005)[hit].mean() for name, tone in tones.items()}
    assert min(shares.values()) > 0.02, shares
