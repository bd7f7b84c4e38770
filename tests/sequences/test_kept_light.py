"""The light of a key frame serves the frames after it until something that it depends on moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.rendering.preparation import prepare
from lippmann.scene.matrices import translation
from lippmann.scene.values.description import Light
from lippmann.sequences.frames import render_sequence
from lippmann.sequences.kept_light import KeptLight
from lippmann.sequences.motion import open_motion
from lippmann.sequences.turntable import open_turntable


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular").resized(32, 32)


@pytest.fixture
def prepared(monkeypatch):
    """A number for each time that light is prepared: of photons or, where there are none, of pilots alone."""
    made, shoot = [], prepare.shoot_photons
    monkeypatch.setattr(prepare, "shoot_photons", lambda *args: made.append(1) or shoot(*args))
    return made


class Prepared:
    def __init__(self, photons=None, light_vertices=None, pilot=None):
        self.photons, self.light_vertices, self.pilot = photons, light_vertices, pilot


@pytest.mark.parametrize(
    ("light", "scene", "built", "exposure", "is_kept"),
    [
        (Prepared(), "scene", "built", 1.0, True),
        (Prepared(photons="photons"), "scene", "built", 1.0, True),
        # Light sources that are elsewhere make a scene another one, though what is built is the same.
        (Prepared(), "moved", "built", 1.0, True),
        (Prepared(photons="photons"), "moved", "built", 1.0, False),
        (Prepared(light_vertices="vertices"), "moved", "built", 1.0, False),
        (Prepared(), "scene", "built anew", 1.0, False),
        (Prepared(), "scene", "built", 2.0, False),
    ],
)
def test_light_is_prepared_anew_where_what_it_depends_on_has_changed(light, scene, built, exposure, is_kept):
    kept = KeptLight()
    assert kept.keep_key(lambda: light, "scene", "built", 1.0) is light
    light.pilot = "pilot"
    next_light = kept.reuse_key(Prepared, scene, built, exposure)
    assert (next_light is light) == is_kept
    assert next_light.pilot == "pilot"  # also of light that is prepared anew
    assert kept.reuse_key(Prepared, "scene", "built", 1.0) is light


def test_without_a_key_frame_light_is_prepared():
    light = Prepared()
    assert KeptLight().reuse_key(lambda: light, "scene", "built", 1.0) is light


@pytest.mark.long
def test_the_light_of_a_flight_is_prepared_once_while_it_is_passed_on(engine, display, prepared, tmp_path):
    path = tmp_path / "flight.cam"
    poses = (f"0 -0.2756 -0.9613  0 0.9613 -0.2756  {x} 174 384\n" for x in range(5))
    path.write_text("".join(poses))
    motion = open_motion("room", camera_path=path)
    options = {"integrator": "path", "device": "cpu"}
    together = dict(render_sequence(motion, display, **options))
    assert len(prepared) == 1  # of frame 0, also for frame 4, which passes it on
    ((_, alone),) = render_sequence(motion, display, [2], **options)
    assert len(prepared) == 2
    assert np.array_equal(alone.pixels, together[2].pixels)
    choices = [image.provenance.options.get("light_vertices") for image in together.values()]
    assert choices[0] is not None
    assert len(set(choices)) == 1


@pytest.mark.long
@pytest.mark.parametrize("way", [None, "photons"])
def test_light_sources_of_a_turntable_light_each_frame_from_where_they_are(engine, display, prepared, way):
    scene = lippmann.load_scene("gears" if way else "teapot")
    if way is None:
        description = replace(scene.physical, lights=[Light("point", (80.0, 80.0, 80.0), translation([6, 4, 6]))])
        scene = replace(scene, description=description, classic_form=None)
    motion, options = open_turntable(scene, 48), {"integrator": "path", "device": "cpu"}
    together = [image for _, image in render_sequence(motion, display, [0, 1], **options)]
    assert [image.provenance.options.get("caustics") for image in together] == [way] * 2
    assert len(prepared) == (2 if way else 1)
    ((_, alone),) = render_sequence(motion, display, [1], **options)
    assert np.array_equal(alone.pixels, together[1].pixels)
