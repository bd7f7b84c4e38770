"""Surfaces of MaterialX and OmniPBR: their plain inputs and images, as ``UsdPreviewSurface`` has them."""

import numpy as np
import pytest

from .conftest import HEAD
from .test_stage_materials import PICTURE, png, surface

STANDARD, OPEN_PBR = "ND_standard_surface_surfaceshader", "ND_open_pbr_surface_surfaceshader"


def material_x(kind, inputs, nodes=""):
    body = surface(inputs, nodes).replace('"UsdPreviewSurface"', f'"{kind}"')
    return body.replace("outputs:surface.connect", "outputs:mtlx:surface.connect")


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        (STANDARD, ("base", "base_color", "metalness", "specular_roughness", "emission", "emission_color")),
        (
            OPEN_PBR,
            (
                "base_weight",
                "base_color",
                "base_metalness",
                "specular_roughness",
                "emission_luminance",
                "emission_color",
            ),
        ),
    ],
)
def test_plain_inputs(read, kind, names):
    weight, color, metal, rough, glow, glow_color = names
    inputs = f"""float inputs:{weight} = 0.5
        color3f inputs:{color} = (0.8, 0.4, 0.2)
        float inputs:{metal} = 0.75
        float inputs:{rough} = 0.25
        float inputs:{glow} = 2
        color3f inputs:{glow_color} = (0.1, 0.2, 0.3)"""
    scene = read(material_x(kind, inputs))
    material = scene.materials[0]
    assert material.base_color == pytest.approx((0.4, 0.2, 0.1))
    assert (material.metallic, material.roughness) == (0.75, 0.25)
    assert material.emission == pytest.approx((0.2, 0.4, 0.6))
    assert material.alpha == 1.0
    assert scene.notes == []


def test_what_is_not_given_is_as_the_surface_has_it(read):
    material = read(material_x(STANDARD, "")).materials[0]
    assert material.base_color == pytest.approx((0.8, 0.8, 0.8))
    assert (material.roughness, material.metallic, material.emission) == (0.2, 0.0, (0.0, 0.0, 0.0))


def test_opacity_of_three_channels_and_transmission(read):
    material = read(
        material_x(STANDARD, "color3f inputs:opacity = (0.5, 0.5, 0.5)\nfloat inputs:transmission = 1")
    ).materials[0]
    assert (material.alpha, material.alpha_mode) == (0.5, "blend")
    assert (material.transmission, material.thickness) == (1.0, 1.0)


def test_a_coloured_coat_tints_the_base(read):
    inputs = (
        "color3f inputs:base_color = (1, 0.5, 0.5)\n float inputs:coat = 0.5\n color3f inputs:coat_color = (1, 1, 0)"
    )
    assert read(material_x(STANDARD, inputs)).materials[0].base_color == pytest.approx((1.0, 0.5, 0.25))


@pytest.mark.parametrize(("kind", "share"), [(STANDARD, "subsurface"), (OPEN_PBR, "subsurface_weight")])
def test_light_that_is_scattered_below_has_its_own_colour(read, kind, share):
    inputs = f"color3f inputs:base_color = (1, 0, 0)\n float inputs:{share} = 0.75\n"
    inputs += "color3f inputs:subsurface_color = (0, 0, 1)"
    assert read(material_x(kind, inputs)).materials[0].base_color == pytest.approx((0.25, 0.0, 0.75))


def test_images_repeat_and_are_decoded_by_their_colour_space(read):
    nodes = """
    def Shader "t" {
        uniform token info:id = "ND_image_color3"
        asset inputs:file = @t.png@ (colorSpace = "srgb_texture")
        color3f outputs:out
    }
    def Shader "r" {
        uniform token info:id = "ND_image_float"
        asset inputs:file = @t.png@
        float outputs:out
    }
"""
    inputs = "color3f inputs:base_color.connect = </mat/t.outputs:out>\n"
    inputs += "float inputs:specular_roughness.connect = </mat/r.outputs:out>"
    scene = read(material_x(STANDARD, inputs, nodes), files={"t.png": png(PICTURE)})
    material = scene.materials[0]
    texture = material.base_color_texture
    assert (texture.srgb, texture.wrap_u, texture.wrap_v) == (True, "repeat", "repeat")
    rough = material.metallic_roughness_texture.image.pixels[..., 1]
    np.testing.assert_allclose(rough, np.asarray(PICTURE)[..., 0] / 255, atol=1 / 255)
    assert scene.notes == []


@pytest.mark.parametrize(
    ("kind", "factor", "scale"),
    [("color3", "color3f inputs:in2 = (1, 0.5, 0)", (1, 0.5, 0)), ("color3FA", "float inputs:in2 = 0.5", (0.5,) * 3)],
)
def test_an_image_times_a_value_at_coordinates_that_are_placed(read, kind, factor, scale):
    nodes = f"""
    def Shader "m" {{
        uniform token info:id = "ND_multiply_{kind}"
        color3f inputs:in1.connect = </mat/t.outputs:out>
        {factor}
        color3f outputs:out
    }}
    def Shader "t" {{
        uniform token info:id = "ND_image_color3"
        asset inputs:file = @t.png@
        float2 inputs:texcoord.connect = </mat/p.outputs:out>
        color3f outputs:out
    }}
    def Shader "p" {{
        uniform token info:id = "ND_place2d_vector2"
        float2 inputs:scale = (0.5, 0.25)
        float2 inputs:offset = (0.125, 0)
        float inputs:rotate = 90
        float2 inputs:pivot = (0.5, 0.5)
        float2 outputs:out
    }}
"""
    scene = read(
        material_x(STANDARD, "color3f inputs:base_color.connect = </mat/m.outputs:out>", nodes),
        files={"t.png": png(PICTURE)},
    )
    material = scene.materials[0]
    assert material.base_color == pytest.approx(scale)
    # Scaled to (2 u, 4 v) about the middle, (x, y) turned to (y, -x), then moved by the offset.
    u, v, _ = material.base_color_texture.uv_transform @ (0.75, 1.0 - 0.625, 1.0)
    assert (u, 1.0 - v) == pytest.approx((0.5 + 4 * 0.125 - 0.125, 0.5 - 2 * 0.25))
    assert scene.notes == []


def test_the_surface_for_all_wins_over_those_of_one_renderer(read):
    body = material_x(STANDARD, "color3f inputs:base_color = (1, 0, 0)")
    preview = """
    token outputs:surface.connect = </mat/p.outputs:surface>
    def Shader "p" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0, 1, 0)
        token outputs:surface
    }
"""
    scene = read(body.replace("    token outputs:mtlx", preview + "    token outputs:mtlx", 1))
    assert scene.materials[0].base_color == (0.0, 1.0, 0.0)


def test_omni_pbr(read):
    inputs = """color3f inputs:diffuse_color_constant = (0.5, 0.25, 0.125)
        float inputs:metallic_constant = 1
        float inputs:reflection_roughness_constant = 0.3
        float inputs:opacity_constant = 0.2"""
    body = surface(inputs).replace(
        'uniform token info:id = "UsdPreviewSurface"',
        'uniform token info:implementationSource = "sourceAsset"\n uniform asset info:mdl:sourceAsset = @OmniPBR.mdl@\n'
        ' uniform token info:mdl:sourceAsset:subIdentifier = "OmniPBR"',
    )
    body = body.replace("outputs:surface.connect", "outputs:mdl:surface.connect")
    material = read(body).materials[0]
    assert material.base_color == (0.5, 0.25, 0.125)
    assert (material.metallic, material.roughness) == (1.0, pytest.approx(0.3))
    assert material.alpha == 1.0  # its opacity counts where enable_opacity says so
    assert material.emission == (0.0, 0.0, 0.0)
    clear = read(
        body.replace("float inputs:metallic", "bool inputs:enable_opacity = 1\n float inputs:metallic")
    ).materials[0]
    assert clear.alpha == pytest.approx(0.2)


def test_an_omni_picture_stands_for_the_constant(read):
    inputs = "asset inputs:diffuse_texture = @t.png@\n color3f inputs:diffuse_color_constant = (1, 0, 0)"
    body = surface(inputs).replace('"UsdPreviewSurface"', '"OmniPBR"')
    material = read(body, files={"t.png": png(PICTURE)}).materials[0]
    assert material.base_color == (1.0, 1.0, 1.0)
    assert material.base_color_texture.srgb


def of_kind(kind, inputs, nodes=""):
    return surface(inputs, nodes).replace('"UsdPreviewSurface"', f'"{kind}"')


@pytest.mark.parametrize("kind", ["OmniPBR_ClearCoat", "OmniPBR_ClearCoat_Opacity"])
def test_relatives_of_omni_pbr(read, kind):
    inputs = """float inputs:metallic_constant = 1
        float inputs:clearcoat_weight = 0.5
        float inputs:clearcoat_reflection_roughness = 0.25
        float inputs:opacity_constant = 0.75"""
    coated = read(of_kind(kind, "bool inputs:enable_clearcoat = 1\n" + inputs)).materials[0]
    assert (coated.metallic, coated.clearcoat, coated.clearcoat_roughness) == (1.0, 0.5, 0.25)
    assert coated.alpha == (0.75 if kind.endswith("Opacity") else 1.0)
    assert read(of_kind(kind, inputs)).materials[0].clearcoat == 0.0


def test_omni_glass(read):
    scene = read(of_kind("OmniGlass", "color3f inputs:glass_color = (0.5, 1, 0.5)\nfloat inputs:glass_ior = 1.4"))
    glass = scene.materials[0]
    assert glass.base_color == (0.5, 1.0, 0.5)
    assert (glass.transmission, glass.roughness, glass.ior) == (1.0, 0.0, pytest.approx(1.4))
    assert scene.notes == []


@pytest.mark.parametrize("file", ['string inputs:filename = "t.png"', "asset inputs:filename = @t.png@"])
def test_arnold(read, file):
    nodes = f"""
    def Shader "i" {{
        uniform token info:id = "arnold:image"
        {file}
        string inputs:swrap = "mirror"
        string inputs:color_space = "Raw"
        color4f outputs:out
        float outputs:g
    }}
    def Shader "n" {{
        uniform token info:id = "arnold:normal_map"
        vector3f inputs:input.connect = </mat/i.outputs:out>
        vector3f outputs:vector
    }}
"""
    inputs = """color3f inputs:base_color.connect = </mat/i.outputs:out>
        float inputs:specular_roughness.connect = </mat/i.outputs:g>
        vector3f inputs:normal.connect = </mat/n.outputs:vector>
        float inputs:metalness = 0.5"""
    body = of_kind("arnold:standard_surface", inputs, nodes)
    scene = read(
        body.replace("outputs:surface.connect", "outputs:arnold:surface.connect"), files={"t.png": png(PICTURE)}
    )
    material = scene.materials[0]
    color = material.base_color_texture
    assert (color.srgb, color.wrap_u, color.wrap_v) == (False, "mirror", "repeat")
    assert material.metallic_roughness_texture.image.pixels[1, 1, 1] == pytest.approx(90 / 255)
    assert material.normal_texture is not None
    assert material.metallic == 0.5
    assert scene.notes == []


def test_highlights_and_sheen(read):
    inputs = """float inputs:specular = 0.25
        color3f inputs:specular_color = (1, 0.5, 0)
        float inputs:sheen = 0.5
        color3f inputs:sheen_color = (1, 0.5, 0)
        float inputs:specular_anisotropy = 0.5
        float inputs:thin_film_thickness = 300
        float inputs:thin_film_IOR = 1.4"""
    scene = read(material_x(STANDARD, inputs))
    material = scene.materials[0]
    assert (material.specular, material.specular_color) == (0.25, (1.0, 0.5, 0.0))
    assert (material.sheen_color, material.sheen_roughness) == ((0.5, 0.25, 0.0), pytest.approx(0.3))
    film = (material.iridescence, material.iridescence_thickness_maximum, material.iridescence_ior)
    assert film == (1.0, 300.0, pytest.approx(1.4))
    assert scene.notes == ["material /mat: not honoured: specular_anisotropy"]
    plain = read(material_x(STANDARD, "")).materials[0]
    assert (plain.specular, plain.sheen_color, plain.iridescence) == (1.0, (0.0, 0.0, 0.0), 0.0)
    film = read(material_x(OPEN_PBR, "float inputs:thin_film_weight = 0.5")).materials[0]
    assert (film.iridescence, film.iridescence_thickness_maximum) == (0.5, 500.0)


def test_a_picture_of_highlights(read):
    nodes = """
    def Shader "i" {
        uniform token info:id = "ND_image_float"
        asset inputs:file = @t.png@
        float outputs:out
    }
"""
    body = material_x(STANDARD, "float inputs:specular.connect = </mat/i.outputs:out>", nodes)
    material = read(body, files={"t.png": png(PICTURE)}).materials[0]
    assert material.specular_texture.image.pixels[0, 1, 3] == 20


@pytest.mark.parametrize(("kind", "share"), [(STANDARD, "transmission"), (OPEN_PBR, "transmission_weight")])
def test_what_is_let_through_has_a_colour_of_its_own(read, kind, share):
    through = f"color3f inputs:base_color = (0, 0, 1)\nfloat inputs:{share} = 1"
    assert read(material_x(kind, through)).materials[0].base_color == (1.0, 1.0, 1.0)
    tinted = f"{through}\ncolor3f inputs:transmission_color = (1, 0.5, 0)"
    assert read(material_x(kind, tinted)).materials[0].base_color == (1.0, 0.5, 0.0)
    head = HEAD.replace("metersPerUnit = 1", "metersPerUnit = 0.5")
    within = read(material_x(kind, f"{tinted}\nfloat inputs:transmission_depth = 5"), head=head).materials[0]
    assert (within.base_color, within.attenuation_color) == ((1.0, 1.0, 1.0), (1.0, 0.5, 0.0))
    assert within.attenuation_distance == 2.5


@pytest.mark.parametrize(
    ("space", "color"),
    [("acescg", (0.720, 0.162, 0.078)), ("lin_p3d65", (0.567, 0.187, 0.084))],
)
def test_colours_of_other_primaries(read, space, color):
    """Values of pxr's ``Gf.ColorSpace.Convert``."""
    given = f'color3f inputs:base_color = (0.5, 0.2, 0.1) (colorSpace = "{space}")'
    assert read(material_x(STANDARD, given)).materials[0].base_color == pytest.approx(color, abs=0.002)


def test_images_of_gltf(read):
    nodes = """
    def Shader "i" {
        uniform token info:id = "ND_gltf_colorimage"
        asset inputs:file = @t.png@
        color4f inputs:color = (0.5, 0.25, 1, 1)
        color3f outputs:outcolor
        float outputs:outa
    }
    def Shader "n" {
        uniform token info:id = "ND_gltf_normalmap_vector3_1_0"
        asset inputs:file = @t.png@
        float3 outputs:out
    }
"""
    inputs = """color3f inputs:base_color.connect = </mat/i.outputs:outcolor>
        float3 inputs:normal.connect = </mat/n.outputs:out>"""
    body = material_x("ND_gltf_pbr_surfaceshader", inputs, nodes)
    scene = read(body, files={"t.png": png(PICTURE)})
    material = scene.materials[0]
    assert material.base_color == (0.5, 0.25, 1.0)
    assert material.base_color_texture.srgb
    assert not material.normal_texture.srgb
    assert scene.notes == []
    placed = body.replace("color4f inputs:color", "float2 inputs:scale = (2, 2)\n color4f inputs:color")
    assert read(placed).notes == ["shader nodes of type 'gltf_colorimage' are not read"]


@pytest.mark.parametrize(
    ("kind", "inputs", "thickness"),
    [
        (STANDARD, "float inputs:transmission = 1\nbool inputs:thin_walled = 1", 0.0),
        (OPEN_PBR, "float inputs:transmission_weight = 1\nbool inputs:geometry_thin_walled = 1", 0.0),
        ("OmniGlass", "bool inputs:thin_walled = 1", 0.0),
        ("OmniGlass", "", 1.0),
        ("ND_gltf_pbr_surfaceshader", "float inputs:transmission = 1", 0.0),
        ("ND_gltf_pbr_surfaceshader", "float inputs:transmission = 1\nfloat inputs:thickness = 0.1", 1.0),
    ],
)
def test_panes_of_glass(read, kind, inputs, thickness):
    material = read(material_x(kind, inputs)).materials[0]
    assert (material.transmission, material.thickness) == (1.0, thickness)


def test_reality_kit(read):
    """As Reality Composer writes materials of visionOS."""
    nodes = """
    def Shader "i" {
        uniform token info:id = "ND_RealityKitTexture2D_color3"
        asset inputs:file = @t.png@
        color3f outputs:out
    }
    def Shader "n" {
        uniform token info:id = "ND_normal_map_decode"
        float3 inputs:in.connect = </mat/i.outputs:out>
        float3 outputs:out
    }
"""
    inputs = """color3f inputs:baseColor = (0.5, 0.25, 1)
        float3 inputs:normal.connect = </mat/n.outputs:out>
        float inputs:metallic = 1
        float inputs:roughness = 0.25
        float inputs:opacity = 0.5
        float inputs:opacityThreshold = 0.25"""
    scene = read(material_x("ND_realitykit_pbr_surfaceshader", inputs, nodes), files={"t.png": png(PICTURE)})
    material = scene.materials[0]
    assert material.base_color == (0.5, 0.25, 1.0)
    assert (material.metallic, material.roughness, material.unlit) == (1.0, 0.25, False)
    assert (material.alpha, material.alpha_mode, material.alpha_cutoff) == (0.5, "mask", 0.25)
    assert material.normal_texture is not None
    assert scene.notes == []


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("ND_realitykit_unlit_surfaceshader", "color"),
        ("ND_surface_unlit", "emission_color"),
        ("arnold:flat", "color"),
    ],
)
def test_surfaces_without_shading(read, kind, name):
    scene = read(material_x(kind, f"color3f inputs:{name} = (0.5, 0.25, 1)"))
    assert (scene.materials[0].base_color, scene.materials[0].unlit) == ((0.5, 0.25, 1.0), True)
    assert scene.notes == []


def test_omni_tints_lays_and_cuts_its_pictures(read):
    """The tint alone is how Omniverse's programs colour; alpha is what the opacity's mode 0 takes."""
    assert read(of_kind("OmniPBR", "color3f inputs:diffuse_tint = (1, 0.5, 0)")).materials[0].base_color == (
        pytest.approx((0.2, 0.1, 0.0))
    )
    inputs = """asset inputs:diffuse_texture = @t.png@
        color3f inputs:diffuse_tint = (1, 0.5, 0)
        float inputs:albedo_brightness = 0.5
        float2 inputs:texture_scale = (2, 3)
        float2 inputs:texture_translate = (0.25, 0)
        float inputs:texture_rotate = 45
        bool inputs:enable_opacity = 1
        bool inputs:enable_opacity_texture = 1
        asset inputs:opacity_texture = @a.png@
        int inputs:opacity_mode = 0
        float inputs:opacity_threshold = 0.25"""
    alpha = np.array([[[255, 255, 255, 0], [0, 0, 0, 255]]], np.uint8)
    scene = read(of_kind("OmniPBR", inputs), files={"t.png": png(PICTURE), "a.png": png(alpha)})
    material = scene.materials[0]
    assert material.base_color == pytest.approx((0.5, 0.25, 0.0))
    assert material.base_color_texture.uv_transform @ (0.5, 1.0, 1.0) == pytest.approx((1.25, 1.0, 1.0))
    np.testing.assert_allclose(material.base_color_texture.image.pixels[0, [0, -1], 3], [0, 255])
    assert (material.alpha_mode, material.alpha_cutoff) == ("mask", 0.25)
    assert scene.notes == ["material /mat: not honoured: texture_rotate"]


IMAGE = (
    'def Shader "t" { uniform token info:id = "ND_image_color3"\n asset inputs:file = @t.png@\n color3f outputs:out\n'
)


def computed(kind, inputs, before=""):
    node = f'def Shader "m" {{ uniform token info:id = "ND_{kind}"\n {inputs}\n color3f outputs:out\n}}\n'
    base = "color3f inputs:base_color.connect = </mat/m.outputs:out>"
    return material_x(STANDARD, base, node + before)


@pytest.mark.parametrize(
    ("kind", "inputs", "color"),
    [
        ("add_color3", "color3f inputs:in1 = (0.5, 0, 0)\n color3f inputs:in2 = (0, 0.25, 0)", (0.5, 0.25, 0.0)),
        ("subtract_color3FA", "color3f inputs:in1 = (1, 0.5, 0.5)\n float inputs:in2 = 0.25", (0.75, 0.25, 0.25)),
        ("divide_color3FA", "color3f inputs:in1 = (1, 0.5, 0)\n float inputs:in2 = 2", (0.5, 0.25, 0.0)),
        ("multiply_color4", "color4f inputs:in1 = (1, 1, 0, 1)\n color4f inputs:in2 = (0.5, 1, 1, 1)", (0.5, 1.0, 0.0)),
        (
            "mix_color3",
            "color3f inputs:fg = (1, 0, 0)\n color3f inputs:bg = (0, 0, 1)\n float inputs:mix = 0.25",
            (0.25, 0.0, 0.75),
        ),
        ("invert_color3", "color3f inputs:in = (1, 0.75, 0)", (0.0, 0.25, 1.0)),
        ("remap_color3", "color3f inputs:in = (1, 0.5, 0)\n color3f inputs:outlow = (0.5, 0.5, 0.5)", (1.0, 0.75, 0.5)),
        ("combine3_color3", "float inputs:in1 = 0.25\n float inputs:in3 = 1", (0.25, 0.0, 1.0)),
        ("dot_color3", 'color3f inputs:in = (0.5, 1, 0) (colorSpace = "srgb_texture")', (0.214041, 1.0, 0.0)),
    ],
)
def test_values_are_computed(read, kind, inputs, color):
    scene = read(computed(kind, inputs))
    assert scene.materials[0].base_color == pytest.approx(color, abs=1e-6)
    assert scene.notes == []


@pytest.mark.parametrize(
    ("kind", "inputs", "color"),
    [
        (
            "subtract_color3",
            "color3f inputs:in1 = (1, 1, 1)\n color3f inputs:in2.connect = </mat/t.outputs:out>",
            (0, 1, 1),
        ),
        (
            "mix_color3",
            "color3f inputs:fg.connect = </mat/t.outputs:out>\ncolor3f inputs:bg = (0, 0, 1)\n float inputs:mix = 0.25",
            (0.25, 0, 0.75),
        ),
        ("hsvadjust_color3", "color3f inputs:in.connect = </mat/t.outputs:out>", (1, 0, 0)),
        (  # what is not read is not 0
            "multiply_color3",
            "color3f inputs:in1.connect = </mat/n.outputs:out>\n color3f inputs:in2.connect = </mat/t.outputs:out>",
            (1, 0, 0),
        ),
    ],
)
def test_images_are_computed_or_shown_as_they_are(read, kind, inputs, color):
    noise = 'def Shader "n" { uniform token info:id = "ND_noise2d_color3"\n color3f outputs:out\n}\n'
    red = np.array([[[255, 0, 0]]], np.uint8)
    scene = read(computed(kind, inputs, IMAGE + "}\n" + noise), files={"t.png": png(red)})
    material = scene.materials[0]
    texel = material.base_color_texture.image.pixels[0, 0]
    values = texel / 255.0 if texel.dtype == np.uint8 else texel
    np.testing.assert_allclose(values * material.base_color, color, atol=1e-6)
    is_computed = kind in ("subtract_color3", "mix_color3")
    assert any(f"'{kind}' are not read: their image is shown as it is" in note for note in scene.notes) != is_computed


def test_coordinates_times_a_value_repeat_an_image(read):
    place = """float2 inputs:texcoord.connect = </mat/p.outputs:out>
    }
    def Shader "p" {
        uniform token info:id = "ND_multiply_vector3FA"
        float3 inputs:in1.connect = </mat/r.outputs:out>
        float inputs:in2 = 3
        float3 outputs:out
    }
    def Shader "r" {
        uniform token info:id = "ND_rotate3d_vector3"
        float3 inputs:in.connect = </mat/c.outputs:out>
        float inputs:amount = 0
        float3 outputs:out
    }
    def Shader "c" {
        uniform token info:id = "ND_texcoord_vector2"
        float2 outputs:out
    }
"""
    image = "color3f inputs:in.connect = </mat/t.outputs:out>"
    scene = read(computed("dot_color3", image, IMAGE + place), files={"t.png": png(PICTURE)})
    texture = scene.materials[0].base_color_texture
    assert texture.uv_transform @ (1.0, 0.0, 1.0) == pytest.approx((3.0, -2.0, 1.0))


@pytest.mark.parametrize(
    ("space", "srgb"),
    [("srgb_texture", True), ("g22_rec709", True), ("lin_srgb", False), ("Utility - Linear - sRGB", False)],
)
def test_linear_spaces_named_after_srgb_are_linear(read, space, srgb):
    image = IMAGE.replace("@t.png@", f'@t.png@ (colorSpace = "{space}")') + "}\n"
    body = computed("dot_color3", "color3f inputs:in.connect = </mat/t.outputs:out>", image)
    assert read(body, files={"t.png": png(PICTURE)}).materials[0].base_color_texture.srgb is srgb


def test_what_blender_puts_in_place_of_a_preview_gives_way_to_materialx(read):
    body = material_x(OPEN_PBR, "color3f inputs:base_color = (1, 0, 0)")
    plain = """
    token outputs:surface.connect = </mat/previewShader.outputs:surface>
    def Shader "previewShader" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.8, 0.8, 0.8)
        token outputs:surface
    }
"""
    scene = read(body.replace("    token outputs:mtlx", plain + "    token outputs:mtlx", 1))
    assert scene.materials[0].base_color == (1.0, 0.0, 0.0)
