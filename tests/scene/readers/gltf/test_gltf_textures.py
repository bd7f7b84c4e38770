"""Textures: samplers, transforms, images."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow
from PIL import features

from lippmann.errors import SceneError

KTX2 = Path(__file__).parents[3] / "codecs" / "ktx2" / "data" / "uastc_rgba.ktx2"


@pytest.fixture
def texture(writer, read):
    """Reads the texture that a material shows by the given texture info."""

    def read_it(**info):
        writer.add("materials", normalTexture={"index": 0, **info})
        return read(writer.triangle(material=0)).materials[0].normal_texture

    return read_it


def test_without_a_sampler(writer, texture):
    writer.texture([[[1, 2, 3]]])
    found = texture()
    assert (found.wrap_u, found.wrap_v, found.filter, found.uv_set) == ("repeat", "repeat", "linear", 0)
    np.testing.assert_array_equal(found.uv_transform, np.eye(3))


@pytest.mark.parametrize(
    ("sampler", "expected"),
    [
        ({}, ("repeat", "repeat", "linear")),
        ({"wrapS": 33071, "wrapT": 33648}, ("clamp", "mirror", "linear")),
        ({"wrapS": 10497, "wrapT": 33071, "magFilter": 9728}, ("repeat", "clamp", "nearest")),
        ({"magFilter": 9729, "minFilter": 9984}, ("repeat", "repeat", "linear")),
    ],
)
def test_samplers(writer, texture, sampler, expected):
    writer.texture([[[1, 2, 3]]], sampler=writer.add("samplers", **sampler))
    found = texture()
    assert (found.wrap_u, found.wrap_v, found.filter) == expected


def test_texture_transform_of_the_extensions_own_example(writer, texture):
    # "only the lower left quadrant of the source image, rotated clockwise 90 degrees"
    writer.texture([[[1, 2, 3]]])
    transform = {"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5]}
    matrix = texture(extensions={"KHR_texture_transform": transform}).uv_transform
    corners = (matrix @ np.array([[0, 1, 1, 0], [0, 0, 1, 1], [1, 1, 1, 1]]))[:2].T
    # v points down: the lower left quadrant is u in [0, 0.5], v in [0.5, 1].
    np.testing.assert_allclose(corners, [[0, 1], [0, 0.5], [0.5, 0.5], [0.5, 1]], atol=1e-12)


def test_texture_transform_scales_before_it_turns(writer, texture):
    writer.texture([[[1, 2, 3]]])
    transform = {"rotation": np.pi / 2, "scale": [2, 3], "texCoord": 1}
    found = texture(texCoord=0, extensions={"KHR_texture_transform": transform})
    np.testing.assert_allclose(found.uv_transform @ [1, 0, 1], [0, -2, 1], atol=1e-12)
    np.testing.assert_allclose(found.uv_transform @ [0, 1, 1], [3, 0, 1], atol=1e-12)
    assert found.uv_set == 1


def test_texture_transform_may_flip(writer, texture):
    writer.texture([[[1, 2, 3]]])
    found = texture(extensions={"KHR_texture_transform": {"offset": [0, 1], "scale": [1, -1]}})
    np.testing.assert_allclose(found.uv_transform @ [0.25, 0.25, 1], [0.25, 0.75, 1])


@pytest.mark.parametrize(
    ("kind", "mode", "shape"),
    [
        ("PNG", "L", (2, 3, 1)),
        ("PNG", "RGB", (2, 3, 3)),
        ("PNG", "RGBA", (2, 3, 4)),
        ("PNG", "LA", (2, 3, 4)),
        ("PNG", "P", (2, 3, 3)),
        ("JPEG", "L", (2, 3, 1)),
        ("JPEG", "RGB", (2, 3, 3)),
        ("WEBP", "RGB", (2, 3, 3)),
    ],
)
def test_image_modes(writer, texture, kind, mode, shape):
    if kind == "WEBP" and not features.check("webp"):
        pytest.skip("this Pillow has no WebP")
    stream = io.BytesIO()
    Pillow.new(mode, (3, 2)).save(stream, kind)
    image = writer.add("images", bufferView=writer.view(stream.getvalue()), mimeType="image/x")
    source = {"extensions": {"EXT_texture_webp": {"source": image}}} if kind == "WEBP" else {"source": image}
    writer.add("textures", **source)
    assert texture().image.pixels.shape == shape


def test_rows_run_from_top_to_bottom(writer, texture):
    writer.texture([[[1, 0, 0]], [[2, 0, 0]]])
    np.testing.assert_array_equal(texture().image.pixels[:, 0, 0], [1, 2])


def test_entries_of_one_file_share_an_image(writer, read, tmp_path):
    (tmp_path / "wood.png").write_bytes(writer.png([[[1, 2, 3]]]))
    for _ in range(2):
        writer.add("textures", source=writer.add("images", uri="wood.png"))
    writer.add("materials", normalTexture={"index": 0}, emissiveTexture={"index": 1})
    material = read(writer.triangle(material=0)).materials[0]
    assert material.normal_texture.image is material.emission_texture.image


def test_a_texture_of_an_unknown_kind_alone_is_noted(writer, read):
    writer.json["extensionsUsed"] = ["ACME_texture"]
    writer.add("textures", extensions={"ACME_texture": {"source": 0}})
    writer.add("materials", normalTexture={"index": 0}, name="kept")
    scene = read(writer.triangle(material=0))
    assert scene.materials[0].normal_texture is None
    assert scene.notes[1] == "a texture has no image that is understood and is left out (textures[0])"


def test_basis_universal_textures_are_read(writer, read, tmp_path):
    """They come before an image that the texture has for readers without the extension."""
    (tmp_path / "wood.png").write_bytes(writer.png([[[1, 2, 3]]]))
    (tmp_path / "wood.ktx2").write_bytes(KTX2.read_bytes())
    writer.json |= {"extensionsUsed": ["KHR_texture_basisu"], "extensionsRequired": ["KHR_texture_basisu"]}
    plain, basis = (writer.add("images", uri=name) for name in ("wood.png", "wood.ktx2"))
    writer.add("textures", source=plain, extensions={"KHR_texture_basisu": {"source": basis}})
    writer.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
    scene = read(writer.triangle(material=0))
    texture = scene.materials[0].base_color_texture
    assert texture.srgb
    assert np.array_equal(texture.image.pixels, np.asarray(Pillow.open(KTX2.with_suffix(".png"))))
    assert not [note for note in scene.notes if "basisu" in note]


def test_a_damaged_basis_universal_texture_is_one_line(writer, read, tmp_path):
    (tmp_path / "wood.ktx2").write_bytes(KTX2.read_bytes()[:300])
    writer.add("textures", extensions={"KHR_texture_basisu": {"source": writer.add("images", uri="wood.ktx2")}})
    writer.add("materials", normalTexture={"index": 0})
    with pytest.raises(SceneError) as caught:
        read(writer.triangle(material=0))
    assert str(caught.value) == "scene.glb: texture 'wood.ktx2' cannot be decoded (it is cut short)"


@pytest.mark.parametrize(
    ("place", "values", "words"),
    [
        ("textures", {"source": 1}, "textures[0].source is 1; there are 1 images"),
        ("textures", {"sampler": 1}, "textures[0].sampler is 1; there are 1 samplers"),
        ("samplers", {"wrapS": 5}, "samplers[0].wrapS is 5"),
        ("samplers", {"magFilter": 5}, "samplers[0].magFilter is 5"),
        ("images", {"bufferView": 9}, "images[0].bufferView is 9"),
        ("images", {"bufferView": None}, "images[0].bufferView is missing"),
        ("images", {"uri": 7}, "a string belongs here"),
        ("images", {"uri": "data:image/png;base64,AAAA"}, "is not a picture"),
        ("images", {"uri": "data:image/png;base64,!"}, "data URI of images[0] is damaged"),
        ("materials", {"normalTexture": {"index": 0, "texCoord": 10**9}}, "up to 8 sets"),
        ("materials", {"normalTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": 2}}}}, "a list"),
    ],
)
def test_bad_textures_are_refused(writer, read, place, values, words):
    writer.texture([[[1, 2, 3]]], sampler=writer.add("samplers"))
    writer.add("materials", normalTexture={"index": 0})
    writer.triangle(material=0).json[place][0].update(values)
    with pytest.raises(SceneError) as caught:
        read(writer)
    assert words in str(caught.value)


@pytest.mark.parametrize("kept", [4, 20, 40, 60])
def test_a_truncated_image_is_refused(writer, texture, kept):
    data = writer.png(np.arange(300).reshape(10, 10, 3) % 251)[:kept]
    writer.add("textures", source=writer.add("images", bufferView=writer.view(data)))
    with pytest.raises(SceneError, match="images\\[0\\]"):
        texture()
