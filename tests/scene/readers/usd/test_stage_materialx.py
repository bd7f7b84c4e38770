"""MaterialX documents that stages refer to: their materials are those of the paths that USD's own plugin gives them."""

import zipfile

import numpy as np
import pytest

from lippmann.scene.readers.load import load_scene

from .conftest import HEAD, triangle
from .test_stage_materials import PICTURE, png

DOCUMENT = """<?xml version="1.0"?>
<materialx version="1.38" colorspace="lin_rec709">
  <nodegraph name="NG" fileprefix="tex/">
    <input name="tiling" type="vector2" value="2, 3"/>
    <tiledimage name="color" type="color3">
      <input name="file" type="filename" value="t.png" colorspace="srgb_texture"/>
      <input name="uvtiling" type="vector2" interfacename="tiling"/>
    </tiledimage>
    <image name="rough" type="float"><input name="file" type="filename" value="t.png"/></image>
    <image name="bent" type="vector3"><input name="file" type="filename" value="t.png"/></image>
    <normalmap name="normal" type="vector3"><input name="in" type="vector3" nodename="bent"/></normalmap>
    <output name="o_color" type="color3" nodename="color"/>
    <output name="rough" type="float" nodename="rough"/>
    <output name="normal" type="vector3" nodename="normal"/>
  </nodegraph>
  <constant name="half" type="float"><input name="value" type="float" value="0.5"/></constant>
  <standard_surface name="s" type="surfaceshader">
    <input name="base" type="float" value="1"/>
    <input name="base_color" type="color3" nodegraph="NG" output="o_color"/>
    <input name="specular_roughness" type="float" nodegraph="NG" output="rough"/>
    <input name="normal" type="vector3" nodegraph="NG" output="normal"/>
    <input name="metalness" type="float" nodename="half"/>
  </standard_surface>
  <surfacematerial name="pictures" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="s"/>
  </surfacematerial>
  <UsdPreviewSurface name="p" type="surfaceshader">
    <input name="diffuseColor" type="color3" value="0.5, 0.75, 1" colorspace="srgb_texture"/>
    <input name="roughness" type="float" value="0.25"/>
  </UsdPreviewSurface>
  <surfacematerial name="plain" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="p"/>
  </surfacematerial>
</materialx>
"""


def looks(material, more=""):
    mesh = triangle(
        more=f"rel material:binding = </looks/{material}>\n"
        'texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1)] (interpolation = "vertex")'
    ).replace('"m"', '"m" (prepend apiSchemas = ["MaterialBindingAPI"])')
    return f'def "looks" (prepend references = @look/x.mtlx@</MaterialX/Materials>) {{\n{more}\n}}\n' + mesh


FILES = {"look/x.mtlx": DOCUMENT, "look/tex/t.png": png(PICTURE)}


def test_images_of_a_graph(read):
    scene = read(looks("pictures"), files=FILES)
    material = scene.materials[0]
    texture = material.base_color_texture
    assert texture.srgb
    assert (texture.uv_transform[0, 0], texture.uv_transform[1, 1]) == (2.0, 3.0)
    rough = material.metallic_roughness_texture.image.pixels[..., 1]
    np.testing.assert_allclose(rough, np.asarray(PICTURE)[..., 0] / 255, atol=1 / 255)
    assert material.metallic == 0.5
    assert material.normal_texture is not None
    assert scene.notes == []


@pytest.mark.parametrize(
    ("more", "color"),
    [("", (0.21404, 0.52252, 1.0)), ('over "plain" {\ncolor3f inputs:diffuseColor = (1, 0, 0)\n}', (1.0, 0.0, 0.0))],
)
def test_plain_values_and_those_that_a_stage_sets(read, more, color):
    material = read(looks("plain", more), files=FILES).materials[0]
    assert material.base_color == pytest.approx(color, abs=1e-5)
    assert material.roughness == 0.25


def test_layers_that_stages_share_name_the_document_each_time(read, tmp_path):
    part = HEAD + looks("plain").replace("@look/x", "@x")
    files = {**FILES, "look/part.usda": part}
    layered = HEAD.replace("(\n", "(\n    subLayers = [@look/part.usda@]\n", 1)
    for _ in range(2):
        scene = read("", head=layered, files=files)
        assert scene.materials[0].base_color == pytest.approx((0.21404, 0.52252, 1.0), abs=1e-5)
        layered += "\n"  # another stage of the same layers
    assert (tmp_path / "look/part.usda").read_text() == part


def test_a_document_in_a_package(tmp_path):
    with zipfile.ZipFile(tmp_path / "s.usdz", "w") as package:
        package.writestr("stage.usda", HEAD + looks("pictures"))
        for name, data in FILES.items():
            package.writestr(name, data)
    scene = load_scene(tmp_path / "s.usdz").description
    assert scene.materials[0].base_color_texture.image.pixels.shape == (*np.shape(PICTURE)[:2], 3)
    assert scene.notes == []


SPACE = 'xmlns:xi="http://www.w3.org/2001/XInclude"'


def split(name):
    """The document in two: its graph, and what includes that by a name."""
    start, end = DOCUMENT.index("<nodegraph"), DOCUMENT.index("<constant")
    head = DOCUMENT[:start]
    graph = head + DOCUMENT[start:end] + "</materialx>"
    return graph, head.replace("version", f"{SPACE} version", 2).replace("xml " + SPACE, "xml") + (
        f'<xi:include href="{name}"/>' + DOCUMENT[end:]
    )


def test_documents_that_include_others(read):
    graph, rest = split("parts/graph.mtlx")
    files = {"look/x.mtlx": rest, "look/parts/graph.mtlx": graph, "look/parts/tex/t.png": png(PICTURE)}
    scene = read(looks("pictures"), files=files)
    assert scene.materials[0].base_color_texture.image.pixels[..., 0].tolist() == np.array(PICTURE)[..., 0].tolist()
    assert scene.notes == []


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("none.mtlx", "No such file"),
        ("../../x.mtlx", "it lies outside the scene's folder"),
    ],
)
def test_what_cannot_be_included_is_named(read, name, why):
    scene = read(looks("pictures"), files={"look/x.mtlx": split(name)[1]})
    assert any(f"'{name}', which 'x.mtlx' includes, cannot be read" in note and why in note for note in scene.notes)
    assert "'x.mtlx' has no node 'NG': its default is taken" in scene.notes


def test_documents_that_include_each_other_are_read_once(read):
    graph, rest = split("parts/graph.mtlx")
    again = "".join(f'<xi:include href="{name}"/>' for name in ["../x.mtlx", "graph.mtlx"] * 20)
    graph = graph.replace("version", f"{SPACE} version", 2).replace("xml " + SPACE, "xml")
    graph = graph.replace("</materialx>", again + "</materialx>")
    files = {"look/x.mtlx": rest, "look/parts/graph.mtlx": graph, "look/parts/tex/t.png": png(PICTURE)}
    scene = read(looks("pictures"), files=files)
    assert scene.materials[0].base_color_texture.image.pixels[..., 0].tolist() == np.array(PICTURE)[..., 0].tolist()
    assert scene.notes == []
