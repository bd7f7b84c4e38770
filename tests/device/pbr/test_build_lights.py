"""Lamps, glowing surfaces and surroundings send the light that they say they send."""

from dataclasses import replace

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.values.description import Environment, Image, Instance, Light, Material, Mesh, Texture

MATTE = Material(base_color=(0.6, 0.6, 0.6), specular=0.0)


def aimed(direction, position=(0.0, 0.0, 0.0)):
    """A frame whose -z runs along ``direction``."""
    z = -np.asarray(direction, float) / np.linalg.norm(direction)
    x = np.cross([0, 1, 0] if abs(z[1]) < 0.9 else [1, 0, 0], z)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 2], frame[:3, 3] = x / np.linalg.norm(x), z, position
    frame[:3, 1] = np.cross(frame[:3, 2], frame[:3, 0])
    return frame


def direct_light(look, built, **rest):
    return look.picture(built, size=8, depth=2, half=0.1, **{"samples": 64, **rest}).mean((0, 1))


def test_point_lamp(build, look, parts):
    lamp = Light("point", (3.0, 6.0, 9.0), parts.shift(0.0, 0.0, 2.0))
    seen = direct_light(look, build(parts.describe([parts.square()], [MATTE], lights=[lamp])), origin=(0, 0, 1))
    np.testing.assert_allclose(seen, 0.6 / np.pi * np.array([3, 6, 9]) / 4, rtol=0.01)


def test_directional_lamp(build, look, parts):
    """Irradiance E falling at an angle makes a matte surface shine with E cos albedo / pi."""
    down = np.array([0.3, -0.4, -1.0]) / np.linalg.norm([0.3, -0.4, -1.0])
    lamp = Light("directional", (2.0, 1.0, 0.5), aimed(down))
    seen = direct_light(look, build(parts.describe([parts.square()], [MATTE], lights=[lamp])))
    np.testing.assert_allclose(seen, 0.6 / np.pi * np.array([2, 1, 0.5]) * -down[2], rtol=1e-4)


@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_spot_keeps_to_its_cone(build, look, parts, radius):
    inner, outer = 0.2, 0.4
    lamp = Light("spot", (1.0, 1.0, 1.0), aimed((0, 0, -1), (0, 0, 2)), inner, outer, radius=radius)
    built = build(parts.describe([parts.square(half=2.0)], [MATTE], lights=[lamp]))
    picture = look.picture(built, size=64, samples=64, depth=2, half=1.0, origin=(0, 0, 1))[..., 0]
    x, y = np.meshgrid((np.arange(64) + 0.5) / 32 - 1, 1 - (np.arange(64) + 0.5) / 32)
    angle = np.arctan(np.hypot(x, y) / 2)
    expected = 0.6 / np.pi * np.cos(angle) ** 4 / 4 * np.clip((outer - angle) / (outer - inner), 0, 1)
    inside, outside = angle < inner - 0.02, angle > outer + 0.02
    assert picture[outside].max() == 0
    np.testing.assert_allclose(picture[inside], expected[inside], rtol=0.05)
    np.testing.assert_allclose(picture, expected, atol=0.05 * expected.max())


def test_spot_without_penumbra_is_whole(build, look, parts):
    lamp = Light("spot", (1.0, 1.0, 1.0), aimed((0, 0, -1), (0, 0, 2)), 0.3, 0.3)
    seen = direct_light(look, build(parts.describe([parts.square()], [MATTE], lights=[lamp])), origin=(0, 0, 1))
    np.testing.assert_allclose(seen, 0.6 / np.pi / 4, rtol=0.01)


def test_lamp_with_a_body_shines_like_one_without(build, look, parts):
    lamp = Light("point", (3.0, 2.0, 1.0), parts.shift(0.0, 0.0, 2.0), radius=0.1)
    built = build(parts.describe([parts.square()], [MATTE], lights=[lamp]))
    seen = direct_light(look, built, origin=(0, 0, 1), samples=1000)
    np.testing.assert_allclose(seen, 0.6 / np.pi * np.array([3, 2, 1]) / 4, rtol=0.02)
    np.testing.assert_allclose(look.emitted(built, 0.05, 0.0), [np.array([3, 2, 1]) / (np.pi * 0.01)], rtol=1e-5)


def test_placement_of_a_lamp_may_be_scaled(build, look, parts):
    lamp = Light("spot", (1.0, 1.0, 1.0), aimed((0, 0, -1), (0, 0, 2)) @ np.diag([3.0, 3, 3, 1]), 0.2, 0.4)
    seen = direct_light(look, build(parts.describe([parts.square()], [MATTE], lights=[lamp])), origin=(0, 0, 1))
    np.testing.assert_allclose(seen, 0.6 / np.pi / 4, rtol=0.01)


@pytest.mark.parametrize(
    ("lamp", "word"),
    [
        (Light("point", (float("inf"), 1.0, 1.0), np.eye(4), name="bulb"), "bulb"),
        (Light("directional", (1.0, -1.0, 1.0), np.eye(4)), "directional"),
        (Light("spot", (1.0, 1.0, 1.0), np.diag([1.0, 1.0, 0.0, 1.0]), name="beam"), "beam"),
    ],
)
def test_impossible_lamps_are_refused(build, parts, lamp, word):
    with pytest.raises(SceneError, match=word):
        build(parts.describe([parts.square()], [MATTE], lights=[lamp]))


# ---- surroundings ----


def one_texel(row, column, shape=(16, 32)):
    pixels = np.full((*shape, 3), 0.1, np.float32)
    pixels[row, column] = (1, 2, 3)
    return pixels


def surroundings(build, parts, direction, pixels, frame=None):
    """Radiance from a direction."""
    import mitsuba as mi

    environment = Environment(pixels, np.eye(4) if frame is None else frame)
    built = build(parts.describe([parts.square(half=1e-3)], [MATTE], environment=environment))
    ray = mi.Ray3f(mi.Point3f(0.0, 0.0, 1.0), mi.Vector3f(*(float(x) for x in direction)))
    si = built.mitsuba.ray_intersect(ray)
    return np.array(si.emitter(built.mitsuba).eval(si)).ravel()


def toward(row, column, shape=(16, 32)):
    """Where a texel lies: the top row up, the middle of the picture at -z, its right half at +x."""
    theta, phi = np.pi * (row + 0.5) / shape[0], 2 * np.pi * (column + 0.5) / shape[1]
    return np.array([-np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)])


@pytest.mark.slow
@pytest.mark.parametrize(("row", "column"), [(8, 16), (8, 24), (8, 8), (8, 0), (1, 20), (14, 3)])
def test_environment_texels_lie_where_they_should(build, parts, row, column):
    seen = surroundings(build, parts, toward(row, column), one_texel(row, column))
    np.testing.assert_allclose(seen, (1, 2, 3), rtol=1e-3)


@pytest.mark.slow
def test_environment_in_words(build, parts):
    """The four walls and the sky, spelled out."""
    for (row, column), direction in {
        (8, 16): (0.1, -0.1, -1),
        (8, 24): (1, -0.1, 0.1),
        (8, 8): (-1, -0.1, -0.1),
        (0, 5): (0, 1, 0),
    }.items():
        length = np.linalg.norm(direction)
        pixels = np.full((16, 32, 3), 0.1, np.float32)
        pixels[row] = 1 if row == 0 else pixels[row]
        pixels[row, column - 1 : column + 2] = 1
        pixels[row - 1 : row + 2, column] = 1
        assert surroundings(build, parts, np.array(direction) / length, pixels)[0] > 0.5


def test_environment_turns_with_its_frame(build, parts):
    frame = np.eye(4)
    frame[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    seen = surroundings(build, parts, frame[:3, :3] @ toward(5, 11), one_texel(5, 11), frame)
    np.testing.assert_allclose(seen, (1, 2, 3), rtol=1e-3)


@pytest.mark.slow
def test_environment_lights_as_it_looks(build, look, parts):
    """Irradiance from a drawn environment equals its sum over the texels."""
    rng = np.random.default_rng(5)
    pixels = rng.random((16, 32, 3)).astype(np.float32) ** 4 * 5
    built = build(parts.describe([parts.square()], [MATTE], environment=Environment(pixels)))
    seen = direct_light(look, built, samples=8000)
    fine = np.kron(pixels, np.ones((8, 8, 1)))  # texels are interpolated, but their mean over the sky hardly moves
    rows, columns = np.meshgrid(np.arange(128), np.arange(256), indexing="ij")
    ways = np.moveaxis(toward(rows, columns, (128, 256)), 0, -1)
    solid = np.sin(np.pi * (rows + 0.5) / 128) * (np.pi / 128) * (2 * np.pi / 256)
    irradiance = (fine * (np.maximum(ways[..., 2], 0) * solid)[..., None]).sum((0, 1))
    np.testing.assert_allclose(seen, 0.6 / np.pi * irradiance, rtol=0.03)


@pytest.mark.parametrize(
    "pixels",
    [
        np.full((2, 4, 3), np.nan, np.float32),
        np.full((2, 4, 3), -1, np.float32),
        np.zeros((2, 4), np.float32),
        np.zeros((0, 4, 3), np.float32),
    ],
)
def test_impossible_environments_are_refused(build, parts, pixels):
    with pytest.raises(SceneError, match="sky"):
        build(parts.describe([parts.square()], [MATTE], environment=Environment(pixels, name="sky")))


# ---- glowing surfaces ----


def patch_irradiance(radiance, size, height):
    """At the point under the middle of a horizontal square panel: ``radiance(x, y)`` summed over it."""
    steps = 400
    x, y = np.meshgrid(*[((np.arange(steps) + 0.5) / steps * 2 - 1) * size] * 2)
    r2 = x**2 + y**2 + height**2
    return (radiance(x, y) * height**2 / r2**2).sum() * (2 * size / steps) ** 2


def lit_from_above(build, look, parts, material, *, samples=4000, uvs=None, colors=None, flip=True):
    """Reflected radiance of a matte floor at the origin under a square lamp at height 1."""
    lamp = parts.square(1, half=0.5, uvs=uvs, colors=colors)
    place = np.diag([1.0, -1.0, -1.0, 1.0]) if flip else np.eye(4)  # turned over, to face the floor
    place[2, 3] = 1.0
    floor = parts.square(0, half=0.05)
    description = parts.describe(
        [floor, lamp], [MATTE, material], instances=[Instance(0, np.eye(4)), Instance(1, place)]
    )
    built = build(description)
    return look.picture(built, size=4, samples=samples, depth=2, half=0.02, origin=(0, 0, 0.5)).mean((0, 1)), built


def test_even_lamp(build, look, parts):
    seen, _ = lit_from_above(build, look, parts, Material(base_color=(0, 0, 0), specular=0.0, emission=(2, 3, 4)))
    expected = 0.6 / np.pi * patch_irradiance(lambda x, y: np.ones_like(x), 0.5, 1.0) * np.array([2, 3, 4])
    np.testing.assert_allclose(seen, expected, rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("repeats", [1, 3])
def test_textured_lamp(build, look, parts, repeats):
    """Also where its texture repeats, which Mitsuba's own area light cannot do."""
    texels = np.zeros((2, 2, 3), np.float32)
    texels[0, 0], texels[1, 1] = (1, 0, 0), (0, 1, 0)
    material = Material(
        base_color=(0, 0, 0),
        specular=0.0,
        emission=(5, 5, 5),
        emission_texture=Texture(Image("t", texels), srgb=False, filter="nearest"),
    )
    uvs = (np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32) * repeats,)
    seen, _ = lit_from_above(build, look, parts, material, uvs=uvs)
    # Red and green together cover half of the panel, and turning it by half a turn swaps them.
    each = 0.6 / np.pi * 5 * patch_irradiance(lambda x, y: np.ones_like(x), 0.5, 1.0) / 4
    np.testing.assert_allclose(seen, [each, each, 0], rtol=0.02, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("double_sided", "expected"), [(False, 0.0), (True, 1.0)])
def test_back_of_a_lamp(build, look, parts, double_sided, expected):
    material = Material(base_color=(0, 0, 0), specular=0.0, emission=(2, 2, 2), double_sided=double_sided)
    seen, built = lit_from_above(build, look, parts, material, flip=False)
    full = 0.6 / np.pi * patch_irradiance(lambda x, y: np.ones_like(x), 0.5, 1.0) * 2
    np.testing.assert_allclose(seen, expected * full, rtol=0.01, atol=1e-9)
    np.testing.assert_allclose(look.emitted(built, 0.3, 0.3, z=0.5, toward=1.0)[0], 2 * expected)


def test_holes_of_a_lamp_do_not_shine(build, look, parts):
    texels = np.full((4, 4, 4), 255, np.uint8)
    texels[:2, :, 3] = 0
    material = Material(
        base_color=(0, 0, 0),
        specular=0.0,
        base_color_texture=Texture(Image("t", texels), srgb=True, filter="nearest"),
        alpha_mode="mask",
        emission=(2, 2, 2),
    )
    seen, built = lit_from_above(build, look, parts, material)
    full = 0.6 / np.pi * patch_irradiance(lambda x, y: np.ones_like(x), 0.5, 1.0) * 2
    np.testing.assert_allclose(seen, full / 2, rtol=0.02)
    assert built.has_null


@pytest.mark.slow
def test_unlit_surface_shows_its_colour_from_both_sides(build, look, parts):
    colors = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], np.float32)
    built = build(parts.describe([parts.square(colors=colors)], [Material(base_color=(0.5, 0.5, 1.0), unlit=True)]))
    x, y = np.array([-0.999, 0.999, 0.999]), np.array([-0.999, -0.999, 0.999])
    expected = colors[:3] * (0.5, 0.5, 1.0)
    np.testing.assert_allclose(look.emitted(built, x, y), expected, atol=2e-3)
    np.testing.assert_allclose(look.emitted(built, x, y, z=-5.0, toward=1.0), expected, atol=2e-3)
    picture = look.picture(built, size=8, samples=1, depth=4)
    assert picture.max() <= 1  # nothing is reflected on top


def test_vertex_coloured_lamp_is_found_by_scattered_rays(build, look, parts):
    """Its colour cannot be known where emitters are drawn; the light must be right all the same."""
    colors = np.tile(np.array([[0.2, 0.4, 0.8]], np.float32), (4, 1))
    seen, _ = lit_from_above(build, look, parts, Material(unlit=True), colors=colors, samples=20000)
    full = 0.6 / np.pi * patch_irradiance(lambda x, y: np.ones_like(x), 0.5, 1.0)
    np.testing.assert_allclose(seen, full * colors[0], rtol=0.03)


def test_texture_multiplies_emission(build, look, parts):
    texels = np.zeros((1, 2, 3), np.uint8)
    texels[0, 1] = 255
    material = Material(
        emission=(1, 2, 3), emission_texture=Texture(Image("t", texels), srgb=True, filter="nearest", wrap_u="clamp")
    )
    built = build(parts.describe([parts.square()], [material]))
    np.testing.assert_allclose(look.emitted(built, [-0.5, 0.5], [0, 0]), [(0, 0, 0), (1, 2, 3)], atol=1e-6)


def test_black_emission_texture_makes_no_lamp(build, parts):
    texture = Texture(Image("t", np.zeros((2, 2, 3), np.uint8)), srgb=True)
    built = build(parts.describe([parts.square()], [Material(emission=(1, 1, 1), emission_texture=texture)]))
    assert not built.mitsuba.emitters()


def test_lamp_without_area_sheds_no_light(build, look, parts):
    line = parts.square(1)
    line = replace(line, positions=line.positions * np.float32([1, 0, 0]))
    built = build(parts.describe([parts.square(z=-1), line], [MATTE, Material(emission=(1, 1, 1))]))
    assert not built.mitsuba.emitters()
    assert not look.picture(built, size=4).any()


def test_black_lamps_are_left_out(build, parts):
    lamp = Light("point", (0.0, 0.0, 0.0), np.eye(4))
    assert not build(parts.describe([parts.square()], [MATTE], lights=[lamp])).mitsuba.emitters()


def test_meshes_of_one_lamp_share_an_emitter(build, parts):
    glow = Material(emission=(1, 1, 1))
    meshes: list[Mesh] = [parts.square(z=float(number)) for number in range(5)]
    assert len(build(parts.describe(meshes, [glow])).mitsuba.emitters()) == 1
