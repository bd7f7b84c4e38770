"""Accessors: component types, strides, sparse values, and everything out of bounds."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf.accessors import JOINTS, Accessors
from lippmann.scene.readers.gltf.buffers import Buffers
from lippmann.scene.readers.gltf.document import open_document


def _refusal(read, writer):
    with pytest.raises(SceneError) as caught:
        read(writer)
    return str(caught.value)


@pytest.mark.parametrize(
    ("dtype", "stored", "expected"),
    [
        ("u1", [[0, 51, 255], [255, 0, 0], [0, 255, 0]], [[0, 0.2, 1], [1, 0, 0], [0, 1, 0]]),
        ("u2", [[0, 13107, 65535], [65535, 0, 0], [0, 65535, 0]], [[0, 0.2, 1], [1, 0, 0], [0, 1, 0]]),
        ("i1", [[-128, -127, 127], [127, 0, 0], [0, 127, 0]], [[-1, -1, 1], [1, 0, 0], [0, 1, 0]]),
        ("i2", [[-32768, -32767, 32767], [32767, 0, 0], [0, 0, 0]], [[-1, -1, 1], [1, 0, 0], [0, 0, 0]]),
    ],
)
def test_normalised_integers(writer, read, dtype, stored, expected):
    mesh = writer.mesh(stored)
    position = writer.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"]
    writer.json["accessors"][position] = {
        **writer.json["accessors"][writer.accessor(stored, dtype)],
        "normalized": True,
    }
    writer.node(mesh=mesh)
    writer.json["extensionsUsed"] = writer.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    np.testing.assert_allclose(read(writer).meshes[0].positions, expected, atol=1e-6)


def test_quantised_positions_of_whole_numbers(writer, read):
    position = writer.accessor([[-300, 0, 0], [7, 0, 0], [0, 9, 0]], "i2")
    writer.node(mesh=writer.add("meshes", primitives=[{"attributes": {"POSITION": position}}]))
    assert "FLOAT belongs here" in _refusal(read, writer)
    writer.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    np.testing.assert_array_equal(read(writer).meshes[0].positions, [[-300, 0, 0], [7, 0, 0], [0, 9, 0]])


def test_interleaved_vertices(writer, read):
    corners = [
        ((0, 0, 0), (0, 0, 1), (0.0, 1.0)),
        ((1, 0, 0), (0, 0, 1), (1.0, 1.0)),
        ((0, 1, 0), (0, 0, 1), (0.0, 0.0)),
    ]
    data = b"".join(struct.pack("<3f3f2f4x", *p, *n, *uv) for p, n, uv in corners)
    view = writer.view(data[:-4], byteStride=36)  # the last element needs no padding behind it
    common = {"bufferView": view, "componentType": 5126, "count": 3}
    attributes = {
        "POSITION": writer.add("accessors", type="VEC3", **common),
        "NORMAL": writer.add("accessors", type="VEC3", byteOffset=12, **common),
        "TEXCOORD_0": writer.add("accessors", type="VEC2", byteOffset=24, **common),
    }
    writer.node(mesh=writer.add("meshes", primitives=[{"attributes": attributes}]))
    mesh = read(writer).meshes[0]
    np.testing.assert_array_equal(mesh.positions, [c[0] for c in corners])
    np.testing.assert_array_equal(mesh.normals, [c[1] for c in corners])
    np.testing.assert_array_equal(mesh.uvs[0], [c[2] for c in corners])


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4"])
def test_sparse_values_replace_those_of_the_view(writer, read, dtype):
    mesh = writer.mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], indices=writer.accessor([0, 1, 3, 0, 3, 2], "u2"))
    indices = writer.view(np.array([0, 3], f"<{dtype}").tobytes())
    values = writer.view(np.array([[9, 9, 9], [7, 7, 7]], "<f4").tobytes())
    component = {"u1": 5121, "u2": 5123, "u4": 5125}[dtype]
    writer.json["accessors"][writer.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"]]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": indices, "componentType": component},
        "values": {"bufferView": values},
    }
    writer.node(mesh=mesh)
    np.testing.assert_array_equal(read(writer).meshes[0].positions, [[9, 9, 9], [1, 0, 0], [0, 1, 0], [7, 7, 7]])


def _sparse_on_zeros(writer, count=3, places=(1, 2), **sparse):
    indices = writer.view(np.array(places, "<u2").tobytes())
    values = writer.view(np.array([[1, 0, 0], [0, 1, 0]], "<f4").tobytes())
    parts = {
        "count": 2,
        "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": values},
    }
    position = writer.add("accessors", componentType=5126, count=count, type="VEC3", sparse={**parts, **sparse})
    writer.node(mesh=writer.add("meshes", primitives=[{"attributes": {"POSITION": position}}]))
    return writer


def test_sparse_values_without_a_view_stand_among_zeros(writer, read):
    np.testing.assert_array_equal(read(_sparse_on_zeros(writer)).meshes[0].positions, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"places": (1, 3)}, "3 points beyond the accessor's 3 elements"),
        ({"count": 1}, "the accessor has 1 elements"),
        ({"indices": None}, "sparse.indices is missing"),
        ({"values": {"bufferView": 99}}, "there are 2 bufferViews"),
        ({"indices": {"bufferView": 0, "componentType": 5126}}, "UNSIGNED_INT belongs here"),
        ({"values": {"bufferView": 1, "byteOffset": 4}}, "ends at byte 28"),
    ],
)
def test_bad_sparse_accessors_are_refused(writer, read, values, words):
    assert words in _refusal(read, _sparse_on_zeros(writer, **values))


@pytest.mark.parametrize("count", [2**22 + 1, 10**12, 10**17])
def test_zeros_are_limited(writer, read, count):
    assert "without bufferView has at most" in _refusal(read, _sparse_on_zeros(writer, count=count))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"count": -3}, "accessors[0].count is -3"),
        ({"count": 3.5}, "accessors[0].count is 3.5"),
        ({"count": "3"}, 'accessors[0].count is "3"'),
        ({"count": True}, "accessors[0].count is true"),
        ({"count": None}, "accessors[0].count is missing"),
        ({"count": 10**15}, "its buffer view holds 36 bytes"),
        ({"count": 4}, "accessors[0] ends at byte 48"),
        ({"byteOffset": 4}, "accessors[0] ends at byte 40"),
        ({"byteOffset": -4}, "accessors[0].byteOffset is -4"),
        ({"bufferView": 1}, "accessors[0].bufferView is 1; there are 1 bufferViews"),
        ({"type": "VEC2"}, 'accessors[0].type is "VEC2"; VEC3 belongs here'),
        ({"type": 3}, "a string belongs here"),
        ({"type": None}, "accessors[0].type is missing"),
        ({"componentType": 5125}, "accessors[0].componentType is 5125; FLOAT belongs here"),
        ({"componentType": 5124}, "accessors[0].componentType is 5124"),
        ({"normalized": 1}, "true or false belongs here"),
        ({"sparse": []}, "an object belongs here"),
    ],
)
def test_bad_accessors_are_refused(writer, read, changes, words):
    writer.triangle().json["accessors"][0].update(changes)
    assert words in _refusal(read, writer)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"buffer": 1}, "bufferViews[0].buffer is 1; there are 1 buffers"),
        ({"buffer": None}, "bufferViews[0].buffer is missing"),
        ({"byteLength": 37}, "bufferViews[0] ends at byte 37"),
        ({"byteLength": -1}, "bufferViews[0].byteLength is -1"),
        ({"byteOffset": 1}, "bufferViews[0] ends at byte 37"),
        ({"byteStride": 8}, "its elements take 12 bytes each"),
        ({"byteStride": 16}, "accessors[0] ends at byte 44"),
    ],
)
def test_bad_buffer_views_are_refused(writer, read, changes, words):
    writer.triangle().json["bufferViews"][0].update(changes)
    assert words in _refusal(read, writer)


def test_an_accessor_is_decoded_once(writer, read):
    first = writer.mesh(indices=writer.accessor([0, 1, 2], "u2"))
    primitive = writer.json["meshes"][first]["primitives"][0]
    writer.add("materials", name="other")
    same = writer.add("meshes", primitives=[{**primitive, "material": 0}])
    turned = writer.add("meshes", primitives=[{**primitive, "indices": writer.accessor([2, 1, 0], "u2")}])
    for mesh in (first, same, turned):
        writer.node(mesh=mesh)
    one, other, backward = read(writer).meshes
    assert one.material != other.material
    assert one.positions is other.positions is backward.positions
    assert one.faces is other.faces
    np.testing.assert_array_equal(backward.faces, [[2, 1, 0]])


def test_joints_that_an_encoder_of_draco_quantised_as_floats_are_whole(tmp_path, writer):
    index = writer.accessor([[0, 0, 0, 0]], "u2")
    document = open_document(writer.gltf_and_bin(tmp_path), files=None)
    accessors = Accessors(document, Buffers(document))
    joints = accessors.with_decoded({index: np.array([[0, 1.0022, 13.0022, 17.9999]], np.float32)})
    assert joints.integers(index, JOINTS).tolist() == [[0, 1, 13, 18]]
    for bad in ([[np.nan, 0, 0, 0]], [[-1.0, 0, 0, 0]], [[7e4, 0, 0, 0]]):
        with pytest.raises(SceneError, match="what was decoded for it"):
            accessors.with_decoded({index: np.array(bad, np.float32)}).integers(index, JOINTS)
