"""The file as a whole: containers, buffers, URIs, extensions, and damage."""

from __future__ import annotations

import base64
import json
import struct
import time

import numpy as np
import pytest

from lippmann.errors import SceneError, UsageError
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.gltf import read_gltf
from lippmann.scene.readers.load import load_scene


def test_glb_data_uri_and_external_buffer_give_the_same(writer, read, tmp_path):
    writer.triangle()
    scenes = [read(writer)]
    del writer.json["buffers"]
    scenes.append(read(writer.gltf(), "scene.gltf"))
    del writer.json["buffers"]
    scenes.append(read_gltf(writer.gltf_and_bin(tmp_path)))
    for scene in scenes:
        np.testing.assert_array_equal(scene.meshes[0].positions, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
        np.testing.assert_array_equal(scene.meshes[0].faces, [[0, 1, 2]])
        assert scene.name == "scene"


def test_the_first_bytes_tell_the_kind_of_file_not_its_name(writer, read):
    assert len(read(writer.triangle().glb(), "wrong.gltf").meshes) == 1


def test_names_are_percent_decoded(writer, tmp_path):
    assert len(read_gltf(writer.triangle().gltf_and_bin(tmp_path, "my scene.bin")).meshes) == 1


def test_a_file_of_another_library_is_read(read, tmp_path):
    pygltflib = pytest.importorskip("pygltflib")
    positions = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]], np.float32)
    indices = np.array([0, 1, 2, 0, 2, 3], np.uint16)
    model = pygltflib.GLTF2(
        scene=0,
        scenes=[pygltflib.Scene(nodes=[0])],
        nodes=[pygltflib.Node(mesh=0, translation=[1.0, 0.0, 0.0])],
        meshes=[
            pygltflib.Mesh(
                primitives=[pygltflib.Primitive(attributes=pygltflib.Attributes(POSITION=1), indices=0, material=0)]
            )
        ],
        materials=[pygltflib.Material(pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(roughnessFactor=0.25))],
        accessors=[
            pygltflib.Accessor(bufferView=0, componentType=5123, count=6, type="SCALAR"),
            pygltflib.Accessor(bufferView=1, componentType=5126, count=4, type="VEC3"),
        ],
        bufferViews=[
            pygltflib.BufferView(buffer=0, byteOffset=0, byteLength=12, target=34963),
            pygltflib.BufferView(buffer=0, byteOffset=12, byteLength=48, target=34962),
        ],
        buffers=[pygltflib.Buffer(byteLength=60)],
    )
    model.set_binary_blob(indices.tobytes() + positions.tobytes())
    model.save_binary(str(tmp_path / "other.glb"))
    scene = read_gltf(tmp_path / "other.glb")
    np.testing.assert_array_equal(scene.meshes[0].positions, positions)
    np.testing.assert_array_equal(scene.meshes[0].faces, indices.reshape(2, 3))
    assert (scene.materials[0].roughness, scene.materials[0].metallic) == (0.25, 1.0)
    np.testing.assert_array_equal(scene.instances[0].world_from_mesh[:3, 3], [1, 0, 0])


def test_byte_order_mark_and_unknown_chunks_are_passed_over(writer, read):
    text = b"\xef\xbb\xbf" + writer.triangle().gltf()
    assert len(read(text, "scene.gltf").meshes) == 1
    del writer.json["buffers"]
    glb = writer.glb()
    longer = glb[:8] + struct.pack("<I", len(glb) + 12) + glb[12:] + struct.pack("<II", 4, 0x12345678) + b"what"
    assert len(read(longer).meshes) == 1


def _refusal(read, source, name="scene.glb"):
    """The one line that says why a file is refused."""
    begin = time.thread_time()
    with pytest.raises(SceneError) as caught:
        read(source, name)
    assert time.thread_time() - begin < 2.0
    line = str(caught.value)
    assert "\n" not in line
    assert name in line
    return line


def test_missing_and_empty_files_are_refused(read, tmp_path):
    with pytest.raises(SceneError, match=r"absent\.glb: no such file"):
        read_gltf(tmp_path / "absent.glb")
    with pytest.raises(SceneError, match="folder"):
        read_gltf(tmp_path)
    assert "empty" in _refusal(read, b"")


@pytest.mark.parametrize("kept", [2, 11, 15, 19, 100, -40, -1])
def test_truncated_glb_is_refused(writer, read, kept):
    _refusal(read, writer.triangle().glb()[:kept])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"\x89PNG\r\n\x1a\n" + bytes(64), "not a glTF file"),
        (b"# Wavefront\nv 0 0 0\n", "line 1, column 1"),
        (b'{"asset": {"version": "2.0"}, "nodes": [', "a glTF file holds JSON"),
        (b"[1, 2]", "not an object"),
        (b"7", "not an object"),
        (b"null", "not an object"),
        (b"{}", "asset is missing"),
        (b'{"asset": {}}', "asset.version is missing"),
        (b'{"asset": 3}', "an object belongs here"),
        (b'{"asset": {"version": "3.0"}}', 'asset.version is "3.0"'),
        (b'{"asset": {"version": "2.1", "minVersion": "2.1"}}', 'asset.minVersion is "2.1"'),
        (b'{"asset": {"version": "2.0"}, "nodes": {}}', "nodes is an object; a list belongs here"),
        (b'{"asset": {"version": "2.0"}, "nodes": [3]}', "a list of objects belongs here"),
        (b"[" * 100000, "nested"),
        (b'{"asset": {"version": "2.0"}, "scene": ' + b"1" * 5000 + b"}", "too long"),
    ],
)
def test_foreign_and_damaged_json_is_refused(read, data, words):
    assert words in _refusal(read, data, "scene.gltf")


def test_a_later_minor_version_is_read_when_two_suffices(writer, read):
    writer.triangle().json["asset"] = {"version": "2.3", "minVersion": "2.0"}
    assert len(read(writer).meshes) == 1


@pytest.mark.parametrize(
    ("offset", "value", "words"),
    [
        (4, 3, "binary glTF of version 3"),
        (8, 2**32 - 1, "cut short"),
        (12, 2**32 - 1, "a chunk of 4294967295 bytes"),
        (12, 2**31, "a chunk of"),
        (16, 0x12345678, "no JSON chunk"),
    ],
)
def test_lying_glb_headers_are_refused(writer, read, offset, value, words):
    glb = bytearray(writer.triangle().glb())
    struct.pack_into("<I", glb, offset, value)
    assert words in _refusal(read, bytes(glb))


def test_binary_chunk_longer_than_the_file_is_refused(writer, read):
    glb = bytearray(writer.triangle().glb())
    size = struct.unpack_from("<I", glb, 12)[0]
    struct.pack_into("<I", glb, 20 + size, 10_000)
    assert "a chunk of 10000 bytes" in _refusal(read, bytes(glb))


def test_buffer_shorter_than_it_says_is_refused(writer, read, tmp_path):
    path = writer.triangle().gltf_and_bin(tmp_path)
    (tmp_path / "scene.bin").write_bytes(writer.data[:-1])
    with pytest.raises(SceneError, match=r"buffers\[0\] \(scene.bin\) holds 35 of 36 bytes"):
        read_gltf(path)


def test_absent_buffer_is_named(writer, tmp_path):
    path = writer.triangle().gltf_and_bin(tmp_path)
    (tmp_path / "scene.bin").unlink()
    with pytest.raises(SceneError, match=r"buffer 'scene\.bin' not found"):
        read_gltf(path)


def test_absent_textures_are_named_and_left_out(writer, read):
    image = writer.add("images", uri="wood.png")
    texture = writer.add("textures", source=image)
    lost = {"index": texture}
    metal = {"metallicRoughnessTexture": lost}
    writer.add(
        "materials", normalTexture=lost, emissiveTexture=lost, emissiveFactor=[1, 1, 1], pbrMetallicRoughness=metal
    )
    writer.triangle(material=0)
    scene = read(writer)
    assert list(scene.notes) == ["texture 'wood.png' not found: shown without it (textures[0])"]
    assert scene.materials[0].normal_texture is scene.materials[0].emission_texture is None
    assert scene.materials[0].emission == (0.0, 0.0, 0.0)
    assert scene.materials[0].metallic == 0.0


@pytest.mark.parametrize(
    "form", ["../secret.bin", "sub/../../secret.bin", "..\\secret.bin", "..%2Fsecret.bin", "absolute"]
)
def test_files_outside_the_folder_need_leave(writer, tmp_path, form):
    inside = tmp_path / "inside"
    (inside / "sub").mkdir(parents=True)
    path = writer.triangle().gltf_and_bin(inside)
    (inside / "scene.bin").rename(tmp_path / "secret.bin")
    uri = str(tmp_path / "secret.bin") if form == "absolute" else form
    writer.json["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(writer.json))
    with pytest.raises(SceneError, match=r"secret\.bin' lies outside the scene's folder"):
        read_gltf(path)
    assert len(read_gltf(path, files=NamedFiles(path.parent, True)).meshes) == 1


@pytest.mark.parametrize("uri", ["https://example.org/scene.bin", "//example.org/scene.bin", "file:///etc/passwd"])
def test_nothing_is_fetched(writer, read, uri):
    writer.triangle().json["buffers"] = [{"byteLength": 36, "uri": uri}]
    assert "nothing is fetched from the network" in _refusal(read, writer)


@pytest.mark.parametrize(
    "uri",
    [
        "data:",
        "data:,plain",
        "data:application/octet-stream;base64",
        "data:application/octet-stream;base64,@@@@",
        "data:application/octet-stream;base64,AAA",
        "data:application/octet-stream;base64,\u00e9\u00e9",
    ],
)
def test_damaged_data_uri_is_refused(writer, read, uri):
    writer.triangle().json["buffers"] = [{"byteLength": 36, "uri": uri}]
    assert "data URI of buffers[0] is damaged" in _refusal(read, writer)


def test_only_the_first_buffer_lives_in_the_binary_chunk(writer, read):
    writer.triangle().json["buffers"] = [{"byteLength": 36}, {"byteLength": 36}]
    writer.json["bufferViews"][0]["buffer"] = 1
    assert "buffers[1].uri is missing" in _refusal(read, writer)
    del writer.json["buffers"]
    writer.json["bufferViews"][0]["buffer"] = 0
    text = json.loads(writer.gltf())
    del text["buffers"][0]["uri"]
    assert "buffers[0].uri is missing" in _refusal(read, json.dumps(text).encode(), "scene.gltf")


def test_required_extension_that_is_not_understood_is_named_with_its_remedy(writer, read):
    writer.triangle().json["extensionsRequired"] = ["ACME_gizmo"]
    line = "scene.glb: the file requires the glTF extension ACME_gizmo; it is not understood"
    assert _refusal(read, writer) == f"{line}; export the scene without it"


@pytest.mark.parametrize("name", ["KHR_techniques_webgl", "KHR_technique_webgl", "KHR_materials_common", "KHR_blend"])
def test_materials_of_former_extensions_are_plain(writer, read, name):
    writer.triangle().json |= {"extensionsRequired": [name], "extensionsUsed": [name]}
    (note,) = read(writer).notes
    assert note.startswith(f"materials of the glTF extension {name} are shown as plain ones; convert it with")


@pytest.mark.parametrize(
    "text",
    [
        {"asset": {"version": "1.0"}},
        {"asset": {"version": "1.0.1"}, "meshes": {}},
        {"asset": {"version": "0.8"}},
        {"asset": {"version": 1}, "meshes": {"mesh": {}}},
        {"asset": {}, "meshes": {"mesh": {}}},
        {"meshes": {"mesh": {}}},
        struct.pack("<4sIIII", b"glTF", 1, 20, 0, 0),
    ],
)
def test_version_1_is_told_with_the_tool_that_converts_it(read, text):
    data = text if isinstance(text, bytes) else json.dumps(text).encode()
    tool = "convert it with 'gltf-pipeline -i in.gltf -o out.glb'"
    assert _refusal(read, data, "s.gltf") == f"s.gltf: the file is glTF 1.0; glTF 2.0 is understood; {tool}"


def _compressed(writer, extension, **accessor):
    writer.triangle().json["meshes"][0]["primitives"][0]["extensions"] = {extension: {"bufferView": 0}}
    writer.json["extensionsUsed"] = [extension]
    writer.json["accessors"][0].update(accessor)
    return writer


@pytest.mark.slow
def test_draco_beside_uncompressed_data_is_not_needed(writer, read):
    scene = read(_compressed(writer, "KHR_draco_mesh_compression"))
    assert scene.notes == ()
    del writer.json["accessors"][0]["bufferView"]
    assert "is no mesh that Draco decodes" in _refusal(read, writer)


def test_a_missing_buffer_is_not_answered_with_the_file_itself(writer, tmp_path):
    path = writer.triangle().gltf_and_bin(tmp_path)
    (tmp_path / "scene.bin").unlink()
    with pytest.raises(SceneError, match=r"^scene\.gltf: buffer 'scene\.bin' not found$"):
        read_gltf(path)


def test_pointers_of_animations_change_nothing_at_rest(writer, read):
    writer.triangle().json |= {key: ["KHR_animation_pointer"] for key in ("extensionsUsed", "extensionsRequired")}
    assert read(writer).notes == ()


def test_where_a_tile_lies_on_the_globe_does_not_matter(writer, read):
    writer.triangle().json |= {
        "extensionsUsed": ["CESIUM_RTC"],
        "extensionsRequired": ["CESIUM_RTC"],
        "extensions": {"CESIUM_RTC": {"center": [6378137, 0, 0]}},
    }
    assert read(writer).notes == ()


def test_used_extension_that_is_not_understood_is_noted(writer, read):
    writer.triangle().json["extensionsUsed"] = ["KHR_materials_dispersion", "KHR_materials_ior", "EXT_feature_metadata"]
    assert read(writer).notes == (
        "the glTF extension KHR_materials_dispersion is not understood; what it adds is left out",
    )


def test_understood_extension_may_be_required(writer, read):
    writer.triangle().json["extensionsRequired"] = ["KHR_texture_transform", "KHR_mesh_quantization"]
    assert read(writer).notes == ()


def test_variants_and_animations_are_noted(writer, read):
    writer.triangle().json["extensionsUsed"] = ["KHR_materials_variants"]
    writer.json["animations"] = [{"channels": [], "samplers": []}]
    assert read(writer).notes == (
        "of the material variants the default one is shown",
        "animations are not played without frames=...; the scene is shown at rest",
    )


def with_variants(writer):
    """A triangle that is red by default, green at noon, blue at night and in the rain, and of no variant elsewhere."""
    name = "KHR_materials_variants"
    for color in ([1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]):
        writer.add("materials", pbrMetallicRoughness={"baseColorFactor": color})
    mappings = [{"material": 1, "variants": [0]}, {"material": 2, "variants": [1, 2]}]
    writer.triangle(material=0, extensions={name: {"mappings": mappings}})
    writer.json["extensionsUsed"] = [name]
    writer.json["extensions"] = {name: {"variants": [{"name": each} for each in ("noon", "night", "rain", "snow")]}}
    return writer


@pytest.mark.parametrize(("variant", "color"), [("noon", 1), ("night", 2), ("rain", 2), ("snow", 0), (None, 0)])
def test_a_variant_is_chosen(writer, tmp_path, variant, color):
    path = tmp_path / "a.glb"
    path.write_bytes(with_variants(writer).glb())
    scene = load_scene(path, variants=None if variant is None else {"materials": variant})
    material = scene.description.materials[scene.description.meshes[0].material]
    assert np.argmax(material.base_color[:3]) == color
    told = "of the material variants the default one is shown; there are noon, night, rain, snow"
    assert (told in scene.notes) == (variant is None)


@pytest.mark.parametrize(("chosen", "what"), [({"materials": "dusk"}, "'dusk'"), ({"head": "round"}, "'head=round'")])
def test_a_variant_that_there_is_not(writer, tmp_path, chosen, what):
    path = tmp_path / "a.glb"
    path.write_bytes(with_variants(writer).glb())
    with pytest.raises(
        UsageError, match=rf"a\.glb: variants: {what}; the material variants are noon, night, rain, snow"
    ):
        load_scene(path, variants=chosen)


@pytest.mark.parametrize("json_part", [{}, {"nodes": [{"name": "empty"}], "scenes": [{"nodes": [0]}]}])
def test_a_scene_without_geometry_is_refused(read, json_part):
    text = json.dumps({"asset": {"version": "2.0"}, **json_part}).encode()
    assert "shows no triangles" in _refusal(read, text, "scene.gltf")


def test_data_uri_of_an_image(writer, read):
    uri = "data:image/png;base64," + base64.b64encode(writer.png([[[10, 20, 30]]])).decode()
    texture = writer.add("textures", source=writer.add("images", uri=uri))
    writer.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
    image = read(writer.triangle(material=0)).materials[0].base_color_texture.image
    np.testing.assert_array_equal(image.pixels, [[[10, 20, 30]]])
