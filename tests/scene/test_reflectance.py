"""Mean reflectance of scenes, and the studio's strength that follows from it."""

import numpy as np
import pytest

from lippmann.scene.reflectance import mean_reflectance
from lippmann.scene.scene import Scene
from lippmann.scene.studio_light import BRIGHTEST, studio, studio_for
from lippmann.scene.values.description import Image, Instance, Material, Mesh, SceneDescription, Texture

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def squares(*parts):
    """A scene of squares: (material, side, colours of the vertices)."""
    meshes = [Mesh("m", SQUARE, FACES, k, colors=colors) for k, (_, _, colors) in enumerate(parts)]
    places = [Instance(k, np.diag([side, side, side, 1.0])) for k, (_, side, _) in enumerate(parts)]
    return SceneDescription("s", meshes, [material for material, _, _ in parts], places)


def grey(value, **more):
    return Material(base_color=(value,) * 3, **more)


def test_surfaces_count_by_their_area():
    assert mean_reflectance(squares((grey(0.5), 1, None))) == pytest.approx(0.5)
    assert mean_reflectance(squares((grey(0.0), 3, None), (grey(1.0), 1, None))) == pytest.approx(0.1)


def test_textures_vertices_and_emission_count():
    codes = np.zeros((300, 200, 3), np.uint8)
    codes[:, ::2] = 188  # linear 0.5 in every second column
    coded = Texture(Image("half", np.repeat(codes[:, :1], 200, axis=1)), srgb=True)
    plain = Texture(Image("grey", np.full((4, 4, 1), 51, np.uint8)), srgb=False)
    assert mean_reflectance(squares((grey(0.4, base_color_texture=coded), 1, None))) == pytest.approx(0.2, abs=0.002)
    assert mean_reflectance(squares((grey(1.0, base_color_texture=plain), 1, None))) == pytest.approx(0.2)
    paint = np.full((4, 4), 0.25, np.float32)
    assert mean_reflectance(squares((grey(0.8), 1, paint))) == pytest.approx(0.2)
    assert mean_reflectance(squares((grey(0.0, emission=(2.0,) * 3), 1, None))) == pytest.approx(2.0)
    glow = grey(0.0, emission=(2.0,) * 3, emission_texture=plain)
    assert mean_reflectance(squares((glow, 1, None))) == pytest.approx(0.4)


def test_no_surface_is_no_reflectance():
    assert mean_reflectance(SceneDescription("none")) is None


@pytest.mark.long
@pytest.mark.parametrize(("value", "strength"), [(0.9, 1.0), (0.25, 1.0), (0.125, 2.0), (0.0, BRIGHTEST)])
def test_dark_models_get_more_light(value, strength):
    scene = Scene("s", squares((grey(value), 1, None)))
    assert scene.in_studio
    assert scene.environment.pixels == pytest.approx(strength * studio().pixels, rel=1e-5)
    assert scene.environment.scale == pytest.approx(strength * studio().scale)


def test_the_bundled_light_is_the_same_object():
    assert studio_for(squares((grey(0.5), 1, None))) is studio()
