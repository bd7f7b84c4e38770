"""Pictures of next to nothing are told from pictures of something."""

import numpy as np
import pytest

from lippmann.rendering.film.wavefront import RayTotals
from lippmann.rendering.provenance import measure_visible_share, warn_of_emptiness

GREY = (0.2, 0.2, 0.2)


def test_pixels_unlike_the_background_count():
    pixels = np.full((100, 50, 3), 0.2, np.float32)
    assert measure_visible_share(pixels, GREY, RayTotals(5000, 9000, 9000)) == 0
    pixels[10, :25, 1] = 0.5
    assert measure_visible_share(pixels, GREY, RayTotals()) == 0.005
    pixels[:, :, 0] += 1e-4  # what a denoiser leaves
    assert measure_visible_share(pixels, GREY, RayTotals()) == 0.005


def test_rays_bound_the_share_where_the_background_varies():
    pixels = np.random.default_rng(1).random((10, 10, 3)).astype(np.float32)
    assert measure_visible_share(pixels, None, RayTotals(1000, 3, 2)) == pytest.approx(0.005)
    assert measure_visible_share(None, GREY, RayTotals(1000, 4000, 3000)) == 1


def test_the_warning_names_the_way_out():
    assert warn_of_emptiness(0.01) == ()
    (line,) = warn_of_emptiness(0.004)
    assert "0.4 % of it shows anything" in line
    assert "camera" in line
    assert "(nothing)" in warn_of_emptiness(0)[0]


@pytest.mark.slow
def test_glowing_surfaces_before_black_are_something(engine):
    """They send no rays on, which an environment's bound goes by."""
    from lippmann import api

    glow = {"type": "rectangle", "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 3.0}}}
    scene = api.load_scene({"type": "scene", "glow": glow}, environment="none")
    preview = api.preview(scene, size=(32, 32), spp=1, tone_map="none")
    assert preview.pixels.max() > 1
    assert not any("empty" in note for note in preview.provenance.notes)


@pytest.mark.slow
def test_colours_of_their_own_before_an_environment_are_something(engine):
    """They send no rays on, which an environment's bound goes by."""
    from lippmann import api
    from lippmann.scene.values.description import Environment, Instance, Material, Mesh, SceneDescription

    corners = np.float32([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
    mesh = Mesh("t", corners, np.array([[0, 1, 2]], np.uint32), 0)
    scene = SceneDescription("unlit", [mesh], [Material(unlit=True)], [Instance(0, np.eye(4))])
    sky = Environment(np.random.default_rng(1).random((4, 8, 3), np.float32))
    small = api.load_display("seed-lenticular").resized(16, 16)
    notes = api.render(api.load_scene(scene, environment=sky), small, spp=1).provenance.notes
    assert not any("nearly empty" in note for note in notes)
