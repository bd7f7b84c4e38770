"""Materials become the surfaces that they describe."""

from dataclasses import replace

import numpy as np
import pytest

from lippmann.scene.values.description import Environment, Image, Instance, Light, Material, Texture


def bsdf_of(built):
    return built.mitsuba.shapes()[0].bsdf()


def flags(built):
    from mitsuba import BSDFFlags, has_flag

    names = (
        "DiffuseReflection",
        "GlossyReflection",
        "GlossyTransmission",
        "DeltaReflection",
        "DeltaTransmission",
        "Null",
    )
    return {name for name in names if has_flag(bsdf_of(built).flags(), getattr(BSDFFlags, name))}


GLASS = Material(transmission=1.0, roughness=0.0, thickness=1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("material", "expected"),
    [
        (Material(), {"DiffuseReflection", "GlossyReflection"}),
        (Material(specular=0.0), {"DiffuseReflection"}),
        (Material(metallic=1.0), {"GlossyReflection"}),
        (Material(metallic=1.0, roughness=0.0), {"DeltaReflection"}),
        (Material(metallic=1.0, roughness=0.0, clearcoat=1.0), {"GlossyReflection"}),
        (GLASS, {"DeltaReflection", "DeltaTransmission"}),
        (replace(GLASS, thickness=0.0), {"DeltaReflection", "Null"}),
        (replace(GLASS, roughness=0.5), {"DiffuseReflection", "GlossyReflection", "GlossyTransmission"}),
        (replace(GLASS, metallic=1.0), {"DeltaReflection"}),
        (Material(alpha=0.5), {"DiffuseReflection", "GlossyReflection"}),
        (Material(alpha=0.5, alpha_mode="blend"), {"DiffuseReflection", "GlossyReflection", "Null"}),
        (Material(alpha=0.6, alpha_mode="mask"), {"DiffuseReflection", "GlossyReflection"}),
        (Material(alpha=0.4, alpha_mode="mask"), {"DiffuseReflection", "GlossyReflection", "Null"}),
        (replace(GLASS, alpha=0.5, alpha_mode="blend"), {"DeltaReflection", "DeltaTransmission", "Null"}),
        (Material(unlit=True), {"DiffuseReflection"}),
    ],
)
def test_kind_of_surface(build, parts, material, expected):
    built = build(parts.describe([parts.square()], [material]))
    assert flags(built) == expected
    assert built.has_null == ("Null" in expected)


# ---- opacity ----


def alpha_texture(values):
    texels = np.full((*np.shape(values), 4), 255, np.uint8)
    texels[..., 3] = values
    return Texture(Image("a", texels), srgb=True, filter="nearest")


ALPHAS = np.array([[0, 100, 127], [128, 200, 255]])


@pytest.mark.parametrize("mode", ["opaque", "mask", "blend"])
def test_opacity(build, look, parts, mode):
    material = Material(base_color_texture=alpha_texture(ALPHAS), alpha_mode=mode)
    built = build(parts.describe([parts.square()], [material]))
    x, y = np.meshgrid((np.arange(3) + 0.5) / 1.5 - 1, [0.5, -0.5])
    expected = {"opaque": np.ones(6), "mask": (ALPHAS.ravel() >= 127.5) * 1.0, "blend": ALPHAS.ravel() / 255}[mode]
    seen = look.opacity(built, x, y)
    np.testing.assert_allclose(seen, expected, atol=1e-6)


def test_cutoff_and_factors(build, look, parts):
    colors = np.tile(np.array([(1, 1, 1, 0.5)], np.float32), (4, 1))
    texture = alpha_texture(ALPHAS)
    x, y = np.meshgrid((np.arange(3) + 0.5) / 1.5 - 1, [0.5, -0.5])
    alpha = ALPHAS.ravel() / 255 * 0.8 * 0.5
    blend = Material(base_color_texture=texture, alpha=0.8, alpha_mode="blend")
    mask = replace(blend, alpha_mode="mask", alpha_cutoff=0.3)
    mesh = parts.square(colors=colors)
    np.testing.assert_allclose(look.opacity(build(parts.describe([mesh], [blend])), x, y), alpha, atol=1e-6)
    np.testing.assert_allclose(look.opacity(build(parts.describe([mesh], [mask])), x, y), alpha >= 0.3, atol=1e-6)


def test_alpha_of_vertex_colours_is_idle_in_opaque_materials(build, parts):
    colors = np.tile(np.array([(1, 1, 1, 0.5)], np.float32), (4, 1))
    assert not build(parts.describe([parts.square(colors=colors)], [Material()])).has_null


def test_light_falls_through_holes(build, look, parts):
    """Seen from above: half of the floor below a sheet with a hole in every second texel."""
    sky = Environment(np.ones((2, 4, 3), np.float32))
    holes = alpha_texture(np.tile([[0, 255], [255, 0]], (2, 2)))
    black = Material(base_color=(0, 0, 0), specular=0.0, base_color_texture=holes, alpha_mode="mask")
    built = build(parts.describe([parts.square()], [black], environment=sky))
    picture = look.picture(built, size=8, samples=4)
    expected = np.kron(np.tile([[1, 0], [0, 1]], (2, 2)), np.ones((2, 2)))
    np.testing.assert_allclose(picture[..., 0], expected, atol=1e-6)


def test_blended_surface_mixes(build, look, parts):
    sky = Environment(np.ones((2, 4, 3), np.float32))
    veil = Material(base_color=(0, 0, 0), specular=0.0, alpha=0.25, alpha_mode="blend")
    built = build(parts.describe([parts.square()], [veil], environment=sky))
    np.testing.assert_allclose(look.picture(built, samples=4000, size=4), 0.75, atol=0.02)


# ---- glass ----


def seen_through(build, look, parts, material, mesh, *, samples=400):
    """Colour of an even white sky seen through the middle of an object."""
    sky = Environment(np.ones((2, 4, 3), np.float32))
    built = build(parts.describe([mesh], [material], environment=sky))
    return look.picture(built, size=4, samples=samples, depth=40, half=0.01).mean((0, 1))


@pytest.mark.slow
def test_clear_ball_is_invisible_in_even_light(build, look, parts):
    seen = seen_through(build, look, parts, replace(GLASS, base_color=(1, 1, 1)), parts.ball())
    np.testing.assert_allclose(seen, 1, atol=0.01)


def test_ball_turns_the_picture_over(build, look, parts):
    """A glass ball is a strong lens: what lies far right behind it is seen on its left."""
    pixels = np.zeros((64, 128, 3), np.float32)
    pixels[:, 66:80, 0] = 1  # right of the middle, which lies at -z
    built = build(parts.describe([parts.ball()], [GLASS], environment=Environment(pixels)))
    row = look.picture(built, size=16, samples=200, depth=6, half=0.5)[8, :, 0]
    assert row[:7].max() > 0.5
    assert row[9:].max() < 0.1


def test_tint_counts_at_each_surface(build, look, parts):
    tinted = Material(base_color=(0.9, 0.5, 0.2), transmission=1.0, roughness=0.0, ior=1.0, thickness=1.0)
    seen = seen_through(build, look, parts, tinted, parts.ball())
    np.testing.assert_allclose(seen, np.array([0.9, 0.5, 0.2]) ** 2, atol=1e-3)


def test_thin_pane_lets_light_straight_through(build, look, parts):
    pane = Material(base_color=(0.9, 0.5, 0.2), transmission=1.0, roughness=0.0)
    seen = seen_through(build, look, parts, pane, parts.square())
    reflected = 2 * 0.04 / 1.04  # a pane has two faces, and light goes back and forth between them
    np.testing.assert_allclose(seen, (1 - reflected) * np.array([0.9, 0.5, 0.2]) + reflected, atol=0.01)
    built = build(parts.describe([parts.square()], [pane]))
    si = look.hit(built, 0.1, 0.1)
    through = np.array(bsdf_of(built).eval_null_transmission(si)).ravel()
    np.testing.assert_allclose(through, (1 - reflected) * np.array([0.9, 0.5, 0.2]), atol=1e-3)


def test_glass_may_be_smooth_by_texture_only(build, parts):
    """A constant texture is as good as a number."""
    even = Texture(Image("r", np.zeros((4, 4, 3), np.uint8)), srgb=False)
    built = build(parts.describe([parts.square()], [replace(GLASS, roughness=1.0, metallic_roughness_texture=even)]))
    assert flags(built) == {"DeltaReflection", "DeltaTransmission"}


def test_absorption_coefficients(build, parts):
    wine = replace(GLASS, attenuation_color=(0.5, 0.25, 1.0), attenuation_distance=2.0)
    meshes = [parts.square(), parts.ball(1), parts.square(2)]
    built = build(parts.describe(meshes, [Material(), wine, Material(metallic=1.0)]))
    assert len(built.absorption) == 1
    ((position, coefficients),) = built.absorption.items()
    assert built.mitsuba.shapes()[position].primitive_count() == len(meshes[1].faces)
    np.testing.assert_allclose(np.exp(-2 * np.array(coefficients)), (0.5, 0.25, 1), rtol=1e-12)


@pytest.mark.parametrize(
    "material",
    [
        replace(GLASS, attenuation_color=(1.0, 1.0, 1.0), attenuation_distance=2.0),
        replace(GLASS, attenuation_color=(0.5, 0.5, 0.5)),  # at an infinite distance
        replace(GLASS, attenuation_color=(0.5, 0.5, 0.5), attenuation_distance=2.0, thickness=0.0),
        replace(GLASS, attenuation_color=(0.5, 0.5, 0.5), attenuation_distance=2.0, transmission=0.0),
    ],
)
def test_clear_bodies_absorb_nothing(build, parts, material):
    assert not build(parts.describe([parts.ball()], [material])).absorption


def test_black_attenuation_stays_finite(build, parts):
    ink = replace(GLASS, attenuation_color=(0.0, 1.0, 1.0), attenuation_distance=1.0)
    ((red, green, _),) = build(parts.describe([parts.ball()], [ink])).absorption.values()
    assert 5 < red < 100
    assert green == 0


@pytest.mark.slow
def test_absorbing_bodies_are_not_instanced(build, parts):
    """Their shapes have to be found among the scene's."""
    wine = replace(GLASS, attenuation_color=(0.5, 0.25, 1.0), attenuation_distance=2.0)
    instances = [Instance(0, parts.shift(3.0 * number)) for number in range(6)]
    built = build(parts.describe([parts.ball(steps=180)], [wine], instances=instances))
    assert [shape.is_mesh() for shape in built.mitsuba.shapes()] == [True]


def test_the_meshs_own_coordinates_are_those_that_tangents_and_emitters_need():
    from lippmann.device.pbr.materials import _uv_sets

    def texture(uv_set):
        return Texture(Image("t", np.zeros((2, 2, 3), np.uint8)), srgb=False, uv_set=uv_set)

    material = Material(base_color_texture=texture(0), emission_texture=texture(1), normal_texture=texture(2))
    assert _uv_sets(material) == (2, 1, 0)
    assert _uv_sets(replace(material, normal_texture=None)) == (1, 0)
    assert _uv_sets(replace(material, normal_texture=None, anisotropy_texture=texture(3))) == (3, 1, 0)
    assert _uv_sets(replace(material, normal_texture=None, anisotropy=0.5)) == (0, 1)
    assert _uv_sets(Material()) == ()


# ---- mirrors ----


def test_mirror_has_the_metals_colour_and_whitens_at_grazing_angles(build, parts):
    import drjit as dr
    import mitsuba as mi

    gold = Material(base_color=(1.0, 0.7, 0.3), metallic=1.0, roughness=0.0)
    bsdf = bsdf_of(build(parts.describe([parts.square()], [gold])))
    for cosine in (1.0, 0.5, 0.1, -0.5):
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0.0, cosine)
        bs, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(0.5), mi.Point2f(0.5))
        base = np.array(gold.base_color)
        np.testing.assert_allclose(np.array(weight).ravel(), base + (1 - base) * (1 - abs(cosine)) ** 5, rtol=1e-5)
        np.testing.assert_allclose(np.array(bs.wo).ravel(), (-np.sqrt(1 - cosine**2), 0, cosine), atol=1e-6)


# ---- guides ----


def test_diffuse_reflectance_leaves_metal_and_glass_out(build, look, parts):
    material = Material(base_color=(0.8, 0.6, 0.4), metallic=0.25, transmission=0.5)
    built = build(parts.describe([parts.square()], [material]))
    si = look.hit(built, 0.1, 0.2)
    seen = np.array(si.bsdf().eval_diffuse_reflectance(si)).ravel()
    np.testing.assert_allclose(seen, np.array([0.8, 0.6, 0.4]) * 0.75 * 0.5, rtol=1e-6)


def test_unlit_surface_reflects_nothing(build, look, parts):
    sun = Light("directional", (5.0, 5.0, 5.0), np.eye(4))
    built = build(parts.describe([parts.square()], [Material(base_color=(0.2, 0.3, 0.4), unlit=True)], lights=[sun]))
    np.testing.assert_allclose(look.picture(built, size=2)[0, 0], (0.2, 0.3, 0.4), rtol=1e-5)


def test_materials_without_a_mesh_are_not_built(build, parts):
    lost = Texture(Image("t", np.random.default_rng(0).integers(0, 255, (4, 4, 3), dtype=np.uint8)), srgb=True)
    built = build(parts.describe([parts.square()], [Material(), Material(base_color_texture=lost)]))
    assert len(built.mitsuba.shapes()) == 1
