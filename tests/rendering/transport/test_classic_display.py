"""Classic scenes on displays and from the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from lippmann import api
from lippmann.cli import run
from lippmann.errors import UsageError

pytestmark = pytest.mark.usefixtures("engine")

CORNERS = """BEGIN_SCENE RESOLUTION 64 64
CAMERA ZOOM 2 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 3 CENTER 0 0 -10 VIEWDIR 0 0 1 UPDIR 0 1 0 END_CAMERA
BACKGROUND 0.1 0.2 0.3
SPHERE CENTER 1.2 1.2 0 RAD 0.8 TEXTURE AMBIENT 1 DIFFUSE 0 SPECULAR 0 OPACITY 1 COLOR 1 0.5 0 TEXFUNC 0
SPHERE CENTER -1.2 -1.2 0 RAD 0.5 TEXTURE AMBIENT 1 DIFFUSE 0 SPECULAR 0 OPACITY 1 COLOR 0 0.5 1 TEXFUNC 0
END_SCENE
"""


@pytest.fixture
def corners(tmp_path):
    """A left-handed file: an orange ball at the upper right, a small blue one at the lower left."""
    path = tmp_path / "corners.dat"
    path.write_text(CORNERS)
    return path


def quarters(pixels):
    """What the four quarters show in their middles: upper left, upper right, lower left, lower right."""
    height, width = pixels.shape[:2]
    return [pixels[height * y // 4, width * x // 4].round(3).tolist() for y in (1, 3) for x in (1, 3)]


ORANGE, BLUE, SKY = [1.0, 0.5, 0.0], [0.0, 0.5, 1.0], [0.1, 0.2, 0.3]


def test_a_left_handed_file_is_shown_as_its_camera_sees_it(corners):
    preview = api.preview(corners, size=(64, 64))
    assert quarters(preview.pixels) == [pytest.approx(c, abs=2e-3) for c in (SKY, ORANGE, BLUE, SKY)]
    image = api.render(corners, "seed-lenticular")
    assert image.provenance.options["placement"] == "camera"
    assert image.provenance.transfer == "linear"
    assert np.linalg.det(image.world_from_display[:3, :3]) > 0
    assert quarters(image.pixels) == [pytest.approx(c, abs=2e-3) for c in (SKY, ORANGE, BLUE, SKY)]


def test_physically_based_light_sees_it_the_same_way_round(corners):
    pixels = api.preview(corners, size=(64, 64), integrator="albedo", spp=1).pixels
    normals = api.preview(corners, size=(64, 64), integrator="normal", spp=1).pixels
    assert pixels.shape == normals.shape
    hit = (normals != 0).any(axis=-1)
    assert [bool(hit[16 + 32 * y, 16 + 32 * x]) for y in (0, 1) for x in (0, 1)] == [False, True, True, False]


@pytest.mark.slow
def test_every_bundled_scene_renders_by_the_classic_model(engine):
    from lippmann.scene import bundled

    for name in bundled.names():
        preview = api.preview(name, size=(24, 24), integrator="classic")
        assert preview.provenance.depth == 2
        assert np.isfinite(preview.pixels).all()
        assert preview.pixels.std() > 0.02


def test_the_picture_does_not_depend_on_how_it_was_cut(corners):
    from dataclasses import replace

    from lippmann.device.whitted.scene import build_classic
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.whitted import WhittedIntegrator
    from lippmann.rendering.transport.whitted_camera import WhittedCameraRays

    scene = api.load_scene(corners).classic
    integrator = WhittedIntegrator(build_classic(scene), 3)
    source = WhittedCameraRays(scene.camera, scene.handedness, 40, 30)
    plan = cut_wavefronts(40, 30, 4, memory=2**30)
    cut = replace(plan, rows_per_tile=7, samples_per_pass=1)
    whole, parts = (trace_frame(integrator, source, each) for each in (plan, cut))
    np.testing.assert_allclose(whole.pixels, parts.pixels, atol=1e-6)
    assert whole.rays == parts.rays


def test_a_scene_without_a_classic_form_is_refused(tmp_path):
    path = tmp_path / "one.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    with pytest.raises(UsageError, match="no form for the classic light models"):
        api.preview(path, size=(8, 8), integrator="classic")
    with pytest.raises(UsageError, match="known are auto, classic, path"):
        api.preview(path, size=(8, 8), integrator="magic")


def test_commands(corners, tmp_path, capsys):
    out = tmp_path / "out.png"
    assert run(["preview", str(corners), "-o", str(out), "--plain", "--pixels", "32x32", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["integrator"], said["depth"], said["spp"]) == ("classic", 3, 1)
    assert said["rays"]["primary"] == 32 * 32
    from PIL import Image

    picture = np.asarray(Image.open(out).convert("RGB"))
    assert picture[8, 24].tolist() == [255, 128, 0]  # the numbers themselves, without a curve
