"""Materials and their extensions."""

from __future__ import annotations

import numpy as np
import pytest

import lippmann
from lippmann.errors import SceneError
from lippmann.scene.values.description import Material


@pytest.fixture
def material(writer, read):
    """Reads one material made of the given JSON, in a scene with textures 0 (red) and 1 (green)."""
    writer.texture([[[255, 0, 0]]])
    writer.texture([[[0, 255, 0]]])

    def read_it(**values):
        writer.add("materials", **values)
        return read(writer.triangle(material=0)).materials[0]

    return read_it


def _pixel(texture):
    return texture.image.pixels[0, 0].tolist()


def test_defaults(writer, read):
    writer.triangle()
    writer.add("materials")
    writer.triangle(material=0)
    implied, empty = read(writer).materials
    for material in (implied, empty):
        expected = vars(Material(name=material.name, metallic=1.0))
        assert {k: v for k, v in vars(material).items() if v != expected[k]} == {}
    assert implied.name == "default"


CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
INWARD = np.array([(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7)])
INWARD = np.concatenate([INWARD, [(0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]])


def box(writer, size, faces, **material):
    index = writer.accessor(faces.ravel(), "u1")
    writer.triangle(positions=CORNERS * size, indices=index, material=writer.add("materials", **material))


@pytest.mark.parametrize(
    ("faces", "material", "front_only"),
    [
        (INWARD, {}, True),
        (INWARD[:, ::-1], {}, False),
        (INWARD[:2], {}, False),
        (INWARD, {"doubleSided": True}, False),
        (INWARD, {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}, False),
    ],
)
def test_inward_meshes_have_no_back_faces(writer, read, faces, material, front_only):
    box(writer, 1, faces, **material)
    scene = read(writer)
    assert scene.materials[scene.meshes[0].material].front_only == front_only


@pytest.mark.parametrize(("faces", "is_open"), [(INWARD, True), (INWARD[:, ::-1], False)])
def test_a_room_is_looked_into_from_outside_and_lit_from_there(writer, tmp_path, faces, is_open):
    def matte(*color):
        return {"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [*color, 1]}}

    box(writer, 1, faces, **matte(0.5, 0.5, 0.5))
    box(writer, 0.4, INWARD[:, ::-1], **matte(0.8, 0.05, 0.05))
    (tmp_path / "room.glb").write_bytes(writer.glb())
    pixels = lippmann.preview(tmp_path / "room.glb", size=(20, 20), spp=16, denoise="none").pixels
    red, green, _ = pixels[8:12, 8:12].mean(axis=(0, 1))
    assert red > 0.1
    assert (red > 3 * green) == is_open


def test_metallic_roughness(material):
    found = material(
        name="paint",
        pbrMetallicRoughness={
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
            "baseColorTexture": {"index": 0},
            "metallicFactor": 0.5,
            "roughnessFactor": 0.25,
            "metallicRoughnessTexture": {"index": 1},
        },
        normalTexture={"index": 1, "scale": -0.5},
        emissiveFactor=[0.5, 0, 1],
        emissiveTexture={"index": 0},
        alphaMode="MASK",
        alphaCutoff=0.75,
        doubleSided=True,
    )
    assert (found.name, found.base_color, found.alpha) == ("paint", (0.1, 0.2, 0.3), 0.4)
    assert (found.metallic, found.roughness, found.normal_scale) == (0.5, 0.25, -0.5)
    assert (found.emission, found.alpha_mode, found.alpha_cutoff) == ((0.5, 0, 1), "mask", 0.75)
    assert found.double_sided
    assert not found.unlit
    assert _pixel(found.base_color_texture) == [255, 0, 0]
    assert _pixel(found.metallic_roughness_texture) == [0, 255, 0]
    # Colours are sRGB-coded, data are not.
    assert found.base_color_texture.srgb
    assert found.emission_texture.srgb
    assert not found.metallic_roughness_texture.srgb
    assert not found.normal_texture.srgb
    # One image, however many textures look at it.
    assert found.base_color_texture.image is found.emission_texture.image


@pytest.mark.parametrize(("mode", "expected"), [("OPAQUE", "opaque"), ("BLEND", "blend"), (None, "opaque")])
def test_alpha_modes(material, mode, expected):
    assert material(alphaMode=mode).alpha_mode == expected


def test_occlusion_textures_are_noted(writer, read):
    writer.add("materials", occlusionTexture={"index": 0})
    (note,) = read(writer.triangle(material=0)).notes
    assert note == "occlusion textures are left out: light is traced into corners (materials[0])"


def test_unlit_and_emissive_strength(material):
    found = material(
        emissiveFactor=[1, 0.5, 0],
        extensions={"KHR_materials_unlit": {}, "KHR_materials_emissive_strength": {"emissiveStrength": 8}},
    )
    assert found.unlit
    assert found.emission == (8, 4, 0)


def test_transmission_volume_and_ior(material):
    found = material(
        extensions={
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": {"index": 0}},
            "KHR_materials_volume": {
                "thicknessFactor": 2.5,
                "thicknessTexture": {"index": 1},
                "attenuationDistance": 0.5,
                "attenuationColor": [0.9, 0.8, 0.7],
            },
        }
    )
    assert (found.ior, found.transmission, found.thickness) == (1.33, 0.9, 2.5)
    assert (found.attenuation_distance, found.attenuation_color) == (0.5, (0.9, 0.8, 0.7))
    assert _pixel(found.transmission_texture) == [255, 0, 0]
    assert _pixel(found.thickness_texture) == [0, 255, 0]
    assert not found.transmission_texture.srgb


def test_volume_without_a_distance_absorbs_nothing(material):
    assert material(extensions={"KHR_materials_volume": {}}).attenuation_distance == float("inf")


def test_ior_of_zero_reflects_all(material):
    ior = material(extensions={"KHR_materials_ior": {"ior": 0}}).ior
    assert ((ior - 1) / (ior + 1)) ** 2 > 0.99


def test_specular_clearcoat_and_sheen(material):
    found = material(
        extensions={
            "KHR_materials_specular": {
                "specularFactor": 0.5,
                "specularTexture": {"index": 0},
                "specularColorFactor": [3, 0.5, 0],
                "specularColorTexture": {"index": 1},
            },
            "KHR_materials_clearcoat": {
                "clearcoatFactor": 0.7,
                "clearcoatTexture": {"index": 0},
                "clearcoatRoughnessFactor": 0.3,
                "clearcoatRoughnessTexture": {"index": 1},
                "clearcoatNormalTexture": {"index": 1, "scale": 0.25},
            },
            "KHR_materials_sheen": {
                "sheenColorFactor": [0.1, 0.2, 0.3],
                "sheenColorTexture": {"index": 0},
                "sheenRoughnessFactor": 0.6,
                "sheenRoughnessTexture": {"index": 1},
            },
        }
    )
    assert (found.specular, found.specular_color) == (0.5, (3, 0.5, 0))
    assert (found.clearcoat, found.clearcoat_roughness, found.clearcoat_normal_scale) == (0.7, 0.3, 0.25)
    assert (found.sheen_color, found.sheen_roughness) == ((0.1, 0.2, 0.3), 0.6)
    coded = {key for key, value in vars(found).items() if key.endswith("texture") and value is not None and value.srgb}
    assert coded == {"specular_color_texture", "sheen_color_texture"}
    present = {key for key, value in vars(found).items() if key.endswith("texture") and value is not None}
    assert present - coded == {
        "specular_texture",
        "clearcoat_texture",
        "clearcoat_roughness_texture",
        "clearcoat_normal_texture",
        "sheen_roughness_texture",
    }


def test_anisotropy_and_iridescence(material):
    found = material(
        extensions={
            "KHR_materials_anisotropy": {
                "anisotropyStrength": 0.6,
                "anisotropyRotation": 1.57,
                "anisotropyTexture": {"index": 0},
            },
            "KHR_materials_iridescence": {
                "iridescenceFactor": 0.9,
                "iridescenceTexture": {"index": 0},
                "iridescenceIor": 1.4,
                "iridescenceThicknessMinimum": 120,
                "iridescenceThicknessMaximum": 600,
                "iridescenceThicknessTexture": {"index": 1},
            },
        }
    )
    assert (found.anisotropy, found.anisotropy_rotation) == (0.6, 1.57)
    assert (found.iridescence, found.iridescence_ior) == (0.9, 1.4)
    assert (found.iridescence_thickness_minimum, found.iridescence_thickness_maximum) == (120, 600)
    textures = found.anisotropy_texture, found.iridescence_texture, found.iridescence_thickness_texture
    assert not any(texture.srgb for texture in textures)


def test_anisotropy_and_iridescence_are_off_by_default(material):
    plain = material(extensions={"KHR_materials_anisotropy": {}, "KHR_materials_iridescence": {}})
    assert (plain.anisotropy, plain.iridescence, plain.iridescence_ior) == (0, 0, 1.3)


def test_only_materials_in_use_are_read(writer, read):
    writer.add("materials", normalTexture={"index": 99})
    writer.add("materials", name="used")
    assert [material.name for material in read(writer.triangle(material=1)).materials] == ["used"]


def test_factors_out_of_range_are_cut_and_noted(writer, read):
    writer.add("materials", pbrMetallicRoughness={"metallicFactor": 1.5, "baseColorFactor": [-1, 2, 0.5, 1]})
    scene = read(writer.triangle(material=0))
    assert (scene.materials[0].metallic, scene.materials[0].base_color) == (1.0, (0.0, 1.0, 0.5))
    assert scene.notes == ("material factors outside [0, 1] were cut to it (materials[0].pbrMetallicRoughness)",)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"alphaMode": "GLASS"}, "one of OPAQUE, MASK, BLEND"),
        ({"pbrMetallicRoughness": 3}, "an object belongs here"),
        ({"pbrMetallicRoughness": {"metallicFactor": "1"}}, "a number belongs here"),
        ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1]}}, "4 numbers belong here"),
        ({"normalTexture": {"index": 2}}, "materials[0].normalTexture.index is 2; there are 2 textures"),
        ({"normalTexture": {}}, "index is missing"),
        ({"normalTexture": {"index": 0, "scale": "x"}}, "a number belongs here"),
        ({"emissiveFactor": [1, 1, 1e400]}, "up to 1e+18"),
        ({"doubleSided": 1}, "true or false"),
        ({"extensions": {"KHR_materials_ior": {"ior": 0.5}}}, "1 or more, or 0"),
        ({"extensions": {"KHR_materials_volume": {"attenuationDistance": 0}}}, "above 0"),
        ({"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": -1}}}, "at least 0"),
        ({"extensions": {"KHR_materials_clearcoat": []}}, "an object belongs here"),
    ],
)
def test_bad_materials_are_refused(material, values, words):
    with pytest.raises(SceneError) as caught:
        material(**values)
    assert words in str(caught.value)


def test_specular_glossiness_of_numbers(material):
    gold = {"diffuseFactor": [0.1, 0, 0, 0.5], "specularFactor": [1.0, 0.766, 0.336], "glossinessFactor": 0.9}
    found = material(
        pbrMetallicRoughness={"metallicFactor": 1},
        extensions={
            "KHR_materials_pbrSpecularGlossiness": gold,
            "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": {"index": 0}},
        },
    )
    assert (found.base_color, found.alpha, found.metallic) == ((0.1, 0, 0), 0.5, 0.0)
    assert (found.specular, found.specular_texture, found.specular_color) == (1.0, None, (1.0, 0.766, 0.336))
    assert found.roughness == pytest.approx(0.1)
    assert found.metallic_roughness_texture is None
    # What is reflected at normal incidence is the specular colour, all but the last few thousandths.
    assert ((found.ior - 1) / (found.ior + 1)) ** 2 == pytest.approx(1.0, abs=4e-3)


def test_specular_glossiness_of_textures(writer, read):
    diffuse = writer.texture([[[10, 20, 30, 255]]])
    specular = writer.texture([[[1, 2, 3, 255], [4, 5, 6, 0]]])
    archived = {"diffuseTexture": {"index": diffuse}, "specularGlossinessTexture": {"index": specular}}
    writer.add("materials", extensions={"KHR_materials_pbrSpecularGlossiness": {**archived, "glossinessFactor": 0.8}})
    found = read(writer.triangle(material=0)).materials[0]
    assert _pixel(found.base_color_texture) == [10, 20, 30, 255]
    assert _pixel(found.specular_color_texture) == [1, 2, 3, 255]
    assert found.specular_color_texture.srgb
    assert found.roughness == 1.0
    texels = found.metallic_roughness_texture.image.pixels
    np.testing.assert_array_equal(texels, [[[0, 51, 0], [0, 255, 0]]])  # roughness 1 - 0.8, and 1
    assert not found.metallic_roughness_texture.srgb


def test_specular_glossiness_texture_without_alpha_has_the_factor_alone(material):
    archived = {"specularGlossinessTexture": {"index": 0}, "glossinessFactor": 0.75}
    found = material(extensions={"KHR_materials_pbrSpecularGlossiness": archived})
    assert (found.roughness, found.metallic_roughness_texture) == (0.25, None)
    assert _pixel(found.specular_color_texture) == [255, 0, 0]
