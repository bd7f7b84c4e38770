"""``UsdPreviewSurface``: values, textures, channels, scale and bias, coordinates, opacity."""

import io
import zipfile

import numpy as np
import pytest
from PIL import Image as Pillow

from lippmann.codecs.exr import write_exr
from lippmann.errors import SceneError

from .conftest import HEAD

SURFACE = """
def Material "mat" {{
    token outputs:surface.connect = </mat/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        {inputs}
        token outputs:surface
    }}
    {nodes}
}}
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    rel material:binding = </mat>
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1)] (interpolation = "vertex")
    texCoord2f[] primvars:other = [(0.5, 0.25), (1, 0), (0, 1)] (interpolation = "vertex")
    uniform token subdivisionScheme = "none"
}}
"""

TEXTURE = """
    def Shader "{name}" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{file}@
        float2 inputs:st.connect = </mat/{st}.outputs:result>
        {more}
        float3 outputs:rgb
        float outputs:r
        float outputs:g
        float outputs:b
        float outputs:a
    }}
"""

READER = """
    def Shader "uv" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }
"""


def surface(inputs, nodes=""):
    return SURFACE.format(inputs=inputs, nodes=nodes)


def texture(name="t", file="t.png", st="uv", more=""):
    """A node whose picture repeats, unless ``more`` says otherwise."""
    more += "".join(f'\ntoken inputs:{wrap} = "repeat"' for wrap in ("wrapS", "wrapT") if wrap not in more)
    return TEXTURE.format(name=name, file=file, st=st, more=more) + READER * (st == "uv")


def png(pixels):
    held = io.BytesIO()
    Pillow.fromarray(np.array(pixels, np.uint8)).save(held, "PNG")
    return held.getvalue()


PICTURE = [[[10, 60, 110, 160], [20, 70, 120, 170]], [[30, 80, 130, 180], [40, 90, 140, 190]]]


def test_plain_values(read):
    body = surface(
        "color3f inputs:diffuseColor = (0.1, 0.2, 0.3)\nfloat inputs:roughness = 0.25\nfloat inputs:metallic = 0.75\n"
        "color3f inputs:emissiveColor = (2, 3, 4)\nfloat inputs:ior = 1.4\nfloat inputs:clearcoat = 0.5\n"
        "float inputs:clearcoatRoughness = 0.125"
    )
    (material,) = read(body).materials
    assert material.base_color == pytest.approx((0.1, 0.2, 0.3))
    assert (material.roughness, material.metallic, material.clearcoat) == (0.25, 0.75, 0.5)
    assert material.clearcoat_roughness == 0.125
    assert material.emission == (2, 3, 4)
    assert material.ior == pytest.approx(1.4)
    assert material.alpha_mode == "opaque"


def test_defaults_are_those_of_the_specification(read):
    (material,) = read(surface("")).materials
    assert material.base_color == (0.18, 0.18, 0.18)
    assert (material.roughness, material.metallic, material.ior, material.clearcoat) == (0.5, 0, 1.5, 0)


def test_values_come_through_the_materials_interface(read):
    body = surface("color3f inputs:diffuseColor.connect = </mat.inputs:paint>").replace(
        'def Material "mat" {', 'def Material "mat" {\ncolor3f inputs:paint = (0.5, 0.25, 0.125)', 1
    )
    assert read(body).materials[0].base_color == (0.5, 0.25, 0.125)


@pytest.mark.parametrize(
    "undeclared", ["nothing", "token outputs:surface\n", "float3 outputs:rgb\n", "float2 outputs:result\n"]
)
def test_a_colour_texture(read, undeclared):
    body = surface(
        "color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", texture(more='token inputs:wrapS = "mirror"')
    )
    scene = read(body.replace(undeclared, "\n"), files={"t.png": png(PICTURE)})
    assert scene.notes == []
    found = scene.materials[0].base_color_texture
    assert found.srgb
    assert found.image.pixels.tolist() == np.array(PICTURE)[..., :3].tolist()
    assert (found.wrap_u, found.wrap_v) == ("mirror", "repeat")
    # v runs upwards in a stage, and downwards here.
    (mesh,) = scene.meshes
    place = {tuple(position): uv.tolist() for position, uv in zip(mesh.positions, mesh.uvs[0], strict=True)}
    assert place == {(0, 0, 0): [0, 1], (1, 0, 0): [1, 1], (0, 1, 0): [0, 0]}


@pytest.mark.parametrize(
    ("mark", "first", "other"),
    [("<UDIM>", "1001", "1012"), ("%(UDIM)d", "1001", "1012"), ("<UVTILE>", "u1_v1", "u2_v2")],
)
def test_a_texture_in_tiles(read, mark, first, other):
    body = surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", texture(file=f"tex/t.{mark}.png"))
    files = {f"tex/t.{first}.png": png([[[255, 0, 0]]]), f"tex/t.{other}.png": png([[[0, 0, 255]]])}
    scene = read(body, files=files)
    found = scene.materials[0].base_color_texture
    assert (found.wrap_u, found.wrap_v) == ("clamp", "clamp")
    colors = {(0.5, 0.5): [255, 0, 0], (1.5, 1.5): [0, 0, 255], (1.5, 0.5): [0, 0, 0], (3.5, 1.5): [0, 0, 0]}
    for place, color in colors.items():
        u, v, _ = found.uv_transform @ (place[0], 1.0 - place[1], 1.0)
        height, width, _ = found.image.pixels.shape
        assert found.image.pixels[int(height * v), int(width * u)].tolist() == color
    assert scene.notes == []


def test_tiles_that_a_mesh_needs_and_that_are_not_there_are_named(read):
    node = texture(file="t.<UDIM>.png", st="move") + READER
    node += 'def Shader "move" {\nuniform token info:id = "UsdTransform2d"\nfloat2 outputs:result\n'
    node += "float2 inputs:in.connect = </mat/uv.outputs:result>\nfloat2 inputs:translation = (0, 1)\n}\n"
    body = surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", node)
    files = {"t.1001.png": png([[[255, 0, 0]]]), "t.1012.png": png([[[0, 0, 255]]])}
    assert read(body, files=files).notes == [
        "texture 't.<UDIM>.png' has no tile 1011, which mesh /m needs: black there"
    ]
    body = body.replace("translation = (0, 1)", "translation = (0, 0)").replace('"st"', '"none"')
    (note,) = read(body, files=files).notes
    assert "has no texture coordinates 'none'" in note


def test_scale_is_a_factor_and_bias_is_added_to_linear_values(read):
    scaled = surface(
        "color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>",
        texture(more="float4 inputs:scale = (0.5, 0.25, 1, 1)"),
    )
    material = read(scaled, files={"t.png": png(PICTURE)}).materials[0]
    assert material.base_color == (0.5, 0.25, 1)
    biased = surface(
        "color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>",
        texture(
            more="float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (0.1, 0, 0, 0)\n"
            'token inputs:sourceColorSpace = "raw"'
        ),
    )
    found = read(biased).materials[0].base_color_texture
    assert not found.srgb
    assert found.image.pixels[0, 0] == pytest.approx([2 * 10 / 255 + 0.1, 2 * 60 / 255, 2 * 110 / 255], abs=1e-6)


def test_channels_of_one_picture_feed_roughness_and_metal(read):
    body = surface(
        "float inputs:roughness.connect = </mat/t.outputs:g>\nfloat inputs:metallic.connect = </mat/t.outputs:b>",
        texture(more='token inputs:sourceColorSpace = "raw"'),
    )
    material = read(body, files={"t.png": png(PICTURE)}).materials[0]
    pixels = material.metallic_roughness_texture.image.pixels
    assert pixels[1, 1, 1:] == pytest.approx([90 / 255, 140 / 255])
    assert (material.roughness, material.metallic) == (1, 1)


def test_opacity_by_the_alpha_of_the_colours_picture(read):
    body = surface(
        "color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>\n"
        "float inputs:opacity.connect = </mat/t.outputs:a>\n"
        "float inputs:opacityThreshold = 0.25",
        texture(),
    )
    material = read(body, files={"t.png": png(PICTURE)}).materials[0]
    assert material.base_color_texture.image.pixels.tolist() == PICTURE
    assert material.base_color_texture.srgb
    assert (material.alpha_mode, material.alpha_cutoff) == ("mask", 0.25)


@pytest.mark.parametrize("mode", ["transparent", "presence"])
def test_plain_opacity_blends(read, mode):
    """By opacityMode, highlights stay where opacity fades the rest, or fade with it."""
    scene = read(surface(f'float inputs:opacity = 0.5\ntoken inputs:opacityMode = "{mode}"'))
    material = scene.materials[0]
    assert (material.alpha_mode, material.alpha) == ("blend", 0.5)
    told = ["highlights fade with opacity, as opacityMode 'presence' has it"]
    assert scene.notes == (told if mode == "transparent" else [])


@pytest.mark.parametrize(("more", "is_glass"), [("", True), ("float inputs:metallic = 1", False)])
def test_what_is_clear_and_shines_is_glass(read, more, is_glass):
    """As Blender writes it: its highlights stay."""
    inputs = "float inputs:opacity = 0\nfloat inputs:roughness = 0.1\ncolor3f inputs:diffuseColor = (0.5, 0, 0)\n"
    (material,) = read(surface(inputs + more)).materials
    assert (material.transmission, material.thickness, material.alpha) == (is_glass, 0.0, is_glass)
    assert (material.base_color == (1.0, 1.0, 1.0)) == is_glass
    assert not read(surface(inputs + 'token inputs:opacityMode = "presence"')).materials[0].transmission
    assert not read(surface(inputs.replace("0.1", "0.5"))).materials[0].transmission  # hidden, and not frosted


@pytest.mark.parametrize("count", [1, 2])
def test_the_only_coordinates_are_taken_for_those_of_another_name(read, count):
    body = surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", texture()).replace(
        'varname = "st"', 'varname = "_"'
    )
    if count == 1:
        body = "\n".join(line for line in body.splitlines() if "primvars:other" not in line)
    scene = read(body, files={"t.png": png(PICTURE)})
    assert bool(np.ptp(scene.meshes[0].uvs[0], axis=0).any()) == (count == 1)
    told = "its only ones, 'st', are taken" if count == 1 else "its textures show one texel"
    assert scene.notes == [f"mesh /m has no texture coordinates '_': {told}"]


@pytest.mark.parametrize("purpose", ["", ":preview", ":full"])
def test_materials_are_bound_for_a_purpose_or_for_all(read, purpose):
    body = surface("color3f inputs:diffuseColor = (0.1, 0.2, 0.3)")
    scene = read(body.replace("rel material:binding =", f"rel material:binding{purpose} ="))
    assert scene.materials[scene.meshes[0].material].name == "/mat"


def test_a_preview_is_shown_before_what_is_bound_for_finished_pictures(read):
    body = surface("color3f inputs:diffuseColor = (0.1, 0.2, 0.3)")
    body = body.replace(
        "rel material:binding =", "rel material:binding:full = </other>\nrel material:binding:preview ="
    )
    scene = read(body + 'def Material "other" {\n}\n')
    assert scene.materials[scene.meshes[0].material].name == "/mat"


def test_textures_of_shapes_without_coordinates_are_named(read):
    body = surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", texture())
    body += 'def Sphere "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {\nrel material:binding = </mat>\n}\n'
    scene = read(body, files={"t.png": png(PICTURE)})
    assert scene.notes == ["mesh /ball has no texture coordinates 'st': its textures show one texel"]
    assert [len(mesh.uvs) for mesh in scene.meshes] == [1, 1]


def test_normal_maps_as_exporters_write_them(read):
    body = surface(
        "normal3f inputs:normal.connect = </mat/t.outputs:rgb>",
        texture(more="float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)"),
    )
    found = read(body, files={"t.png": png(PICTURE)}).materials[0].normal_texture
    assert found.image.pixels.tolist() == np.array(PICTURE)[..., :3].tolist()
    assert not found.srgb


def test_a_specular_workflow(read):
    material = read(
        surface(
            "int inputs:useSpecularWorkflow = 1\nfloat inputs:metallic = 1\n"
            "color3f inputs:specularColor = (0.5, 0.25, 0.125)"
        )
    ).materials[0]
    assert material.metallic == 0
    assert material.specular_color == (0.5, 0.25, 0.125)
    assert ((material.ior - 1) / (material.ior + 1)) ** 2 > 0.99


def test_transformed_coordinates_of_another_set(read):
    nodes = (
        texture(st="move")
        + """
    def Shader "move" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </mat/other.outputs:result>
        float inputs:rotation = 90
        float2 inputs:scale = (2, 3)
        float2 inputs:translation = (0.125, 0.25)
        float2 outputs:result
    }
    def Shader "other" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "other"
        float2 outputs:result
    }
"""
    )
    scene = read(
        surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", nodes), files={"t.png": png(PICTURE)}
    )
    found = scene.materials[0].base_color_texture
    (mesh,) = scene.meshes
    first = mesh.uvs[found.uv_set][np.flatnonzero((mesh.positions == 0).all(axis=1))[0]]
    u, v, _ = found.uv_transform @ [*first, 1]
    # (0.5, 0.25): scaled to (1, 0.75), turned counter-clockwise to (-0.75, 1), moved; v then runs downwards.
    assert (u, 1 - v) == pytest.approx((-0.75 + 0.125, 1 + 0.25))


@pytest.mark.parametrize(
    ("more", "color"), [("", (0.18, 0.18, 0.18)), ("float4 inputs:fallback = (1, 0, 0.5, 1)", (1.0, 0.0, 0.5))]
)
def test_missing_textures_leave_the_fallback(read, more, color):
    inputs = "color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>"
    scene = read(surface(inputs, texture(file="none.png", more=more)))
    assert "stage.usda: texture 'none.png' not found: shown without it" in scene.notes
    assert scene.materials[0].base_color == pytest.approx(color)
    assert scene.materials[0].base_color_texture is None


@pytest.mark.parametrize("names", ["RGB", "R", "Y"])
def test_pictures_of_light_are_linear_textures(read, tmp_path, names):
    values = np.array([[0.5, 2.0]], np.float32)
    write_exr(tmp_path / "light.exr", dict.fromkeys(names, values), text={})
    inputs = (
        "color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>\n"
        "color3f inputs:emissiveColor.connect = </mat/t.outputs:rgb>"
    )
    scene = read(surface(inputs, texture(file="t.exr")), files={"t.exr": (tmp_path / "light.exr").read_bytes()})
    base, emission = scene.materials[0].base_color_texture, scene.materials[0].emission_texture
    assert (base.srgb, emission.srgb) == (False, False)
    assert emission.image.pixels == pytest.approx(np.repeat(values[..., None], 3, axis=2))
    assert base.image.pixels == pytest.approx(np.minimum(emission.image.pixels, 1.0))  # no surface adds light


def test_other_surfaces_are_named(read):
    scene = read(surface("").replace("UsdPreviewSurface", "ND_lama_surface"))
    assert scene.notes == [
        "material /mat: its surface is 'ND_lama_surface', which is not read: display colours are taken"
    ]
    assert scene.materials[0].name == "display colour"


@pytest.mark.parametrize(
    ("file", "line"),
    [
        (
            "../../secret.png",
            "stage.usda: texture '../../secret.png' lies outside the scene's folder; a scene file may",
        ),
        ("bad.png", "stage.usda: texture 'bad.png' is not a picture that can be read"),
    ],
)
def test_textures_that_are_not_read_are_errors(read, tmp_path, file, line):
    body = surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", texture(file=file))
    (tmp_path.parent.parent / "secret.png").write_bytes(png(PICTURE))
    with pytest.raises(SceneError) as caught:
        read(body, files={"bad.png": b"no picture"})
    assert str(caught.value).startswith(line)


def test_a_package_with_its_picture(tmp_path):
    from lippmann.scene.readers.load import load_scene

    body = HEAD + surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", texture(file="maps/t.png"))
    path = tmp_path / "model.usdz"
    packed(path, {"stage.usda": body.encode(), "maps/t.png": png(PICTURE)})
    found = load_scene(path).description.materials[0].base_color_texture
    assert found.image.pixels.tolist() == np.array(PICTURE)[..., :3].tolist()


def packed(path, files, compression=zipfile.ZIP_STORED):
    """A package whose contents begin at multiples of 64 bytes, as the format has it."""
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)
            entry.compress_type = compression
            place = archive.fp.tell() + 30 + len(name)
            entry.extra = b"\0" * (-place % 64) if -place % 64 >= 4 or not -place % 64 else b"\0" * (-place % 64 + 64)
            if entry.extra:
                entry.extra = b"\x86\x19" + (len(entry.extra) - 4).to_bytes(2, "little") + entry.extra[4:]
            archive.writestr(entry, data)


@pytest.mark.parametrize("mode", ["black", "useMetadata"])
def test_beyond_pictures_without_a_mode_of_their_own_is_black(read, mode):
    """UsdPreviewSurface 2.6: ``useMetadata``, the default, is black where a picture has no metadata."""
    node = texture(more=f'token inputs:wrapS = "{mode}"\ntoken inputs:wrapT = "repeat"')
    scene = read(
        surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", node),
        files={"t.png": png([[[200, 0, 0], [0, 200, 0]]])},
    )
    found = scene.materials[0].base_color_texture
    assert (found.wrap_u, found.wrap_v) == ("clamp", "repeat")
    assert found.image.pixels[0].tolist() == [[0] * 3, [200, 0, 0], [200, 0, 0], [0, 200, 0], [0, 200, 0], [0] * 3]
    # Coordinates of the middles of the two texels of the file.
    assert (found.uv_transform @ [0.25, 0.5, 1.0])[:2] == pytest.approx([2.5 / 6, 0.5])
    assert (found.uv_transform @ [0.75, 0.5, 1.0])[:2] == pytest.approx([3.5 / 6, 0.5])


def reader(name, kind, varname, fallback):
    return f"""
    def Shader "{name}" {{
        uniform token info:id = "UsdPrimvarReader_{kind}"
        string inputs:varname = "{varname}"
        {kind} inputs:fallback = {fallback}
        {kind} outputs:result
    }}
"""


def painted(nodes, inputs, primvars=""):
    body = surface(inputs, nodes)
    return body.replace("uniform token subdivisionScheme", primvars + "\nuniform token subdivisionScheme")


def test_display_colours_and_opacities_that_a_material_reads(read):
    nodes = reader("c", "float3", "displayColor", "(0.5, 0.25, 1)") + reader("o", "float", "displayOpacity", "0.75")
    inputs = "color3f inputs:diffuseColor.connect = </mat/c.outputs:result>\n"
    inputs += "float inputs:opacity.connect = </mat/o.outputs:result>\nfloat inputs:opacityThreshold = 0.5"
    color = 'color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] (interpolation = "vertex")'
    scene = read(painted(nodes, inputs, color))
    (mesh,) = scene.meshes
    material = scene.materials[mesh.material]
    assert mesh.colors[mesh.faces[0]].tolist() == [[1, 0, 0, 0.75], [0, 1, 0, 0.75], [0, 0, 1, 0.75]]
    assert (material.base_color, material.alpha) == ((1, 1, 1), 1)
    assert (material.alpha_mode, material.alpha_cutoff) == ("mask", 0.5)
    # A mesh without: the fallbacks.
    (mesh,) = read(painted(nodes, inputs)).meshes
    assert {tuple(row) for row in mesh.colors.tolist()} == {(0.5, 0.25, 1, 0.75)}


def test_opacities_of_faces(read):
    inputs = "float inputs:opacity.connect = </mat/o.outputs:result>"
    nodes = reader("o", "float", "displayOpacity", "1")
    scene = read(painted(nodes, inputs, 'float[] primvars:displayOpacity = [0.5] (interpolation = "uniform")'))
    assert (scene.meshes[0].colors == (1, 1, 1, 0.5)).all()
    assert scene.materials[0].alpha_mode == "blend"


HEAT = "color3f inputs:diffuseColor.connect = </mat/c.outputs:result>"


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("color3f[]", "[(1, 0, 0), (0, 1, 0), (0, 0, 1)]"),
        ("color4f[]", "[(1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1)]"),
        ("half3[]", "[(1, 0, 0), (0, 1, 0), (0, 0, 1)]"),
    ],
)
def test_colours_of_any_name_that_a_material_reads(read, kind, values):
    nodes = reader("c", "float3", "heat", "(0.5, 0.25, 1)")
    display = "color3f[] primvars:displayColor = [(1, 1, 0)]\n"
    scene = read(painted(nodes, HEAT, f'{display}{kind} primvars:heat = {values} (interpolation = "vertex")'))
    assert scene.meshes[0].colors[scene.meshes[0].faces[0]].tolist() == np.eye(3).tolist()
    # A mesh without, or with something else of that name: the fallback.
    for other in ("", 'float[] primvars:heat = [1, 2, 3] (interpolation = "vertex")'):
        (mesh,) = read(painted(nodes, HEAT, other)).meshes
        assert (mesh.colors == (0.5, 0.25, 1)).all()


def test_copies_that_inherit_colours_of_their_own(read):
    body = painted(reader("c", "float3", "heat", "(1, 1, 1)"), HEAT).replace(
        'def Mesh "', 'class "shape"\n{\ndef Mesh "'
    )
    copies = "".join(
        f'def "{name}" (instanceable = true\n inherits = </shape>)\n{{\ncolor3f primvars:heat = {color}\n}}\n'
        for name, color in (("red", "(1, 0, 0)"), ("green", "(0, 1, 0)"))
    )
    scene = read(f"{body}\n}}\n{copies}")
    assert [mesh.colors[0].tolist() for mesh in scene.meshes] == [[1, 0, 0], [0, 1, 0]]


def test_copies_inherit_colours_that_materials_of_subsets_read(read):
    subset = """    def GeomSubset "all" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [0]
        rel material:binding = </mat>
    }
"""
    body = painted(reader("c", "float3", "heat", "(0.5, 0.25, 1)"), HEAT)
    body = body.replace("    rel material:binding = </mat>\n    point3f", f"{subset}    point3f")
    body = body.replace('def Mesh "', 'class "shape"\n{\ndef Mesh "')
    copies = "".join(
        f'def "{name}" (instanceable = true\n inherits = </shape>)\n{{\n{color}\n}}\n'
        for name, color in (("red", "color3f primvars:heat = (1, 0, 0)"), ("plain", ""))
    )
    scene = read(f"{body}\n}}\n{copies}")
    assert [mesh.colors[0].tolist() for mesh in scene.meshes] == [[1, 0, 0], [0.5, 0.25, 1]]


def test_other_inputs_by_primvars_are_named(read):
    nodes = reader("e", "float3", "displayColor", "(1, 1, 1)")
    scene = read(painted(nodes, "color3f inputs:emissiveColor.connect = </mat/e.outputs:result>"))
    assert scene.meshes[0].colors is None
    assert "emissiveColor by the primvar 'displayColor' is not read: its fallback is taken" in scene.notes


def test_arrays_of_colours_hinder_nothing(read):
    """Ramps have them."""
    body = surface(
        "color3f inputs:diffuseColor = (1, 0, 0)\ncolor3f[] inputs:ramp = [(1, 0, 0), (0, 1, 0)]",
    )
    assert read(body).materials[0].base_color == (1, 0, 0)


def test_pictures_of_maketx(read, tmp_path):
    """Either TIFF or OpenEXR, whatever their name says."""
    write_exr(tmp_path / "light.exr", {name: np.full((1, 1), 0.25, np.float32) for name in "RGB"}, text={})
    body = surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", texture(file="t.tx"))
    found = read(body, files={"t.tx": (tmp_path / "light.exr").read_bytes()}).materials[0].base_color_texture
    assert not found.srgb
    assert (found.image.pixels == 0.25).all()
    held = io.BytesIO()
    Pillow.fromarray(np.full((1, 1, 3), 64, np.uint8)).save(held, "TIFF")
    found = read(body, files={"t.tx": held.getvalue()}).materials[0].base_color_texture
    assert found.srgb
    assert (found.image.pixels == 64).all()


@pytest.mark.parametrize(("st", "texel"), [("", (1, 0)), ("float2 inputs:st = (0.9, 0.9)", (0, 1))])
def test_a_texture_whose_coordinates_are_not_connected_shows_one_texel(read, st, texel):
    """That at (0, 0), which is the schema's fallback and what usdview shows, below on the left."""
    pixels = [[[10, 20, 30], [40, 50, 60]], [[70, 80, 90], [100, 110, 120]]]
    node = texture().replace("float2 inputs:st.connect = </mat/uv.outputs:result>", st)
    body = surface("color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>", node)
    scene = read(body.replace("primvars:st =", "primvars:map1 ="), files={"t.png": png(pixels)})
    found = scene.materials[0].base_color_texture
    assert scene.notes == []
    assert (found.wrap_u, found.wrap_v) == ("clamp", "clamp")
    assert found.image.pixels.tolist() == [[pixels[texel[0]][texel[1]]]]
