"""Compressed buffer views: what an encoder that is written here from the extension's description makes, and damage."""

from __future__ import annotations

import base64

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf.meshopt import MeshoptError, decompress

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def zigzag(values):
    signed = np.asarray(values, np.uint8).astype(np.int8).astype(int)
    return [2 * value if value >= 0 else -2 * value - 1 for value in signed]


def group(codes, kind):
    """Header bits and bytes of 16 deltas; ``kind`` is the number of bits each, 0 to leave it open."""
    if not any(codes):
        return 0, b""
    for bits, header in ((2, 1), (4, 2)):
        top = (1 << bits) - 1
        if kind == bits or (kind == 0 and max(codes) < top):
            short = [min(code, top) for code in codes]
            packed = [
                sum(
                    value << bits * (8 // bits - 1 - place)
                    for place, value in enumerate(short[start : start + 8 // bits])
                )
                for start in range(0, 16, 8 // bits)
            ]
            return header, bytes(packed) + bytes(code for code in codes if code >= top)
    return 3, bytes(codes)


def encode_attributes(elements, kind=0):
    count, stride = elements.shape
    most = min((8192 // stride) & ~15, 256)
    data, previous = b"\xa0", elements[0]
    for start in range(0, count, most):
        block = elements[start : start + most]
        deltas = np.diff(np.vstack([previous, block]), axis=0)
        padded = np.zeros((-(-len(block) // 16) * 16, stride), np.uint8)
        padded[: len(block)] = deltas
        for column in range(stride):
            codes = zigzag(padded[:, column])
            groups = [group(codes[place : place + 16], kind) for place in range(0, len(codes), 16)]
            headers = [bits for bits, _ in groups] + [0] * (-len(groups) % 4)
            data += bytes(sum(headers[place + i] << 2 * i for i in range(4)) for place in range(0, len(headers), 4))
            data += b"".join(body for _, body in groups)
        previous = block[-1]
    return data + bytes(max(0, 32 - stride)) + elements[0].tobytes()


def varint(value):
    data = b""
    while value > 127:
        data += bytes([value & 127 | 128])
        value >>= 7
    return data + bytes([value])


def encode_triangles(indices):
    """Each corner explicitly."""
    data, last = b"", 0
    for place, index in enumerate(indices):
        data += b"\xff" if place % 3 == 0 else b""
        data += varint(2 * (index - last) if index >= last else 2 * (last - index) - 1)
        last = index
    return b"\xe1" + b"\xff" * (len(indices) // 3) + data + bytes(16)


def encode_indices(indices):
    """Every second one on a track of its own."""
    data, last = b"\xd1", [0, 0]
    for place, index in enumerate(indices):
        step = index - last[place % 2]
        last[place % 2] = index
        data += varint((2 * step if step >= 0 else -2 * step - 1) << 1 | place % 2)
    return data + bytes(4)


@settings(max_examples=20, deadline=None)
@given(
    count=st.sampled_from([1, 15, 16, 17, 100, 255, 256, 257, 600]),
    stride=st.sampled_from([4, 8, 12, 64, 256]),
    spread=st.sampled_from([1, 2, 6, 40, 255]),
    kind=st.sampled_from([0, 2, 4, 8]),
    seed=st.integers(0, 2**32 - 1),
)
def test_attributes(count, stride, spread, kind, seed):
    random = np.random.default_rng(seed)
    elements = np.cumsum(random.integers(-spread, spread + 1, (count, stride)), axis=0).astype(np.uint8)
    data = encode_attributes(elements, kind)
    assert decompress(data, "ATTRIBUTES", "NONE", count, stride) == elements.tobytes()


def test_the_example_of_the_extension():
    """Sixteen deltas of four bits each, two of them written out."""
    body = bytes([0x17, 0x5F, 0xF0, 0xBC, 0x77, 0xA9, 0x21, 0x00, 0x34, 0xB5])
    data = b"\xa0" + b"\x02" + body + b"\x00" * 3 + bytes(32)
    deltas = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]
    found = np.frombuffer(decompress(data, "ATTRIBUTES", "NONE", 16, 4), np.uint8).reshape(16, 4)
    assert found[:, 0].tolist() == np.cumsum(deltas).astype(np.uint8).tolist()
    assert not found[:, 1:].any()


@pytest.mark.parametrize("stride", [2, 4])
def test_triangles_and_indices_one_by_one(stride):
    indices = [0, 1, 2, 2, 1, 300, 65535, 7, 0, 9, 8, 7]
    for data, mode in ((encode_triangles(indices), "TRIANGLES"), (encode_indices(indices), "INDICES")):
        assert np.frombuffer(decompress(data, mode, "NONE", 12, stride), f"<u{stride}").tolist() == indices


def test_every_code_of_a_triangle():
    """Worked out by hand from the description."""
    auxiliary = bytes([0x00, 0x10, 0x02]) + bytes(13)
    codes = [
        0xF0,  # next three: 0 1 2; edges (newest first) 0-2, 2-1, 1-0; vertices 2 1 0
        0x00,  # edge 0-2 and next: 0 2 3; edges 0-3, 3-2, 0-2, 2-1, 1-0; vertices 3 2 1 0
        0x43,  # the fifth edge, 1-0, and the fourth vertex: 1 0 0; edges 1-0, 0-0, 0-3, ...
        0x2E,  # edge 0-3 and last + 1: 0 3 1; vertices 1 3 2 1 0; last 1
        0x0F,  # edge 0-1 and an explicit one, last + 5: 0 1 6; vertices 6 1 3 2 1 0; last 6
        0x0D,  # edge 0-6 and last - 1: 0 6 5; vertices 5 6 1 3 2 1 0; last 5
        0xF1,  # next, the latest vertex, next: 4 5 5; vertices 5 4 5 6 ...
        0xF2,  # next, next, the second latest: 6 7 4
        0xFE,  # next, the latest, an explicit one, last - 3: 8 7 2
        0xFE,  # a new beginning: 0 1 2
    ]
    data = bytes([10, 0x1F]) + varint(5) + b"\0"  # + 5; the latest and an explicit one, - 3; the beginning
    expected = [[0, 1, 2], [0, 2, 3], [1, 0, 0], [0, 3, 1], [0, 1, 6], [0, 6, 5], [4, 5, 5], [6, 7, 4], [8, 7, 2]]
    expected += [[0, 1, 2]]
    stream = b"\xe1" + bytes(codes) + data + auxiliary
    found = np.frombuffer(decompress(stream, "TRIANGLES", "NONE", 30, 2), "<u2").reshape(10, 3)
    assert found.tolist() == expected


def test_octahedral_vectors():
    values = np.array([[127, 0, 127, 5], [0, -127, 127, 0], [127, 127, 127, 0], [0, 0, 127, 9], [42, 42, 127, 0]], "i1")
    data = encode_attributes(values.view(np.uint8))
    found = np.frombuffer(decompress(data, "ATTRIBUTES", "OCTAHEDRAL", 5, 4), "i1").reshape(5, 4)
    assert found[:4].tolist() == [[127, 0, 0, 5], [0, -127, 0, 0], [0, 0, -127, 0], [0, 0, 127, 9]]
    assert np.linalg.norm(found[4, :3].astype(float)) == pytest.approx(127, abs=1)


def test_quaternions():
    one = 0x7FFC  # 1, with room for the place of the largest component
    half = round(0.5 * 2**0.5 * (one | 3))
    values = np.array([[0, 0, 0, one | 3], [half, half, half, one]], "<i2")
    data = encode_attributes(values.view(np.uint8))
    found = np.frombuffer(decompress(data, "ATTRIBUTES", "QUATERNION", 2, 8), "<i2").reshape(2, 4)
    assert found[0].tolist() == [0, 0, 0, 32767]
    assert found[1] == pytest.approx(np.full(4, 16384), abs=2)


def test_exponents():
    values = np.array([[(-2 & 255) << 24 | 5], [3 << 24 | (-7 & 0xFFFFFF)]], np.uint32)
    data = encode_attributes(values.view(np.uint8).reshape(2, 4))
    found = np.frombuffer(decompress(data, "ATTRIBUTES", "EXPONENTIAL", 2, 4), "<f4")
    assert found.tolist() == [1.25, -56.0]


@pytest.mark.parametrize(
    ("mode", "count", "stride", "tail", "data"),
    [
        ("ATTRIBUTES", 20, 4, 32, encode_attributes(np.arange(80, dtype=np.uint8).reshape(20, 4) * 37)),
        ("TRIANGLES", 6, 2, 16, encode_triangles([0, 1, 2, 300, 2, 1])),
        ("INDICES", 6, 4, 4, encode_indices([0, 1, 2, 300, 2, 1])),
    ],
)
def test_damage_is_told(mode, count, stride, tail, data):
    for end in range(len(data)):
        with pytest.raises(MeshoptError):
            decompress(data[:end], mode, "NONE", count, stride)
    with pytest.raises(MeshoptError, match="it begins with 0x00"):
        decompress(b"\0" + data[1:], mode, "NONE", count, stride)
    with pytest.raises(MeshoptError, match="left over"):
        decompress(data[:-tail] + bytes(9) + data[-tail:], mode, "NONE", count, stride)
    with pytest.raises(MeshoptError):
        decompress(data, mode, "NONE", 3 * 10**9, stride)
    with pytest.raises(MeshoptError):
        decompress(data, mode, "OTHER", count, stride)
    with pytest.raises(MeshoptError):
        decompress(data, "OTHER", "NONE", count, stride)


def changing(kind, count, stride):
    """Elements whose bytes, pairs or words change as those of real meshes do."""
    rng = np.random.default_rng(count)
    if kind == "noise":
        return rng.integers(0, 256, (count, stride), dtype=np.uint8)
    if kind == "zeros":
        return np.zeros((count, stride), np.uint8)
    if kind == "floats":
        return np.cumsum(rng.normal(size=(count, stride // 4)), axis=0).astype("<f4").view(np.uint8)
    if kind == "shorts":
        return np.cumsum(rng.integers(-300, 300, (count, stride // 2)), axis=0).astype("<i2").view(np.uint8)
    return np.cumsum(rng.integers(0, 2, (count, stride)), axis=0).astype(np.uint8)


@pytest.mark.parametrize("kind", ["noise", "zeros", "floats", "shorts", "bits"])
@pytest.mark.parametrize("stride", [4, 12, 36])
def test_version_1_of_the_library_s_own_encoder(kind, stride):
    imagecodecs = pytest.importorskip("imagecodecs")
    if not hasattr(imagecodecs, "meshopt_encode"):
        pytest.skip("this imagecodecs has no meshoptimizer")
    for count in (1, 16, 300):
        elements = np.ascontiguousarray(changing(kind, count, stride))
        for level in (0, 3):
            data = bytes(imagecodecs.meshopt_encode(elements, level=level))
            assert data[0] == 0xA1
            assert decompress(data, "ATTRIBUTES", "NONE", count, stride) == elements.tobytes()
    for end in range(0, len(data), len(data) // 8 + 1):
        with pytest.raises(MeshoptError):
            decompress(data[:end], "ATTRIBUTES", "NONE", count, stride)


@pytest.mark.parametrize(
    ("codes", "colors"),
    [
        ([255, 0, 0, 255], [255, 255, 255, 255]),
        ([100, 20, 246, 255], [130, 90, 90, 255]),  # r = y + co - cg, g = y + cg, b = y - co - cg
        ([63, 0, 0, 63], [255, 255, 255, 255]),  # six bits
        ([0, 0, 0, 128], [0, 0, 0, 0]),  # the highest bit of alpha tells the bits alone
        ([64, 0, 0, 192], [64, 64, 64, 128]),
    ],
)
def test_colours_of_luma_and_chroma(codes, colors):
    elements = np.array([codes], np.uint8)
    data = encode_attributes(elements)
    assert list(decompress(data, "ATTRIBUTES", "COLOR", 1, 4)) == colors


def test_colours_of_16_bits():
    elements = np.array([[0x3FF, 0, 0, 0x3FF], [0x1000, 0x200, 0xFF00, 0xFFFF]], "<u2")
    found = decompress(encode_attributes(elements.view(np.uint8)), "ATTRIBUTES", "COLOR", 2, 8)
    assert np.frombuffer(found, "<u2").reshape(2, 4).tolist() == [[65535] * 4, [0x1300, 0xF00, 0xF00, 65535]]


def compressed(writer, name="EXT_meshopt_compression"):
    """A square whose positions and indices are only there compressed."""
    writer.json |= {"extensionsUsed": [name], "extensionsRequired": [name]}
    positions, indices = np.array(SQUARE, "<f4"), np.array([0, 1, 2, 0, 2, 3], "<u2")
    parts = [
        (encode_attributes(positions.view(np.uint8)), {"mode": "ATTRIBUTES", "count": 4, "byteStride": 12}),
        (encode_triangles(indices.tolist()), {"mode": "TRIANGLES", "count": 6, "byteStride": 2}),
    ]
    offset = 0
    views = []
    for data, how in parts:
        view = writer.view(data)
        place = writer.json["bufferViews"][view]
        size = how["count"] * how["byteStride"]
        views.append({"buffer": 1, "byteOffset": offset, "byteLength": size, "extensions": {name: {**place, **how}}})
        offset += size
    writer.json["bufferViews"] = views
    writer.json["accessors"] = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
    ]
    writer.node(mesh=writer.add("meshes", primitives=[{"attributes": {"POSITION": 0}, "indices": 1}]))
    placeholder = {"byteLength": offset, "extensions": {name: {"fallback": True}}}
    writer.json["buffers"] = [{"byteLength": len(writer.data)}, placeholder]
    return writer


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_a_file_without_uncompressed_data(writer, read, name):
    scene = read(compressed(writer, name))
    (mesh,) = scene.meshes
    np.testing.assert_array_equal(mesh.positions, SQUARE)
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])
    assert scene.notes == ()


def _refusal(read, writer):
    with pytest.raises(SceneError) as caught:
        read(writer)
    return str(caught.value)


def test_a_damaged_view_is_named_with_the_tool_that_may_read_it(writer, read):
    how = compressed(writer).json["bufferViews"][1]["extensions"]["EXT_meshopt_compression"]
    how["byteLength"] -= 1
    line = _refusal(read, writer)
    assert line.startswith("scene.glb: bufferViews[1] cannot be decompressed (")
    assert "decompress it with 'gltfpack -noq -i in.glb -o out.glb'" in line


def test_a_later_version_is_read_where_an_uncompressed_copy_is_there(writer, read):
    compressed(writer)
    copies = np.array(SQUARE, "<f4").tobytes() + np.array([0, 1, 2, 0, 2, 3], "<u2").tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(copies).decode()
    writer.data[0] = 0xA2
    assert "it begins with 0xa2, and 0xa0 is understood" in _refusal(read, writer)
    writer.json["buffers"][1]["uri"] = uri
    np.testing.assert_array_equal(read(writer).meshes[0].positions, SQUARE)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"count": 3}, "bufferViews[1].byteLength is 12; 3 elements of 2 bytes belong here"),
        ({"byteOffset": 10**6}, "its buffer holds"),
        ({"buffer": 7}, "there are 2 buffers"),
        ({"count": None}, "count is missing"),
        ({"mode": None}, "mode is missing"),
    ],
)
def test_views_that_lie_are_refused(writer, read, changes, words):
    compressed(writer).json["bufferViews"][1]["extensions"]["EXT_meshopt_compression"].update(changes)
    assert words in _refusal(read, writer)
