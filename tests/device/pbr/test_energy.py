"""Furnaces: what white surfaces keep of even light, and that none makes any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.scene.values.description import Environment, Image, Material, Texture

WHITE = Material(base_color=(1.0, 1.0, 1.0))
METAL = replace(WHITE, metallic=1.0)
SHEET = replace(WHITE, transmission=1.0)
GLASS = replace(SHEET, thickness=1.0)


@pytest.fixture(scope="session")
def kept(build, parts):
    """Share of the light from each direction that a surface reflects or lets through, by sampling it ``(n, 3)``."""

    def keep(material, cosines, count=25_000, **options):
        import drjit as dr
        import mitsuba as mi

        from lippmann.device.kernel_ops import upload

        bsdf = build(parts.describe([parts.square()], [material], **options)).mitsuba.shapes()[0].bsdf()
        rng = np.random.default_rng(1)
        u = [upload(rng.random(count * len(cosines), dtype=np.float32)) for _ in range(3)]
        si = dr.zeros(mi.SurfaceInteraction3f, count * len(cosines))
        cosine = np.repeat(np.float32(cosines), count)
        sine = np.sqrt(1 - cosine**2)
        si.wi = mi.Vector3f(*(upload(part) for part in (0.6 * sine, 0.8 * sine, cosine)))
        sample, weight = bsdf.sample(mi.BSDFContext(), si, u[0], mi.Point2f(u[1], u[2]))
        # Radiance grows on entering a denser body; the light itself does not.
        through = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Transmission)
        return np.array(weight * dr.select(through, dr.square(sample.eta), 1)).reshape(3, -1, count).mean(axis=2).T

    return keep


def tilted(degrees):
    """A normal map that leans by so much all over."""
    angle = np.radians(degrees)
    texel = (np.float32([np.sin(angle), 0, np.cos(angle)]) + 1) / 2
    return Texture(Image("n", np.tile(texel, (2, 2, 1))), srgb=False)


@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("material", [METAL, SHEET, GLASS], ids=["metal", "sheet", "glass"])
def test_white_surfaces_keep_all_light(kept, material, roughness):
    """Light that microfacets reflect more than once comes out, too (single scattering keeps 0.41 of it on metal)."""
    np.testing.assert_allclose(kept(replace(material, roughness=roughness), (1.0, 0.5, 0.1, -0.7)), 1, atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("ior", [1.0, 1.1, 1.33, 1.8, 2.4])
def test_glass_of_any_index_keeps_all_light(kept, ior):
    glass = replace(GLASS, ior=ior, roughness=0.8)
    np.testing.assert_allclose(kept(glass, (0.9, 0.4, -0.9, -0.4)), 1, atol=0.02)


def test_single_scattering_can_be_asked_for(kept):
    """glTF's formulas as they stand: 41 % of the light on rough white metal, 88 % at roughness 0.5."""
    np.testing.assert_allclose(kept(METAL, [0.7], multiple_scattering=False), 0.41, atol=0.05)
    np.testing.assert_allclose(kept(replace(METAL, roughness=0.5), [1.0], multiple_scattering=False), 0.9, atol=0.04)


@pytest.mark.parametrize("coated", [METAL, WHITE], ids=["metal", "plastic"])
def test_rough_clear_coat_keeps_all_light(kept, coated):
    np.testing.assert_allclose(kept(replace(coated, clearcoat=1.0, clearcoat_roughness=1.0), [0.5]), 1, atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
def test_white_cloth_keeps_all_light(kept, roughness):
    cloth = replace(WHITE, sheen_color=(1.0, 1.0, 1.0), sheen_roughness=roughness)
    np.testing.assert_allclose(kept(cloth, (0.95, 0.4)), 1, atol=0.03)


def test_coloured_rough_metal_gets_deeper_not_darker(kept):
    """Each further reflection takes on the colour once more."""
    copper = Material(base_color=(0.9, 0.5, 0.3), metallic=1.0, roughness=1.0)
    [bright], [single] = kept(copper, [0.7]), kept(copper, [0.7], multiple_scattering=False)
    assert (bright > 1.4 * single).all()
    assert (bright < (0.95, 0.6, 0.4)).all()
    assert bright[2] / bright[0] < single[2] / single[0]


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [30, 50, 60, 80])
@pytest.mark.parametrize("roughness", [0.05, 0.5])
def test_steep_normal_maps_do_not_blacken_metal(kept, degrees, roughness):
    material = replace(METAL, roughness=roughness, normal_texture=tilted(degrees))
    np.testing.assert_allclose(kept(material, (1.0, 0.5, -0.8)), 1, atol=0.03)


def test_steep_normal_maps_do_not_blacken_plastic(kept):
    for degrees in (30, 60):
        np.testing.assert_allclose(kept(replace(WHITE, normal_texture=tilted(degrees)), [0.8]), 1, atol=0.03)


@pytest.mark.parametrize("strength", [0.5, 1.0])
def test_brushed_metal_keeps_nearly_all_light(kept, strength):
    for roughness in (0.1, 0.5):
        light = kept(replace(METAL, roughness=roughness, anisotropy=strength), [0.6])
        np.testing.assert_allclose(light, 1, atol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("base", [METAL, Material(base_color=(0.0, 0.0, 0.0), metallic=1.0), WHITE, SHEET])
@pytest.mark.parametrize("thickness", [0.0, 250.0, 550.0])
def test_thin_films_make_no_light(kept, base, thickness):
    material = replace(base, roughness=0.3, iridescence=1.0, iridescence_thickness_maximum=thickness)
    assert (kept(material, (1.0, 0.3)) < 1.03).all()


@pytest.mark.slow
def test_solid_glass_in_even_light_cannot_be_seen(build, look, parts):
    """The furnace of a whole body: paths cross several interfaces (single scattering keeps a third at roughness 1)."""
    even = Environment(np.ones((2, 4, 3), np.float32))
    for roughness, ior in ((1.0, 1.5), (0.5, 1.5), (0.6, 1.0)):
        glass = replace(GLASS, roughness=roughness, ior=ior)
        built = build(parts.describe([parts.ball(steps=24)], [glass], environment=even))
        picture = look.picture(built, size=16, samples=256, depth=64, half=0.7)
        assert picture.mean() == pytest.approx(1, abs=0.05)


@pytest.mark.slow
def test_glass_of_index_one_is_a_tinted_nothing(build, look, parts):
    """Rays pass straight through: whatever lies behind is seen, in the glass's colour twice."""
    pane = replace(GLASS, ior=1.0, roughness=0.4, base_color=(0.9, 0.5, 0.3))
    backdrop = Material(base_color=(0.0, 0.0, 0.0), specular=0.0, emission=(1.0, 1.0, 1.0), double_sided=True)
    meshes = [parts.ball(steps=24), parts.square(1, half=8.0, z=-3.0)]
    picture = look.picture(build(parts.describe(meshes, [pane, backdrop])), size=8, samples=64, depth=16, half=0.5)
    np.testing.assert_allclose(picture.mean((0, 1)), np.square([0.9, 0.5, 0.3]), rtol=0.05)
