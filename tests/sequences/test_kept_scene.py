"""A scene that is kept on the device while only the display and far light move, as if it were built for each frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.device import pbr
from lippmann.device.pbr import scene as scene_module
from lippmann.display import load_display
from lippmann.scene.values.description import Environment, Light
from lippmann.sequences.frames import render_sequence
from lippmann.sequences.kept_scene import KeptScene
from lippmann.sequences.motion import Motion, open_motion
from lippmann.sequences.turntable import open_turntable

QUICK = {"integrator": "path", "spp": 2, "device": "cpu"}


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular").resized(64, 64)


@pytest.fixture
def builds(monkeypatch):
    """Names of the scenes that were built."""
    built, build = [], pbr.build

    def counted(scene, *args, **options):
        built.append(scene.name)
        return build(scene, *args, **options)

    monkeypatch.setattr(pbr, "build", counted)
    return built


def sky():
    """Bright on one side: turned, it lights another."""
    pixels = np.full((8, 16, 3), 0.1, np.float32)
    pixels[2:4, 3:5] = 20.0
    return Environment(pixels)


def teapot(**more):
    scene = lippmann.load_scene("teapot")
    return replace(scene, description=replace(scene.physical, **more), classic_form=None)


@pytest.mark.parametrize("lit", ["studio", "sky"])
def test_a_turn_builds_once_and_shows_what_frames_built_alone_show(engine, display, builds, lit):
    scene = teapot() if lit == "studio" else teapot(environment=sky(), background=None)
    motion = open_turntable(scene, 5)
    together = {frame: image.pixels for frame, image in render_sequence(motion, display, [0, 1, 3], **QUICK)}
    assert len(builds) == 1
    for frame in (1, 3):
        ((_, alone),) = render_sequence(motion, display, [frame], **QUICK)
        assert np.array_equal(alone.pixels, together[frame])
    assert len(builds) == 3


PLACE = np.array([[0.6, 0, 0.8, 6], [0, 1, 0, 4], [-0.8, 0, 0.6, 6], [0, 0, 0, 1.0]])


def light_source(kind="point", **more):
    return Light(kind, (80.0, 80.0, 80.0), PLACE, **more)


def test_light_sources_go_along_with_what_is_built(engine, display, builds):
    lights = [light_source(kind) for kind in ("point", "spot", "directional")]
    # From above, where it is seen.
    lights[1] = replace(
        lights[1], world_from_light=np.array([[1, 0, 0, 6], [0, 0, 1, 70], [0, -1, 0, 6], [0, 0, 0, 1.0]])
    )
    motion = open_turntable(teapot(lights=lights, environment=sky(), background=None), 5)
    *_, (_, together) = render_sequence(motion, display, [0, 1], **QUICK)
    assert len(builds) == 1
    ((_, alone),) = render_sequence(motion, display, [1], **QUICK)
    assert np.array_equal(alone.pixels, together.pixels)


def test_a_light_source_that_is_a_shape_is_built_anew(engine, display, builds):
    motion = open_turntable(teapot(lights=[light_source(radius=1.0)]), 4)
    list(render_sequence(motion, display, [0, 1], **QUICK))
    assert len(builds) == 2


class Cut(Motion):
    """Frames of the scenes that are given."""

    def __init__(self, *scenes):
        self._scenes = scenes

    count = property(lambda self: len(self._scenes))
    content = property(lambda self: self._scenes)

    def scene(self, frame):
        return self._scenes[frame]

    def camera(self, frame, name):
        return None

    def bounds(self):
        boxes = np.stack([scene.bounds for scene in self._scenes])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def test_a_scene_that_stays_as_it_is_is_built_once(engine, display, builds):
    """As in a flight, with a light source that is a shape."""
    scene = teapot(lights=[light_source(radius=1.0)])
    first, second = render_sequence(Cut(scene, scene), display, [0, 1], fixed_noise=True, **QUICK)
    assert len(builds) == 1
    assert np.array_equal(first[1].pixels, second[1].pixels)


@pytest.fixture(scope="module")
def lit_teapot():
    return teapot(environment=sky(), lights=[light_source()])


@pytest.fixture(scope="module")
def begun_there(engine, display, lit_teapot):
    """Frames 1 and 2 after a cut, without the frame before it."""
    motion = Cut(teapot(), lit_teapot, lit_teapot)
    return [image for _, image in render_sequence(motion, display, [1, 2], integrator="path", device="cpu")]


@pytest.mark.long_cases("object", "light")
@pytest.mark.parametrize("change", ["surfaces", "object", "light", "dark"])
def test_a_film_after_a_cut_is_one_that_begins_there(engine, display, lit_teapot, begun_there, change):
    scene = lit_teapot
    before = {
        "surfaces": teapot(environment=sky(), lights=[light_source()], materials=scene.physical.materials[::-1]),
        "object": teapot(environment=sky(), lights=[light_source()], instances=scene.physical.instances[:-1]),
        "light": teapot(environment=sky()),
        "dark": teapot(environment=sky(), lights=[replace(light_source(), color=(0.0, 0.0, 0.0))]),
    }[change]
    motion, options = Cut(before, scene, scene), {"integrator": "path", "device": "cpu"}
    together = [image for _, image in render_sequence(motion, display, [0, 1, 2], **options)]
    for one, other in zip(together[1:], begun_there, strict=True):
        assert np.array_equal(one.pixels, other.pixels)
        assert one.provenance.estimate == other.provenance.estimate
        assert not any("frame 0's" in note for note in one.provenance.notes)


def test_an_animation_keeps_its_materials_and_shows_what_frames_built_alone_show(
    engine, display, builds, moving_ball, monkeypatch
):
    made, make = [], scene_module.make_finishes
    monkeypatch.setattr(scene_module, "make_finishes", lambda *args, **more: made.append(1) or make(*args, **more))
    motion = open_motion(moving_ball)
    together = {frame: image.pixels for frame, image in render_sequence(motion, display, [0, 5], **QUICK)}
    assert len(builds) == 2
    assert len(made) == 1
    ((_, alone),) = render_sequence(motion, display, [5], **QUICK)
    assert np.array_equal(alone.pixels, together[5])


def test_other_materials_are_made_anew(engine):
    scene, kept = teapot(), KeptScene()
    first = kept.build(scene, engine)
    red = [replace(material, base_color=(1.0, 0.0, 0.0)) for material in scene.physical.materials]
    second = kept.build(teapot(materials=red), engine)
    assert not set(map(id, first.finishes.values())) & set(map(id, second.finishes.values()))


def test_a_scene_read_anew_is_known_but_for_its_cameras(engine):
    first = teapot(lights=[light_source()])
    description = first.description
    kept = KeptScene()
    assert kept.known(first) is first
    kept.build(first, engine)

    def read(**changed):
        meshes = [replace(mesh, positions=mesh.positions.copy()) for mesh in description.meshes]
        return replace(first, description=replace(description, meshes=meshes, **changed))

    assert kept.known(read(cameras=[])) is first
    for changed in (
        {"lights": [light_source("spot")]},
        {"lights": []},
        {"background": (1.0, 0.0, 0.0)},
        {"materials": [replace(description.materials[0], metallic=0.5), *description.materials[1:]]},
        {"instances": [replace(description.instances[0], world_from_mesh=2 * np.eye(4)), *description.instances[1:]]},
    ):
        other = read(**changed)
        assert kept.known(other) is other
